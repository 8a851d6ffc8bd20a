#pragma once

/// @file
/// Integrals of a phase: the work of motors, of friction and of external effects, and the external impulse; in total
/// and of each tree. The integrals as returned, their places among the integrated numbers, and their rates, as
/// templates for a single capture (double) and for many in SIMD lanes (packs, grapnel/lanes/).

#include <cmath>
#include <vector>

#include "grapnel/contact/contact_integrals.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// External input to one tree of the model.
struct TreeIntegrals {
  /// Moments are about the tree's moving centre of mass, so that a uniform motion of everything has no effect.
  Momentumd impulse = Momentumd::zero();
  double work = 0;  // in the frame of the centre of mass: of forces that change the motion relative to it [J]
};

/// Integrals of the magnitudes of all exchange of a tree since a phase began, without cancellation: scales of the
/// conservation checks.
struct TreeExchange {
  double impulse = 0;          // of each external force [N s]
  double angular_impulse = 0;  // of each external wrench, about the tree's centre of mass [N m s]
  double work = 0;             // of each motor, friction and wrench, in the frame of the centre of mass [J]
  TreeExchange& operator+=(const TreeExchange& other) {
    impulse += other.impulse, angular_impulse += other.angular_impulse, work += other.work;
    return *this;
  }
};

/// Integrals of one joint.
struct JointIntegrals {
  std::size_t joint = 0;     // position in Model::joints()
  double motor_work = 0;     // [J]; mechanical
  double friction_work = 0;  // [J]; negative; without stops
  double copper_loss = 0;    // [J]; zero if its motor's torque constant is unknown
};

/// Integrals of a slipping grasp.
struct SlipIntegrals {
  double friction = 0;  // dissipated [J]
  double distance = 0;  // path of the gripper's frame relative to the target [m]
  double angle = 0;     // likewise, of its rotation [rad]
};

/// Integrals since the phase's start.
struct PhaseIntegrals {
  double motor_work = 0;     // [J]; of drives, prescribed joints included
  double friction_work = 0;  // [J]; negative; of friction, and of impacts at stops
  double external_work = 0;  // [J]; of gravity, loads, contacts, slipping grasps, attitude control, a holding wrench
  /// Of these and of the ground; about the world's origin, in W.
  Momentumd external_impulse = Momentumd::zero();
  std::vector<TreeIntegrals> trees = {};  // in the order of the roots; empty without external effects
  std::vector<SlipIntegrals> slips = {};  // of PhaseSetup::slips
  /// Of dampers at joints with springs, part of friction_work, per tree; empty if there are none [J].
  std::vector<double> damper_work = {};
  std::vector<JointIntegrals> joints = {};      // with static friction, stops or a motor (JointDescription)
  std::vector<ContactIntegrals> contacts = {};  // per group of contacts
  std::vector<TreeExchange> exchanged = {};     // in the order of the roots; empty: not measured
};

namespace phase_integral {

// Places of the integrals of the whole: work [J], moment about the world's origin [N m s], force [N s].
inline constexpr int kMotorWork = 0, kFrictionWork = 1, kExternalWork = 2, kExternalMoment = 3, kExternalForce = 6;
inline constexpr int kWholeCount = 9;
// Then, tree by tree if there are external effects: work in the frame of the tree's centre of mass [J], moment about it
// [N m s], force [N s].
inline constexpr int kTreeWork = 0, kTreeMoment = 1, kTreeForce = 4;
inline constexpr int kTreeCount = 7;
// Then, of slipping grasps (SlipIntegrals).
inline constexpr int kSlipFriction = 0, kSlipDistance = 1, kSlipAngle = 2;
inline constexpr int kSlipCount = 3;
// Then, of joints with static friction, stops or a motor: work of motor and friction, copper loss [J].
inline constexpr int kJointMotor = 0, kJointFriction = 1, kJointCopper = 2;
inline constexpr int kJointCount = 3;
// Then, of groups of contacts (ContactIntegrals); then the deformations of contacts (ContactSet::stick_count()).
inline constexpr int kContactWork = 0, kContactDamping = 1, kContactFriction = 2, kContactImpulse = 3, kContactSlip = 4;
inline constexpr int kContactCount = 5;
// At the end, tree by tree, the magnitudes of TreeExchange. They are not under error control.
inline constexpr int kExchangedImpulse = 0, kExchangedMoment = 1, kExchangedWork = 2;
inline constexpr int kExchangeCount = 3;

/// A tree of the model at an instant.
template <class S>
struct TreeMotion {
  S mass = S(0.0);                           // [kg]
  Vector3<S> com = Vector3<S>::zero();       // of mass, in W [m]
  Vector3<S> of_root = Vector3<S>::zero();   // velocity of a point of the root, in W [m/s]
  Vector3<S> velocity = Vector3<S>::zero();  // of the centre of mass, in W: a sum over differences from of_root, which
                                             // is exact where all bodies have one velocity [m/s]
};

/// Adds the rates of a wrench on a body of tree number `t`: a force at the point p_W, a moment, and their power [W],
/// all in W. `rates`: of the total and of all trees.
template <class S>
GRAPNEL_INLINE void add_wrench(S* rates, int t, const TreeMotion<S>& tree, const Vector3<S>& force,
                               const Vector3<S>& p_W, const Vector3<S>& moment, const S& power) {
  S* own = rates + kWholeCount + kTreeCount * t;
  const Vector3<S> about_origin = moment + cross(p_W, force), about_com = moment + cross(p_W - tree.com, force);
  for (int i = 0; i < 3; ++i) {
    rates[kExternalMoment + i] += about_origin[i];
    rates[kExternalForce + i] += force[i];
    own[kTreeMoment + i] += about_com[i];
    own[kTreeForce + i] += force[i];
  }
  rates[kExternalWork] += power;
  own[kTreeWork] += S(power - dot(force, tree.velocity));
}

/// Adds the magnitudes of the same wrench to a tree's TreeExchange rates.
template <class S>
GRAPNEL_INLINE void add_exchange(S* exchanged, const TreeMotion<S>& tree, const Vector3<S>& force,
                                 const Vector3<S>& p_W, const Vector3<S>& moment, const S& power) {
  using std::abs;
  exchanged[kExchangedImpulse] += norm(force);
  exchanged[kExchangedMoment] += norm(Vector3<S>(moment + cross(p_W - tree.com, force)));
  exchanged[kExchangedWork] += abs(S(power - dot(force, tree.velocity)));
}

/// The same as add_wrench() for uniform gravity [m/s^2] on tree number `t`: it acts at its centre of mass, relative to
/// which it has no effect.
template <class S>
GRAPNEL_INLINE void add_weight(S* rates, int t, const TreeMotion<S>& tree, const Vector3<S>& gravity) {
  const Vector3<S> weight = tree.mass * gravity, moment = cross(tree.com, weight);
  for (int i = 0; i < 3; ++i) {
    rates[kExternalMoment + i] += moment[i];
    rates[kExternalForce + i] += weight[i];
    rates[kWholeCount + kTreeCount * t + kTreeForce + i] += weight[i];
  }
  rates[kExternalWork] += dot(weight, tree.velocity);
}

}  // namespace phase_integral
}  // namespace grapnel
