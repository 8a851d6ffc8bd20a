#pragma once

/// @file
/// What deviations of momentum and energy are relative to, for one group of bodies that touch (docs/theory.md, section
/// 9), as a template on the scalar: the conservation checks of single captures and those of lanes share it.

#include <algorithm>
#include <cmath>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

/// How large a group's motion is at an instant: sums over its bodies of mass m, velocity v of the centre of mass and
/// spin momentum I w; r and V are measured from the group's own centre of mass and its velocity.
template <class S>
struct GroupSize {
  S mass;           // [kg]
  S linear;         // sum |m v| [N s]
  S angular;        // sum (|I w| + |r x m (v - V)|) [N m s]
  S second_moment;  // sum (m r^2 + tr(I) / 2) = mass times the radius of gyration squared [kg m^2]
  S inner_energy;   // kinetic energy of the motion relative to the centre of mass, rotors included [J]
  S energy;         // kinetic energy [J]
};

/// Scales of one group.
template <class S>
struct GroupScale {
  S linear, angular, energy;
};

/// Neither scale of momentum is smaller than this part of what the other one is worth at the group's radius of
/// gyration, and energy's not smaller than its square of the whole kinetic energy: where a motion has no angular
/// momentum, or nothing but it, rounding of what cancels is not taken for drift.
inline constexpr double kScaleFloor = 1e-3;

template <class S>
GRAPNEL_INLINE GroupScale<S> group_scale(const GroupSize<S>& size) {
  using std::max;
  using std::sqrt;
  const S radius = sqrt(S(size.second_moment / size.mass));
  const S floor(kScaleFloor);
  return {max(size.linear, S(floor * S(size.angular / radius))), max(size.angular, S(floor * S(radius * size.linear))),
          max(size.inner_energy, S(S(floor * floor) * size.energy))};
}

}  // namespace grapnel
