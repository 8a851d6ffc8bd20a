#pragma once

/// @file
/// Polynomials on both sides of a contact: values and slopes at its ends from noisy samples (docs/theory, section 25).

#include <Eigen/Core>
#include <span>
#include <vector>

namespace grapnel {

/// Times relative to the contact [s]: before it, at most 0; after it, at least `average`.
struct SideTimes {
  std::vector<double> before, after;
};

/// A least-squares fit of one polynomial per side to samples of equal uncertainty. All results are linear in the
/// samples: weights over the samples before, then those after.
class StepFit {
 public:
  /// `average`: each sample is a mean over this time before its time stamp [s]. `continuous`: both polynomials have one
  /// value at zero, as positions have. @pre can_fit()
  StepFit(const SideTimes& times, int degree, bool continuous, double average);
  /// Whether both sides have at least two samples more than coefficients.
  static bool can_fit(const SideTimes& times, int degree);

  Eigen::VectorXd value_before() const { return weights(value_before_); }
  Eigen::VectorXd value_after() const { return weights(value_after_); }
  Eigen::VectorXd slope_before() const { return weights(slope_before_) / window_; }
  Eigen::VectorXd slope_after() const { return weights(slope_after_) / window_; }
  /// Samples minus polynomials.
  Eigen::VectorXd residual(const Eigen::VectorXd& samples) const;
  int coefficients() const { return static_cast<int>(Q_.cols()); }

 private:
  Eigen::VectorXd weights(int coefficient) const;

  Eigen::MatrixXd Q_, R_;
  double window_ = 1;
  int value_before_ = 0, value_after_ = 0, slope_before_ = 0, slope_after_ = 0;
};

}  // namespace grapnel
