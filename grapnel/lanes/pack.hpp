#pragma once

/// @file
/// A pack: one double per SIMD lane, a scalar as scalar.hpp asks for, so that the kernels' templates compute one state
/// per lane.
///
/// Same bits at every width. A compiler may fuse a * b + c or not as it likes, so in translation units that use packs
/// it may not (-ffp-contract=off), and the grammar decides: `a * b` is a Product, which is rounded when it becomes a
/// Pack and is fused when something is added to it. Division and square root are exactly rounded anyway. So a lane's
/// result depends on that lane's input alone: not on its neighbours, nor on the width, among the sets with fused
/// products (Avx512, Avx2, OneLane); Sse2 rounds products first and is reproducible in itself.
///
/// `auto p = a * b;` keeps a Product; write the type.

#include "grapnel/lanes/lane_mask.hpp"

namespace grapnel::lanes {

template <class P>
struct Product;

template <class Arch>
class Pack {
 public:
  using Register = LaneRegister<Arch>;
  using Value = typename Register::Value;
  using Mask = LaneMask<Arch>;
  static constexpr int kWidth = Arch::kWidth;

  /// Indeterminate.
  Pack() = default;
  /// The same number in every lane. Implicit, so that constants mix with packs as they do with doubles.
  GRAPNEL_INLINE Pack(double x) : value_(Register::broadcast(x)) {}
  static GRAPNEL_INLINE Pack from_register(const Value& value) {
    Pack p;
    p.value_ = value;
    return p;
  }
  /// From kWidth doubles, aligned or not.
  static GRAPNEL_INLINE Pack load(const double* x) { return from_register(Register::load(x)); }
  GRAPNEL_INLINE void store(double* x) const { Register::store(value_, x); }
  GRAPNEL_INLINE double get(int lane) const {
    double x;
    __builtin_memcpy(&x, address() + lane * sizeof(double), sizeof(double));
    return x;
  }
  GRAPNEL_INLINE void set(int lane, double x) {
    __builtin_memcpy(reinterpret_cast<char*>(&value_) + lane * sizeof(double), &x, sizeof(double));
  }
  GRAPNEL_INLINE const Value& value() const { return value_; }

  friend GRAPNEL_INLINE Pack operator+(const Pack& a, const Pack& b) { return from_register(a.value_ + b.value_); }
  friend GRAPNEL_INLINE Pack operator-(const Pack& a, const Pack& b) { return from_register(a.value_ - b.value_); }
  friend GRAPNEL_INLINE Product<Pack> operator*(const Pack& a, const Pack& b) { return {a, b}; }
  friend GRAPNEL_INLINE Pack operator/(const Pack& a, const Pack& b) { return from_register(a.value_ / b.value_); }
  friend GRAPNEL_INLINE Pack operator-(const Pack& a) { return from_register(Register::negate(a.value_)); }
  GRAPNEL_INLINE Pack& operator+=(const Pack& b) { return *this = *this + b; }
  GRAPNEL_INLINE Pack& operator-=(const Pack& b) { return *this = *this - b; }
  GRAPNEL_INLINE Pack& operator*=(const Pack& b) { return *this = *this * b; }
  GRAPNEL_INLINE Pack& operator/=(const Pack& b) { return *this = *this / b; }
  GRAPNEL_INLINE Pack& operator+=(const Product<Pack>& b) { return *this = *this + b; }
  GRAPNEL_INLINE Pack& operator-=(const Product<Pack>& b) { return *this = *this - b; }

  /// a b + c, a b - c and c - a b, rounded once (twice on Sse2).
  friend GRAPNEL_INLINE Pack fma(const Pack& a, const Pack& b, const Pack& c) {
    return from_register(Register::fma(a.value_, b.value_, c.value_));
  }
  friend GRAPNEL_INLINE Pack fms(const Pack& a, const Pack& b, const Pack& c) {
    return from_register(Register::fms(a.value_, b.value_, c.value_));
  }
  friend GRAPNEL_INLINE Pack fnma(const Pack& a, const Pack& b, const Pack& c) {
    return from_register(Register::fnma(a.value_, b.value_, c.value_));
  }
  friend GRAPNEL_INLINE Pack sqrt(const Pack& a) { return from_register(Register::sqrt(a.value_)); }
  friend GRAPNEL_INLINE Pack abs(const Pack& a) { return from_register(Register::abs(a.value_)); }
  /// b where either is not a number.
  friend GRAPNEL_INLINE Pack min(const Pack& a, const Pack& b) {
    return from_register(Register::min(a.value_, b.value_));
  }
  friend GRAPNEL_INLINE Pack max(const Pack& a, const Pack& b) {
    return from_register(Register::max(a.value_, b.value_));
  }
  /// a where the mask holds, else b.
  friend GRAPNEL_INLINE Pack select(const Mask& mask, const Pack& a, const Pack& b) {
    return from_register(Register::select(mask.value(), a.value_, b.value_));
  }

  friend GRAPNEL_INLINE Mask operator<(const Pack& a, const Pack& b) {
    return Mask::from_register(a.value_ < b.value_);
  }
  friend GRAPNEL_INLINE Mask operator<=(const Pack& a, const Pack& b) {
    return Mask::from_register(a.value_ <= b.value_);
  }
  friend GRAPNEL_INLINE Mask operator>(const Pack& a, const Pack& b) {
    return Mask::from_register(a.value_ > b.value_);
  }
  friend GRAPNEL_INLINE Mask operator>=(const Pack& a, const Pack& b) {
    return Mask::from_register(a.value_ >= b.value_);
  }
  friend GRAPNEL_INLINE Mask operator==(const Pack& a, const Pack& b) {
    return Mask::from_register(a.value_ == b.value_);
  }
  /// True where either is not a number.
  friend GRAPNEL_INLINE Mask operator!=(const Pack& a, const Pack& b) { return !(a == b); }

  // A product and a sum. Both kinds of argument are named, so that neither is rounded on the way.
  friend GRAPNEL_INLINE Pack operator+(const Product<Pack>& p, const Pack& c) { return fma(p.a, p.b, c); }
  friend GRAPNEL_INLINE Pack operator+(const Pack& c, const Product<Pack>& p) { return fma(p.a, p.b, c); }
  friend GRAPNEL_INLINE Pack operator-(const Product<Pack>& p, const Pack& c) { return fms(p.a, p.b, c); }
  friend GRAPNEL_INLINE Pack operator-(const Pack& c, const Product<Pack>& p) { return fnma(p.a, p.b, c); }
  // Of two products, the second is rounded first.
  friend GRAPNEL_INLINE Pack operator+(const Product<Pack>& p, const Product<Pack>& q) {
    return fma(p.a, p.b, q.rounded());
  }
  friend GRAPNEL_INLINE Pack operator-(const Product<Pack>& p, const Product<Pack>& q) {
    return fms(p.a, p.b, q.rounded());
  }
  friend GRAPNEL_INLINE Product<Pack> operator-(const Product<Pack>& p) { return {-p.a, p.b}; }

 private:
  GRAPNEL_INLINE const char* address() const { return reinterpret_cast<const char*>(&value_); }
  Value value_;
};

/// a b, not yet rounded.
template <class P>
struct Product {
  P a;
  P b;
  GRAPNEL_INLINE P rounded() const { return P::from_register(a.value() * b.value()); }
  GRAPNEL_INLINE operator P() const { return rounded(); }
};

}  // namespace grapnel::lanes
