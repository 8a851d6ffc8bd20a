#pragma once

/// @file
/// Packs whose products are rounded before anything is added to them, on every instruction set: a lane then has the
/// bits that the same text has on doubles, in code that the compiler may not contract. The price is two instructions
/// in place of one where the set has fused products.

#include "grapnel/pack/pack.hpp"

namespace grapnel::lanes {

/// The registers of another set, without its fused products.
template <class Arch>
struct Rounded {
  static constexpr int kWidth = Arch::kWidth;
  static constexpr bool kFused = false;
};

template <class Arch>
struct LaneRegister<Rounded<Arch>> : LaneRegister<Arch> {
  using Value = typename LaneRegister<Arch>::Value;

  static GRAPNEL_INLINE Value fma(const Value& a, const Value& b, const Value& c) { return a * b + c; }
  static GRAPNEL_INLINE Value fms(const Value& a, const Value& b, const Value& c) { return a * b - c; }
  static GRAPNEL_INLINE Value fnma(const Value& a, const Value& b, const Value& c) { return c - a * b; }
};

}  // namespace grapnel::lanes
