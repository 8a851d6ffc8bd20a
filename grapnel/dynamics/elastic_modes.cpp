#include "grapnel/dynamics/elastic_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"

namespace grapnel {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd block_of(const MatrixXd& M, const std::vector<int>& rows, const std::vector<int>& columns) {
  MatrixXd block(rows.size(), columns.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j)
      block(static_cast<Index>(i), static_cast<Index>(j)) = M(rows[i], columns[j]);
  }
  return block;
}

}  // namespace

std::vector<ElasticMode> elastic_modes(const Model& model, const State& state, std::span<const int> locked) {
  const auto is_locked = [&](int v) { return std::find(locked.begin(), locked.end(), v) != locked.end(); };
  std::vector<int> sprung, others;  // velocities
  std::vector<double> stiffness, damping;
  std::vector<std::uint8_t> has_spring(static_cast<std::size_t>(model.velocities()));
  for (const int body : model.springs()) {
    const Body& b = model.bodies()[body];
    has_spring[b.v] = 1;
    if (is_locked(b.v)) continue;
    sprung.push_back(b.v);
    stiffness.push_back(b.description.joint.spring->stiffness);
    damping.push_back(b.description.joint.spring->damping);
  }
  for (int v = 0; v < model.velocities(); ++v) {
    if (!has_spring[v] && !is_locked(v)) others.push_back(v);
  }
  if (sprung.empty()) return {};
  const MatrixXd M = mass_matrix(model, state);
  MatrixXd reduced = block_of(M, sprung, sprung);
  MatrixXd follow;  // what is free of springs answers: y = -follow d
  if (!others.empty()) {
    const MatrixXd M_yd = block_of(M, others, sprung);
    follow = cholesky_solution(Cholesky(block_of(M, others, others)), M_yd);
    reduced -= M_yd.transpose() * follow;
  }
  // With d = K^-1/2 z: K^-1/2 M* K^-1/2 z = z / omega^2.
  const auto n = static_cast<Index>(sprung.size());
  VectorXd root(n);
  for (Index i = 0; i < n; ++i) root[i] = 1 / std::sqrt(stiffness[static_cast<std::size_t>(i)]);
  const MatrixXd scaled = root.asDiagonal() * reduced * root.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (scaled + scaled.transpose()));
  std::vector<ElasticMode> modes;
  for (Index i = n; i-- > 0;) {
    const double omega = 1 / std::sqrt(solver.eigenvalues()[i]);
    if (!std::isfinite(omega)) continue;  // what springs hold there has no inertia
    const VectorXd d = omega * (root.asDiagonal() * solver.eigenvectors().col(i));
    ElasticMode mode;
    mode.frequency = omega / (2 * std::numbers::pi);
    mode.shape = VectorXd::Zero(model.velocities());
    double loss = 0;
    for (Index k = 0; k < n; ++k) {
      mode.shape[sprung[static_cast<std::size_t>(k)]] = d[k];
      loss += damping[static_cast<std::size_t>(k)] * d[k] * d[k];
    }
    mode.damping_ratio = loss / (2 * omega);
    if (!others.empty()) {
      const VectorXd y = -follow * d;
      for (std::size_t k = 0; k < others.size(); ++k) mode.shape[others[k]] = y[static_cast<Index>(k)];
    }
    modes.push_back(std::move(mode));
  }
  return modes;
}

VectorXd participation(const Model& model, const State& state, const ElasticMode& mode, int body) {
  const int v = model.bodies().at(body).v;
  return mass_matrix(model, state).middleRows(v, 6) * mode.shape;
}

}  // namespace grapnel
