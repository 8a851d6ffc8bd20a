#pragma once

/// @file
/// Poses, twists and Jacobians of bodies and frames (2.1). Public, kept stable.

#include <Eigen/Core>
#include <vector>

#include "grapnel/dynamics/link_motion.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel {

/// Poses and twists of all bodies at one state.
struct Kinematics {
  std::vector<Posed> X_WB;                // per body; forward_kinematics
  std::vector<Twistd> V_WB;               // per body, at its frame's origin, in W [rad/s, m/s]; forward_kinematics
  std::vector<LinkMotion<double>> links;  // of the kernels' tree

  Kinematics() = default;
  explicit Kinematics(const Model& model);
};

/// Computes `kinematics`. @throws std::invalid_argument if the sizes of state or output do not match the model.
void forward_kinematics(const Model& model, const State& state, Kinematics& kinematics);
Kinematics forward_kinematics(const Model& model, const State& state);
/// The second half of forward_kinematics(): X_WB and V_WB of all bodies from kinematics.links.
void place_bodies(const Model& model, Kinematics& kinematics);

/// Pose X_WE of a frame, and its twist V_WE at E's origin in W.
Posed frame_pose(const Model& model, const Kinematics& kinematics, int frame);
Twistd frame_twist(const Model& model, const Kinematics& kinematics, int frame);

/// Jacobian of a point fixed on a body, 6 x velocities: the twist [angular; linear] of the body at the point, in W, is
/// J v (2.1). The columns of a free root are J_b, those of the joints J_m. `p_WP`: the point's position in W. With
/// modal joints the result is J Pi of modal_chains.hpp.
void point_jacobian(const Model& model, const Kinematics& kinematics, int body, const Vector3d& p_WP,
                    Eigen::Ref<Eigen::MatrixXd> J);
/// Jacobian of a frame at its origin.
Eigen::MatrixXd frame_jacobian(const Model& model, const Kinematics& kinematics, int frame);

// Accelerations of bodies in the world, from parent to child. Independent of the kernels, which work in the links' own
// frames.

/// Ordinary accelerations in W.
struct BodyAcceleration {
  Vector3d angular;  // [rad/s^2]
  Vector3d linear;   // of the body frame's origin [m/s^2]
};

/// Accelerations of all bodies for the accelerations `vdot` (empty: zero, leaving the velocity-dependent terms).
std::vector<BodyAcceleration> body_accelerations(const Model& model, const Kinematics& kinematics,
                                                 std::span<const double> vdot);

}  // namespace grapnel
