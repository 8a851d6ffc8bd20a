#pragma once

/// @file
/// Values of a problem set in place: what changing the scenario and reading it again gives, without reading it; and all
/// of a problem as bytes, for exact comparison.

#include <functional>
#include <span>
#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Puts numbers, in the order of the scenario's value, where the reader of scenarios would. False if it cannot vouch
/// for them: they may be refused by the reader, and the problem is to be read, not used.
using ProblemSetter = std::function<bool(CaptureProblem&, std::span<const double>)>;

/// The setter of what stands at `steps`, whose value has the form of `form` (a number, a list or a mapping of numbers);
/// null if there is none. `problem` was read from the scenario. Whoever uses it compares once what it does with what
/// the reader does (problem_bytes()).
ProblemSetter problem_setter(std::span<const PathStep> steps, const Node& form, const CaptureProblem& problem);

// All of a problem as bytes, for exact comparison.

/// The bits of every member but the sha256 and the source: two problems are the same, to the last bit and with the
/// signs of zeros, if and only if their bytes are. Not a format: only for comparison within one program. Meshes count
/// as the same where they are one object.
std::string problem_bytes(const CaptureProblem& problem);

}  // namespace grapnel
