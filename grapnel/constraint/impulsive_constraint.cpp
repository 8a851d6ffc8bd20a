#include "grapnel/constraint/impulsive_constraint.hpp"

#include <stdexcept>

namespace grapnel {

namespace {
// Singular values below this fraction of the largest are redundant rows. LoopSolver uses their squares, the pivots.
// Rounding errors are about 1e-15, and true constraints of extreme mass ratios (the squares) are still counted.
constexpr double kRankTolerance = 1e-6;
}  // namespace

ImpulsiveSolution solve_impulsive_constraint(const Eigen::MatrixXd& M, const Eigen::MatrixXd& J,
                                             const Eigen::VectorXd& v, const Eigen::MatrixXd& D,
                                             const Eigen::VectorXd& after) {
  if (M.rows() != M.cols()) throw std::invalid_argument("solve_impulsive_constraint: M is not square");
  return solve_impulsive_constraint(Cholesky(M), J, v, D, after);
}

// M = L L^T, J, v-, w, D => v+, P, self-stresses and rank, by the singular value decomposition of Y = L^-1 J^T G^-T
// with D = G G^T.
ImpulsiveSolution solve_impulsive_constraint(const Cholesky& mass, const Eigen::MatrixXd& J, const Eigen::VectorXd& v,
                                             const Eigen::MatrixXd& D, const Eigen::VectorXd& after) {
  if (mass.rows() != v.size() || J.cols() != v.size() || D.rows() != J.rows() || D.cols() != J.rows() ||
      (after.size() != 0 && after.size() != J.rows())) {
    throw std::invalid_argument("solve_impulsive_constraint: sizes of M, J, v and D do not match");
  }
  const Cholesky metric(D);
  if (mass.info() != Eigen::Success)
    throw std::invalid_argument("solve_impulsive_constraint: M is not positive definite");
  if (metric.info() != Eigen::Success)
    throw std::invalid_argument("solve_impulsive_constraint: D is not positive definite");

  // Eigen's decompositions do not accept empty matrices.
  if (J.rows() == 0) return {v, Eigen::VectorXd(0), Eigen::MatrixXd(0, 0), 0};

  Eigen::MatrixXd Y = J.transpose();
  mass.matrixL().solveInPlace(Y);
  Y = lower_solution(metric, Y.transpose()).transpose().eval();
  const Eigen::VectorXd weighted = mass.matrixU() * v;

  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Y, Eigen::ComputeThinU | Eigen::ComputeFullV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  const double threshold = sigma.size() > 0 ? kRankTolerance * sigma[0] : 0.0;
  ImpulsiveSolution solution;
  while (solution.rank < sigma.size() && sigma[solution.rank] > threshold) ++solution.rank;
  const auto U = svd.matrixU().leftCols(solution.rank);
  Eigen::VectorXd along = U.transpose() * weighted;
  // Projected twice: the second projection removes the rounding error of the first, of the size of v-.
  Eigen::VectorXd rest = weighted - U * along;
  rest -= U * (U.transpose() * rest);
  if (after.size() != 0) {
    const Eigen::VectorXd wanted = (svd.matrixV().leftCols(solution.rank).transpose() * lower_solution(metric, after))
                                       .cwiseQuotient(sigma.head(solution.rank));
    rest += U * wanted;
    along -= wanted;
  }
  solution.velocity = upper_solution(mass, rest);
  const Eigen::VectorXd y = -(svd.matrixV().leftCols(solution.rank) * along.cwiseQuotient(sigma.head(solution.rank)));
  solution.impulse = upper_solution(metric, y);
  solution.null_space = svd.matrixV().rightCols(J.rows() - solution.rank);
  if (solution.null_space.cols() > 0) solution.null_space = upper_solution(metric, solution.null_space);
  return solution;
}

}  // namespace grapnel
