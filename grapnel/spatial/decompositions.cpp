#include "grapnel/spatial/decompositions.hpp"

#include <cmath>

#include <utility>

GRAPNEL_DECOMPOSITIONS(template);

namespace grapnel {
namespace detail {

Eigen::VectorXd cholesky_solution_vector(const Cholesky& A, Eigen::VectorXd b) {
  A.solveInPlace(b);
  return b;
}

Eigen::MatrixXd cholesky_solution_matrix(const Cholesky& A, Eigen::MatrixXd B) {
  A.solveInPlace(B);
  return B;
}

Eigen::VectorXd lower_solution_vector(const Cholesky& A, Eigen::VectorXd b) {
  A.matrixL().solveInPlace(b);
  return b;
}

Eigen::MatrixXd lower_solution_matrix(const Cholesky& A, Eigen::MatrixXd B) {
  A.matrixL().solveInPlace(B);
  return B;
}

Eigen::VectorXd upper_solution_vector(const Cholesky& A, Eigen::VectorXd b) {
  A.matrixU().solveInPlace(b);
  return b;
}

Eigen::MatrixXd upper_solution_matrix(const Cholesky& A, Eigen::MatrixXd B) {
  A.matrixU().solveInPlace(B);
  return B;
}

Eigen::VectorXd lu_solution_vector(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.partialPivLu().solve(b);
}

Eigen::MatrixXd lu_solution_matrix(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  return A.partialPivLu().solve(B);
}

Eigen::VectorXd least_squares_solution_vector(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.householderQr().solve(b);
}

Eigen::MatrixXd least_squares_solution_matrix(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  return A.householderQr().solve(B);
}

}  // namespace detail

ThinQr thin_qr(const Eigen::MatrixXd& A) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A);
  return {qr.householderQ() * Eigen::MatrixXd::Identity(A.rows(), A.cols()),
          qr.matrixQR().topRows(A.cols()).triangularView<Eigen::Upper>()};
}

Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.completeOrthogonalDecomposition().solve(b);
}

Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(threshold);
  decomposition.compute(A);
  return decomposition.solve(b);
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(threshold);
  decomposition.compute(A);
  return decomposition.pseudoInverse();
}

std::optional<Eigen::VectorXd> least_norm_above(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double edge) {
  constexpr double kNoRow = 1e-9;
  const Eigen::VectorXd length = A.rowwise().norm();
  const double longest = length.size() > 0 ? length.maxCoeff() : 0;
  if (!(longest > 0) || !std::isfinite(longest)) return {};
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    if (length[i] > kNoRow * longest) rows.push_back(i);
  }
  const bool all = static_cast<Eigen::Index>(rows.size()) == A.rows();
  if (static_cast<Eigen::Index>(rows.size()) > A.cols()) return {};
  Eigen::MatrixXd some;
  if (!all) some = A(rows, Eigen::all);
  const Eigen::MatrixXd& G = all ? A : some;
  const Eigen::VectorXd wanted = all ? b : Eigen::VectorXd(b(rows));
  Eigen::MatrixXd gram = G * G.transpose();
  gram.diagonal().array() -= edge * edge;
  if (Cholesky(gram).info() != Eigen::Success) return {};
  gram.diagonal().array() += edge * edge;
  const Cholesky factor(gram);
  if (factor.info() != Eigen::Success) return {};
  Eigen::VectorXd x = G.transpose() * factor.solve(wanted);
  // The normal equations square the condition number; one step of iterative refinement compensates.
  x += G.transpose() * factor.solve(wanted - G * x);
  return x;
}

int rank_of(const Eigen::MatrixXd& A) { return static_cast<int>(A.colPivHouseholderQr().rank()); }

}  // namespace grapnel
