#pragma once

/// @file
/// What the shipped captures by contacts between shapes show.

#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::testing::examples_test {

/// Checks the result of a capture by contacts; false if `name` is none of them.
bool expect_gripper_example(const std::string& name, const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel::testing::examples_test
