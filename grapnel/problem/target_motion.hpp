#pragma once

/// @file
/// Target motion at the start and at the capture.

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Pose and twist (at the frame's origin, in W) of a target.
struct TargetMotion {
  Posed X_WT;
  Twistd V_WT;
};

/// What acts on a free target, and how its motion is integrated.
struct TargetPropagation {
  Vector3d gravity = Vector3d::zero();    // in W [m/s^2]
  std::span<const LoadSetup> loads = {};  // on the target (2.13)
  std::optional<OrbitSetup> orbit = {};   // whose field acts
  IntegrationSetup integration = {};
  std::function<void(double t)> each_step = {};  // may throw to end it
};

/// Propagates a target from t0 to t1. Without loads and orbit the result is exact to rounding error, otherwise to the
/// tolerances of the integration. @throws std::runtime_error if the integration fails.
TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const TargetPropagation& propagation);
/// As above, with the surroundings of a problem.
TargetMotion propagate_target(const CaptureProblem& problem, const TargetSetup& target, const TargetMotion& at_t0,
                              double t0, double t1, const std::function<void(double t)>& each_step = {});

/// A pair of targets, or a target and an obstacle, that touches before the capture.
struct TargetContact {
  BodyName a, b;
  double time = 0;  // of the first contact [s]
};

/// Motion of a problem's targets at the start and at the capture time T.
struct TargetPlan {
  std::vector<TargetMotion> start;
  std::vector<TargetMotion> capture;
  /// With contacts before the capture (predict_contacts()): per target, its motion at the start and at all instants
  /// from which on it is free until the next one, in the order of time; empty for a target that touches nothing.
  struct Instant {
    double time = 0;  // [s]
    TargetMotion motion;
  };
  std::vector<std::vector<Instant>> instants = {};
  std::vector<TargetContact> contacts = {};
};
/// The motion without contacts between shapes.
TargetPlan plan_targets(const CaptureProblem& problem, const std::function<void(double t)>& each_step = {});

}  // namespace grapnel
