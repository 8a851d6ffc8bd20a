#include "grapnel/dynamics/forward_dynamics.hpp"

#include <stdexcept>

#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/newton_euler.hpp"

namespace grapnel {
namespace {

void check(const Model& model, const State& state, const Workspace& workspace, const char* function) {
  if (static_cast<int>(state.q.size()) != model.coordinates() ||
      static_cast<int>(state.v.size()) != model.velocities()) {
    throw std::invalid_argument(std::string(function) + ": the state has another model's size");
  }
  if (workspace.kernel.links.size() != model.tree().links.size() ||
      static_cast<int>(workspace.force.size()) != model.velocities()) {
    throw std::invalid_argument(std::string(function) + ": the workspace was made for another model");
  }
}

// External wrenches need poses; without them the kernels work in the links' own frames alone.
std::span<const Wrenchd> external_wrenches(const Model& model, const State& state, const Forces& forces,
                                           Workspace& workspace) {
  if (forces.external.empty()) return {};
  forward_kinematics(model, state, workspace.kinematics);
  gather_external(model, forces.external, workspace);
  return workspace.link_wrench;
}

}  // namespace

Workspace::Workspace(const Model& model)
    : kernel(model.tree()),
      link_wrench(model.tree().links.size()),
      force(model.velocities()),
      square(model.velocities() * model.velocities()),
      kinematics(model) {}

void gather_external(const Model& model, std::span<const ExternalWrench> external, Workspace& workspace) {
  for (Wrenchd& F : workspace.link_wrench) F = Wrenchd::zero();
  for (const ExternalWrench& e : external) {
    const int link = model.bodies().at(e.body).placement.link;
    const Posed& X_WL = workspace.kinematics.links[link].X_WL;
    workspace.link_wrench[link] += transposed_times(X_WL.R, shift(e.F_W, X_WL.p - e.p_WP));
  }
}

// State and forces => vdot (2.7), by articulated_body().
void forward_dynamics(const Model& model, const State& state, const Forces& forces, Workspace& workspace,
                      std::vector<double>& vdot) {
  check(model, state, workspace, "forward_dynamics");
  if (!forces.generalized.empty() && static_cast<int>(forces.generalized.size()) != model.velocities()) {
    throw std::invalid_argument("forward_dynamics: generalized forces have another model's size");
  }
  vdot.resize(model.velocities());
  DynamicsInput<double> in;
  in.q = state.q, in.v = state.v, in.gravity = forces.gravity;
  in.link_wrench = external_wrenches(model, state, forces, workspace);
  if (forces.generalized.empty()) {
    for (double& f : workspace.force) f = 0;
    in.force = workspace.force;
  } else {
    in.force = forces.generalized;
  }
  articulated_body<double>(model.tree(), in, workspace.kernel, vdot, workspace.force);
}

std::vector<double> forward_dynamics(const Model& model, const State& state, const Forces& forces) {
  Workspace workspace(model);
  std::vector<double> vdot;
  forward_dynamics(model, state, forces, workspace, vdot);
  return vdot;
}

void inverse_dynamics(const Model& model, const State& state, const std::vector<double>& vdot, const Forces& forces,
                      Workspace& workspace, std::vector<double>& tau) {
  check(model, state, workspace, "inverse_dynamics");
  if (static_cast<int>(vdot.size()) != model.velocities()) {
    throw std::invalid_argument("inverse_dynamics: the accelerations have another model's size");
  }
  tau.resize(model.velocities());
  DynamicsInput<double> in;
  in.q = state.q, in.v = state.v, in.gravity = forces.gravity, in.acceleration = vdot;
  in.link_wrench = external_wrenches(model, state, forces, workspace);
  newton_euler<double>(model.tree(), in, workspace.kernel, tau);
}

std::vector<double> inverse_dynamics(const Model& model, const State& state, const std::vector<double>& vdot,
                                     const Forces& forces) {
  Workspace workspace(model);
  std::vector<double> tau;
  inverse_dynamics(model, state, vdot, forces, workspace, tau);
  return tau;
}

void coordinate_rates(const Model& model, std::span<const double> q, std::span<const double> v,
                      std::span<double> qdot) {
  coordinate_rates<double>(model.tree(), q, v, qdot);
}

}  // namespace grapnel
