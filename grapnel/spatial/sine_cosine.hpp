#pragma once

/// @file
/// Combined sine and cosine of a double, inline and without branches in the common range, so that evaluations for
/// neighbouring joints overlap.
///
/// Argument reduction by the method of Cody and Waite with pi/2 in three parts, followed by the polynomials of fdlibm's
/// k_sin.c and k_cos.c. Each result is within 0.8 units in the last place for |angle| <= 1e5; the standard library is
/// used beyond. fdlibm is Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved. Developed at SunSoft, a Sun
/// Microsystems, Inc. business. Permission to use, copy, modify, and distribute this software is freely granted,
/// provided that this notice is preserved.

#include <bit>
#include <cmath>
#include <cstdint>

namespace grapnel {

template <class S>
struct SineCosine {
  S sine;
  S cosine;
};

namespace sine_cosine_detail {

// pi/2 = kPart1 + kPart2 + kPart3: 33 bits, 33 bits, the rest. Products of the first two with integers below 2^20 are
// exact.
inline constexpr double kPart1 = 1.57079632673412561417e+00;
inline constexpr double kPart2 = 6.07710050630396597660e-11;
inline constexpr double kPart3 = 2.02226624879595063154e-21;
inline constexpr double kTwoOverPi = 6.36619772367581382433e-01;
inline constexpr double kLimit = 1e5;
// Adding and subtracting 1.5 * 2^52 rounds to an integer, which is stored in the sum's lowest bits.
inline constexpr double kRound = 6755399441055744.0;

/// An angle as a number of quarter turns and the sine and cosine of the remainder, for |angle| <= kLimit.
template <class S>
struct Quartered {
  S turns;  // the count in its lowest bits
  S sine;
  S cosine;
};

/// For any scalar; for packs, the types of products determine which operations are fused.
template <class S>
__attribute__((always_inline)) inline Quartered<S> quartered(const S& angle) {
  // angle = n pi/2 + y + tail with |y| <= pi/4 (1 + epsilon); the tail is the rounding error of y.
  const S shifted = angle * kTwoOverPi + kRound;
  const S count = shifted - kRound;
  const S first = angle - count * kPart1;
  const S r = first - count * kPart2;
  const S lost = count * kPart3 - ((first - r) - count * kPart2);
  const S y = r - lost;
  const S tail = (r - y) - lost;

  const S z = y * y;
  // sin(y + tail) = y + (S1 y^3 + ... + S6 y^13) + tail cos(y).
  const S z2 = z * z;
  const S s = (8.33333333332248946124e-03 + z * -1.98412698298579493134e-04) +
              z2 * ((2.75573137070700676789e-06 + z * -2.50507602534068634195e-08) + z2 * 1.58969099521155010221e-10);
  const S y3 = z * y;
  const S sine = y - ((z * (0.5 * tail - y3 * s) - tail) - y3 * -1.66666666666666324348e-01);
  // cos(y + tail) = 1 - y^2/2 + (C1 y^4 + ... + C6 y^14) - y tail.
  const S c = z * ((4.16666666666666019037e-02 + z * -1.38888888888741095749e-03) +
                   z2 * ((2.48015872894767294178e-05 + z * -2.75573143513906633035e-07) +
                         z2 * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)));
  const S w = 1.0 - 0.5 * z;
  const S cosine = w + (((1.0 - w) - 0.5 * z) + (z * c - y * tail));
  return {shifted, sine, cosine};
}

/// For |angle| <= kLimit.
__attribute__((always_inline)) inline SineCosine<double> reduced(double angle) {
  const Quartered<double> at = quartered(angle);
  // Quadrant n mod 4: odd ones swap; the sine changes sign in 2 and 3, the cosine in 1 and 2.
  const std::uint64_t n = std::bit_cast<std::uint64_t>(at.turns), sine_bits = std::bit_cast<std::uint64_t>(at.sine),
                      cosine_bits = std::bit_cast<std::uint64_t>(at.cosine);
  const std::uint64_t swapped = (sine_bits ^ cosine_bits) & (std::uint64_t{0} - (n & 1));
  return {std::bit_cast<double>(sine_bits ^ swapped ^ ((n & 2) << 62)),
          std::bit_cast<double>(cosine_bits ^ swapped ^ (((n + 1) & 2) << 62))};
}

/// The standard library's functions, for large angles; not inlined.
SineCosine<double> unreduced(double angle);

}  // namespace sine_cosine_detail

/// Sine and cosine of an angle [rad].
__attribute__((always_inline)) inline SineCosine<double> sine_cosine(double angle) {
  using namespace sine_cosine_detail;
  if (std::abs(angle) <= kLimit) [[likely]] {
    return reduced(angle);
  }
  return unreduced(angle);
}

}  // namespace grapnel
