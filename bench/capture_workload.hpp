#pragma once

/// @file
/// A whole capture for benchmarks: the thesis's open-loop case 1 with its planned final state frozen, and the
/// tolerances required for an end-state error of 1e-8.

#include <string>
#include <vector>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel::bench {

/// Maximum end-state error: the largest difference of any coordinate or velocity [m, rad, m/s, rad/s].
inline constexpr double kEndError = 1e-8;

struct CaptureWorkload {
  CaptureProblem problem;
  CaptureSystem free;                   // with all targets free
  State start;                          // in `free`
  std::vector<JointTrajectory> joints;  // references of the approach, per robot joint
  std::vector<double> end;              // end_numbers() of a run at the tightest tolerances
};

/// scenarios/thesis/open-loop-case-1.yaml without clearance and output, with the planned final rates frozen.
CaptureWorkload thesis_capture();

/// scenarios/NAME.yaml without clearance and output; its plan, if any, frozen.
CaptureProblem frozen_scenario(const std::string& name, const std::vector<Override>& overrides = {});

/// The result of the impact at the end of the approach, with the targets welded to the arms that grasp them.
CapturedSystem weld(const CaptureWorkload& workload, const State& arrived);

/// Base and joints of a state after the capture: position, quaternion (scalar part positive), joint values, velocity
/// and angular velocity in W, joint rates.
std::vector<double> end_numbers(const CaptureSystem& system, const State& state);
std::vector<double> end_numbers(const PhaseEnd& end);

/// Largest difference from the workload's end state.
double end_error(const CaptureWorkload& workload, const std::vector<double>& numbers);

}  // namespace grapnel::bench
