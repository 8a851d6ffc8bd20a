#pragma once

/// @file
/// Eigen's decompositions of dense matrices and what is solved with them, compiled once: each takes ten seconds and
/// more to compile, a solution by one several, and two dozen files use them. Include this instead of <Eigen/QR> and the
/// like, and call these functions instead of the decompositions' own solve(). Matrices of fixed size are compiled where
/// they are used.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <optional>
#include <vector>

extern template class Eigen::LLT<Eigen::MatrixXd>;
extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::BDCSVD<Eigen::MatrixXd>;
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

namespace grapnel {

/// The numbers, to compute with.
inline Eigen::VectorXd as_vector(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

/// A = L L^T of a symmetric positive definite matrix. As with Eigen's own, info() tells whether it was.
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

/// A^-1 b, a vector or a matrix as b is.
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

/// A^-1 b of a square matrix that is not singular, by LU with partial pivoting.
template <class B>
auto lu_solution(const Eigen::MatrixXd& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::lu_solution_vector(A, b);
  else
    return detail::lu_solution_matrix(A, b);
}

/// The x that makes |A x - b| least, for A of full column rank: by Householder QR.
template <class B>
auto least_squares_solution(const Eigen::MatrixXd& A, const Eigen::MatrixBase<B>& b) {
  if constexpr (B::ColsAtCompileTime == 1)
    return detail::least_squares_solution_vector(A, b);
  else
    return detail::least_squares_solution_matrix(A, b);
}

/// A = Q R with as many columns of Q, orthonormal, as A has; R is upper triangular. A has no more columns than rows.
struct ThinQr {
  Eigen::MatrixXd Q, R;
};
ThinQr thin_qr(const Eigen::MatrixXd& A);

/// Of the x that make |A x - b| least the shortest, by the complete orthogonal decomposition. Pivots below `threshold`
/// times the largest count as zero; absent: Eigen's own, of the size of rounding.
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold);
/// The matrix that makes these solutions of all b.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A, double threshold);
/// The x of least norm with A x = b, if every singular value of A is above `edge` (so A has no more rows than columns);
/// else nothing. Rows below 1e-9 of the longest are left out, with their b: no x meets them. Whether a singular value
/// is below the edge, Cholesky's decomposition of A A^T - edge^2 1 tells, which costs a hundredth of the singular value
/// decomposition.
std::optional<Eigen::VectorXd> least_norm_above(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double edge);
/// Rank, by pivots against Eigen's own threshold, of the size of rounding.
int rank_of(const Eigen::MatrixXd& A);

}  // namespace grapnel
