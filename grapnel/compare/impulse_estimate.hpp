#pragma once

/// @file
/// The impulses at grasps from measured changes of rates, by weighted least squares on the generalized momentum balance
/// (docs/theory, section 25). Knows neither logs nor files.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

namespace grapnel {

/// The rows A x = b + noise of a weighted least-squares problem, and the scale of each unknown.
struct WeightedRows {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  Eigen::MatrixXd covariance;  // of the noise, positive definite
  Eigen::VectorXd scale;       // of the unknowns, positive: makes them comparable
};

struct WeightedSolution {
  Eigen::VectorXd value;              // minimum norm, in units of the scales, where it is not determined
  Eigen::MatrixXd covariance;         // on the determined directions
  Eigen::MatrixXd null_space;         // columns: orthonormal undetermined directions, in units of the scales
  Eigen::VectorXd whitened_residual;  // sum of squares: chi-square with `freedom` degrees of freedom
  double chi_square = 0;
  int rank = 0, freedom = 0;
};

/// Singular values of the whitened rows below this share of the largest count as zero.
inline constexpr double kRankTolerance = 1e-9;
/// A combination of unknowns is determined if undetermined directions change it by at most this, relative to its scale:
/// where measured axes deviate a little from those of the undetermined directions, but not more.
inline constexpr double kDeterminedTolerance = 1e-2;

WeightedSolution solve_weighted(const WeightedRows& rows);
/// A combination of the unknowns.
struct Combination {
  bool determined = false;
  double value = 0;
  /// Standard uncertainty: the covariance, and the share of undetermined directions in the combination times the norm
  /// of the estimate in units of the scales, since these directions are assumed to be no larger.
  double deviation = 0;
};
Combination combine(const WeightedSolution& solution, const Eigen::VectorXd& scale, const Eigen::VectorXd& c);

/// One contact. v: all generalized velocities; P: components of impulses at grasps, as rows of J.
struct ImpulseTask {
  Eigen::MatrixXd M;                // mass matrix
  Eigen::MatrixXd J;                // rows of the unknown impulses x v
  std::vector<int> unknown_drives;  // velocities with an unknown generalized impulse
  Eigen::VectorXd known;            // known generalized impulse of actuators and finite forces
  Eigen::VectorXd known_deviation;  // its standard uncertainty; zero: exact
  // Measured rows: H (v+ - v-) = change + noise.
  Eigen::MatrixXd H;
  Eigen::VectorXd change;
  Eigen::MatrixXd covariance;
  // Directly measured components of the impulses, by force sensors: D P = direct + noise. May have no rows.
  Eigen::MatrixXd D;
  Eigen::VectorXd direct, direct_deviation;
};

/// Estimated impulses: the unknowns are P, then the impulses of unknown drives.
struct ImpulseEstimate {
  WeightedSolution solution;
  Eigen::VectorXd scale;
};

/// Eliminates the change of velocities, so that velocities without a sensor need no rows: with M dv = J^T P + E s +
/// known, the rows are H M^-1 [J^T E] [P; s] = change - H M^-1 known. `at` makes the task for small changes of the
/// configuration, in standard uncertainties, one at a time; their effects on the rows are part of the covariance.
ImpulseEstimate estimate_impulses(const std::function<ImpulseTask(std::span<const double> changes)>& at,
                                  std::size_t configurations);

/// The same with a known configuration.
ImpulseEstimate estimate_impulses(const ImpulseTask& task);

}  // namespace grapnel
