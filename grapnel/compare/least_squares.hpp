#pragma once

/// @file
/// Bounded nonlinear least squares by the method of Levenberg and Marquardt.

#include <Eigen/Dense>
#include <functional>
#include <optional>

namespace grapnel {

/// Residuals as functions of variables between bounds. A point whose residuals are empty cannot be evaluated; the
/// search rejects the step to it.
struct LeastSquares {
  Eigen::VectorXd lower, upper;
  std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd& x)> residuals;
  /// The derivatives at a point whose residuals exist. Empty: they could not be computed.
  std::function<std::optional<Eigen::MatrixXd>(const Eigen::VectorXd& x)> jacobian;
};

/// Minimum reduction of the sum of squares that the next step must promise. A step of 1 % of a standard uncertainty
/// promises 1e-4.
inline constexpr double kStopReduction = 1e-4;

struct LeastSquaresResult {
  Eigen::VectorXd x, residuals;
  double cost = 0;  ///< sum of squares
  std::size_t iterations = 0, rejected = 0;
  bool converged = false;
};

/// Searches from a point with residuals. Each iteration minimizes the model of (26.5) between the bounds. The search
/// ends when the linear model promises a reduction below kStopReduction, or below 1e-9 of the cost. Empty if the start
/// cannot be evaluated.
std::optional<LeastSquaresResult> minimize_squares(const LeastSquares& problem, const Eigen::VectorXd& start,
                                                   std::size_t most_iterations);

}  // namespace grapnel
