#pragma once

/// @file
/// Impact of contacts that are not grasps: unilateral, with restitution and Coulomb friction, any number
/// simultaneously.
///
/// All hypotheses follow the same path in the space of impulses and differ in its end (docs/theory, section 11).

#include <optional>
#include <string>

#include "grapnel/impact/impact_setup.hpp"
#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// A point at which a body of the robot touches a target. One of both may be -1: fixed in W.
struct ContactPoint {
  int robot_body;
  int target_body;
  Vector3d p_WC;
  Vector3d n_W;            // unit, from the target to the robot's body: the robot receives P_n n_W, P_n >= 0
  double restitution = 0;  // e, 0 to 1
  double friction = 0;     // Coulomb's coefficient, >= 0
  /// Normal stiffness relative to the other contacts: determines how simultaneous contacts share the impulse.
  double relative_stiffness = 1;
  std::optional<RestitutionHypothesis> hypothesis = {};  // absent: that of the impact
};

struct ContactImpactOptions {
  bool spread = true;      // evaluate `spread` and `unique` of several contacts, by 2 n further paths
  int max_steps = 100000;  // of a path, beyond which it fails
  /// Closed grasps and held rates keep the velocities of the state instead of reaching theirs: the state is the one
  /// after the impact of these rows, in the same instant.
  bool keep_rates = false;
};

/// Solves the impact. `closed`: grasps that hold and transmit the contacts' impulses; `held`: as for plastic_impact(),
/// reached immediately and kept. The solution lists the grasps, then the contacts. Contacts that neither approach nor
/// are pushed together by others receive no impulse. If held rates press a contact together and no body can move, the
/// status reports it.
///
/// One contact: the result depends on its relative_stiffness by rounding only. Several coupled contacts: the
/// distribution of the impulse depends on the ratios of their stiffnesses, which rigid bodies do not have; `spread` and
/// `unique` report it. If several contacts stick redundantly, tangential impulses are one choice of many (the motion is
/// unique). @throws std::invalid_argument for coefficients out of range, a normal that is not a unit vector, or the
/// state of another model; std::runtime_error if GRAPNEL_LANES names no instruction set available here.
ImpactSolution contact_impact(const Model& model, const State& state, std::span<const ContactPoint> contacts,
                              RestitutionHypothesis hypothesis, std::span<const Grasp> closed = {},
                              std::span<const HeldRate> held = {}, const ContactImpactOptions& options = {});

}  // namespace grapnel
