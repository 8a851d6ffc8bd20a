#pragma once

/// @file
/// Numbers of a capture problem that contradict each other: times that are out of order, spans that are too long. What
/// one number alone may be, its range, stands with its description.

#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Something in a problem that cannot be meant, with its place as `--set` names it: "approach.waypoints[1].time".
struct ProblemFault {
  std::string path;
  std::string message;  // a whole sentence, which names the place
};

/// All conflicts among times, durations and steps, in the order of phases. Durations that are not positive and finite
/// say nothing about others. Empty: there are none.
std::vector<ProblemFault> problem_conflicts(const CaptureProblem& problem);

}  // namespace grapnel
