#pragma once

/// @file
/// A torque-free axisymmetric body, in closed form.

#include <cmath>

#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel::oracle {

/// Moments `transverse` about the body's x and y, `axial` about its z, centre of mass at the body's origin.
///
/// Euler's equations give constant w_z and w_x' = -r w_y, w_y' = r w_x with r = (axial/transverse - 1) w_z, so that the
/// angular velocity circles the body's z at rate r (1). The angular momentum h is constant in W, and
/// w = h/transverse - r z (2): the motion is a turn about the body's z at -r followed by one about h at |h|/transverse,
///   R_WB(t) = exp(t h/transverse) R_WB(0) exp(-t r z) (3).
struct SymmetricTop {
  double transverse, axial;  // [kg m^2]
  Posed X_WB;                // at t = 0
  Vector3d w_B;              // angular velocity in B at t = 0
  Vector3d v_W;              // velocity of the centre of mass in W

  double body_rate() const { return (axial / transverse - 1) * w_B[2]; }
  Vector3d angular_momentum_W() const {
    return X_WB.R * Vector3d{transverse * w_B[0], transverse * w_B[1], axial * w_B[2]};
  }

  Vector3d angular_velocity_B(double t) const {  // (1)
    const double c = std::cos(body_rate() * t), s = std::sin(body_rate() * t);
    return {c * w_B[0] - s * w_B[1], s * w_B[0] + c * w_B[1], w_B[2]};
  }
  Posed pose(double t) const {  // (3)
    const Vector3d h = angular_momentum_W();
    const double size = norm(h);
    const Rotationd turn = size > 0 ? rotation_about((1 / size) * h, size / transverse * t) : Rotationd::identity();
    return {turn * X_WB.R * rotation_about({0, 0, 1}, -body_rate() * t), X_WB.p + t * v_W};
  }
};

}  // namespace grapnel::oracle
