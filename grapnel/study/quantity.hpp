#pragma once

/// @file
/// Quantities of a capture that have no single value in a scenario file: what a study varies by name. Each is a
/// function on a CaptureProblem.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// In the order in which they are applied, whatever order a study names them in: each reads what those before it set.
enum class QuantityKind { mass_ratio, target_spin, relative_speed, relative_direction, approach_angle };
template <>
struct Described<QuantityKind> : Enumeration<QuantityKind, "QuantityKind", "mass_ratio", "target_spin",
                                             "relative_speed", "relative_direction", "approach_angle"> {};

/// What a quantity is of.
struct QuantityInfo {
  QuantityKind kind;
  const char* unit;  // SI
  bool is_angular;   // may be given in degrees
  bool of_grasp;     // of a grasp, named by its end-effector; else of a target
  const char* description;
};

const QuantityInfo& info(QuantityKind kind);

/// Which quantity, of what, and how it is measured.
struct Quantity {
  QuantityKind kind = QuantityKind::relative_speed;
  std::string of;  // end-effector of the grasp, or target; empty: all
  /// Unit. target_spin: the spin axis, in W; absent: the present one. relative_direction, approach_angle: about which
  /// they turn, in the target's frame at the capture; absent: its z.
  std::optional<Vector3d> axis;
  /// Unit, in W, for relative_speed; absent: the grasp's inward normal at the capture.
  std::optional<Vector3d> direction;
};

struct QuantityValue {
  Quantity quantity;
  double value = 0;  // SI
};

/// Sets the quantities in the order of their kinds:
/// - mass_ratio: mass of the target over that of the servicer; its inertia is scaled alike.
/// - target_spin: the target's angular velocity, pose of its frame and velocity of its centre of mass as they were.
/// - relative_speed: end-effector minus target at the contact point, in magnitude; its direction is
/// Quantity::direction.
///   With an approach it is GraspSetup::relative_velocity, so that final rates must follow from the grasp points'
///   motion (ApproachSetup::match). Without one the target's velocity changes, its spin kept.
/// - relative_direction: the relative velocity is turned by this angle.
/// - approach_angle: the end-effector's approach axis, turned by this angle from the inward normal; the contact point
/// and
///   the relative velocity stay. A copy of the grasp point has the turned approach direction, and the grasp takes it.
/// @throws std::invalid_argument, saying why, where a quantity has no meaning for this problem.
void apply_quantities(std::span<const QuantityValue> values, CaptureProblem& problem);

/// Unit, in the target's frame, per grasp: against the grasp point's normal, else its approach direction, else from the
/// point to the target's centre of mass; zero where neither is there. Read it before quantities are applied:
/// approach_angle turns the approach direction, not the surface.
std::vector<Vector3d> inward_normals(const CaptureProblem& problem);

}  // namespace grapnel
