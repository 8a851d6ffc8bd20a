#include "grapnel/dynamics/dynamics_derivatives.hpp"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "grapnel/dynamics/derivatives_workspace.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {
namespace derivatives {

void check_size(const Model& model, const State& state, const DerivativesWorkspace& workspace, const char* function) {
  const auto fail = [&](const char* text) { throw std::invalid_argument(std::string(function) + ": " + text); };
  if (static_cast<int>(state.q.size()) != model.coordinates() || static_cast<int>(state.v.size()) != model.velocities())
    fail("the state has another model's size");
  if (workspace.tree().links.size() != model.tree().links.size() || workspace.size() != model.velocities())
    fail("the workspace was made for another model");
}

void check_size(const Model& model, std::size_t size, const char* function, const char* what) {
  if (static_cast<int>(size) == model.velocities()) return;
  throw std::invalid_argument(std::string(function) + ": " + what + " have another model's size");
}

}  // namespace derivatives

using derivatives::check_size;

std::shared_ptr<DerivativesWorkspace> make_derivatives_workspace(const Model& model) {
  return std::make_shared<DerivativesWorkspace>(model);
}

// State, accelerations => tau and its derivatives, (28.7) and (28.8).
void inverse_dynamics_derivatives(const Model& model, const State& state, const std::vector<double>& vdot,
                                  const Forces& forces, DerivativesWorkspace& workspace,
                                  InverseDynamicsDerivatives& result) {
  check_size(model, state, workspace, "inverse_dynamics_derivatives");
  check_size(model, vdot.size(), "inverse_dynamics_derivatives", "the accelerations");
  result.tau.resize(vdot.size());
  workspace.move(model, state, forces, vdot);
  workspace.form_mass_matrix(vdot, result.tau);
  workspace.read_mass_matrix(result.dvdot);
  workspace.differentiate();
  workspace.read_inverse(result.dq, result.dv);
}

InverseDynamicsDerivatives inverse_dynamics_derivatives(const Model& model, const State& state,
                                                        const std::vector<double>& vdot, const Forces& forces) {
  DerivativesWorkspace workspace(model);
  InverseDynamicsDerivatives result;
  inverse_dynamics_derivatives(model, state, vdot, forces, workspace, result);
  return result;
}

// State => the forces of (22.1) at the joints, and their slopes: zero within the backlash.
SpringForces spring_forces(const Model& model, const State& state) {
  if (static_cast<int>(state.q.size()) != model.coordinates() || static_cast<int>(state.v.size()) != model.velocities())
    throw std::invalid_argument("spring_forces: the state has another model's size");
  const auto n = static_cast<std::size_t>(model.velocities());
  SpringForces result{std::vector<double>(n), std::vector<double>(n), std::vector<double>(n)};
  for (const int b : model.springs()) {
    const Body& body = model.bodies()[static_cast<std::size_t>(b)];
    const JointSpring& spring = *body.description.joint.spring;
    const double q = state.q[body.q];
    const bool acts = spring.backlash == 0 || spring.deflection(q) != 0;
    result.force[body.v] = spring.effort(q) - spring.damping * state.v[body.v];
    result.dq[body.v] = acts ? -spring.stiffness : 0;
    result.dv[body.v] = -spring.damping;
  }
  return result;
}

// State, accelerations => d tau / d phi (28.13).
RowMatrix inertial_regressor(const Model& model, const State& state, const std::vector<double>& vdot,
                             const Vector3d& gravity) {
  DerivativesWorkspace workspace(model);
  check_size(model, state, workspace, "inertial_regressor");
  check_size(model, vdot.size(), "inertial_regressor", "the accelerations");
  workspace.move(model, state, {{}, {}, gravity}, vdot);
  RowMatrix dphi;
  workspace.inertial_columns(model, dphi);
  return dphi;
}

// State, forces => vdot of (2.7) and its derivatives (28.12): at these accelerations, -M^-1 times those of the inverse
// dynamics.
void forward_dynamics_derivatives(const Model& model, const State& state, const Forces& forces,
                                  DerivativesWorkspace& workspace, ForwardDynamicsDerivatives& result,
                                  const PrescribedMotion& given) {
  workspace.accelerate_freely(model, state, forces, given, "forward_dynamics_derivatives", result.vdot);
  workspace.differentiate();
  workspace.invert(given.prescribed);
  workspace.read_forward(result.dq, result.dv, result.dtau);
  workspace.wrench_columns(model, forces.external, result.dtau, result.dwrench);
}

ForwardDynamicsDerivatives forward_dynamics_derivatives(const Model& model, const State& state, const Forces& forces,
                                                        const PrescribedMotion& given) {
  DerivativesWorkspace workspace(model);
  ForwardDynamicsDerivatives result;
  forward_dynamics_derivatives(model, state, forces, workspace, result, given);
  return result;
}

}  // namespace grapnel
