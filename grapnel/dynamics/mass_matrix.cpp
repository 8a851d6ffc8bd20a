#include "grapnel/dynamics/mass_matrix.hpp"

#include "grapnel/dynamics/composite_body.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/dynamics/newton_euler.hpp"

namespace grapnel {

void mass_matrix(const Model& model, const State& state, Workspace& workspace, Eigen::MatrixXd& M) {
  M.resize(model.velocities(), model.velocities());
  // A symmetric matrix has the same row-major and column-major storage.
  composite_body<double>(model.tree(), state.q, workspace.kernel, std::span<double>(M.data(), M.size()));
  project_mass_matrix(model.tree(), M);
}

Eigen::MatrixXd mass_matrix(const Model& model, const State& state) {
  Workspace workspace(model);
  Eigen::MatrixXd M;
  mass_matrix(model, state, workspace, M);
  return M;
}

void bias(const Model& model, const State& state, const Vector3d& gravity, Workspace& workspace,
          std::vector<double>& c) {
  c.resize(model.velocities());
  DynamicsInput<double> in;
  in.q = state.q, in.v = state.v, in.gravity = gravity;
  newton_euler<double>(model.tree(), in, workspace.kernel, c);
}

}  // namespace grapnel
