#include "grapnel/compare/impulse_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

// With L L^T the covariance and S the scales: L^-1 A S = U diag V^T.
WeightedSolution solve_weighted(const WeightedRows& rows) {
  const Eigen::Index unknowns = rows.A.cols(), count = rows.A.rows();
  WeightedSolution s;
  s.value = Eigen::VectorXd::Zero(unknowns);
  s.covariance = Eigen::MatrixXd::Zero(unknowns, unknowns);
  s.null_space = Eigen::MatrixXd::Identity(unknowns, unknowns);
  if (count == 0 || unknowns == 0) return s;
  const Cholesky L(rows.covariance);
  if (L.info() != Eigen::Success)
    throw std::invalid_argument("the covariance of measured rows is not positive definite");
  const Eigen::MatrixXd whitened = lower_solution(L, Eigen::MatrixXd(rows.A * rows.scale.asDiagonal()));
  const Eigen::VectorXd b = lower_solution(L, rows.b);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(whitened, Eigen::ComputeThinU | Eigen::ComputeFullV);
  const Eigen::VectorXd& values = svd.singularValues();
  while (s.rank < values.size() && values[s.rank] > kRankTolerance * values[0]) ++s.rank;
  const Eigen::MatrixXd U = svd.matrixU().leftCols(s.rank), V = svd.matrixV().leftCols(s.rank);
  const Eigen::VectorXd projected = U.transpose() * b, inverse = values.head(s.rank).cwiseInverse();
  s.value = rows.scale.asDiagonal() * (V * (inverse.asDiagonal() * projected));
  const Eigen::MatrixXd half = rows.scale.asDiagonal() * (V * inverse.asDiagonal());
  s.covariance = half * half.transpose();
  s.null_space = svd.matrixV().rightCols(unknowns - s.rank);
  s.whitened_residual = b - U * projected;
  s.chi_square = s.whitened_residual.squaredNorm();
  s.freedom = static_cast<int>(count) - s.rank;
  return s;
}

Combination combine(const WeightedSolution& solution, const Eigen::VectorXd& scale, const Eigen::VectorXd& c) {
  const Eigen::VectorXd scaled = scale.cwiseProduct(c);
  const double share = (solution.null_space.transpose() * scaled).norm();
  Combination one;
  one.determined = share <= kDeterminedTolerance * scaled.norm();
  one.value = c.dot(solution.value);
  const double unknown = share * solution.value.cwiseQuotient(scale).norm();
  one.deviation = std::sqrt(std::max(c.dot(solution.covariance * c), 0.0) + unknown * unknown);
  return one;
}

namespace {

// An impulse of this size changes its relative velocity by one unit of the root of its mobility.
Eigen::VectorXd scales_of(const ImpulseTask& task, const Cholesky& M) {
  const Eigen::Index rows = task.J.rows(), drives = static_cast<Eigen::Index>(task.unknown_drives.size());
  const Eigen::MatrixXd response = cholesky_solution(M, Eigen::MatrixXd(task.J.transpose()));
  Eigen::VectorXd scale(rows + drives);
  for (Eigen::Index i = 0; i < rows; ++i) scale[i] = 1 / std::sqrt(task.J.row(i).dot(response.col(i)));
  for (Eigen::Index i = 0; i < drives; ++i) {
    const int v = task.unknown_drives[static_cast<std::size_t>(i)];
    scale[rows + i] = std::sqrt(task.M(v, v));
  }
  return scale;
}

WeightedRows rows_of(const ImpulseTask& task) {
  const Cholesky M(task.M);
  if (M.info() != Eigen::Success) throw std::invalid_argument("the mass matrix is not positive definite");
  const Eigen::Index nv = task.M.rows(), impulses = task.J.rows();
  const Eigen::Index drives = static_cast<Eigen::Index>(task.unknown_drives.size());
  Eigen::MatrixXd into(nv, impulses + drives);  // generalized impulse per unknown
  into.leftCols(impulses) = task.J.transpose();
  into.rightCols(drives).setZero();
  for (Eigen::Index i = 0; i < drives; ++i) into(task.unknown_drives[static_cast<std::size_t>(i)], impulses + i) = 1;
  const Eigen::Index measured = task.H.rows(), direct = task.D.rows();
  // H M^-1, transposed.
  const Eigen::MatrixXd gain = cholesky_solution(M, Eigen::MatrixXd(task.H.transpose()));
  WeightedRows rows;
  rows.A = Eigen::MatrixXd::Zero(measured + direct, impulses + drives);
  rows.A.topRows(measured) = gain.transpose() * into;
  if (direct > 0) rows.A.bottomLeftCorner(direct, impulses) = task.D;
  rows.b.resize(measured + direct);
  rows.b.head(measured) = task.change - gain.transpose() * task.known;
  rows.covariance = Eigen::MatrixXd::Zero(measured + direct, measured + direct);
  const Eigen::MatrixXd spread = task.known_deviation.asDiagonal() * gain;
  rows.covariance.topLeftCorner(measured, measured) = task.covariance + spread.transpose() * spread;
  if (direct > 0) {
    rows.b.tail(direct) = task.direct;
    rows.covariance.bottomRightCorner(direct, direct).diagonal() = task.direct_deviation.cwiseAbs2();
  }
  rows.scale = scales_of(task, M);
  return rows;
}

}  // namespace

ImpulseEstimate estimate_impulses(const std::function<ImpulseTask(std::span<const double> changes)>& at,
                                  std::size_t configurations) {
  std::vector<double> changes(configurations, 0.0);
  WeightedRows rows = rows_of(at(changes));
  ImpulseEstimate estimate;
  estimate.scale = rows.scale;
  estimate.solution = solve_weighted(rows);
  if (configurations == 0) return estimate;
  // The rows' errors from the configuration depend on the impulses: those of the first solution.
  const Eigen::VectorXd first = estimate.solution.value, residual = rows.A * first - rows.b;
  for (std::size_t k = 0; k < configurations; ++k) {
    changes[k] = 1;
    const WeightedRows other = rows_of(at(changes));
    changes[k] = 0;
    const Eigen::VectorXd error = (other.A * first - other.b) - residual;
    rows.covariance += error * error.transpose();
  }
  estimate.solution = solve_weighted(rows);
  return estimate;
}

ImpulseEstimate estimate_impulses(const ImpulseTask& task) {
  return estimate_impulses([&](std::span<const double>) { return task; }, 0);
}

}  // namespace grapnel
