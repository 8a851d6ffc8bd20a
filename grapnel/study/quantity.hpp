#pragma once

/// @file
/// Quantities of a capture without a single value in a scenario file, which a study varies by name. Each is a function
/// on a CaptureProblem.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// In the order of application, independent of their order in a study: each uses the results of the previous ones.
enum class QuantityKind { mass_ratio, target_spin, relative_speed, relative_direction, approach_angle };
template <>
struct Described<QuantityKind> : Enumeration<QuantityKind, "QuantityKind", "mass_ratio", "target_spin",
                                             "relative_speed", "relative_direction", "approach_angle"> {};

/// Properties of a kind of quantity.
struct QuantityInfo {
  QuantityKind kind;
  const char* unit;  // SI
  bool is_angular;   // may be given in degrees
  bool of_grasp;     // true: of a grasp, named by its end-effector; false: of a target
  const char* description;
};

const QuantityInfo& info(QuantityKind kind);

/// A quantity, its grasp or target, and its axis.
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
/// - mass_ratio: mass of the target over that of the servicer; its inertia is scaled by the same factor.
/// - target_spin: the target's angular velocity; the pose of its frame and the velocity of its centre of mass are
/// unchanged.
/// - relative_speed: end-effector minus target at the contact point, in magnitude; its direction is
/// Quantity::direction.
///   With an approach it is GraspSetup::relative_velocity, so that final rates must follow from the grasp points'
///   motion (ApproachSetup::match). Without one the target's velocity changes, with unchanged spin.
/// - relative_direction: rotation of the relative velocity by this angle.
/// - approach_angle: the end-effector's approach axis, turned by this angle from the inward normal; the contact point
/// and
///   the relative velocity stay. A copy of the grasp point has the turned approach direction, and the grasp takes it.
/// @throws std::invalid_argument with the reason if a quantity has no meaning for this problem.
void apply_quantities(std::span<const QuantityValue> values, CaptureProblem& problem);

/// Unit, in the target's frame, per grasp: against the grasp point's normal, else its approach direction, else from the
/// point to the target's centre of mass; zero where neither is there. Read it before quantities are applied:
/// approach_angle turns the approach direction, not the surface.
std::vector<Vector3d> inward_normals(const CaptureProblem& problem);

}  // namespace grapnel
