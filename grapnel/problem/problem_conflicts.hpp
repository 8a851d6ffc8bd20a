#pragma once

/// @file
/// Conflicts between parts of a capture problem: times in order, grasps that an impact law supports, requirements of a
/// form of approach. These checks apply to problems from files, to those that campaigns modify, and to those made by
/// programs. The range of a single value is checked with its description. Names are resolved where files are read.

#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// A contradiction in a problem, with its place as `--set` names it: "approach.waypoints[1].time".
struct ProblemFault {
  std::string path;
  std::string message;  // a complete sentence, which names the place
  bool of_key = false;  // the presence of the key, not its value
  /// The place of the value on which this conflict depends: a reader that found an error there omits this conflict.
  std::string relies_on = {};
};

/// All conflicts except those within the robot, in the order of phases. Durations that are not positive and finite
/// cause no further conflicts. Empty: none.
std::vector<ProblemFault> problem_conflicts(const CaptureProblem& problem);

/// Limit of shapes of all bodies: their pairs, for which distances are evaluated, number 12 million.
inline constexpr std::size_t kMostShapes = 5000;

/// Conflicts within a robot, with paths that begin at it; messages prefix them with `path`, "robot" for a problem.
std::vector<ProblemFault> robot_conflicts(const RobotSetup& robot, const std::string& path);

/// Returns the problem if it has no conflicts. @throws CaptureProblemError with all of them, one per line.
const CaptureProblem& without_conflicts(const CaptureProblem& problem);

}  // namespace grapnel
