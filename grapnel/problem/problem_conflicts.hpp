#pragma once

/// @file
/// What parts of a capture problem demand of each other: times in order, grasps that a law of impact can close, what a
/// way of approaching needs. Said once, here, for problems from files, for those that campaigns change number by number
/// and for those that a program makes. What one value alone may be, its range, stands with its description; what names
/// mean is looked up where files are read, which knows what was meant.

#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Something in a problem that cannot be meant, with its place as `--set` names it: "approach.waypoints[1].time".
struct ProblemFault {
  std::string path;
  std::string message;  // a whole sentence, which names the place
  bool of_key = false;  // that it is there at all, not its value
  /// Where what this rests on stands, or would stand: a reader that found it faulty has said so, and this says nothing.
  std::string relies_on = {};
};

/// All conflicts but those within the robot, in the order of phases. Durations that are not positive and finite say
/// nothing about others. Empty: there are none.
std::vector<ProblemFault> problem_conflicts(const CaptureProblem& problem);

/// Shapes of all bodies. Distances of all their pairs are watched: these are 12 million.
inline constexpr std::size_t kMostShapes = 5000;

/// Those within a robot, with paths that begin at it; messages name their places below `path`, "robot" of a problem.
std::vector<ProblemFault> robot_conflicts(const RobotSetup& robot, const std::string& path);

}  // namespace grapnel
