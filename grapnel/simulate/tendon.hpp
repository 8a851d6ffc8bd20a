#pragma once

/// @file
/// Tendons that pull joints: one tension, and at each joint the effort moment arm times tension. docs/theory, (19.22)
/// to (19.24). Plain data.

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

namespace grapnel {

/// A tendon under a command that begins at one instant.
struct Tendon {
  struct Arm {
    int joint;       // index in Model::joints()
    int coordinate;  // of the joint, in State::q
    double arm;      // [m], or [1] of a sliding joint
  };
  std::vector<Arm> arms;
  double tension = 0;                // with a speed: maximum [N]
  std::optional<double> speed = {};  // at which the drive winds the tendon up [m/s]; absent: the tension is constant
  double stiffness = 0;              // with a speed [N/m]
  double begin = 0;                  // start of the command [s]
  double excursion_at_begin = 0;     // [m]

  /// The length that the joints have taken up, (19.23): sum of arm times coordinate [m].
  double excursion(std::span<const double> q) const {
    double sum = 0;
    for (const Arm& a : arms) sum += a.arm * q[static_cast<std::size_t>(a.coordinate)];
    return sum;
  }
  /// The tension at a time, (19.24) [N].
  double tension_at(double t, std::span<const double> q) const {
    if (!speed) return tension;
    const double stretch = *speed * (t - begin) - (excursion(q) - excursion_at_begin);
    return std::clamp(stiffness * stretch, 0.0, tension);
  }
};

}  // namespace grapnel
