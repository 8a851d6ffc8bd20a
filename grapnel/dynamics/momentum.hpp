#pragma once

/// @file
/// Momentum, centre of mass and kinetic energy, body by body from poses and twists. Independent of the mass matrix and
/// of the integrator's variables, and therefore suitable for conservation checks. Public, kept stable.

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

/// Spin momentum, per joint rate, of the rotor of a body's joint, in W [kg m^2 or kg m]; the rotor is carried by the
/// body's parent (Model::rotors()).
Vector3d rotor_momentum(const Model& model, const Kinematics& kinematics, int body);

/// Momentum of one body about its own centre of mass, in W, including the spin of the rotors that it carries, and the
/// position of that centre.
struct BodyMomentum {
  Momentumd h;    // [angular about the body's centre of mass; linear] in W
  Vector3d p_WC;  // centre of mass in W
};
BodyMomentum body_momentum(const Model& model, const Kinematics& kinematics, int body);

/// Centre of mass, in W, of the trees rooted at `roots` (empty: of everything).
Vector3d center_of_mass(const Model& model, const Kinematics& kinematics, std::span<const int> roots = {});

/// Total momentum [l; p] about a point of W, in W (2.2), of the trees rooted at `roots` (empty: of all trees). Rotors
/// with a stated axis contribute their spin, (19.6); the others contribute only to the diagonal of the mass matrix.
Momentumd momentum_about(const Model& model, const Kinematics& kinematics, const Vector3d& p_W,
                         std::span<const int> roots = {});

/// Kinetic energy [J] of the trees rooted at `roots` (empty: of all trees), rotors included. The sum of V . I V / 2
/// over bodies plus reflected inertia times rate squared / 2; for rotors with a stated axis also spin times the
/// carrier's angular velocity about it (19.7).
double kinetic_energy(const Model& model, const Kinematics& kinematics, const State& state,
                      std::span<const int> roots = {});

/// Energy of the spring at a body's joint [J]; the body is one of Model::springs().
double spring_energy(const Model& model, const State& state, int body);

// Reference scales of momentum and energy deviations, for one group of connected bodies (docs/theory, section 9). A
// template on the scalar, shared by the conservation checks of single captures and of lanes.

/// Magnitude of a group's motion: sums over its bodies of mass m, velocity v of the centre of mass and spin momentum I
/// w; r and V are measured from the group's own centre of mass and its velocity.
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

/// Lower bounds of the scales: this share of the other momentum scale, converted by the group's radius of gyration, and
/// its square times the total kinetic energy. They prevent rounding errors of cancelling terms from counting as drift,
/// for motions without angular momentum or with angular momentum alone.
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
