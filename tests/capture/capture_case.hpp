#pragma once

/// @file
/// Capture problems to start from, and functions that read results.

#include <gtest/gtest.h>

#include "grapnel/capture/simulate_capture.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

/// Thesis section 4.1, case 1, written down here: final angles of Table 4.3, `match: velocity`, ideal tracking, 20 s,
/// weld_as_found, no motion afterwards.
CaptureProblem thesis_case();
/// The same with PD 49/14.
CaptureProblem thesis_case_pd();
/// Gives robot and targets joint limits, shapes and a clearance that the thesis's motions exceed.
void watch_closely(CaptureProblem& problem);
/// Sets PD gains on all joints of the approach.
void use_pd(CaptureProblem& problem, double kp, double kd);

/// A random branched robot with two targets that tumble about any axis, triaxial, centres of mass off their frames;
/// a moving base; 3 s of approach and 4 s afterwards. Options vary with `index`: tracking, what is known of targets,
/// the motion given to the base, grasps, gap rule, joints afterwards.
CaptureProblem random_capture(int index);

const Series& series(const CaptureResult& result, const std::string& path);
Vector3d vector_at(const CaptureResult& result, const std::string& path, std::size_t sample);
double value_at(const CaptureResult& result, const std::string& path, std::size_t sample, int component = 0);
/// Pose of the group `base`, `targets/NAME`, `end_effectors/NAME` at a sample.
Posed pose_at(const CaptureResult& result, const std::string& group, std::size_t sample);
/// First sample of a named phase; the number of samples if there is none.
std::size_t first_sample(const CaptureResult& result, const std::string& phase);

const LedgerEntry& row(const CaptureResult& result, const std::string& name);
/// Completed, every row within its bound; names what is not. Prints the ledger's largest share of a bound.
void expect_passes(const CaptureResult& result);

}  // namespace grapnel::testing
