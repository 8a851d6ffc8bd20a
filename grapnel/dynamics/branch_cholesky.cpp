#include "grapnel/dynamics/branch_cholesky.hpp"

#include <cmath>

namespace grapnel {
namespace {

constexpr std::size_t kBlock = 8;  // number of right-hand sides processed together

// Rows never overlap; with __restrict the compiler vectorizes these short loops without run-time checks.
void subtract(double factor, const double* __restrict from, double* __restrict to, std::size_t size) {
  for (std::size_t k = 0; k < size; ++k) to[k] -= factor * from[k];
}
void subtract_blocks(double factor, const double* __restrict from, double* __restrict to, std::size_t blocks) {
  for (std::size_t b = 0; b < blocks; ++b, from += kBlock, to += kBlock) {
    for (std::size_t k = 0; k < kBlock; ++k) to[k] -= factor * from[k];
  }
}

void scale(double factor, double* row, std::size_t blocks) {
  for (std::size_t k = 0; k < blocks * kBlock; ++k) row[k] *= factor;
}

}  // namespace

// Model => order of the velocities and the ancestors of each: the pattern of nonzeros of L.
BranchCholesky::BranchCholesky(const Model& model) {
  // The mass matrix of a modal chain is dense.
  const bool dense = !model.tree().chains.empty();
  std::vector<std::vector<int>> on(model.velocities());
  std::vector<int> last(model.bodies().size(), -1);  // last velocity of a body, or of the nearest ancestor with one
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    int before = dense ? (order_.empty() ? -1 : order_.back()) : body.parent < 0 ? -1 : last[body.parent];
    for (int k = 0; k < velocity_count(body.description.joint.type); ++k) {
      const int v = body.v + k;
      if (before >= 0) {
        on[v].push_back(before);
        on[v].insert(on[v].end(), on[before].begin(), on[before].end());
      }
      order_.push_back(v);
      before = v;
    }
    last[i] = before;
  }
  begin_.push_back(0);
  for (const std::vector<int>& row : on) {
    on_.insert(on_.end(), row.begin(), row.end());
    begin_.push_back(on_.size());
  }
  L_.resize(on_.size());
  inverse_.resize(rows());
}

// M => L of M = L^T L, eliminating velocities from the tips to the roots within the pattern.
void BranchCholesky::factor(const Eigen::MatrixXd& M) {
  for (const int i : order_) {
    inverse_[i] = M(i, i);
    for (std::size_t e = begin_[i]; e < begin_[i + 1]; ++e) L_[e] = i > on_[e] ? M(i, on_[e]) : M(on_[e], i);
  }
  for (std::size_t n = rows(); n-- > 0;) {
    const int k = order_[n];
    inverse_[k] = 1 / std::sqrt(inverse_[k]);
    double* const row = L_.data() + begin_[k];
    const std::size_t count = begin_[k + 1] - begin_[k];
    for (std::size_t a = 0; a < count; ++a) row[a] *= inverse_[k];
    // The ancestors of a velocity in k's row are the velocities that follow it in that row.
    for (std::size_t a = 0; a < count; ++a) {
      const int i = on_[begin_[k] + a];
      inverse_[i] -= row[a] * row[a];
      subtract(row[a], row + a + 1, L_.data() + begin_[i], count - a - 1);
    }
  }
}

// B => X = M^-1 B, by L^T Y = B and L X = Y, several right-hand sides at a time.
void BranchCholesky::solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X) {
  const auto columns = static_cast<std::size_t>(B.cols());
  const std::size_t blocks = (columns + kBlock - 1) / kBlock, stride = blocks * kBlock;
  X_.assign(rows() * stride, 0.0);
  for (std::size_t i = 0; i < rows(); ++i) {
    for (std::size_t k = 0; k < columns; ++k)
      X_[i * stride + k] = B(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
  }
  const auto row = [&](int i) { return X_.data() + static_cast<std::size_t>(i) * stride; };
  for (std::size_t n = rows(); n-- > 0;) {  // L^T Y = B
    const int i = order_[n];
    scale(inverse_[i], row(i), blocks);
    for (std::size_t e = begin_[i]; e < begin_[i + 1]; ++e) subtract_blocks(L_[e], row(i), row(on_[e]), blocks);
  }
  for (const int i : order_) {  // L X = Y
    for (std::size_t e = begin_[i]; e < begin_[i + 1]; ++e) subtract_blocks(L_[e], row(on_[e]), row(i), blocks);
    scale(inverse_[i], row(i), blocks);
  }
  X.resize(B.rows(), B.cols());
  for (std::size_t k = 0; k < columns; ++k) {
    for (std::size_t i = 0; i < rows(); ++i)
      X(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = X_[i * stride + k];
  }
}

}  // namespace grapnel
