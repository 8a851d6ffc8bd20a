#pragma once

/// @file
/// What the shipped captures show, by the names of their scenarios.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::testing::examples_test {

using ExampleCheck = std::function<void(const CaptureProblem& problem, const CaptureResult& result)>;
using ExampleChecks = std::map<std::string, ExampleCheck>;

inline ExampleCheck of_result(void (*check)(const CaptureResult&)) {
  return [check](const CaptureProblem&, const CaptureResult& result) { check(result); };
}

ExampleChecks planned_checks();   // all of kPlanned
ExampleChecks flexible_checks();  // flexible arms and targets
ExampleChecks impact_checks();
ExampleChecks control_checks();
ExampleChecks gripper_checks();
ExampleChecks test_bed_checks();  // experiments on Earth

/// Several arms on one target: `rows` is the number of constraint rows of all grasps together, all independent;
/// `impulses` are those of the first impact as stated in the file's header; `loops` is the number of closed loops while
/// all grasps hold.
void expect_closed_loops(const CaptureResult& r, int rows, const std::vector<double>& impulses, std::size_t loops,
                         std::size_t segments = 1);

}  // namespace grapnel::testing::examples_test
