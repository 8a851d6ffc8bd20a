#pragma once

/// @file
/// Plain data that describe bodies, joints and frames, as a file or a program gives them. ModelBuilder turns them into
/// an immutable Model. Public, kept stable.

#include <limits>
#include <string>

#include "grapnel/model/joint_type.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// Position limits [rad or m], rate limit [rad/s or m/s], effort limit [N m or N]; infinite where none is given.
struct JointLimits {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double rate = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity();
};

/// Friction torque -(viscous rate + coulomb tanh(rate / transition_rate)). The smooth transition stands for the jump of
/// dry friction, so a joint creeps where a real one sticks; the rate at which it does is the user's to choose.
struct JointFriction {
  double viscous = 0;             // [N m s/rad or N s/m]
  double coulomb = 0;             // [N m or N]
  double transition_rate = 1e-3;  // [rad/s or m/s]
};

/// A joint between a body and its parent.
struct JointDescription {
  std::string name;
  JointType type = JointType::fixed;
  Vector3d axis{0, 0, 1};  // unit vector in the joint's frame
  JointLimits limits;
  JointFriction friction;
  double rotor_inertia = 0;  // of the motor about its own axis [kg m^2]
  double gear_ratio = 1;     // motor turns per joint turn [1, or rad/m for a prismatic joint]

  /// What the rotor adds to the joint's diagonal of the mass matrix [kg m^2 or kg].
  double reflected_inertia() const { return gear_ratio * gear_ratio * rotor_inertia; }
};

/// A rigid body and the joint that carries it. Its frame sits at the joint: X_PB(q) = X_PF * joint motion(q).
struct BodyDescription {
  std::string name;
  std::string parent;              // name of the parent body; empty: the world
  Posed X_PF = Posed::identity();  // joint frame in the parent's frame
  JointDescription joint;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the body's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in the body's axes [kg m^2]
};

/// A named frame fixed on a body: an end-effector, a grasp point, a sensor.
struct FrameDescription {
  std::string name;
  std::string body;
  Posed X_BE = Posed::identity();  // in the body's frame
};

}  // namespace grapnel
