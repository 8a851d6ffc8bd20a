#pragma once

/// @file
/// Values of a problem set in place: what changing the scenario and reading it again gives, without reading it.

#include <functional>
#include <span>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_paths.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Puts numbers, in the order of the scenario's value, where the reader of scenarios would. False if it cannot vouch
/// for them: they may be refused by the reader, and the problem is to be read, not used.
using ProblemSetter = std::function<bool(CaptureProblem&, std::span<const double>)>;

/// The setter of what stands at `steps`, whose value has the form of `form` (a number, a list or a mapping of numbers);
/// null if there is none. `problem` was read from the scenario. Whoever uses it compares once what it does with what
/// the reader does (problem_bytes()).
ProblemSetter problem_setter(std::span<const PathStep> steps, const Node& form, const CaptureProblem& problem);

}  // namespace grapnel
