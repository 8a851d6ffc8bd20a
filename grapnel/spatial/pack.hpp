#pragma once

/// @file
/// Packs: one double per SIMD lane. A pack is a scalar in the sense of scalar.hpp, so the templates of the kernels
/// compute one state per lane. Contents: instruction sets, registers, masks, packs, functions of packs, arrays.
///
/// Identical bits for every width. Compilers may fuse a * b + c at will; therefore translation units that use packs
/// disable contraction (-ffp-contract=off), and the types decide. `a * b` is a Product, which is rounded on conversion
/// to a Pack and fused in a sum. Division and square root are exactly rounded. A lane's result therefore depends on
/// that lane's input alone. It is independent of neighbours and, among the sets with fused products (Avx512, Avx2,
/// OneLane), of the width; Sse2 rounds products first and is reproducible by itself.
///
/// `auto p = a * b;` stores a Product; write the type explicitly.

#include <cstdint>
#include <type_traits>
#include <xsimd/xsimd.hpp>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel::lanes {

// --- Instruction sets: tags of all lane templates. The mangled names of a translation unit's symbols therefore contain
// its set, and a linker cannot give portable code a function that needs AVX-512 (tests/lanes/symbols_test).
// -------------

/// Eight doubles, fused products.
struct Avx512 {
  static constexpr int kWidth = 8;
  static constexpr bool kFused = true;
};
/// Four doubles, fused products.
struct Avx2 {
  static constexpr int kWidth = 4;
  static constexpr bool kFused = true;
};
/// Two doubles; a fused product is two roundings here, so its results differ in the last bits.
struct Sse2 {
  static constexpr int kWidth = 2;
  static constexpr bool kFused = false;
};
/// One double on any machine, the reference for the others: the same bits as Avx512 and Avx2. Slow if std::fma is not a
/// single instruction.
struct OneLane {
  static constexpr int kWidth = 1;
  static constexpr bool kFused = true;
};

// --- One register type per set, with a common set of operations. A set is defined only in the translation units
// compiled for it. Based on xsimd 8.1, with replacements for defects and gaps: fused products on AVX-512 (xsimd rounds
// twice), negation (0 - x loses the sign of zero), != with NaN, and-not (its argument order varies), masks as bits.
// -------------

/// Register operations of one instruction set; undefined if the compiler must not use it.
template <class Arch>
struct LaneRegister;

/// Operations that xsimd provides uniformly for its architectures.
template <class Arch, class XsimdArch>
struct XsimdRegister {
  using Value = xsimd::batch<double, XsimdArch>;
  using Bits = xsimd::batch<std::int64_t, XsimdArch>;
  using Mask = xsimd::batch_bool<double, XsimdArch>;
  static_assert(Value::size == Arch::kWidth);

  static GRAPNEL_INLINE Value broadcast(double x) { return Value(x); }
  static GRAPNEL_INLINE Value load(const double* x) { return Value::load_unaligned(x); }
  static GRAPNEL_INLINE void store(const Value& a, double* x) { a.store_unaligned(x); }
  static GRAPNEL_INLINE Value negate(const Value& a) { return a ^ Value(-0.0); }
  static GRAPNEL_INLINE Value sqrt(const Value& a) { return xsimd::sqrt(a); }
  static GRAPNEL_INLINE Value abs(const Value& a) {
    return a & Value(__builtin_bit_cast(double, ~(std::uint64_t{1} << 63)));
  }
  // b if either is NaN, as the instruction.
  static GRAPNEL_INLINE Value min(const Value& a, const Value& b) { return xsimd::min(a, b); }
  static GRAPNEL_INLINE Value max(const Value& a, const Value& b) { return xsimd::max(a, b); }
  static GRAPNEL_INLINE Value select(const Mask& m, const Value& a, const Value& b) { return xsimd::select(m, a, b); }
  static GRAPNEL_INLINE Mask both(const Mask& a, const Mask& b) { return a & b; }
  static GRAPNEL_INLINE Mask either(const Mask& a, const Mask& b) { return a | b; }

  /// Converts the sine and cosine of an angle's remainder to those of the angle, n quarter turns later; n is in the
  /// lowest bits of `turns`. Odd quarters swap them; the sine changes sign in quarters 2 and 3, the cosine in 1 and 2.
  static GRAPNEL_INLINE void turn(const Value& turns, Value& sine, Value& cosine) {
    const Bits n = xsimd::bitwise_cast<Bits>(turns), s = xsimd::bitwise_cast<Bits>(sine),
               c = xsimd::bitwise_cast<Bits>(cosine);
    const Bits swapped = (s ^ c) & (Bits(0) - (n & Bits(1)));
    sine = xsimd::bitwise_cast<Value>(s ^ swapped ^ ((n & Bits(2)) << 62));
    cosine = xsimd::bitwise_cast<Value>(c ^ swapped ^ (((n + Bits(1)) & Bits(2)) << 62));
  }
};

#ifdef __AVX512F__
template <>
struct LaneRegister<Avx512> : XsimdRegister<Avx512, xsimd::avx512f> {
  static GRAPNEL_INLINE Value fma(const Value& a, const Value& b, const Value& c) { return _mm512_fmadd_pd(a, b, c); }
  static GRAPNEL_INLINE Value fms(const Value& a, const Value& b, const Value& c) { return _mm512_fmsub_pd(a, b, c); }
  static GRAPNEL_INLINE Value fnma(const Value& a, const Value& b, const Value& c) { return _mm512_fnmadd_pd(a, b, c); }
  static GRAPNEL_INLINE unsigned to_bits(const Mask& m) { return m.data; }
  static GRAPNEL_INLINE Mask from_bits(unsigned bits) { return Mask(static_cast<__mmask8>(bits)); }
};
#endif

#if defined(__AVX2__) && defined(__FMA__)
template <>
struct LaneRegister<Avx2> : XsimdRegister<Avx2, xsimd::fma3<xsimd::avx2>> {
  static GRAPNEL_INLINE Value fma(const Value& a, const Value& b, const Value& c) { return _mm256_fmadd_pd(a, b, c); }
  static GRAPNEL_INLINE Value fms(const Value& a, const Value& b, const Value& c) { return _mm256_fmsub_pd(a, b, c); }
  static GRAPNEL_INLINE Value fnma(const Value& a, const Value& b, const Value& c) { return _mm256_fnmadd_pd(a, b, c); }
  static GRAPNEL_INLINE unsigned to_bits(const Mask& m) { return static_cast<unsigned>(_mm256_movemask_pd(m)); }
  static GRAPNEL_INLINE Mask from_bits(unsigned bits) {
    const __m256i own = _mm256_set_epi64x(8, 4, 2, 1);
    const __m256i set = _mm256_and_si256(_mm256_set1_epi64x(static_cast<long long>(bits)), own);
    return Mask(_mm256_castsi256_pd(_mm256_cmpeq_epi64(set, own)));
  }
};
#endif

#ifdef __SSE2__
template <>
struct LaneRegister<Sse2> : XsimdRegister<Sse2, xsimd::sse2> {
  static GRAPNEL_INLINE Value fma(const Value& a, const Value& b, const Value& c) { return a * b + c; }
  static GRAPNEL_INLINE Value fms(const Value& a, const Value& b, const Value& c) { return a * b - c; }
  static GRAPNEL_INLINE Value fnma(const Value& a, const Value& b, const Value& c) { return c - a * b; }
  static GRAPNEL_INLINE unsigned to_bits(const Mask& m) { return static_cast<unsigned>(_mm_movemask_pd(m)); }
  static GRAPNEL_INLINE Mask from_bits(unsigned bits) {
    return Mask(
        _mm_castsi128_pd(_mm_set_epi64x(-static_cast<long long>((bits >> 1) & 1), -static_cast<long long>(bits & 1))));
  }
};
#endif

template <>
struct LaneRegister<OneLane> {
  using Value = double;
  using Mask = bool;

  static GRAPNEL_INLINE Value broadcast(double x) { return x; }
  static GRAPNEL_INLINE Value load(const double* x) { return *x; }
  static GRAPNEL_INLINE void store(Value a, double* x) { *x = a; }
  static GRAPNEL_INLINE Value negate(Value a) { return -a; }
  static GRAPNEL_INLINE Value fma(Value a, Value b, Value c) { return __builtin_fma(a, b, c); }
  static GRAPNEL_INLINE Value fms(Value a, Value b, Value c) { return __builtin_fma(a, b, -c); }
  static GRAPNEL_INLINE Value fnma(Value a, Value b, Value c) { return __builtin_fma(-a, b, c); }
  static GRAPNEL_INLINE Value sqrt(Value a) { return __builtin_sqrt(a); }
  static GRAPNEL_INLINE Value abs(Value a) { return __builtin_fabs(a); }
  static GRAPNEL_INLINE Value min(Value a, Value b) { return a < b ? a : b; }
  static GRAPNEL_INLINE Value max(Value a, Value b) { return a > b ? a : b; }
  static GRAPNEL_INLINE Value select(Mask m, Value a, Value b) { return m ? a : b; }
  static GRAPNEL_INLINE Mask both(Mask a, Mask b) { return a && b; }
  static GRAPNEL_INLINE Mask either(Mask a, Mask b) { return a || b; }
  static GRAPNEL_INLINE unsigned to_bits(Mask m) { return m; }
  static GRAPNEL_INLINE Mask from_bits(unsigned bits) { return (bits & 1) != 0; }
  static GRAPNEL_INLINE void turn(Value turns, Value& sine, Value& cosine) {
    const auto n = __builtin_bit_cast(std::uint64_t, turns), s = __builtin_bit_cast(std::uint64_t, sine),
               c = __builtin_bit_cast(std::uint64_t, cosine);
    const std::uint64_t swapped = (s ^ c) & (std::uint64_t{0} - (n & 1));
    sine = __builtin_bit_cast(double, s ^ swapped ^ ((n & 2) << 62));
    cosine = __builtin_bit_cast(double, c ^ swapped ^ (((n + 1) & 2) << 62));
  }
};

/// A Boolean per lane, the result of comparing packs.
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
  /// Bit i belongs to lane i.
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
  /// Loads kWidth doubles, aligned or not.
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
  /// b if either is NaN.
  friend GRAPNEL_INLINE Pack min(const Pack& a, const Pack& b) {
    return from_register(Register::min(a.value_, b.value_));
  }
  friend GRAPNEL_INLINE Pack max(const Pack& a, const Pack& b) {
    return from_register(Register::max(a.value_, b.value_));
  }
  /// a where the mask is true, else b.
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
  /// True if either is NaN.
  friend GRAPNEL_INLINE Mask operator!=(const Pack& a, const Pack& b) { return !(a == b); }

  // Sum of a product and a pack. Both argument types are named, so that neither is rounded first.
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

// --- Functions of packs, by basic arithmetic only, so that every width gives the same bits. Sine and cosine use the
// polynomials of grapnel/spatial/sine_cosine.hpp.
// ---------------------------------------------------------------------------

/// Lanes whose angle is too large for the reduction, evaluated one by one by the standard library. NaN propagates
/// through the polynomials and is not handled here.
template <class Arch>
__attribute__((noinline, cold)) void replace_unreduced(const Pack<Arch>& angle, SineCosine<Pack<Arch>>& result) {
  for (int lane = 0; lane < Arch::kWidth; ++lane) {
    const double x = angle.get(lane);
    if (!(__builtin_fabs(x) > sine_cosine_detail::kLimit)) continue;
    const SineCosine<double> at = sine_cosine_detail::unreduced(x);
    result.sine.set(lane, at.sine);
    result.cosine.set(lane, at.cosine);
  }
}

/// Sine and cosine of each lane's angle [rad].
template <class Arch>
GRAPNEL_INLINE SineCosine<Pack<Arch>> sine_cosine(const Pack<Arch>& angle) {
  using P = Pack<Arch>;
  const sine_cosine_detail::Quartered<P> at = sine_cosine_detail::quartered(angle);
  typename P::Value sine = at.sine.value(), cosine = at.cosine.value();
  LaneRegister<Arch>::turn(at.turns.value(), sine, cosine);
  SineCosine<P> result{P::from_register(sine), P::from_register(cosine)};
  if (any(abs(angle) > P(sine_cosine_detail::kLimit))) [[unlikely]]
    replace_unreduced(angle, result);
  return result;
}

/// tanh(x) = t / (t + 2) with t = e^{2|x|} - 1. Six doublings t(t + 2) build t from e^{2|x|/64} - 1, a Taylor
/// polynomial. The sum does not cancel, so the relative accuracy for small arguments is preserved. Relative error below
/// 1e-15 (measured).
template <class S>
GRAPNEL_INLINE S tanh(const S& x) {
  // 2 |x| / 64, with |x| clipped at 20, beyond which tanh is 1.
  const S y = min(S(20.0), abs(x)) * S(0.03125);
  // e^y - 1 = y (1 + y/2 (1 + y/3 (...))) for y <= 0.625: 15 terms leave 2e-17 of it.
  S p(1.0);
  for (int n = 15; n >= 2; --n) p = S(1.0) + (y * S(1.0 / n)).rounded() * p;
  S t = y * p;
  for (int k = 0; k < 6; ++k) t = t * t + (t + t);
  const S magnitude = t / (t + S(2.0));
  return select(x < S(0.0), -magnitude, magnitude);
}

/// Power of each lane's nonnegative number, by the C library.
template <class Arch>
__attribute__((noinline)) Pack<Arch> power(const Pack<Arch>& x, double exponent) {
  Pack<Arch> result;
  for (int lane = 0; lane < Arch::kWidth; ++lane) result.set(lane, __builtin_pow(x.get(lane), exponent));
  return result;
}

/// The angle of the shorter rotation divided by s, with the sign of w: 2 atan2(s, |w|) / s for s >= 0. s is the norm of
/// a quaternion's vector part and w its scalar part, not both zero. Arc tangents of quotients within tan(pi/8) use a
/// polynomial (interpolated at Chebyshev points, relative error 7e-18), others are reduced by pi/4 or pi/2; small
/// rotations need no division by s. Relative error below 1e-15 (measured).
template <class S>
GRAPNEL_INLINE S turn_per_sine(const S& s, const S& w) {
  constexpr double kTangent = 0.41421356237309503, kQuarterPi = 0.78539816339744831;
  constexpr double kArcTangent[] = {-0.3333333333333333,  0.1999999999999552,   -0.14285714284666542,
                                    0.11111111015256361,  -0.09090904578123903, 0.07692183190826087,
                                    -0.06664511447381948, 0.0585814891280221,   -0.0508544973794026,
                                    0.03923165829558719,  -0.01917688711906226};
  const S size = abs(w);
  const auto small = s <= S(S(kTangent) * size), large = size < S(S(kTangent) * s);
  const S quotient = select(small, s, select(large, -size, s - size)) / select(small, size, select(large, s, s + size));
  const S square = quotient * quotient;
  S p(kArcTangent[10]);
  for (int k = 10; k-- > 0;) p = square * p + S(kArcTangent[k]);
  p = square * p + S(1.0);  // atan(x) / x
  const S angle = quotient * p + select(large, S(2 * kQuarterPi), S(kQuarterPi));
  const S half = select(small, p / size, angle / s);
  const S turn = half + half;
  return select(w < S(0.0), -turn, turn);
}

/// A fixed number of values in aligned memory. Lane code has no standard containers of doubles: their instantiations in
/// a translation unit for one instruction set could be linked into portable code. The tag S, a pack, separates the
/// names.
template <class S, class T = S>
class LaneArray {
 public:
  explicit LaneArray(int size) : data_(new T[static_cast<unsigned long>(size > 0 ? size : 1)]()), size_(size) {
    if constexpr (std::is_convertible_v<double, T>) {
      for (int i = 0; i < size; ++i) data_[i] = T(0);
    }
  }
  LaneArray(const LaneArray&) = delete;
  LaneArray& operator=(const LaneArray&) = delete;
  ~LaneArray() { delete[] data_; }
  GRAPNEL_INLINE T& operator[](int i) { return data_[i]; }
  GRAPNEL_INLINE const T& operator[](int i) const { return data_[i]; }
  GRAPNEL_INLINE T* data() { return data_; }
  GRAPNEL_INLINE const T* data() const { return data_; }
  GRAPNEL_INLINE int size() const { return size_; }

 private:
  T* data_;
  int size_;
};

}  // namespace grapnel::lanes
