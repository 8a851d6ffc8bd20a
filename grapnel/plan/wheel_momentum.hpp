#pragma once

/// @file
/// What reaction wheels hold while they keep the base's attitude and the joints move. The base does not turn, so of the
/// angular momentum L of everything about the centre of mass, in W, the wheels have relative to the base, in B, what
/// the joints' motion does not have,
///   h = H - u,   H = R^T L,   u = sum_j k_j theta_dot_j  ((5) of floating_base.hpp)                                (1)
/// They share torques by (17.2), and their motion that gives none by (18.7), so that with A the wheels' axes, J their
/// moments of inertia and N = 1 - A^+ A
///   J Omega = A^+ h + N J [Omega_d + (Omega_0 - Omega_d) e^(-r (t - t_0))]                                         (2)
/// where motors give what is asked of them; Omega_0 are the rates at t_0, Omega_d those that wheel_speed_rate r brings
/// them to. The share of wheel i is J_i Omega_i over J_i Omega_max,i, and changes as
///   ds_i = -(row i of A^+)/(J_i Omega_max,i) . sum_j (g_j dtheta_j + k_j dtheta_dot_j)                             (3)
/// with g_j of (6) of floating_base.hpp for a base that does not turn.

#include <string>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

struct PlannedWheel {
  std::string name;
  Vector3d row = Vector3d::zero();  // of A^+ over the wheel's largest momentum [1/(N m s)]
  double wanted = 0, fading = 0;    // shares of (2) without h: N J Omega_d, and N J (Omega_0 - Omega_d), which fades
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
