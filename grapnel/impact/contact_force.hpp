#pragma once

/// @file
/// Normal force of a compliant contact over its deformation.

#include "grapnel/impact/compliant_impact.hpp"

namespace grapnel {

struct NormalForce {
  double elastic = 0;  // of the spring alone [N]
  double total = 0;    // with the damper, signed: where it is negative the surfaces do not touch [N]
  double energy = 0;   // of the spring [J]
};

/// (12.4)-(12.6). `deformation` d [m], zero force for d <= 0 (but for kelvin_voigt's damper, which knows no d);
/// `rate` d' [m/s].
NormalForce normal_force(const CompliantContact& contact, double deformation, double rate);

/// Largest deformation of a lossless central impact at `speed` between bodies that the spring feels as `mass`, (12.15).
double largest_deformation(const CompliantContact& contact, double mass, double speed);

}  // namespace grapnel
