#include "grapnel/capture/ledger_scale.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Fraction of the exchanged momentum or energy: an exchange accumulates rounding and integration errors of many steps.
constexpr double kExchanged = 1e-2;
// Position errors of some ten roundings, relative to a momentum drift of 1e-11.
constexpr double kRoundedArm = 2e-4;
// A motion is slow below these fractions of (radius times rate) and of the maximum speed of the run.
constexpr double kSlow = 3e-2, kSlowest = 1e-6;
// Energy as a fraction of mean force times radius: the square of kScaleFloor.
constexpr double kHeld = kScaleFloor * kScaleFloor;

}  // namespace

void GroupReach::raise(const GroupReach& other) {
  mass = std::max(mass, other.mass);
  radius = std::max(radius, other.radius);
  distance = std::max(distance, other.distance);
}

GroupReach reach_of(const GroupSize<double>& size, const Vector3d& com) {
  return {size.mass, std::sqrt(size.second_moment / size.mass), norm(com)};
}

SlowestMotion slowest_motion(const CaptureProblem& problem) {
  const double approach = problem.approach ? problem.approach->duration : 0;
  const double duration = approach + problem.post_impact.total_duration();
  SlowestMotion slowest;
  if (duration > 0) slowest.rate = 1 / duration;
  if (problem.orbit) slowest.rate = std::max(slowest.rate, mean_motion(reference_orbit(*problem.orbit)));
  return slowest;
}

GroupScale<double> ledger_scale(const GroupScale<double>& motion, const TreeExchange& exchanged,
                                const GroupReach& reach, const SlowestMotion& slowest) {
  const double R = reach.radius, J = exchanged.impulse, N = exchanged.angular_impulse;
  const double speed = std::max(kSlow * R * slowest.rate, kSlowest * slowest.speed);
  GroupScale<double> scale{motion.linear + kExchanged * J, motion.angular + kExchanged * N,
                           motion.energy + kExchanged * exchanged.work};
  if (R > 0) {
    const double linear = scale.linear, angular = scale.angular;
    scale.linear = std::max(linear, kScaleFloor * angular / R);
    scale.angular =
        std::max({angular, kScaleFloor * R * linear, kRoundedArm * reach.distance * (motion.angular / R + J)});
  }
  scale.linear = std::max(scale.linear, reach.mass * speed);
  scale.angular = std::max(scale.angular, reach.mass * R * speed);
  scale.energy = std::max({scale.energy, kHeld * R * J * slowest.rate, 0.5 * reach.mass * speed * speed});
  return scale;
}

}  // namespace grapnel
