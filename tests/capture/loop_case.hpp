#pragma once

/// @file
/// Several arms on one target, and what the results of such captures must say.

#include "capture/recorded.hpp"

namespace grapnel::testing {

struct LoopOptions {
  std::vector<int> target_of_arm{0, 0};  // one arm per entry
  std::vector<GraspModel> models;        // per arm; empty: all rigid
  int joints = 7;                        // of every arm, revolute about axes in any direction
  double spin = 0.3;                     // of the targets, largest component [rad/s]
  double time = 10;                      // after the impact [s]
};

/// A base of 300 kg with arms of links of 0.45 m whose hands ("hand0", …) are near their targets ("target0", …):
/// tumbling, triaxial, centres of mass off their frames. No approach: grasps close at t = 0, welded as found, by a
/// plastic impact; joints are free afterwards. Everything moves from the start.
CaptureProblem random_loops(const LoopOptions& options, int index);

/// A scenario of the repository, by its path under scenarios/.
CaptureProblem scenario(const std::string& path);

/// The grasp of hand and target is constant over all samples from `from` to `to`, by the recorded poses: violations of
/// the grasp's constraints [m, rad], and the relative rotation of hand and target.
struct Opening {
  double position = 0, angle = 0, turned = 0;
};
Opening opening(const CaptureProblem& problem, const CaptureResult& result, std::size_t grasp, std::size_t from,
                std::size_t to);
/// The largest over the grasps, in one phase.
Opening opening(const CaptureProblem& problem, const CaptureResult& result, const std::string& phase);

/// No number of series (but what joints that follow nothing are to follow), ledger and impacts is NaN or infinite.
void expect_finite(const CaptureResult& result);

/// Differences between a grasp's forces and the motions recorded, relative to the largest force and moment of the
/// phase. By central differences of order 8 over the samples, at every fifth sample.
struct WrenchErrors {
  double linear = 0, angular = 0;  // the targets' momenta against what their grasps pass on (and gravity)
  double base = 0, joints = 0;     // inverse dynamics of the robot alone: forces left on the base; joint efforts
  double largest_force = 0;
};
WrenchErrors wrench_errors(const CaptureProblem& problem, const CaptureResult& result, const std::string& phase);

/// The motion that the impulse or wrench P at p would give the free target, J_t M_t^-1 J_t^T P, as its twist at p.
Twistd mobility(const TargetSetup& target, const Posed& X_WT, const Vector3d& p_W, const Vector3d& moment,
                const Vector3d& force);

/// Largest difference of two phases' neighbouring samples, in poses and momenta of all bodies and in joint positions;
/// `twists`: in twists and joint rates too.
double jump(const CaptureResult& result, const std::string& before, const std::string& after, bool twists);

}  // namespace grapnel::testing
