#pragma once

/// @file
/// Sine and cosine of packs: grapnel/spatial/sine_cosine.hpp's polynomials, so that OneLane is the reference for the
/// wider sets bit by bit.

#include "grapnel/lanes/pack.hpp"

namespace grapnel::lanes {

/// The lanes whose angle is too large for the reduction, one after the other by the standard library. A NaN stays one
/// in the polynomials and does not come here.
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

}  // namespace grapnel::lanes
