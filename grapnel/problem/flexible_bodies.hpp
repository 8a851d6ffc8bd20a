#pragma once

/// @file
/// Flexible bodies as rigid pieces on springs: beams within links (finite segments), flexible gears, hinges with
/// springs. This module converts their descriptions (BeamDescription, JointElasticity, JointSpring) to bodies and
/// joints of a robot, once, so that dynamics, constraints and impacts treat only rigid bodies; (22.1) to (22.6) of
/// docs/theory.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Whether a robot has flexible parts.
bool is_flexible(const RobotSetup& robot);

/// The robot with pieces and springs instead of beams and flexible gears. The piece of a link NAME at its joint keeps
/// the name; the others are called NAME:1 and so on. Bodies between two joints at one place, and the body turned by the
/// motor of a flexible gear, are massless. The joints of a beam that keeps a few modes move by these (ModalJoint),
/// evaluated with the joints beyond it at zero. End-effectors, links and shapes move to the piece at their position.
/// The order of the driven joints is unchanged. `undeformed` of the result is the original robot. A robot without
/// flexible parts is returned unchanged. @throws std::invalid_argument naming the link, if beam_fault() or gear_fault()
/// finds an error.
RobotSetup flexible_robot(const RobotSetup& robot);

/// The robot with all flexible parts fixed at rest: used to plan its joints' motion.
RobotSetup rigid_robot(const RobotSetup& robot);

/// The robot as a model contains it: with flexible parts (`moving`: flexible_robot()) or without (rigid_robot()). A
/// robot without flexible parts is returned itself, without a copy; otherwise the result is stored in `made`.
const RobotSetup& modelled_robot(const RobotSetup& robot, bool moving, std::optional<RobotSetup>& made);

/// The problem with rigid_robot().
CaptureProblem rigid_problem(CaptureProblem problem);
/// The problem with flexible_robot(): loads act on the pieces at their position.
CaptureProblem flexible_problem(CaptureProblem problem);

/// The bodies of a target in a model, and the shapes of all but the first: the target "target:NAME" without its panels,
/// then their pieces, "target:NAME/PANEL". @throws std::invalid_argument if panel_fault() finds an error.
struct TargetBodies {
  std::vector<BodyDescription> bodies;                     // the first is the target
  std::vector<std::pair<std::string, Geometry>> geometry;  // of the others, by the body's name
};
TargetBodies target_bodies(const TargetSetup& target);
/// The error in a target's panels; empty: none.
std::string panel_fault(const TargetSetup& target);

/// The piece that contains a point of a link: its body in flexible_robot(), and the point in its frame.
struct PlaceOnPiece {
  std::string body;
  Vector3d p;  // [m]
};
PlaceOnPiece place_on_piece(const BodyDescription& link, const Vector3d& p);

/// The link of which a body of flexible_robot() is a piece: the body's own name if it is no piece.
std::string link_of_piece(const BodyDescription& body);
/// The bodies of a model that are pieces of a link, or the body of that name. @throws std::out_of_range if there is
/// none.
std::vector<int> pieces_of(const Model& model, const std::string& link);

/// The error in a link's beam, its modes, or a flexible gear; empty: none.
std::string beam_fault(const BodyDescription& link);
std::string modes_fault(const BodyDescription& link);
/// The error in the modes that a link's beam keeps, if beam_fault() finds none: more than its segments have, or faster
/// than fastest_mode, with the bodies that hang on it in the robot.
std::string beam_modes_fault(const RobotSetup& robot, const BodyDescription& link);
std::string gear_fault(const JointDescription& joint);

/// Whether a body of flexible_robot() is on a joint that represents bending or a gear, and is not a joint of the robot.
bool is_elastic_part(const BodyDescription& body);
/// Whether it has no shape: a body between two joints at one place, or the mass of a mode.
bool is_unseen(const BodyDescription& body);

/// Whether a joint of a model has a spring and is not driven.
inline bool yields(const JointDescription& joint) { return joint.spring.has_value(); }

}  // namespace grapnel
