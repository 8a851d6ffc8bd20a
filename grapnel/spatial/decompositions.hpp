#pragma once

/// @file
/// Eigen's decompositions of dense matrices and solutions with them, compiled once. Each decomposition takes at least
/// ten seconds to compile, each solution several, and two dozen files use them. Include this instead of <Eigen/QR> and
/// similar headers, and call these functions instead of the decompositions' own solve(). Matrices of fixed size are
/// compiled where they are used.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <optional>
#include <vector>

// Members that are templates themselves are not parts of their class's instantiation: they are declared for a matrix.
// Where an expression is decomposed, make it a matrix first, Eigen::MatrixXd(A * B).
#define GRAPNEL_DECOMPOSITIONS(extern_template)                                        \
  extern_template class Eigen::LLT<Eigen::MatrixXd>;                                   \
  extern_template Eigen::LLT<Eigen::MatrixXd>& Eigen::LLT<Eigen::MatrixXd>::compute(   \
      const Eigen::EigenBase<Eigen::MatrixXd>&);                                       \
  extern_template class Eigen::LDLT<Eigen::MatrixXd>;                                  \
  extern_template Eigen::LDLT<Eigen::MatrixXd>& Eigen::LDLT<Eigen::MatrixXd>::compute( \
      const Eigen::EigenBase<Eigen::MatrixXd>&);                                       \
  extern_template class Eigen::PartialPivLU<Eigen::MatrixXd>;                          \
  extern_template class Eigen::FullPivLU<Eigen::MatrixXd>;                             \
  extern_template class Eigen::HouseholderQR<Eigen::MatrixXd>;                         \
  extern_template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;                   \
  extern_template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;       \
  extern_template class Eigen::JacobiSVD<Eigen::MatrixXd>;                             \
  extern_template class Eigen::BDCSVD<Eigen::MatrixXd>;                                \
  extern_template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;                \
  extern_template Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>&                      \
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>::compute(const Eigen::EigenBase<Eigen::MatrixXd>&, int)

GRAPNEL_DECOMPOSITIONS(extern template);

namespace grapnel {

/// View of a std::vector as an Eigen vector.
inline Eigen::VectorXd as_vector(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

/// A = L L^T of a symmetric positive definite matrix. As with Eigen, info() reports whether it was positive definite.
using Cholesky = Eigen::LLT<Eigen::MatrixXd>;

namespace detail {
Eigen::VectorXd cholesky_solution_vector(const Cholesky& A, Eigen::VectorXd b);
Eigen::MatrixXd cholesky_solution_matrix(const Cholesky& A, Eigen::MatrixXd B);
Eigen::VectorXd lower_solution_vector(const Cholesky& A, Eigen::VectorXd b);
Eigen::MatrixXd lower_solution_matrix(const Cholesky& A, Eigen::MatrixXd B);
Eigen::VectorXd upper_solution_vector(const Cholesky& A, Eigen::VectorXd b);
Eigen::MatrixXd upper_solution_matrix(const Cholesky& A, Eigen::MatrixXd B);
Eigen::VectorXd lu_solution_vector(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd lu_solution_matrix(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::VectorXd least_squares_solution_vector(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd least_squares_solution_matrix(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
}  // namespace detail

/// A^-1 b for a vector or matrix b.
template <class B>
auto cholesky_solution(const Cholesky& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::cholesky_solution_vector(A, b);
  else
    return detail::cholesky_solution_matrix(A, b);
}
/// L^-1 b.
template <class B>
auto lower_solution(const Cholesky& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::lower_solution_vector(A, b);
  else
    return detail::lower_solution_matrix(A, b);
}
/// L^-T b.
template <class B>
auto upper_solution(const Cholesky& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::upper_solution_vector(A, b);
  else
    return detail::upper_solution_matrix(A, b);
}

/// A^-1 b for a nonsingular square matrix, by LU with partial pivoting.
template <class B>
auto lu_solution(const Eigen::MatrixXd& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::lu_solution_vector(A, b);
  else
    return detail::lu_solution_matrix(A, b);
}

/// The x that minimizes |A x - b|, for A of full column rank, by Householder QR.
template <class B>
auto least_squares_solution(const Eigen::MatrixXd& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::least_squares_solution_vector(A, b);
  else
    return detail::least_squares_solution_matrix(A, b);
}

/// A = Q R with orthonormal columns of Q, as many as A has, and upper triangular R. A has at most as many columns as
/// rows.
struct ThinQr {
  Eigen::MatrixXd Q, R;
};
ThinQr thin_qr(const Eigen::MatrixXd& A);

/// The minimum-norm x that minimizes |A x - b|, by the complete orthogonal decomposition. Pivots below `threshold`
/// times the largest count as zero; absent: Eigen's default, of the size of rounding error.
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold);
/// The matrix that maps every b to this solution.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A, double threshold);
/// The minimum-norm x with A x = b, if every singular value of A is above `edge` (A then has at most as many rows as
/// columns); otherwise empty. Rows below 1e-9 of the longest are dropped together with their b, since no x satisfies
/// them. The test of the singular values is a Cholesky decomposition of A A^T - edge^2 1, at a hundredth of the cost of
/// a singular value decomposition.
std::optional<Eigen::VectorXd> least_norm_above(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double edge);
/// Rank, by pivots relative to Eigen's default threshold, of the size of rounding error.
int rank_of(const Eigen::MatrixXd& A);

}  // namespace grapnel
