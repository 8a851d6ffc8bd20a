#pragma once

/// @file
/// Analytical derivatives of the dynamics for many states of one model, one state per SIMD lane, with the conventions
/// of dynamics_derivatives.hpp. Public, kept stable (grapnel/api/dynamics_derivatives.hpp).

#include <span>
#include <vector>

#include "grapnel/model/model.hpp"

namespace grapnel {

/// One state after another: vectors of velocities numbers, row-major matrices of velocities x velocities.
struct BatchedDerivatives {
  std::vector<double> value;     // accelerations of forward dynamics; forces of inverse dynamics
  std::vector<double> dq, dv;    // of the value
  std::vector<double> by_input;  // of the value, by the forces of forward, the accelerations of inverse dynamics
};

/// Derivatives of forward dynamics at n states: q has n times Model::coordinates() numbers, v and tau n times
/// Model::velocities(). On the calling thread; the result of a state does not depend on the others. Models with modal
/// joints are evaluated state by state. @throws std::invalid_argument if the sizes do not match.
BatchedDerivatives batched_forward_dynamics_derivatives(const Model& model, std::span<const double> q,
                                                        std::span<const double> v, std::span<const double> tau,
                                                        const Vector3d& gravity = Vector3d::zero());
/// The same of inverse dynamics at the accelerations vdot.
BatchedDerivatives batched_inverse_dynamics_derivatives(const Model& model, std::span<const double> q,
                                                        std::span<const double> v, std::span<const double> vdot,
                                                        const Vector3d& gravity = Vector3d::zero());

}  // namespace grapnel
