#pragma once

/// @file
/// Momentum, centre of mass and kinetic energy, body by body from poses and twists: independent of the mass matrix and
/// of what an integrator carries, so that a ledger can trust it. Public, kept stable.

#include <algorithm>
#include <cmath>
#include <span>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

/// Inertia of one body about the world's axes at its frame's origin.
RigidBodyInertiad world_inertia(const Model& model, const Kinematics& kinematics, int body);

/// Rate of a body's joint with one degree of freedom, from the twists of body and parent [rad/s or m/s].
double joint_rate(const Model& model, const Kinematics& kinematics, int body);

/// Spin momentum, per joint rate, of the rotor of a body's joint, in W [kg m^2 or kg m]; the body's parent carries the
/// rotor (Model::rotors()).
Vector3d rotor_momentum(const Model& model, const Kinematics& kinematics, int body);

/// Momentum of one body about its own centre of mass, the spin of the rotors that it carries included, in W, and where
/// that centre is.
struct BodyMomentum {
  Momentumd h;    // [angular about the body's centre of mass; linear] in W
  Vector3d p_WC;  // centre of mass in W
};
BodyMomentum body_momentum(const Model& model, const Kinematics& kinematics, int body);

/// Centre of mass, in W, of the trees rooted at `roots` (empty: of everything).
Vector3d center_of_mass(const Model& model, const Kinematics& kinematics, std::span<const int> roots = {});

/// Total momentum [l; p] about a point of W, in W (2.2), of the trees rooted at `roots` (empty: of everything). Rotors
/// whose axis is given count with their spin, (19.6); the others count through the mass matrix's diagonal only.
Momentumd momentum_about(const Model& model, const Kinematics& kinematics, const Vector3d& p_W,
                         std::span<const int> roots = {});

/// Kinetic energy [J], rotors included: sum of V . I V / 2 over bodies plus reflected inertia times rate squared / 2,
/// and of rotors whose axis is given spin times the carrier's angular velocity about it (19.7), of the trees rooted at
/// `roots` (empty: of everything).
double kinetic_energy(const Model& model, const Kinematics& kinematics, const State& state,
                      std::span<const int> roots = {});

/// Energy of the spring at a body's joint [J]; the body is one of Model::springs().
double spring_energy(const Model& model, const State& state, int body);

// What deviations of momentum and energy are relative to, for one group of bodies that touch (docs/theory, section
// 9), as a template on the scalar: the conservation checks of single captures and those of lanes share it.

/// How large a group's motion is at an instant: sums over its bodies of mass m, velocity v of the centre of mass and
/// spin momentum I w; r and V are measured from the group's own centre of mass and its velocity.
template <class S>
struct GroupSize {
  S mass;           // [kg]
  S linear;         // sum |m v| [N s]
  S angular;        // sum (|I w| + |r x m (v - V)|) [N m s]
  S second_moment;  // sum (m r^2 + tr(I) / 2) = mass times the radius of gyration squared [kg m^2]
  S inner_energy;   // kinetic energy of the motion relative to the centre of mass, rotors included, and of springs [J]
  S energy;         // the same and kinetic energy of the centre of mass [J]
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
