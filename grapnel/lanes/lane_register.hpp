#pragma once

/// @file
/// One SIMD register of doubles per instruction set, behind the same few operations: the part of Pack that differs
/// between sets. A set is known only where the compiler may use it, that is in the translation units compiled for it.
///
/// On xsimd 8.1, but for what it gets wrong or lacks: AVX-512 fused products (it rounds twice), negation (0 - x loses
/// the sign of zero), != with NaN, and-not (its order of arguments varies), masks as bits.

#include <cstdint>
#include <xsimd/xsimd.hpp>

#include "grapnel/lanes/arch.hpp"
#include "grapnel/spatial/scalar.hpp"

namespace grapnel::lanes {

/// Register operations of one instruction set; undefined where the compiler must not use it.
template <class Arch>
struct LaneRegister;

/// What xsimd does alike for its architectures.
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
  // b where either is not a number, as the instruction.
  static GRAPNEL_INLINE Value min(const Value& a, const Value& b) { return xsimd::min(a, b); }
  static GRAPNEL_INLINE Value max(const Value& a, const Value& b) { return xsimd::max(a, b); }
  static GRAPNEL_INLINE Value select(const Mask& m, const Value& a, const Value& b) { return xsimd::select(m, a, b); }
  static GRAPNEL_INLINE Mask both(const Mask& a, const Mask& b) { return a & b; }
  static GRAPNEL_INLINE Mask either(const Mask& a, const Mask& b) { return a | b; }

  /// Turns the sine and cosine of an angle's remainder into those of the angle, n quarter turns on; n is in the lowest
  /// bits of `turns`. Odd quarters swap, the sine changes sign in quarters 2 and 3, the cosine in 1 and 2.
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

}  // namespace grapnel::lanes
