#pragma once

/// @file
/// A truth value per lane, as comparisons of packs give it.

#include "grapnel/lanes/lane_register.hpp"

namespace grapnel::lanes {

template <class Arch>
class LaneMask {
 public:
  using Register = LaneRegister<Arch>;
  static constexpr int kWidth = Arch::kWidth;
  static constexpr unsigned kAllBits = (1U << kWidth) - 1;

  /// Indeterminate.
  LaneMask() = default;
  static GRAPNEL_INLINE LaneMask from_register(const typename Register::Mask& value) {
    LaneMask m;
    m.value_ = value;
    return m;
  }
  /// Bit i is lane i's.
  static GRAPNEL_INLINE LaneMask from_bits(unsigned bits) { return from_register(Register::from_bits(bits)); }
  GRAPNEL_INLINE unsigned bits() const { return Register::to_bits(value_); }
  GRAPNEL_INLINE bool get(int lane) const { return (bits() & (1U << lane)) != 0; }
  GRAPNEL_INLINE void set(int lane, bool x) {
    const unsigned bit = 1U << lane;
    *this = from_bits(x ? bits() | bit : bits() & ~bit);
  }
  GRAPNEL_INLINE const typename Register::Mask& value() const { return value_; }

  friend GRAPNEL_INLINE LaneMask operator&(const LaneMask& a, const LaneMask& b) {
    return from_register(Register::both(a.value_, b.value_));
  }
  friend GRAPNEL_INLINE LaneMask operator|(const LaneMask& a, const LaneMask& b) {
    return from_register(Register::either(a.value_, b.value_));
  }
  friend GRAPNEL_INLINE LaneMask operator!(const LaneMask& a) { return from_register(!a.value_); }
  friend GRAPNEL_INLINE bool any(const LaneMask& a) { return a.bits() != 0; }
  friend GRAPNEL_INLINE bool all(const LaneMask& a) { return a.bits() == kAllBits; }
  friend GRAPNEL_INLINE bool none(const LaneMask& a) { return a.bits() == 0; }

 private:
  typename Register::Mask value_;
};

}  // namespace grapnel::lanes
