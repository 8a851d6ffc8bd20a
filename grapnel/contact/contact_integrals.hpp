#pragma once

/// @file
/// Integrals of contacts over a motion. Without functions, since files of SIMD lanes include it.

namespace grapnel {

/// Integrals of a group of contacts (GroupContact) over a phase or an impact.
struct ContactIntegrals {
  double work = 0;      // of the forces on both bodies [J]
  double damping = 0;   // dissipated by normal forces [J]
  double friction = 0;  // dissipated by friction [J]
  double impulse = 0;   // of the magnitude of the normal forces [N s]
  double slip = 0;      // path of the largest slip velocity [m]
};

}  // namespace grapnel
