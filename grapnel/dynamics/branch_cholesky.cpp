#include "grapnel/dynamics/branch_cholesky.hpp"

#include <cmath>

namespace grapnel {

BranchCholesky::BranchCholesky(const Model& model)
    : supporting_(model.velocities()), L_(model.velocities(), model.velocities()) {
  // Joints that move by modes share them: their mass matrix has no zeros to count on.
  const bool dense = !model.tree().chains.empty();
  std::vector<int> last(model.bodies().size(), -1);  // velocity of a body or of the nearest that carries it
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    int before = dense ? (order_.empty() ? -1 : order_.back()) : body.parent < 0 ? -1 : last[body.parent];
    for (int k = 0; k < velocity_count(body.description.joint.type); ++k) {
      const int v = body.v + k;
      if (before >= 0) {
        supporting_[v].push_back(before);
        supporting_[v].insert(supporting_[v].end(), supporting_[before].begin(), supporting_[before].end());
      }
      order_.push_back(v);
      before = v;
    }
    last[i] = before;
  }
}

void BranchCholesky::factor(const Eigen::MatrixXd& M) {
  for (const int i : order_) {
    L_(i, i) = M(i, i);
    for (const int j : supporting_[i]) L_(i, j) = i > j ? M(i, j) : M(j, i);
  }
  for (std::size_t n = order_.size(); n-- > 0;) {
    const int k = order_[n];
    const std::vector<int>& on = supporting_[k];
    const double inverse = 1 / std::sqrt(L_(k, k));
    L_(k, k) = inverse;
    for (const int i : on) L_(k, i) *= inverse;
    for (std::size_t a = 0; a < on.size(); ++a) {
      const int i = on[a];
      for (std::size_t b = a; b < on.size(); ++b) L_(i, on[b]) -= L_(k, i) * L_(k, on[b]);
    }
  }
}

void BranchCholesky::solve(RightSides& X) const {
  for (std::size_t n = order_.size(); n-- > 0;) {  // L^T Y = X
    const int i = order_[n];
    X.row(i) *= L_(i, i);
    for (const int j : supporting_[i]) X.row(j) -= L_(i, j) * X.row(i);
  }
  for (const int i : order_) {  // L X = Y
    for (const int j : supporting_[i]) X.row(i) -= L_(i, j) * X.row(j);
    X.row(i) *= L_(i, i);
  }
}

}  // namespace grapnel
