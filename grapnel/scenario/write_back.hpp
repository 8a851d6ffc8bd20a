#pragma once

/// @file
/// A capture that was changed as plain data, written back into the scenario it came from.

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Changes `scenario`, from which `before` was read, so that `after` is read from it: masses, inertias and twists of
/// targets, their grasp points (also further ones), which point a grasp takes, its orientation and relative velocity,
/// approach.plan's guess and measure. Numbers read back to the same double; orientations of grasp points to rounding.
/// Other differences are not looked for.
void write_back(const CaptureProblem& before, const CaptureProblem& after, Node& scenario);

}  // namespace grapnel
