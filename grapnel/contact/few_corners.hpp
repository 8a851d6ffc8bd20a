#pragma once

/// @file
/// Convex polygons of at most eight corners, with one number per corner in SIMD registers. Nearly all polygons of
/// contacts are such. Private to this module.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "grapnel/spatial/scalar.hpp"

#if defined(__AVX512F__)
#include <immintrin.h>
#define GRAPNEL_CUT_IN_REGISTERS
#endif

namespace grapnel::few_corners {

constexpr std::size_t kFew = 8;

using Numbers = double __attribute__((vector_size(64)));

/// The corners before and after each one of n. Behind the last one: itself, and the first one.
struct Neighbors {
  alignas(64) std::int64_t before[kFew], after[kFew], corner[kFew];
};
constexpr std::array<Neighbors, kFew + 1> kNeighbors = [] {
  std::array<Neighbors, kFew + 1> all{};
  for (std::size_t n = 1; n <= kFew; ++n) {
    for (std::size_t i = 0; i < kFew; ++i) {
      const std::size_t before = i > 0 ? i - 1 : n - 1, after = i + 1 < n ? i + 1 : 0;
      all[n].before[i] = static_cast<std::int64_t>(i < n ? before : i);
      all[n].after[i] = static_cast<std::int64_t>(i < n ? after : 0);
      all[n].corner[i] = static_cast<std::int64_t>(i < n ? i : 0);
    }
  }
  return all;
}();

/// to[i] = from[index[i]].
GRAPNEL_INLINE void permute(const Numbers& from, const std::int64_t* index, Numbers& to) {
#if defined(__AVX512F__)
  to = _mm512_permutexvar_pd(_mm512_load_si512(index), from);
#else
  for (std::size_t i = 0; i < kFew; ++i) to[i] = from[index[i]];
#endif
}

/// Sum of all numbers; the same bits for any width of registers.
GRAPNEL_INLINE double total(const Numbers& v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

#if defined(GRAPNEL_CUT_IN_REGISTERS)

/// Anticlockwise. Numbers behind the last corner are those of the first one.
struct Polygon {
  __m512d s, t;
  unsigned corners;
};

/// A polygon of which some corners are outside of a line => the numbers of the corners of the part inside: less than
/// kFew, a corner of the polygon; otherwise kFew + i, where the line crosses the edge from corner i. No corners: those
/// outside are not consecutive, or the part has too many.
struct alignas(16) Cut {
  std::uint8_t pick[kFew], corners;
};
/// By the bits of the corners outside, and one bit behind that of the last corner.
constexpr std::array<Cut, 2u << kFew> kCuts = [] {
  std::array<Cut, 2u << kFew> all{};
  for (unsigned n = 3; n <= kFew; ++n) {
    const unsigned every = (1u << n) - 1;
    for (unsigned outside = 1; outside < every; ++outside) {
      const unsigned before = (outside << 1 | outside >> (n - 1)) & every;
      const unsigned kept = n - static_cast<unsigned>(std::popcount(outside));
      if (!std::has_single_bit(outside & ~before) || kept + 2 > kFew) continue;
      const unsigned first = static_cast<unsigned>(std::countr_zero(before & ~outside));  // the first one inside
      Cut& cut = all[every + 1 + outside];
      cut.corners = static_cast<std::uint8_t>(kept + 2);
      for (unsigned i = 0; i < kFew; ++i) cut.pick[i] = static_cast<std::uint8_t>((first + (i < kept ? i : 0)) % n);
      cut.pick[kept] = static_cast<std::uint8_t>(kFew + (first + kept - 1) % n);
      cut.pick[kept + 1] = static_cast<std::uint8_t>(kFew + (first + n - 1) % n);
    }
  }
  return all;
}();

enum class Rest { none, some, unknown };

/// Keeps the part of the polygon where c + a s + b t is not negative. Unknown: it has too many corners, or rounding
/// errors make its corners alternate; the polygon is then unchanged.
GRAPNEL_INLINE Rest clip(Polygon& p, double c, double a, double b) {
  const __m512d value = c + a * p.s + b * p.t;
  const __mmask8 negative = _mm512_cmp_pd_mask(value, _mm512_setzero_pd(), _CMP_LT_OQ);
  const unsigned behind = 1u << p.corners, outside = negative & (behind - 1);
  if (outside == 0) return Rest::some;
  if (outside == behind - 1) return Rest::none;
  const Cut& cut = kCuts[behind + outside];
  if (cut.corners == 0) return Rest::unknown;
  // Crossings of all edges, from the corner inside: they do not wait for the numbers of those that are needed.
  const __m512i after = _mm512_load_si512(kNeighbors[p.corners].after);
  const __m512i pick = _mm512_cvtepu8_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(cut.pick)));
  const __m512d next = _mm512_permutexvar_pd(after, value);
  const __m512d inside = _mm512_mask_blend_pd(negative, value, next);
  const __m512d part = inside / (inside - _mm512_mask_blend_pd(negative, next, value));
  const auto picked = [&](const __m512d& x) GRAPNEL_INLINE_LAMBDA {
    const __m512d x_after = _mm512_permutexvar_pd(after, x);
    const __m512d near = _mm512_mask_blend_pd(negative, x, x_after), far = _mm512_mask_blend_pd(negative, x_after, x);
    return _mm512_permutex2var_pd(x, pick, near + part * (far - near));
  };
  p.s = picked(p.s), p.t = picked(p.t), p.corners = cut.corners;
  return Rest::some;
}

/// The corners to an array of pairs (s, t), also those behind the last one.
GRAPNEL_INLINE void store(const Polygon& p, double* pairs) {
  const __m512i low = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11), high = _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15);
  _mm512_storeu_pd(pairs, _mm512_permutex2var_pd(p.s, low, p.t));
  _mm512_storeu_pd(pairs + kFew, _mm512_permutex2var_pd(p.s, high, p.t));
}

#endif

/// The corners from an array of at least kFew pairs (s, t), those behind the n-th one from the first one.
GRAPNEL_INLINE void load(const double* pairs, std::size_t n, Numbers& s, Numbers& t) {
#if defined(__AVX512F__)
  const __m512d low = _mm512_loadu_pd(pairs), high = _mm512_loadu_pd(pairs + kFew);
  s = _mm512_permutex2var_pd(low, _mm512_setr_epi64(0, 2, 4, 6, 8, 10, 12, 14), high);
  t = _mm512_permutex2var_pd(low, _mm512_setr_epi64(1, 3, 5, 7, 9, 11, 13, 15), high);
  permute(s, kNeighbors[n].corner, s);
  permute(t, kNeighbors[n].corner, t);
#else
  for (std::size_t i = 0; i < kFew; ++i) {
    const std::size_t k = static_cast<std::size_t>(kNeighbors[n].corner[i]);
    s[i] = pairs[2 * k], t[i] = pairs[2 * k + 1];
  }
#endif
}

}  // namespace grapnel::few_corners
