#pragma once

/// @file
/// Forward and inverse dynamics of a model. Public, kept stable.

#include <span>
#include <string>
#include <vector>

#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Scratch for one model; create one per thread. No function allocates after its construction.
struct Workspace {
  DynamicsWorkspace<double> kernel;
  std::vector<Wrenchd> link_wrench;  // external wrenches, gathered on the links
  std::vector<double> force;         // generalized forces written by the kernels
  std::vector<double> square;        // velocities x velocities
  Kinematics kinematics;

  explicit Workspace(const Model& model);
};

/// A wrench on a body, in W [N m; N], about the point p_WP.
struct ExternalWrench {
  int body;
  Vector3d p_WP;
  Wrenchd F_W;
};

/// Forces on a model. Empty vectors mean zero.
struct Forces {
  std::vector<double> generalized;  // per velocity: joint torques; for a free root the wrench on B, in B, at its origin
  std::vector<ExternalWrench> external;
  Vector3d gravity = Vector3d::zero();  // uniform, in W [m/s^2]
};

/// Accelerations vdot of (2.7) in O(n). `vdot` is resized to the number of velocities (no allocation if it has that
/// size). @throws std::invalid_argument if a size does not match the model.
void forward_dynamics(const Model& model, const State& state, const Forces& forces, Workspace& workspace,
                      std::vector<double>& vdot);
std::vector<double> forward_dynamics(const Model& model, const State& state, const Forces& forces = {});

/// Generalized forces required for the accelerations `vdot`, in addition to `forces.external` and gravity
/// (`forces.generalized` is not read).
void inverse_dynamics(const Model& model, const State& state, const std::vector<double>& vdot, const Forces& forces,
                      Workspace& workspace, std::vector<double>& tau);
std::vector<double> inverse_dynamics(const Model& model, const State& state, const std::vector<double>& vdot,
                                     const Forces& forces = {});

/// Sums external wrenches per link of the kernels' tree, in the links' frames; workspace.kinematics must be current.
void gather_external(const Model& model, std::span<const ExternalWrench> external, Workspace& workspace);

/// Rates of the coordinates: positions move with R v, quaternions by q o (0, w)/2, joints by their rate.
void coordinate_rates(const Model& model, std::span<const double> q, std::span<const double> v, std::span<double> qdot);

}  // namespace grapnel
