#pragma once

/// @file
/// The solution of an impact, which every impact law returns, and the rates that drives and brakes hold during it.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// A velocity (index into State::v) that a drive or a brake sets to a prescribed value with any impulse (a kept rate,
/// or zero). If the grasps contradict some of them, drives are overpowered, with minimum deviation
/// (yielding_drives.hpp).
struct HeldRate {
  int velocity;
  double after = 0;  // [rad/s or m/s]
  /// Per velocity. Not empty: the quantity with the value `after` is the sum of these times the velocities, the rate of
  /// a mode of vibration that does not respond or of a coupling of joints, and `velocity` is -1. Such rates come before
  /// all others.
  std::vector<double> row = {};

  bool is_mode() const { return !row.empty(); }
};

/// Checks of one instantaneous impact, for every law: (9.5) and (9.6) of docs/theory. They are relative to the bodies
/// in the impact, so that a heavy body elsewhere hides nothing.
struct ImpactChecks {
  double kinetic_energy_before = 0;  // [J], by the mass matrix, of the whole model
  double kinetic_energy_after = 0;
  double energy_identity_residual = 0;       // |dT - work of the impulses|, over T before or after of what takes part
  double generalized_momentum_residual = 0;  // (3.6): |M dv - J^T P| in the energy norm, over that of M v, likewise
};

/// An impulse at a grasp or contact, on the robot at the contact point, in W.
struct ContactImpulse {
  Impulsed P_WC;                 // [N m s; N s]
  std::vector<bool> determined;  // per component [angular; linear]: the same in every solution
};

/// Tangential motion of a contact point in one interval of the impact.
enum class ContactMode { separated, sticking, sliding, reversed };  // reversed: sliding opposite to the first slip

/// The rebound of a contact point in an instantaneous impact.
struct ContactPointImpulse {
  double normal = 0;            // P_n >= 0 [N s]
  Vector3d tangential;          // in W [N s]
  double compression = 0;       // of P_n while the bodies approach [N s]
  double compression_work = 0;  // of the normal force while they approach [J], <= 0
  double normal_work = 0;       // work of the normal force on the bodies [J], <= 0 unless energy is created
  double friction_work = 0;     // <= 0 [J]
  /// Of the whole impulse, at the mean of the velocities after it and before it, once grasps and held rates are
  /// reached. The sum over all contacts equals that of the works above. [J]
  double work = 0;
  std::vector<ContactMode> modes;            // in order, without repetition; only `separated` without an impulse
  Vector3d velocity_before, velocity_after;  // relative: robot minus target at the point, in W [m/s]
  /// Maximum difference of P_n from its value for other orders of the same contacts (relative_stiffness varied by a
  /// factor of 100 in both directions, one contact at a time), over the maximum P_n. Infinite if such a variation did
  /// not converge.
  double spread = 0;
};

/// One contact or grasp of a compliant impact over time; forces on the robot at its own point, in W.
struct ForceHistory {
  std::vector<Vector3d> point;      // point of force and moment, common to both bodies, in W, per sample [m]
  std::vector<Vector3d> force;      // [N]
  std::vector<Vector3d> moment;     // about the robot's point; zero for contacts [N m]
  std::vector<double> deformation;  // of contacts along the normal, of grasps the distance of the two points [m]
  double peak_force = 0, peak_force_time = 0;    // over all steps, not only samples [N, s]
  double peak_moment = 0, peak_moment_time = 0;  // [N m, s]
  double largest_deformation = 0;                // [m]
  double duration = 0;                           // of contacts: time in contact, of grasps: until at rest [s]
  Impulsed impulse = Impulsed::zero();           // integral, about the contact point at the beginning [N m s; N s]
  double energy_lost = 0;                        // by its damper and friction [J]
  int touches = 0;                               // number of touches; 1 for grasps
};

struct ImpactSolution : ImpactChecks {
  /// solved: instantaneously. The others end a compliant impact: all contacts have separated; grasps have come to rest;
  /// the time limit. failed: `message` states the condition.
  enum class Status { solved, separated, settled, time_over, failed };
  Status status = Status::failed;
  std::string message;
  std::vector<double> velocity;          // v+ of the whole model
  std::vector<ContactImpulse> contacts;  // per grasp, then per contact; of compliant_impact(): see `forces`
  std::vector<double> held_impulses;     // per held rate [N m s or N s]
  // Determinacy:
  int rank = 0;
  int rows = 0;
  Eigen::MatrixXd null_space;      // self-stresses, rows x (rows - rank): constrained directions, then held rates
  double constraint_residual = 0;  // (9.7): largest |J v+ - u+| over the largest |u-| or rate of what takes part
  /// Not empty: redundant rows for which no motion has the required velocities ("grasp 2, linear y"). The solution is
  /// then the nearest one in the least-squares sense. (Drives whose held rates contradict the law are overpowered.)
  std::string inconsistent;
  // Of contacts that rebound instantaneously:
  std::vector<ContactPointImpulse> points;
  bool energy_created = false;  // by the hypothesis (possible for Newton's with friction): reported, never corrected
  bool unique = true;           // whether all spreads are below 1e-6
  long steps = 0;               // of the path, or of the integration
  double cone_residual = 0;     // largest violation of |P_t| <= mu P_n, over the largest P_n
  /// One entry per hard contact that touches (ImpactInput::hard); empty: none receives an impulse.
  std::vector<ContactPointImpulse> hard;
  // Of a compliant impact:
  double duration = 0;                                // [s]
  State after;                                        // includes coordinates: the system moves
  std::vector<double> times;                          // of the samples, from 0, nondecreasing; an event has two
  std::vector<State> states;                          // at the samples
  std::vector<std::vector<double>> accelerations;     // at the samples: rates of State::v, per velocity
  std::vector<ForceHistory> forces;                   // of compliant_impact(): contacts, then grasps
  std::vector<std::vector<double>> loop_multipliers;  // at the samples, with loops: LoopSolver::multipliers()
  /// Per loop closure: impulse on its body a about `loop_point` in W [N m s; N s].
  std::vector<Impulsed> loop_impulses;
  Vector3d loop_point = Vector3d::zero();
  double held_work = 0;                                      // work of the efforts that keep held rates [J]
  double drive_work = 0;                                     // work of an ImpactDrive [J]
  double elastic_energy_after = 0;                           // in contacts and grasps [J]
  double spring_energy_before = 0, spring_energy_after = 0;  // of springs at joints, of the trees in the impact [J]
  double spring_energy_lost = 0;                             // by their dampers [J]
  double kinetic_energy_taking_part = 0;  // before, of the trees that an interface or a held velocity acts on [J]
  /// |T+ + V+ + lost - held_work - drive_work - T-| of these trees, including energy and losses of springs at joints,
  /// over the larger of T- and T+.
  double energy_residual = 0;
  long rhs_evaluations = 0;
};

}  // namespace grapnel
