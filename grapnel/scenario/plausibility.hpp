#pragma once

/// @file
/// Warnings of what is allowed but hardly meant: the slips that otherwise end in a plan that fails for no reason in
/// sight. Each names its suspect and what may have been meant; none of them refuses anything. The thresholds are stated
/// in docs/formats/scenario.md.

#include "grapnel/scenario/reader.hpp"

namespace grapnel {

/// An angle beyond a full turn, or a rate beyond 6 rad/s: degrees? `name` is the value's, "initial.joints.elbow".
void doubt_angle(double angle, const Mark& mark, const std::string& name, FaultList& faults);
void doubt_angular_rate(double rate, const Mark& mark, const std::string& name, FaultList& faults);

/// A rate of a wheel or rotor that is faster than any: revolutions per minute?
void doubt_rotor_rate(double rate, const Mark& mark, const std::string& name, FaultList& faults);

/// Limits of a joint that turns: position limits beyond two turns that are no multiple of ten degrees, and a rate limit
/// beyond two turns per second. Limits with a unit are not doubted, nor are the rate limits of imported models, where
/// a large number states that there is no limit. `joint` is its mapping.
void doubt_joint_limits(const Node& joint, const std::string& path, const JointDescription& read, FaultList& faults);

/// A half turn that would be next to no rotation with its numbers in the order x, y, z, w.
bool is_doubtful_quaternion(std::span<const double, 4> q);
void doubt_quaternion(std::span<const double, 4> q, const Mark& mark, const std::string& name, FaultList& faults);

/// An inertia that no body of this mass and these shapes has. `body` is its mapping, `path` leads to it.
void doubt_inertia(const Node& body, const std::string& path, double mass, const Vector3d& com,
                   const Symmetric3d& inertia, const std::vector<Geometry>& shapes, FaultList& faults);

/// An inertia that is about the origin of the body's frame (of a link: about its joint) instead of the centre of mass:
/// the mass would spread, along the line between the two, beyond everything that is known of the body, and would not
/// otherwise. `points`: of the body, in its frame (joints, end-effectors), beside the shapes.
void doubt_inertia_point(const Node& body, const std::string& path, const BodyDescription& read,
                         const std::vector<Vector3d>& points, const std::vector<Geometry>& shapes, FaultList& faults);
/// Both doubts of a target's inertia.
void doubt_target_inertia(const Node& target, const std::string& path, const TargetSetup& read, FaultList& faults);

/// An approach axis that points back along the end-effector.
void doubt_approach_axis(const Node& end_effector, const std::string& path, const EndEffectorSetup& read,
                         FaultList& faults);

/// Grasp points far off the target's shape, approach directions that lead away from it, normals that lead into it.
void doubt_grasp_points(const Node& target, const std::string& path, const TargetSetup& read, FaultList& faults);

/// End-effectors that hold the same place at the same time. `list` is that of the grasps.
void doubt_shared_points(const Node& list, const CaptureProblem& problem, FaultList& faults);

/// Targets that overlap anything at t = 0. The problem must be without faults; `scenario` is what it was read from.
/// @throws std::invalid_argument where no system can be made of it all the same.
void doubt_start(const CaptureProblem& problem, const Node& scenario, FaultList& faults);

}  // namespace grapnel
