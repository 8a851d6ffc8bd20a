#pragma once

/// @file
/// The approach: where the targets are, which joint rates meet their grasp points, and the reference the joints follow.
/// Thread safety: pure functions.

#include "grapnel/capture/capture_system.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

/// Pose and twist (at the frame's origin, in W) of a target.
struct TargetMotion {
  Posed X_WT;
  Twistd V_WT;
};

/// A free target's motion at time t1 from that at t0, under gravity alone (2.13 with no torque).
/// @throws std::runtime_error if the integration fails.
TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const Vector3d& gravity, const IntegrationSetup& integration);

/// Motion of a problem's targets at the start and at the instant of capture T.
struct TargetPlan {
  std::vector<TargetMotion> start;
  std::vector<TargetMotion> capture;
};
TargetPlan plan_targets(const CaptureProblem& problem);

/// Final joint rates of the approach: given, zero, or by `match` the fixed point at which the rates that the
/// generalized Jacobian demands at the configuration reached by ideal tracking with those rates are the rates
/// themselves.
struct RatePlan {
  std::vector<double> rates;  // per robot joint
  int iterations = 0;
  double unmatched = 0;  // largest component of the demanded end-effector motion that no rates give
  std::string warning;   // empty, or what the user should know
};
/// @throws std::runtime_error if the fixed point is not found, saying how far it got.
RatePlan plan_final_rates(const CaptureProblem& problem, const TargetPlan& targets);

/// Drives of all joints of `system` during the approach.
std::vector<JointDrive> approach_drives(const CaptureProblem& problem, const CaptureSystem& system,
                                        const std::vector<double>& final_rates);

}  // namespace grapnel
