#pragma once

/// @file
/// pack_checks.hpp's functions for one instruction set; included by that set's translation unit alone.

#include "grapnel/spatial/pack.hpp"
#include "lanes/pack_checks.hpp"

namespace grapnel::lanes::testing {

template <class Arch>
void arithmetic(const double* a_, const double* b_, const double* c_, double* out, int count) {
  using P = Pack<Arch>;
  for (int i = 0; i < count; i += P::kWidth) {
    const P a = P::load(a_ + i), b = P::load(b_ + i), c = P::load(c_ + i), one(1.0), zero(0.0);
    const auto put = [&](PackResult k, const P& x) { x.store(out + k * count + i); };
    const auto truth = [&](PackResult k, const LaneMask<Arch>& m) { put(k, select(m, one, zero)); };
    put(kSum, a + b), put(kDifference, a - b), put(kProduct, a * b), put(kQuotient, a / b), put(kNegative, -a);
    put(kRoot, sqrt(a)), put(kMagnitude, abs(a)), put(kSmaller, min(a, b)), put(kLarger, max(a, b));
    put(kProductPlus, a * b + c), put(kPlusProduct, c + a * b);
    put(kProductMinus, a * b - c), put(kMinusProduct, c - a * b);
    put(kTwoProducts, a * b + b * c), put(kProductsApart, a * b - b * c), put(kNegativeProduct, -(a * b) + c);
    put(kThreeProducts, a * b + b * c - c * a);
    P sum = c, rest = c;
    sum += a * b, rest -= a * b;
    put(kAddedProduct, sum), put(kTakenProduct, rest);
    put(kMixed, 2 * (a - 0.5 * b) / 3);
    put(kSelected, select(a * b < c, a, b));
    truth(kEqual, a == b), truth(kUnequal, a != b);
    truth(kLess, a < b), truth(kLessOrEqual, a <= b), truth(kGreater, a > b), truth(kGreaterOrEqual, a >= b);
    truth(kBoth, (a < b) & (b < c)), truth(kEither, (a < b) | (b < c)), truth(kNeither, !((a < b) | (b < c)));
  }
}

// Writes one lane of a pack and of a mask and checks that the others are unchanged. The expectation is kept in arrays
// because g++ 12.2 at -O2 miscompiles the bitwise comparison of two numbers that it knows to be equal.
template <class Arch>
bool writes_one_lane(unsigned bits, int lane) {
  using P = Pack<Arch>;
  bool truth[P::kWidth];
  double numbers[P::kWidth];
  for (int i = 0; i < P::kWidth; ++i) truth[i] = (bits & (1U << i)) != 0, numbers[i] = truth[i] ? 1.0 : -1.0;
  LaneMask<Arch> m = LaneMask<Arch>::from_bits(bits);
  P x = select(m, P(1.0), P(-1.0));
  m.set(lane, truth[lane] = !truth[lane]);
  x.set(lane, numbers[lane] = 7.0);
  for (int i = 0; i < P::kWidth; ++i) {
    if (m.get(i) != truth[i] || x.get(i) != numbers[i]) return false;
  }
  return true;
}

template <class Arch>
int masks() {
  using M = LaneMask<Arch>;
  for (unsigned bits = 0; bits <= M::kAllBits; ++bits) {
    const M m = M::from_bits(bits);
    if (m.bits() != bits || any(m) != (bits != 0) || none(m) != (bits == 0) || all(m) != (bits == M::kAllBits))
      return 1;
    if ((!m).bits() != (bits ^ M::kAllBits)) return 2;
    for (int lane = 0; lane < M::kWidth; ++lane) {
      if (!writes_one_lane<Arch>(bits, lane)) return 3;
    }
  }
  return 0;
}

template <class Arch>
void turns(const double* s, const double* w, double* out, int count) {
  using P = Pack<Arch>;
  for (int i = 0; i < count; i += P::kWidth) turn_per_sine(P::load(s + i), P::load(w + i)).store(out + i);
}

template <class Arch>
constexpr PackChecks make_pack_checks() {
  return {Arch::kWidth, arithmetic<Arch>, masks<Arch>, turns<Arch>};
}

}  // namespace grapnel::lanes::testing
