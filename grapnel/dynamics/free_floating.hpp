#pragma once

/// @file
/// A robot with a floating base: base motion from momentum, and the equations reduced to the joints (2.3)-(2.8).
///
/// All functions apply to the tree rooted at `root` (the servicer) and ignore other trees of the model, such as
/// targets. n is the number of that tree's joint velocities, in the order of `joint_velocities`. For a root fixed to
/// the world the base quantities are empty (6 x 0 etc.) and the reduced quantities are those of a fixed base. Public,
/// kept stable.

#include <Eigen/Core>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {

/// Indices into State::v of the velocities of the tree's joints (all but the root's own).
std::vector<int> joint_velocities(const Model& model, int root);

/// Blocks of the mass matrix (2.7).
struct MassBlocks {
  Eigen::MatrixXd I_b;   // base inertia, 6 x 6, in B at B's origin
  Eigen::MatrixXd I_bm;  // coupling inertia, 6 x n
  Eigen::MatrixXd I_m;   // n x n
};
MassBlocks mass_blocks(const Model& model, const State& state, int root);
/// Extracts the blocks of a tree from the whole model's mass matrix.
MassBlocks mass_blocks(const Model& model, const Eigen::MatrixXd& mass_matrix, int root);

/// Generalized Jacobian of a frame, J_g = J_m - J_b I_b^-1 I_bm (2.5), 6 x n: twist of the frame in W per joint rate at
/// zero momentum.
Eigen::MatrixXd generalized_jacobian(const Model& model, const State& state, int root, int frame);
/// The same for a body's point at p_WP.
Eigen::MatrixXd generalized_jacobian(const Model& model, const State& state, int root, int body, const Vector3d& p_WP);
/// Where kinematics and mass matrix are known.
Eigen::MatrixXd generalized_jacobian(const Model& model, const Kinematics& kinematics, const MassBlocks& blocks,
                                     int root, int body, const Vector3d& p_WP);
/// The part of a frame's twist that total momentum carries, J_b I_b^-1 [momentum about the base] (second term of
/// (2.3)).
Eigen::VectorXd momentum_twist(const Model& model, const State& state, int root, int body, const Vector3d& p_WP,
                               const Momentumd& momentum);

/// Base twist V_WB at B's origin in W for joint rates as in `state` and the tree's total momentum `momentum` =
/// [about the tree's centre of mass; linear] in W: I_b^-1 (h - I_bm rates), which is (2.6) where the momentum is zero.
Twistd base_twist_from_momentum(const Model& model, const State& state, int root, const Momentumd& momentum);
Twistd base_twist_from_momentum(const Model& model, const State& state, const Kinematics& kinematics,
                                const MassBlocks& blocks, int root, const Momentumd& momentum);

/// The equation of motion reduced to the joints (2.8), I thetaddot + c = tau.
struct ReducedEquation {
  Eigen::MatrixXd I;    // generalized inertia I_m - I_bm^T I_b^-1 I_bm
  Eigen::VectorXd c;    // c_m - I_bm^T I_b^-1 c_b
  Eigen::VectorXd tau;  // tau_m - I_bm^T I_b^-1 F_b
};
/// `generalized` as in Forces::generalized. External wrenches enter through generalized_jacobian^T F.
ReducedEquation reduced_equation(const Model& model, const State& state, int root,
                                 const std::vector<double>& generalized, const Vector3d& gravity = Vector3d::zero());
/// The generalized inertia alone.
Eigen::MatrixXd generalized_inertia(const Model& model, const State& state, int root);
Eigen::MatrixXd generalized_inertia(const MassBlocks& blocks);

}  // namespace grapnel
