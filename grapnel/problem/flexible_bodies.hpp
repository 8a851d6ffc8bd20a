#pragma once

/// @file
/// Bodies that bend, as rigid pieces on springs: beams within links (finite segments), gears that yield, hinges with
/// springs. What a scenario says of them (BeamDescription, JointElasticity, JointSpring) is made into bodies and joints
/// of a robot here, once, so that all of dynamics, constraints and impacts are those of rigid bodies; (22.1) to (22.6)
/// of docs/theory.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Whether anything of a robot yields.
bool is_flexible(const RobotSetup& robot);

/// The robot with pieces and springs in place of beams and gears that yield. Of a link NAME the piece at its joint
/// keeps the name, the others are called NAME:1 and so on; what lies between two joints of one place, and turns the
/// body of a gear that yields, has no mass. The joints of a beam that keeps a few modes move by these (ModalJoint),
/// which it has at the zero of the joints beyond it. End-effectors, links and shapes are on the piece where they are.
/// The order of the driven joints stays. `undeformed` of the result is the robot as it was. A robot without anything
/// that yields stays as it is.
/// @throws std::invalid_argument naming the link, where beam_fault() or gear_fault() finds something.
RobotSetup flexible_robot(const RobotSetup& robot);

/// The robot with everything that yields held where it is at rest: what plans its joints' motion.
RobotSetup rigid_robot(const RobotSetup& robot);

/// The robot as a model has it: with what yields (`moving`: flexible_robot()) or without (rigid_robot()). Where nothing
/// does it is the robot itself, of which no copy is made; else it is in `made`.
const RobotSetup& modelled_robot(const RobotSetup& robot, bool moving, std::optional<RobotSetup>& made);

/// The problem with rigid_robot().
CaptureProblem rigid_problem(CaptureProblem problem);
/// The problem with flexible_robot(): loads act on the pieces where they are.
CaptureProblem flexible_problem(CaptureProblem problem);

/// The bodies of a target in a model, and the shapes of those that are not the target's own: the target, "target:NAME",
/// less its panels, then their pieces, "target:NAME/PANEL". @throws std::invalid_argument where panel_fault() finds
/// something.
struct TargetBodies {
  std::vector<BodyDescription> bodies;                     // the first is the target
  std::vector<std::pair<std::string, Geometry>> geometry;  // of the others, by the body's name
};
TargetBodies target_bodies(const TargetSetup& target);
/// What is wrong with a target's panels; empty: nothing.
std::string panel_fault(const TargetSetup& target);

/// The piece on which a point of a link is: its body in flexible_robot(), and where the point is in its frame.
struct PlaceOnPiece {
  std::string body;
  Vector3d p;  // [m]
};
PlaceOnPiece place_on_piece(const BodyDescription& link, const Vector3d& p);

/// The link of whose pieces a body of flexible_robot() is one: the body itself, where it is no piece.
std::string link_of_piece(const BodyDescription& body);
/// The bodies of a model that are pieces of a link, or the body of that name. @throws std::out_of_range if there is
/// none.
std::vector<int> pieces_of(const Model& model, const std::string& link);

/// What is wrong with a link's beam, its modes, or with a gear that yields; empty: nothing.
std::string beam_fault(const BodyDescription& link);
std::string modes_fault(const BodyDescription& link);
/// What is wrong with the modes that a link's beam keeps, in which beam_fault() finds nothing: more than its segments
/// have, or faster than it allows, carrying what hangs on it in the robot.
std::string beam_modes_fault(const RobotSetup& robot, const BodyDescription& link);
std::string gear_fault(const JointDescription& joint);

/// Whether a body of flexible_robot() is on a joint that stands for bending or a gear, and is no joint of the robot.
bool is_elastic_part(const BodyDescription& body);
/// Whether it is nothing that can be seen: what lies between two joints of one place, or the mass of a mode.
bool is_unseen(const BodyDescription& body);

/// Whether a joint of a model yields and is not driven.
inline bool yields(const JointDescription& joint) { return joint.spring.has_value(); }

}  // namespace grapnel
