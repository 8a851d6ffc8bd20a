#include "grapnel/dynamics/modal_chains.hpp"

#include <vector>

namespace grapnel {

// A => A Pi, with Pi = S S^T for the orthonormal shapes S of each chain.
void project_columns(const Tree<double>& tree, Eigen::Ref<Eigen::MatrixXd> A) {
  for (const ModalChain& chain : tree.chains) {
    const auto modes = static_cast<std::size_t>(chain.modes);
    const auto joints = static_cast<int>(chain.velocities.size());
    std::vector<double> share(modes);
    for (Eigen::Index row = 0; row < A.rows(); ++row) {
      std::fill(share.begin(), share.end(), 0.0);
      for (int j = 0; j < joints; ++j) {
        for (std::size_t k = 0; k < modes; ++k) share[k] += A(row, chain.velocities[j]) * chain.row(j)[k];
      }
      for (int j = 0; j < joints; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < modes; ++k) sum += chain.row(j)[k] * share[k];
        A(row, chain.velocities[j]) = sum;
      }
    }
  }
}

// M => Pi M Pi + alpha (1 - Pi), symmetric.
void project_mass_matrix(const Tree<double>& tree, Eigen::Ref<Eigen::MatrixXd> M) {
  if (tree.chains.empty()) return;
  std::vector<double> alphas;
  for (const ModalChain& chain : tree.chains) {
    double sum = 0;
    for (const int v : chain.velocities) sum += M(v, v);
    alphas.push_back(sum / static_cast<double>(chain.velocities.size()));
  }
  project_columns(tree, M);
  Eigen::MatrixXd transposed = M.transpose();
  project_columns(tree, transposed);
  M = 0.5 * (transposed + transposed.transpose());  // exactly symmetric, as M was
  for (std::size_t c = 0; c < tree.chains.size(); ++c) {
    const ModalChain& chain = tree.chains[c];
    for (std::size_t i = 0; i < chain.velocities.size(); ++i) {
      for (std::size_t j = 0; j < chain.velocities.size(); ++j) {
        double shared = i == j ? 1 : 0;
        for (int k = 0; k < chain.modes; ++k)
          shared -= chain.row(static_cast<int>(i))[k] * chain.row(static_cast<int>(j))[k];
        M(chain.velocities[i], chain.velocities[j]) += alphas[c] * shared;
      }
    }
  }
}

}  // namespace grapnel
