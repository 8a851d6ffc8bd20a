#pragma once

/// @file
/// Warnings about valid but implausible input, which would otherwise lead to a failure without a visible cause. Each
/// warning names the suspicious value and a likely correction; none rejects the input. docs/formats/scenario.md states
/// the thresholds.

#include "grapnel/scenario/reader.hpp"

namespace grapnel {

/// An angle beyond a full turn, or a rate beyond 6 rad/s, possibly in degrees. `name` is the value's name,
/// "initial.joints.elbow".
void doubt_angle(double angle, const Mark& mark, const std::string& name, FaultList& faults);
void doubt_angular_rate(double rate, const Mark& mark, const std::string& name, FaultList& faults);

/// An implausibly high rate of a wheel or rotor, possibly in revolutions per minute.
void doubt_rotor_rate(double rate, const Mark& mark, const std::string& name, FaultList& faults);

/// Limits of a revolute joint: position limits beyond two turns that are not a multiple of ten degrees, and a rate
/// limit beyond two turns per second. Limits with an explicit unit are accepted, and so are rate limits of imported
/// models, where a large number means no limit. `joint` is its mapping.
void doubt_joint_limits(const Node& joint, const std::string& path, const JointDescription& read, FaultList& faults);

/// A half turn that would be nearly no rotation with its numbers in the order x, y, z, w.
bool is_doubtful_quaternion(std::span<const double, 4> q);
void doubt_quaternion(std::span<const double, 4> q, const Mark& mark, const std::string& name, FaultList& faults);

/// Mass [kg], centre of mass [m] and central inertia [kg m^2] of a body, in its frame.
struct MassProperties {
  double mass;
  const Vector3d& com;
  const Symmetric3d& inertia;
};

/// An inertia that is not possible for this mass and these shapes. `body` is its mapping, `path` the path of it.
void doubt_inertia(const Node& body, const std::string& path, const MassProperties& read,
                   const std::vector<Geometry>& shapes, FaultList& faults);

/// An inertia that is probably about the origin of the body's frame (for a link: its joint) instead of the centre of
/// mass. As stated, the mass would extend along the line between the two beyond all known points of the body; about the
/// origin it would not. `points`: known points of the body in its frame (joints, end-effectors), in addition to the
/// shapes.
void doubt_inertia_point(const Node& body, const std::string& path, const BodyDescription& read,
                         const std::vector<Vector3d>& points, const std::vector<Geometry>& shapes, FaultList& faults);
/// Both checks for a target's inertia.
void doubt_target_inertia(const Node& target, const std::string& path, const TargetSetup& read, FaultList& faults);

/// An approach axis that points back along the end-effector.
void doubt_approach_axis(const Node& end_effector, const std::string& path, const EndEffectorSetup& read,
                         FaultList& faults);

/// Grasp points far from the target's shape, approach directions that point away from it, normals that point into it.
void doubt_grasp_points(const Node& target, const std::string& path, const TargetSetup& read, FaultList& faults);

/// End-effectors that hold the same grasp point at the same time. `list` is the list of grasps.
void doubt_shared_points(const Node& list, const CaptureProblem& problem, FaultList& faults);

/// Targets that overlap another body at t = 0. The problem must be without errors; `scenario` is its source. @throws
/// std::invalid_argument if no system can be built from it.
void doubt_start(const CaptureProblem& problem, const Node& scenario, FaultList& faults);

/// Contacts between shapes so stiff that an explicit method would need more than integration.max_steps while they last,
/// with an estimate of the steps and of the time. Conditions as for doubt_start().
void doubt_contact_stiffness(const CaptureProblem& problem, const Node& scenario, FaultList& faults);

}  // namespace grapnel
