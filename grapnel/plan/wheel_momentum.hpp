#pragma once

/// @file
/// Momentum of reaction wheels that hold the base's attitude while the joints move. The base does not rotate. With L
/// the total angular momentum about the centre of mass, in W, the wheels have relative to the base, in B, the momentum
///   h = H - u,   H = R^T L,   u = sum_j k_j theta_dot_j  ((5) of floating_base.hpp)                                (1)
/// They share torques by (17.2), and their torque-free null motion follows (18.7). With A the wheels' axes, J their
/// moments of inertia and N = 1 - A^+ A
///   J Omega = A^+ h + N J [Omega_d + (Omega_0 - Omega_d) e^(-r (t - t_0))]                                         (2)
/// if the motors deliver the commanded torques. Omega_0 are the rates at t_0, and Omega_d those to which
/// wheel_speed_rate r drives them. The share of wheel i is J_i Omega_i over J_i Omega_max,i, and changes as
///   ds_i = -(row i of A^+)/(J_i Omega_max,i) . sum_j (g_j dtheta_j + k_j dtheta_dot_j)                             (3)
/// with g_j of (6) of floating_base.hpp for a base that does not rotate.

#include <string>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

struct PlannedWheel {
  std::string name;
  Vector3d row = Vector3d::zero();  // of A^+ over the wheel's maximum momentum [1/(N m s)]
  double wanted = 0, fading = 0;    // shares of (2) without h: N J Omega_d, and the decaying N J (Omega_0 - Omega_d)
};

struct WheelMomentum {
  std::vector<PlannedWheel> wheels;
  Vector3d H = Vector3d::zero();  // of (1) [N m s]
  double begin = 0;               // t_0 [s]
  double rate = 0;                // r [1/s]

  /// s_i at time t [s], for joints with the momentum u [N m s].
  double share(std::size_t wheel, double t, const Vector3d& u) const;
};

}  // namespace grapnel
