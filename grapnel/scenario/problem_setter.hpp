#pragma once

/// @file
/// Sets values of a problem in place, with the same result as changing the scenario and reading it again; and
/// serializes a problem to bytes, for exact comparison.

#include <functional>
#include <span>
#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Sets numbers, in the order of the scenario's value. False if the reader might reject them: discard the problem and
/// read the scenario again.
using ProblemSetter = std::function<bool(CaptureProblem&, std::span<const double>)>;

/// The setter for the value at `steps`, with the form of `form` (a number, a list or a mapping of numbers); null if
/// there is none. `problem` was read from the scenario. Callers compare its result once with that of the reader
/// (problem_bytes()).
ProblemSetter problem_setter(std::span<const PathStep> steps, const Node& form, const CaptureProblem& problem);

// A problem as bytes, for exact comparison.

/// The bits of every member but the sha256 and the source: two problems are the same, to the last bit and with the
/// signs of zeros, if and only if their bytes are. Not a file format: only for comparison within one process. Meshes
/// are equal if they are the same object.
std::string problem_bytes(const CaptureProblem& problem);

}  // namespace grapnel
