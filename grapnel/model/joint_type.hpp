#pragma once

/// @file
/// Properties of joint types. All code except the recursive kernels (dynamics/recursion.hpp) uses this table. Public,
/// kept stable.

#include <cstdint>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// Motion of a body relative to its parent. `free`, and `fixed` to the world, make a root; `spherical` is used for
/// targets held at a point.
enum class JointType : std::uint8_t { revolute, continuous, prismatic, fixed, spherical, free };

/// Coordinate of a joint with one axis: an angle about the axis [rad], or a length along it [m].
enum class AxisMotion : std::uint8_t { none, turn, slide };

struct JointTraits {
  JointType type;
  const char* name;     // in files and results
  bool in_robot_files;  // others result from bases, targets and grasps
  int coordinates;      // without a quaternion, their rates equal the velocities
  int velocities;
  AxisMotion axis;
  int quaternion = -1;  // its offset among the joint's coordinates; velocities 0 to 2 rotate it, in the body's axes
  int position = -1;    // likewise, of the body's origin in W; velocities 3 to 5 translate it, in the body's axes
};

inline constexpr JointTraits kJointTypes[] = {
    {JointType::revolute, "revolute", true, 1, 1, AxisMotion::turn},
    {JointType::continuous, "continuous", true, 1, 1, AxisMotion::turn},
    {JointType::prismatic, "prismatic", true, 1, 1, AxisMotion::slide},
    {JointType::fixed, "fixed", true, 0, 0, AxisMotion::none},
    {JointType::spherical, "spherical", false, 4, 3, AxisMotion::none, 0},
    {JointType::free, "free", false, 7, 6, AxisMotion::none, 3, 0},
};

GRAPNEL_INLINE constexpr const JointTraits& traits_of(JointType type) { return kJointTypes[static_cast<int>(type)]; }

/// Whether a joint has one coordinate, along or about an axis; only such joints have drives and friction.
GRAPNEL_INLINE constexpr bool has_one_axis(JointType type) { return traits_of(type).axis != AxisMotion::none; }
constexpr bool turns_about_axis(JointType type) { return traits_of(type).axis == AxisMotion::turn; }
constexpr bool slides_along_axis(JointType type) { return traits_of(type).axis == AxisMotion::slide; }

/// Number of generalized velocities of a joint.
GRAPNEL_INLINE constexpr int velocity_count(JointType type) { return traits_of(type).velocities; }
/// Number of coordinates of a joint.
constexpr int coordinate_count(JointType type) { return traits_of(type).coordinates; }

/// Units of the quantities of a joint's axis.
struct AxisUnits {
  const char *position, *rate, *effort, *impulse;
};
constexpr AxisUnits axis_units(JointType type) {
  return slides_along_axis(type) ? AxisUnits{"m", "m/s", "N", "N s"} : AxisUnits{"rad", "rad/s", "N m", "N m s"};
}

/// The joint's motion subspace. Calls turn(velocity, axis) for each velocity that rotates the body about an axis
/// through its origin, and slide(velocity, axis) for each that translates it along one. `v`: the joint's first
/// velocity; `R`: from the body's axes to those of the results; `axis` is the joint's own axis.
template <class S, class Turn, class Slide>
void each_direction(JointType type, int v, const Rotation<S>& R, const Vector3<S>& axis, Turn turn, Slide slide) {
  const JointTraits& t = traits_of(type);
  if (t.axis == AxisMotion::turn) turn(v, axis);
  if (t.axis == AxisMotion::slide) slide(v, axis);
  for (int k = 0; k < 3; ++k) {
    if (t.quaternion >= 0) turn(v + k, R.column(k));
    if (t.position >= 0) slide(v + 3 + k, R.column(k));
  }
}

}  // namespace grapnel
