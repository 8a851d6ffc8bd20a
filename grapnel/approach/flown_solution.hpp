#pragma once

/// @file
/// Final joint values of a motion that has to be flown to be known: loads or attitude control act on the servicer, and
/// its momentum is no constant. Newton's method on flights, with sensitivities by differences of flights.
/// Thread safety: pure functions, as far as the flight is.

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace grapnel {

/// Where a motion with given final joint values and rates ends, against what is asked for.
struct FlownEnd {
  Eigen::VectorXd error;  // of the goals (goal_error) [m and rad]
  Eigen::VectorXd gap;    // rates demanded there less the final ones; zeros where rates are given [rad/s or m/s]
  double unmet = 0;       // largest component of the demand that no rates give
  double size() const;    // largest component of error and gap
};
using Flight = std::function<FlownEnd(const std::vector<double>& position, const std::vector<double>& rate)>;

struct FlownSolution {
  bool found = false;  // error and gap are below `tolerance`
  std::vector<double> position, rate;
  FlownEnd end;
  int iterations = 0;
};

/// Final positions and rates at which error and gap vanish, from a first guess of both: steps of least norm in the
/// positions within their limits, each with the rates that it takes, shortened until the miss falls. Empty limits: the
/// positions stay, the rates alone are looked for. What `flight` throws passes through.
FlownSolution solve_by_flights(const Flight& flight, std::vector<double> position, std::vector<double> rate,
                               const std::vector<double>& lower, const std::vector<double>& upper, double tolerance);

}  // namespace grapnel
