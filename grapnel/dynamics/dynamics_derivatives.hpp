#pragma once

/// @file
/// Analytical derivatives of inverse and forward dynamics in O(n d), d the depth of the tree: section 27 of
/// docs/theory. Public, kept stable (grapnel/api/dynamics_derivatives.hpp).
///
/// Derivatives with respect to q are with respect to the displacement xi of dynamics/linearization.hpp, with the order
/// and the axes of State::v: to first order the displaced coordinates are q + qdot(q, xi), with qdot of
/// coordinate_rates(). A joint: its position. A free root: a rotation vector and a displacement in the axes of B. A
/// spherical joint: a rotation vector in the axes of the child. The numbers in State::v stay the same.
///
/// External wrenches keep their components in W and the point of their body. Gravity keeps its direction in W. Springs,
/// friction, controllers and couplings of joints have no effect, as in forward_dynamics(): add the derivatives of their
/// generalized forces by the chain rule, dvdot/dx += dtau * (dforce/dx); for springs see
/// spring_forces().

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

/// Row-major, as NumPy's arrays.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Of tau = inverse_dynamics(); rows: forces, columns: velocities.
struct InverseDynamicsDerivatives {
  std::vector<double> tau;
  RowMatrix dq, dv;
  RowMatrix dvdot;  // the mass matrix; with modal joints the unprojected one
};

/// Of vdot = forward_dynamics(); rows: accelerations.
struct ForwardDynamicsDerivatives {
  std::vector<double> vdot;
  RowMatrix dq, dv;
  RowMatrix dtau;     // inverse mass matrix
  RowMatrix dwrench;  // six columns [moment; force] in W for each of Forces::external
};

/// Velocities with given accelerations, as those of a held base: one entry per velocity each; empty: none. The joints
/// of a modal chain are prescribed together or not at all.
struct PrescribedMotion {
  std::vector<std::uint8_t> prescribed;
  std::vector<double> vdot;  // read where prescribed
};

/// Scratch for one model; create one per thread. The functions below do not allocate after its construction if their
/// results have the right sizes, except for models with modal joints.
class DerivativesWorkspace;
std::shared_ptr<DerivativesWorkspace> make_derivatives_workspace(const Model& model);

/// @throws std::invalid_argument if a size does not match the model.
void inverse_dynamics_derivatives(const Model& model, const State& state, const std::vector<double>& vdot,
                                  const Forces& forces, DerivativesWorkspace& workspace,
                                  InverseDynamicsDerivatives& result);
InverseDynamicsDerivatives inverse_dynamics_derivatives(const Model& model, const State& state,
                                                        const std::vector<double>& vdot, const Forces& forces = {});

/// With prescribed accelerations, their rows are zero, as are their columns of dtau.
/// @throws std::invalid_argument if a size does not match the model.
void forward_dynamics_derivatives(const Model& model, const State& state, const Forces& forces,
                                  DerivativesWorkspace& workspace, ForwardDynamicsDerivatives& result,
                                  const PrescribedMotion& given = {});
ForwardDynamicsDerivatives forward_dynamics_derivatives(const Model& model, const State& state,
                                                        const Forces& forces = {}, const PrescribedMotion& given = {});

/// Forces of the springs and dampers of joints (JointDescription::spring), and their derivatives with respect to the
/// same joint's position and rate; one entry per velocity. With them as Forces::generalized, the derivatives of forward
/// dynamics are dq + dtau diag(spring.dq) and dv + dtau diag(spring.dv).
struct SpringForces {
  std::vector<double> force;
  std::vector<double> dq, dv;
};
SpringForces spring_forces(const Model& model, const State& state);

/// Inertial parameters phi of a body, about its frame's origin in its axes: mass, first moment (mass times centre of
/// mass: x, y, z), and rotational inertia about the origin (xx, yy, zz, xy, xz, yz).
inline constexpr int kRegressorColumns = 10;

/// d tau / d phi of inverse_dynamics(): ten columns per body, in the order of Model::bodies(). tau is linear in phi.
/// For forward dynamics, d vdot / d phi = -dtau * inertial_regressor() at its accelerations. Allocates.
/// @throws std::invalid_argument if a size does not match the model.
RowMatrix inertial_regressor(const Model& model, const State& state, const std::vector<double>& vdot,
                             const Vector3d& gravity = Vector3d::zero());

}  // namespace grapnel
