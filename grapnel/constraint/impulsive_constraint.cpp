#include "grapnel/constraint/impulsive_constraint.hpp"

#include <stdexcept>
#include <utility>

namespace grapnel {

namespace {
// Singular values below this fraction of the largest are redundant rows, as for LoopSolver, whose pivots are their
// squares: rounding leaves some 1e-15 there, and true constraints of extreme mass ratios (the squares) still count.
constexpr double kRankTolerance = 1e-6;
// Pivots below this fraction of the largest are nothing but rounding, far below what decides the rank.
constexpr double kRounding = 1e-12;

// Y = U diag(sigma) V^T, V square; of U and sigma as many columns and values as Y has pivots above rounding.
struct SingularValues {
  Eigen::MatrixXd U;
  Eigen::VectorXd sigma;
  Eigen::MatrixXd V;
};

// Every second of the rows of planar arms on one target says what others do: a complete orthogonal decomposition
// Y = Q T Z first leaves them out, and the singular values of the triangle T, of half the size, take a fifth of the
// time.
SingularValues singular_values(const Eigen::MatrixXd& Y) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> whole;
  whole.setThreshold(kRounding);
  whole.compute(Y);
  const Eigen::Index rank = whole.rank(), rows = Y.cols();
  if (rank == 0) return {Eigen::MatrixXd(Y.rows(), 0), Eigen::VectorXd(0), Eigen::MatrixXd::Identity(rows, rows)};
  Eigen::MatrixXd T = whole.matrixT().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(T, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::MatrixXd Q = whole.householderQ() * Eigen::MatrixXd::Identity(Y.rows(), rank);
  // Eigen's Z is not there where nothing is left out.
  const Eigen::MatrixXd Z = rank < rows ? Eigen::MatrixXd(whole.matrixZ()) : Eigen::MatrixXd::Identity(rows, rows);
  Eigen::MatrixXd V = whole.colsPermutation() * Z.transpose();
  V.leftCols(rank) = (V.leftCols(rank) * svd.matrixV()).eval();
  return {Q * svd.matrixU(), svd.singularValues(), std::move(V)};
}
}  // namespace

ImpulsiveSolution solve_impulsive_constraint(const Eigen::MatrixXd& M, const Eigen::MatrixXd& J,
                                             const Eigen::VectorXd& v, const Eigen::MatrixXd& D,
                                             const Eigen::VectorXd& after) {
  if (M.rows() != M.cols()) throw std::invalid_argument("solve_impulsive_constraint: M is not square");
  return solve_impulsive_constraint(Cholesky(M), J, v, D, after);
}

ImpulsiveSolution solve_impulsive_constraint(const Cholesky& mass, const Eigen::MatrixXd& J, const Eigen::VectorXd& v,
                                             const Eigen::MatrixXd& D, const Eigen::VectorXd& after) {
  if (mass.rows() != v.size() || J.cols() != v.size() || D.rows() != J.rows() || D.cols() != J.rows() ||
      (after.size() != 0 && after.size() != J.rows())) {
    throw std::invalid_argument("solve_impulsive_constraint: sizes of M, J, v and D do not fit");
  }
  const Cholesky metric(D);
  if (mass.info() != Eigen::Success)
    throw std::invalid_argument("solve_impulsive_constraint: M is not positive definite");
  if (metric.info() != Eigen::Success)
    throw std::invalid_argument("solve_impulsive_constraint: D is not positive definite");

  // Eigen's decompositions do not take empty matrices.
  if (J.rows() == 0) return {v, Eigen::VectorXd(0), Eigen::MatrixXd(0, 0), 0};

  Eigen::MatrixXd Y = J.transpose();
  mass.matrixL().solveInPlace(Y);
  Y = lower_solution(metric, Y.transpose()).transpose().eval();
  const Eigen::VectorXd weighted = mass.matrixU() * v;

  const SingularValues svd = singular_values(Y);
  const Eigen::VectorXd& sigma = svd.sigma;
  const double threshold = sigma.size() > 0 ? kRankTolerance * sigma[0] : 0.0;
  ImpulsiveSolution solution;
  while (solution.rank < sigma.size() && sigma[solution.rank] > threshold) ++solution.rank;
  const auto U = svd.U.leftCols(solution.rank);
  Eigen::VectorXd along = U.transpose() * weighted;
  // Projected twice: the first subtraction leaves rounding of the size of v-, the second removes it.
  Eigen::VectorXd rest = weighted - U * along;
  rest -= U * (U.transpose() * rest);
  if (after.size() != 0) {
    const Eigen::VectorXd wanted = (svd.V.leftCols(solution.rank).transpose() * lower_solution(metric, after))
                                       .cwiseQuotient(sigma.head(solution.rank));
    rest += U * wanted;
    along -= wanted;
  }
  solution.velocity = upper_solution(mass, rest);
  const Eigen::VectorXd y = -(svd.V.leftCols(solution.rank) * along.cwiseQuotient(sigma.head(solution.rank)));
  solution.impulse = upper_solution(metric, y);
  solution.null_space = svd.V.rightCols(J.rows() - solution.rank);
  if (solution.null_space.cols() > 0) solution.null_space = upper_solution(metric, solution.null_space);
  return solution;
}

}  // namespace grapnel
