#pragma once

/// @file
/// Force laws of a contact as templates on the scalar (scalar.hpp), for one contact (double) and for SIMD lanes. They
/// need `sqrt`, `min` and `max`, and have no branches. Equations of theory section 23.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel::contact_law {

using std::max;
using std::min;

/// Hertz: F = 4/3 E* sqrt(R) depth^(3/2) [N] (23.4). Zero for a negative depth.
template <class S>
GRAPNEL_INLINE S hertz_force(const S& modulus, const S& radius, const S& depth) {
  using std::sqrt;
  const S d = max(S(0.0), depth);
  return S(4.0 / 3.0) * modulus * sqrt(radius * d) * d;
}
/// Its potential [J].
template <class S>
GRAPNEL_INLINE S hertz_energy(const S& modulus, const S& radius, const S& depth) {
  return S(0.4) * max(S(0.0), depth) * hertz_force(modulus, radius, depth);
}

/// The smooth step 3 t^2 - 2 t^3 from 0 to 1, for t clamped to [0, 1].
template <class S>
GRAPNEL_INLINE S smooth_step(const S& t) {
  const S x = min(S(1.0), max(S(0.0), t));
  return x * x * (S(3.0) - S(2.0) * x);
}

/// Normal force (23.5): elastic force with the dissipation of Hunt and Crossley, and a damper that acts gradually from
/// depth zero to damping_depth. Never tensile. `approach_speed`: rate of the depth [m/s].
template <class S>
GRAPNEL_INLINE S normal_force(const S& elastic, const S& dissipation, const S& damping, const S& relative_depth,
                              const S& approach_speed) {
  return max(S(0.0), elastic * (S(1.0) + dissipation * approach_speed) +
                         damping * smooth_step(relative_depth) * approach_speed);
}

/// Friction coefficient at a slip speed (23.7): the static one at rest, the mean of both at the stiction speed, the
/// kinetic one far beyond it.
template <class S>
GRAPNEL_INLINE S friction_coefficient(const S& static_friction, const S& kinetic_friction, const S& stiction_speed,
                                      const S& slip_speed) {
  const S ratio = slip_speed / stiction_speed;
  return kinetic_friction + (static_friction - kinetic_friction) / (S(1.0) + ratio * ratio);
}

/// Couple against rolling per length, normal force and angular rate [s/rad]: it rises to 1 / rate at stiction_rate, and
/// falls with the rate beyond, so that the couple stays constant. Continuously differentiable.
template <class S>
GRAPNEL_INLINE S rolling_ratio(const S& stiction_rate, const S& rate) {
  const S stuck = min(S(1.0), rate / stiction_rate);
  return (S(2.0) - stuck) / max(rate, stiction_rate);
}

}  // namespace grapnel::contact_law
