#pragma once

/// @file
/// The bodies that the stages of a capture are about.

#include <vector>

#include "grapnel/problem/contact_pairs.hpp"

namespace grapnel {

/// Index of the target. @throws std::out_of_range for an unknown name, which problem_conflicts() finds.
std::size_t stage_target(const CaptureProblem& problem, const StagesSetup& stages);
/// The pairs of gripper and target, with its panels: indices into contact_pairs().
std::vector<std::size_t> stage_pairs(const CaptureProblem& problem, const StagesSetup& stages,
                                     const std::vector<ContactPair>& pairs);

}  // namespace grapnel
