#pragma once

/// @file
/// The step of least norm towards e + J d = 0 within bounds.

#include <Eigen/Core>
#include <vector>

namespace grapnel {

/// What a step does and what it met.
struct NewtonStep {
  Eigen::VectorXd d;
  std::vector<int> at_bound;  // variables that the bounds stopped
  double smallest_singular_value =
      0;                  // of J's columns that are free, structural zeros (below 1e-9 of the largest) left out
  bool filtered = false;  // a singular value was so small that its direction was damped
};

/// Least-norm d with e + J d = 0 in the least-squares sense and lower <= x + d <= upper: the variable that goes
/// farthest beyond its bound is put on it, and the others are solved for again. Directions whose singular value s is
/// below `damping` are damped by s^2/(s^2 + (damping - s)^2) (numerical filtering: Maciejewski and Klein 1988).
NewtonStep least_norm_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, const std::vector<double>& x,
                           const std::vector<double>& lower, const std::vector<double>& upper, double damping);

}  // namespace grapnel
