#pragma once

/// @file
/// Settings of impacts, as plain data: parts of CaptureProblem. impact_law.cpp describes their keys and contains the
/// table of laws.

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

/// Compliance of contacts (GraspSetup::contact) in a compliant impact; see CompliantContact.
struct ContactComplianceSetup {
  ContactForceModel model = ContactForceModel::kelvin_voigt;
  double stiffness = 0;
  double damping = 0;
  double exponent = 1.5;
  double slip_speed = 1e-4;  // [m/s]
};

/// Compliance of grasps; see CompliantGrasp.
struct GraspComplianceSetup {
  double linear_stiffness = 0;   // [N/m]
  double linear_damping = 0;     // [N s/m]
  double angular_stiffness = 0;  // [N m/rad]
  double angular_damping = 0;    // [N m s/rad]
};

struct ImpactSetup {
  /// plastic: grasps, exact, simultaneous. bilateral_restitution: grasps whose relative velocity is partly reversed, u+
  /// = -E u-, and that do not hold. restitution: contacts without friction. friction: contacts with Coulomb friction.
  /// compliant: grasps and contacts, resolved in time. as_published: the thesis's (3.9)-(3.13), for comparison: it does
  /// not conserve momentum, and velocities of a closed loop violate its constraints. With restitution and friction,
  /// grasps that close at the same time close first, plastically.
  enum class Law { plastic, bilateral_restitution, restitution, friction, compliant, as_published };
  Law law = Law::plastic;
  double duration = 1e-3;  // averaging time of mean forces, and the limit of slow modes [s]
  /// Joints during the impact. free: no efforts. braked: at rest from its first instant on. driven: they keep their
  /// rates, as with infinitely heavy rotors. impedance: by the law of ImpedanceSetup, law compliant only.
  enum class Joints { free, braked, driven, impedance };
  Joints joints = Joints::free;
  /// Flexible modes that respond during an impact. all: every mode. none: no mode, and deformation rates remain as
  /// before (for instantaneous laws: the impulse decreases as more modes respond to a rigid contact). slow: the modes
  /// whose period is longer than `duration`; the others keep their rates.
  enum class Modes { all, none, slow };
  Modes modes = Modes::all;
  double restitution = 0;          // e of contacts; of grasps, of the linear rows
  double angular_restitution = 0;  // of grasps
  double friction = 0;             // Coulomb's coefficient; laws friction and compliant
  RestitutionHypothesis hypothesis = RestitutionHypothesis::stronge;
  ContactComplianceSetup contact;  // law compliant
  GraspComplianceSetup grasp;
  CompliantSetup compliant;
};

}  // namespace grapnel
