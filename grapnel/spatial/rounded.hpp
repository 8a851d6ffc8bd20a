#pragma once

/// @file
/// Packs whose products are rounded before any addition, on every instruction set. A lane then has the bits of the same
/// template on doubles in code without contraction. The cost is two instructions instead of one on sets with fused
/// products.

#include "grapnel/spatial/pack.hpp"

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
