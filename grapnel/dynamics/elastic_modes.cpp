#include "grapnel/dynamics/elastic_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/model/tree.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Coordinates d with springs: single joints, and the modes of chains.
struct Sprung {
  MatrixXd shapes;               // velocities x coordinates
  MatrixXd stiffness, damping;   // over the coordinates
  std::vector<std::uint8_t> is;  // per velocity: whether its joint has a spring
};

// Model and locked velocities => coordinates with springs that can move, and their stiffness and damping matrices.
Sprung sprung_coordinates(const Model& model, std::span<const int> locked) {
  const auto is_locked = [&](int v) { return std::find(locked.begin(), locked.end(), v) != locked.end(); };
  const auto n = static_cast<Index>(model.velocities());
  Sprung sprung;
  sprung.is.resize(n);
  VectorXd k = VectorXd::Zero(n), c = VectorXd::Zero(n);
  std::vector<VectorXd> columns;
  for (const int body : model.springs()) {
    const Body& b = model.bodies()[body];
    const TreeLink<double>& link = model.tree().links[b.placement.link];
    sprung.is[b.v] = 1;
    k[b.v] = b.description.joint.spring->stiffness, c[b.v] = b.description.joint.spring->damping;
    if (link.chain < 0) {
      if (!is_locked(b.v)) columns.push_back(VectorXd::Unit(n, b.v));
      continue;
    }
    const ModalChain& chain = model.tree().chains[link.chain];
    if (link.member > 0 || std::any_of(chain.velocities.begin(), chain.velocities.end(), is_locked)) continue;
    for (int mode = 0; mode < chain.modes; ++mode) {
      columns.push_back(VectorXd::Zero(n));
      for (std::size_t j = 0; j < chain.velocities.size(); ++j)
        columns.back()[chain.velocities[j]] = chain.row(static_cast<int>(j))[mode];
    }
  }
  sprung.shapes.resize(n, static_cast<Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) sprung.shapes.col(static_cast<Index>(i)) = columns[i];
  sprung.stiffness = sprung.shapes.transpose() * k.asDiagonal() * sprung.shapes;
  sprung.damping = sprung.shapes.transpose() * c.asDiagonal() * sprung.shapes;
  return sprung;
}

}  // namespace

// State => modes of vibration: eliminates the coordinates without springs (22.7) and solves L^-1 M* L^-T z = z /
// omega^2, K = L L^T.
std::vector<ElasticMode> elastic_modes(const Model& model, const State& state, std::span<const int> locked) {
  const Sprung sprung = sprung_coordinates(model, locked);
  const Index n = sprung.shapes.cols();
  if (n == 0) return {};
  std::vector<int> others;  // velocities
  for (int v = 0; v < model.velocities(); ++v) {
    if (!sprung.is[v] && std::find(locked.begin(), locked.end(), v) == locked.end()) others.push_back(v);
  }
  const MatrixXd M = mass_matrix(model, state), M_d = M * sprung.shapes;
  MatrixXd reduced = sprung.shapes.transpose() * M_d;
  MatrixXd follow;  // response of the coordinates without springs: y = -follow d
  if (!others.empty()) {
    const MatrixXd M_yd = M_d(others, Eigen::all);
    follow = cholesky_solution(Cholesky(MatrixXd(M(others, others))), M_yd);
    reduced -= M_yd.transpose() * follow;
  }
  // With K = L L^T and d = L^-T z: L^-1 M* L^-T z = z / omega^2.
  const Cholesky root(sprung.stiffness);
  const MatrixXd half = lower_solution(root, reduced);
  const MatrixXd scaled = lower_solution(root, MatrixXd(half.transpose()));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(0.5 * (scaled + scaled.transpose())));
  std::vector<ElasticMode> modes;
  for (Index i = n; i-- > 0;) {
    const double omega = 1 / std::sqrt(solver.eigenvalues()[i]);
    if (!std::isfinite(omega)) continue;  // a massless sprung coordinate
    const VectorXd d = omega * upper_solution(root, VectorXd(solver.eigenvectors().col(i)));
    ElasticMode mode;
    mode.frequency = omega / (2 * std::numbers::pi);
    mode.shape = sprung.shapes * d;
    mode.damping_ratio = d.dot(sprung.damping * d) / (2 * omega);
    if (!others.empty()) mode.shape(others) = VectorXd(-follow * d);
    modes.push_back(std::move(mode));
  }
  return modes;
}

VectorXd participation(const Model& model, const State& state, const ElasticMode& mode, int body) {
  const int v = model.bodies().at(body).v;
  return mass_matrix(model, state).middleRows(v, 6) * mode.shape;
}

}  // namespace grapnel
