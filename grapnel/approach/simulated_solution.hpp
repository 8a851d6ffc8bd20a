#pragma once

/// @file
/// Final joint values of a motion that requires forward simulation: loads or attitude control act on the servicer, so
/// its momentum is not constant. Newton's method on simulations, with sensitivities by finite differences. Thread
/// safety: pure functions if the simulation is.

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace grapnel {

/// Errors at the end of a motion with given final joint values and rates.
struct SimulatedEnd {
  Eigen::VectorXd error;  // of the goals (goal_error) [m and rad]
  Eigen::VectorXd gap;    // demanded rates minus final rates; zeros if rates are given [rad/s or m/s]
  double unmet = 0;       // largest component of the demand that no rates produce
  double size() const;    // largest component of error and gap
};
using Flight = std::function<SimulatedEnd(const std::vector<double>& position, const std::vector<double>& rate)>;

struct SimulatedSolution {
  bool found = false;  // error and gap are below `tolerance`
  std::vector<double> position, rate;
  SimulatedEnd end;
  int iterations = 0;
};

/// Solves for final positions and rates with zero error and gap, from a first guess of both. Uses minimum-norm steps in
/// the positions within their limits, each with the corresponding rates; steps are shortened until the error decreases.
/// Empty limits: positions are fixed and only the rates are solved for. Exceptions from `flight` pass through.
SimulatedSolution solve_by_simulations(const Flight& flight, std::vector<double> position, std::vector<double> rate,
                                       const std::vector<double>& lower, const std::vector<double>& upper,
                                       double tolerance);

}  // namespace grapnel
