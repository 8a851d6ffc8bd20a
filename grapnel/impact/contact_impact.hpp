#pragma once

/// @file
/// Impact of contacts that are not grasps: unilateral, with restitution and Coulomb friction, any number at once.
///
/// All hypotheses share one path in the space of impulses and differ in where it ends (docs/theory, section 11).

#include <string>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// What says when the restitution of a contact is over. newton: its normal velocity is -e times the one before.
/// poisson: the normal impulse of restitution is e times that of compression. stronge: the work done by the normal
/// force in restitution is -e^2 times that in compression.
enum class RestitutionHypothesis { newton, poisson, stronge };

/// A point at which a body of the robot touches a target.
struct ContactPoint {
  int robot_body;
  int target_body;
  Vector3d p_WC;
  Vector3d n_W;            // unit, from the target to the robot's body: the robot receives P_n n_W, P_n >= 0
  double restitution = 0;  // e, 0 to 1
  double friction = 0;     // Coulomb's coefficient, >= 0
  /// Normal stiffness against the other contacts': decides how simultaneous contacts share what each alone could take.
  double relative_stiffness = 1;
};

/// How a contact point moved across its tangent plane in one stretch of the impact.
enum class ContactMode { separated, sticking, sliding, reversed };  // reversed: sliding back against the first slip

struct ContactPointImpulse {
  Impulsed P_WC;                   // on the robot at the contact point; angular part zero [N m s; N s]
  double normal = 0;               // P_n >= 0 [N s]
  Vector3d tangential;             // in W [N s]
  double compression = 0;          // of P_n while the bodies approach [N s]
  double compression_work = 0;     // of the normal force while they approach [J], <= 0
  double normal_work = 0;          // done by the normal force on the bodies [J], <= 0 unless energy is created
  double friction_work = 0;        // <= 0 [J]
  std::vector<ContactMode> modes;  // in order, without repetition; `separated` alone if nothing happened here
  Vector3d velocity_before, velocity_after;  // relative: robot minus target at the point, in W [m/s]
  /// Largest difference of P_n over what other orders of the same contacts give (relative_stiffness varied by 100 to
  /// either side, one contact at a time), over the largest P_n. Infinite where such a variation did not converge.
  double spread = 0;
};

struct ContactImpactSolution : ImpactChecks {
  enum class Status { solved, not_converged };
  Status status = Status::not_converged;
  std::string message;           // what did not converge, where; empty if solved
  std::vector<double> velocity;  // v+ of the whole model
  std::vector<ContactPointImpulse> contacts;
  std::vector<ContactImpulse> grasps;  // impulses of `closed`, as of plastic_impact()
  std::vector<double> held_impulses;
  bool energy_created = false;  // by the hypothesis (Newton's with friction can): flagged, never altered
  bool unique = true;           // whether all spreads are below 1e-6
  int steps = 0;                // of the path that was followed
  double cone_residual = 0;     // largest violation of |P_t| <= mu P_n, over the largest P_n
};

/// Solves the impact. `closed`: grasps that hold and pass on what the contacts bring; `held`: as of plastic_impact(),
/// reached at once and kept. Contacts that do not approach and are not pushed together by others do nothing. Where
/// held rates press a contact together that nothing else can yield to, the status says so.
///
/// One contact: the result depends on its relative_stiffness by rounding only. Several that feel each other: how they
/// share the impulse depends on the ratios of their stiffnesses, which a rigid body does not have; `spread` and
/// `unique` report it. Where several contacts stick redundantly, tangential impulses are one choice of many (the
/// motion is not).
/// @throws std::invalid_argument for coefficients out of range, a normal that is no unit vector, or another model's
/// state; std::runtime_error where GRAPNEL_LANES names no instruction set that runs here.
ContactImpactSolution contact_impact(const Model& model, const State& state, std::span<const ContactPoint> contacts,
                                     RestitutionHypothesis hypothesis, std::span<const Grasp> closed = {},
                                     std::span<const HeldRate> held = {});

}  // namespace grapnel
