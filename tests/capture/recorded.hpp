#pragma once

/// @file
/// Quantities of grasps computed from a capture's time series by independent formulas.

#include <functional>

#include "capture/capture_case.hpp"

namespace grapnel::testing {

/// Twist of a group (`base`, `targets/NAME`, `end_effectors/NAME`), at its frame's origin, in W.
Twistd twist_at(const CaptureResult& result, const std::string& group, std::size_t sample);

/// An end-effector against its grasp point.
struct Meeting {
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
  struct Missed {
    double distance = 0, angle = 0, velocity = 0, spin = 0;  // [m, rad, m/s, rad/s]
    double largest() const { return std::max({distance, angle, velocity, spin}); }
  };
  Missed missed(GraspSetup::Orientation orientation, const StraightIn& in) const;
};
Meeting meeting(const CaptureProblem& problem, const CaptureResult& result, std::size_t grasp, std::size_t sample);

/// Last sample of the phase.
std::size_t last_sample(const CaptureResult& result, const std::string& phase);
/// The sample of the phase at this time, to 1e-9 s. @throws std::out_of_range
std::size_t sample_at(const CaptureResult& result, const std::string& phase, double time);

/// All joints at a sample.
std::vector<double> joints_at(const CaptureResult& result, const std::string& path, std::size_t sample);

/// A body's share of a result's warnings that contains the text.
bool warns(const CaptureResult& result, const std::string& text);

/// A random robot of random_capture() whose final joint values are to be found: its targets are where a flown random
/// motion with ideal tracking puts the hands, so that there is a solution. `match`: final rates by it, else those that
/// were flown are given. Grasps ask for the orientation given. `change`: made before that flight. No motion
/// afterwards. Nothing where no rates were found for that flight.
std::optional<CaptureProblem> random_plan(int index, GraspSetup::Orientation orientation,
                                          std::optional<RateMatch> match,
                                          const std::function<void(CaptureProblem&)>& change = {});

}  // namespace grapnel::testing
