#pragma once

/// @file
/// Quantities of grasps computed from a capture's time series by independent formulas.

#include <functional>

#include "capture/capture_case.hpp"

namespace grapnel::testing {

/// Twist of a group (`base`, `targets/NAME`, `end_effectors/NAME`), at its frame's origin, in W.
Twistd twist_at(const CaptureResult& result, const std::string& group, std::size_t sample);

/// Motion of an end-effector and of its grasp point.
struct GraspError {
  Posed X_WE, X_WG;
  Twistd V_WE, V_WG;
  Vector3d direction_W;  // the grasp point's approach direction; zero if it has none
  Vector3d axis_W;       // the end-effector's approach axis; zero if it has none
  double distance() const { return norm(X_WE.p - X_WG.p); }
  Vector3d relative_velocity() const { return V_WE.linear - V_WG.linear; }
  Vector3d relative_spin() const { return V_WE.angular - V_WG.angular; }
  double pose_angle() const { return rotation_angle(transpose(X_WG.R) * X_WE.R); }
  double axis_angle() const { return std::atan2(norm(cross(direction_W, axis_W)), dot(direction_W, axis_W)); }

  /// Deviation of the final straight approach from the requirements of its grasp.
  struct Deviation {
    double distance = 0, angle = 0, velocity = 0, spin = 0;  // [m, rad, m/s, rad/s]
    double largest() const { return std::max({distance, angle, velocity, spin}); }
  };
  Deviation deviation(GraspSetup::Orientation orientation, const StraightIn& in) const;
};
GraspError grasp_error(const CaptureProblem& problem, const CaptureResult& result, std::size_t grasp,
                       std::size_t sample);

/// Last sample of the phase.
std::size_t last_sample(const CaptureResult& result, const std::string& phase);
/// The sample of the phase at this time, to 1e-9 s. @throws std::out_of_range
std::size_t sample_at(const CaptureResult& result, const std::string& phase, double time);

/// All joints at a sample.
std::vector<double> joints_at(const CaptureResult& result, const std::string& path, std::size_t sample);

/// Whether a warning of the result contains the text.
bool warns(const CaptureResult& result, const std::string& text);

/// A planning problem with a known solution: a random robot of random_capture() with targets at the end-effectors'
/// final poses of a simulated random motion. `match` determines the final rates; without it they are those of that
/// simulation. Grasps require the given orientation. `change` is applied before the simulation. The problem ends with
/// the approach. Returns nothing if the simulation does not complete the approach.
std::optional<CaptureProblem> random_plan(int index, GraspSetup::Orientation orientation,
                                          std::optional<RateMatch> match,
                                          const std::function<void(CaptureProblem&)>& change = {});

}  // namespace grapnel::testing
