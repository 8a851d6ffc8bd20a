#pragma once

/// @file
/// Settings of impacts, as plain data: parts of CaptureProblem.

namespace grapnel {

/// The end of the restitution of a contact. newton: its normal velocity is -e times the one before. poisson: the normal
/// impulse of restitution is e times that of compression. stronge: the work of the normal force in restitution is -e^2
/// times that in compression.
enum class RestitutionHypothesis { newton, poisson, stronge };

/// Normal force of a contact over the deformation d >= 0 and its rate.
/// kelvin_voigt: max(0, k d + c d').  hertz: k d^(3/2).  hunt_crossley: max(0, k d^n (1 + a d')).
enum class ContactForceModel { kelvin_voigt, hertz, hunt_crossley };

/// Limits and accuracy of the integration of a compliant impact.
struct CompliantSetup {
  double longest = 1;  // maximum duration of the integration [s]
  /// Grasps are at rest when the kinetic energy of their relative motion stays below this fraction of its initial value
  /// for a whole period of the slowest spring. (Springs stay stressed if the joined bodies rotate.)
  double settled = 1e-8;
  /// Approximate error of velocities, impulses, and of these times the shortest time scale of the springs, relative to
  /// the maximum change in a rigid impact; forces between steps' ends are less accurate.
  double relative_tolerance = 1e-12;
  // minimum number of samples of the histories (if the impact lasts that long); up to twice that; plus two at events
  int samples = 400;
  long max_steps = 2'000'000;
};

}  // namespace grapnel
