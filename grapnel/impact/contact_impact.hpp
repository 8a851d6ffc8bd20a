#pragma once

/// @file
/// Impact of contacts that are not grasps: unilateral, with restitution and Coulomb friction, any number
/// simultaneously.
///
/// All hypotheses follow the same path in the space of impulses and differ in its end (docs/theory, section 11).

#include <string>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// The end of the restitution of a contact. newton: its normal velocity is -e times the one before. poisson: the normal
/// impulse of restitution is e times that of compression. stronge: the work of the normal force in restitution is -e^2
/// times that in compression.
enum class RestitutionHypothesis { newton, poisson, stronge };

/// A point at which a body of the robot touches a target.
struct ContactPoint {
  int robot_body;
  int target_body;
  Vector3d p_WC;
  Vector3d n_W;            // unit, from the target to the robot's body: the robot receives P_n n_W, P_n >= 0
  double restitution = 0;  // e, 0 to 1
  double friction = 0;     // Coulomb's coefficient, >= 0
  /// Normal stiffness relative to the other contacts: determines how simultaneous contacts share the impulse.
  double relative_stiffness = 1;
};

/// Tangential motion of a contact point in one interval of the impact.
enum class ContactMode { separated, sticking, sliding, reversed };  // reversed: sliding opposite to the first slip

struct ContactPointImpulse {
  Impulsed P_WC;                   // on the robot at the contact point; angular part zero [N m s; N s]
  double normal = 0;               // P_n >= 0 [N s]
  Vector3d tangential;             // in W [N s]
  double compression = 0;          // of P_n while the bodies approach [N s]
  double compression_work = 0;     // of the normal force while they approach [J], <= 0
  double normal_work = 0;          // work of the normal force on the bodies [J], <= 0 unless energy is created
  double friction_work = 0;        // <= 0 [J]
  std::vector<ContactMode> modes;  // in order, without repetition; only `separated` without an impulse
  Vector3d velocity_before, velocity_after;  // relative: robot minus target at the point, in W [m/s]
  /// Maximum difference of P_n from its value for other orders of the same contacts (relative_stiffness varied by a
  /// factor of 100 in both directions, one contact at a time), over the maximum P_n. Infinite if such a variation did
  /// not converge.
  double spread = 0;
};

struct ContactImpactSolution : ImpactChecks {
  enum class Status { solved, not_converged };
  Status status = Status::not_converged;
  std::string message;           // cause and place of a failure; empty if solved
  std::vector<double> velocity;  // v+ of the whole model
  std::vector<ContactPointImpulse> contacts;
  std::vector<ContactImpulse> grasps;  // impulses of `closed`, as of plastic_impact()
  std::vector<double> held_impulses;
  bool energy_created = false;  // by the hypothesis (possible for Newton's with friction): reported, never corrected
  bool unique = true;           // whether all spreads are below 1e-6
  int steps = 0;                // of the path
  double cone_residual = 0;     // largest violation of |P_t| <= mu P_n, over the largest P_n
};

/// Solves the impact. `closed`: grasps that hold and transmit the contacts' impulses; `held`: as for plastic_impact(),
/// reached immediately and kept. Contacts that neither approach nor are pushed together by others receive no impulse.
/// If held rates press a contact together and no body can move, the status reports it.
///
/// One contact: the result depends on its relative_stiffness by rounding only. Several coupled contacts: the
/// distribution of the impulse depends on the ratios of their stiffnesses, which rigid bodies do not have; `spread` and
/// `unique` report it. If several contacts stick redundantly, tangential impulses are one choice of many (the motion is
/// unique). @throws std::invalid_argument for coefficients out of range, a normal that is not a unit vector, or the
/// state of another model; std::runtime_error if GRAPNEL_LANES names no instruction set available here.
ContactImpactSolution contact_impact(const Model& model, const State& state, std::span<const ContactPoint> contacts,
                                     RestitutionHypothesis hypothesis, std::span<const Grasp> closed = {},
                                     std::span<const HeldRate> held = {});

}  // namespace grapnel
