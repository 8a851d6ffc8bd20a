#include "grapnel/import/expanded_nodes.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;

// A pivot below this, relative to its diagonal element, is a rounding error: the stiffness is singular there.
constexpr double kSingular = 1e-11;
// Relative addition to the diagonal, with which a singular matrix can be factorized.
constexpr double kShift = 1e-13;
// Permitted inconsistency of positions, relative to the distances between them.
constexpr double kMismatch = 1e-3;

// The rigid motions of a free model, in any six coordinates: stiffness times motions is zero.
class RigidMotions {
 public:
  explicit RigidMotions(const Sparse& K) : K_(K) {}

  // `candidates`: rows and their motions at known positions. Searches six rows that support the model among them, then,
  // if needed, one by one where the factorized stiffness is singular.
  std::optional<MatrixXd> find(const std::vector<ExpandedRow>& candidates) {
    hold_by(candidates);
    while (held_.size() < 6) {
      const auto loose = loosest_row();
      if (!loose) return std::nullopt;
      held_.push_back(*loose);
    }
    const std::vector<int> free = free_rows();
    const Eigen::SimplicialLDLT<Sparse> factor(block(free, free));
    if (factor.info() != Eigen::Success) return std::nullopt;
    const MatrixXd follow = factor.solve(MatrixXd(-block(free, held_)));
    if (!follow.allFinite()) return std::nullopt;
    MatrixXd N = MatrixXd::Zero(K_.rows(), 6);
    for (std::size_t i = 0; i < held_.size(); ++i) N(held_[i], static_cast<Index>(i)) = 1;
    for (std::size_t i = 0; i < free.size(); ++i) N.row(free[i]) = follow.row(static_cast<Index>(i));
    return N;
  }

 private:
  void hold_by(const std::vector<ExpandedRow>& candidates) {
    double size = 0;
    for (const ExpandedRow& r : candidates)
      for (std::size_t k = 0; k < 3; ++k) size = std::max(size, std::abs(r.place[k] - candidates[0].place[k]));
    MatrixXd G = MatrixXd::Zero(6, static_cast<Index>(candidates.size()));
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const ExpandedRow& r = candidates[i];
      const auto c = static_cast<std::size_t>(r.component - 1);
      const auto column = static_cast<Index>(i);
      G(static_cast<Index>(c), column) = 1;
      if (size == 0) continue;
      const auto p = [&](std::size_t k) { return (r.place[k] - candidates[0].place[k]) / size; };
      G(static_cast<Index>(3 + (c + 1) % 3), column) = p((c + 2) % 3);
      G(static_cast<Index>(3 + (c + 2) % 3), column) = -p((c + 1) % 3);
    }
    Eigen::ColPivHouseholderQR<MatrixXd> qr(G);
    qr.setThreshold(1e-3);
    for (Index k = 0; k < std::min<Index>(qr.rank(), 6); ++k)
      held_.push_back(candidates[static_cast<std::size_t>(qr.colsPermutation().indices()[k])].row);
  }

  std::vector<int> free_rows() const {
    std::vector<int> rows;
    for (int row = 0; row < K_.rows(); ++row) {
      if (std::find(held_.begin(), held_.end(), row) == held_.end() && K_.coeff(row, row) != 0) rows.push_back(row);
    }
    return rows;
  }

  Sparse block(const std::vector<int>& rows, const std::vector<int>& columns) const {
    std::vector<int> place(static_cast<std::size_t>(K_.rows()), -1);
    for (std::size_t i = 0; i < rows.size(); ++i) place[static_cast<std::size_t>(rows[i])] = static_cast<int>(i);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      for (Sparse::InnerIterator it(K_, columns[c]); it; ++it) {
        if (const int r = place[static_cast<std::size_t>(it.row())]; r >= 0)
          entries.emplace_back(r, static_cast<int>(c), it.value());
      }
    }
    Sparse A(static_cast<Index>(rows.size()), static_cast<Index>(columns.size()));
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
  }

  // The row of the first singular pivot of the elimination, or of the smallest one.
  std::optional<int> loosest_row() const {
    const std::vector<int> free = free_rows();
    Sparse A = block(free, free);
    const VectorXd diagonal = A.diagonal();
    for (Index k = 0; k < A.rows(); ++k) A.coeffRef(k, k) += kShift * std::abs(diagonal[k]);
    const Eigen::SimplicialLDLT<Sparse> factor(A);
    if (factor.info() != Eigen::Success || free.empty()) return std::nullopt;
    const VectorXd pivots = factor.vectorD();
    double least = HUGE_VAL;
    Index at = 0;
    for (Index k = 0; k < pivots.size(); ++k) {
      const Index row = factor.permutationPinv().indices()[k];
      const double relative = pivots[k] / std::abs(diagonal[row]);
      if (relative < least) least = relative, at = row;
      if (least < kSingular) break;
    }
    return free[static_cast<std::size_t>(at)];
  }

  const Sparse& K_;
  std::vector<int> held_;
};

// Positions of expanded nodes from the motions: with rotations W (three coordinates, without translations) there are X
// and Z such that W X + Z is theta x p at every position p.
class PlaceFit {
 public:
  PlaceFit(const MatrixXd& N, std::string& reason) : N_(N), reason_(reason) {}

  std::optional<std::vector<std::array<double, 6>>> run(const std::vector<ExpandedRow>& rows,
                                                        const std::vector<ExpandedRow>& others) {
    std::vector<ExpandedRow> known = rows;
    known.insert(known.end(), others.begin(), others.end());
    if (!split_translations(known) || !fit(rows, known)) return std::nullopt;
    std::vector<std::array<double, 6>> motions;
    for (const ExpandedRow& r : rows) {
      const Index c = r.component - 1;
      std::array<double, 6> motion{};
      motion[static_cast<std::size_t>(c)] = 1;
      const Eigen::RowVector3d rotation = W_.row(r.row) * X_ + Z_.row(c);
      for (Index k = 0; k < 3; ++k) motion[static_cast<std::size_t>(3 + k)] = rotation[k];
      motions.push_back(motion);
    }
    return motions;
  }

 private:
  bool split_translations(const std::vector<ExpandedRow>& known) {
    MatrixXd A(static_cast<Index>(known.size()), 6), E = MatrixXd::Zero(static_cast<Index>(known.size()), 3);
    for (std::size_t i = 0; i < known.size(); ++i) {
      A.row(static_cast<Index>(i)) = N_.row(known[i].row);
      E(static_cast<Index>(i), known[i].component - 1) = 1;
    }
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
    const MatrixXd T = qr.solve(E);
    if (!((A * T - E).cwiseAbs().maxCoeff() < kMismatch)) {
      reason_ = "the stiffness resists a translation of the whole model: remove the remaining support";
      return false;
    }
    const Eigen::HouseholderQR<MatrixXd> complement(T);
    const MatrixXd Q = complement.householderQ() * MatrixXd::Identity(6, 6);
    W_ = N_ * Q.rightCols(3);
    return true;
  }

  // Unknowns: X, then Z, column by column.
  bool fit(const std::vector<ExpandedRow>& rows, const std::vector<ExpandedRow>& known) {
    std::vector<Eigen::Matrix<double, 1, 18>> equations;
    std::vector<double> right;
    const auto add = [&](const Eigen::RowVector3d& w, Index component, Index column, Eigen::Matrix<double, 1, 18>& e) {
      e.segment<3>(3 * column) += w;
      e[9 + 3 * column + component] += 1;
    };
    // Known positions: the mean of the nodes that result from one node.
    std::map<std::pair<long long, int>, std::pair<Eigen::RowVector3d, int>> means;
    std::map<long long, std::array<double, 3>> places;
    for (const ExpandedRow& r : known) {
      auto& mean =
          means.emplace(std::pair(r.node, r.component), std::pair(Eigen::RowVector3d(0, 0, 0), 0)).first->second;
      mean.first += W_.row(r.row), ++mean.second;
      places.emplace(r.node, r.place);
    }
    for (const auto& [name, mean] : means) {
      const Index c = name.second - 1;
      const std::array<double, 3>& p = places[name.first];
      Eigen::RowVector3d theta_x_p(0, 0, 0);  // component c
      theta_x_p[(c + 1) % 3] = p[static_cast<std::size_t>((c + 2) % 3)];
      theta_x_p[(c + 2) % 3] = -p[static_cast<std::size_t>((c + 1) % 3)];
      for (Index k = 0; k < 3; ++k) {
        Eigen::Matrix<double, 1, 18> e = Eigen::Matrix<double, 1, 18>::Zero();
        add(mean.first / mean.second, c, k, e);
        equations.push_back(e), right.push_back(theta_x_p[k]);
      }
    }
    // The map from a rotation to the motion of a position is skew-symmetric.
    for (std::size_t i = 0; i + 2 < rows.size(); ++i) {
      if (rows[i].component != 1 || rows[i + 1].component != 2 || rows[i + 2].component != 3 ||
          rows[i].node != rows[i + 2].node || rows[i + 2].row != rows[i].row + 2)
        continue;
      for (Index a = 0; a < 3; ++a) {
        for (Index b = a; b < 3; ++b) {
          Eigen::Matrix<double, 1, 18> e = Eigen::Matrix<double, 1, 18>::Zero();
          add(W_.row(rows[i].row + static_cast<int>(a)), a, b, e);
          add(W_.row(rows[i].row + static_cast<int>(b)), b, a, e);
          equations.push_back(e), right.push_back(0);
        }
      }
    }
    MatrixXd A(static_cast<Index>(equations.size()), 18);
    VectorXd b(A.rows());
    for (Index i = 0; i < A.rows(); ++i)
      A.row(i) = equations[static_cast<std::size_t>(i)], b[i] = right[static_cast<std::size_t>(i)];
    return solve(A, b);
  }

  bool solve(const MatrixXd& A, const VectorXd& b) {
    VectorXd scale(18);
    for (Index k = 0; k < 18; ++k) scale[k] = std::max(A.col(k).norm(), 1e-300);
    const MatrixXd scaled = A * scale.cwiseInverse().asDiagonal();
    const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const VectorXd sigma = svd.singularValues();
    if (A.rows() < 18 || !(sigma[17] > 1e-7 * sigma[0])) {
      reason_ =
          "the positions of these nodes do not determine those of the expanded solids: state at least "
          "two nodes at different positions, or further ones with --node-places";
      return false;
    }
    const VectorXd y = svd.solve(b);
    const VectorXd x = y.cwiseQuotient(scale);
    X_ = Eigen::Map<const Eigen::Matrix3d>(x.data());
    Z_ = Eigen::Map<const Eigen::Matrix3d>(x.data() + 9);
    // Distances between the positions, the scale of their inconsistency.
    const double size = (A.leftCols(9) * x.head(9)).cwiseAbs().maxCoeff();
    if ((A * x - b).cwiseAbs().maxCoeff() <= kMismatch * size) return true;
    reason_ = "the positions of the nodes do not match the matrices: they must be those of the model, in its units";
    return false;
  }

  const MatrixXd& N_;
  std::string& reason_;
  MatrixXd W_;
  Eigen::Matrix3d X_, Z_;
};

}  // namespace

std::optional<std::vector<std::array<double, 6>>> expanded_motions(const Sparse& stiffness,
                                                                   const std::vector<ExpandedRow>& rows,
                                                                   const std::vector<ExpandedRow>& others,
                                                                   std::string& reason) {
  std::vector<ExpandedRow> known = rows;
  known.insert(known.end(), others.begin(), others.end());
  const auto N = RigidMotions(stiffness).find(known);
  if (!N) {
    reason = "no rigid motions of the model were found in its stiffness";
    return std::nullopt;
  }
  return PlaceFit(*N, reason).run(rows, others);
}

}  // namespace grapnel
