#pragma once

/// @file
/// The list of the kinds of actuators of the base. Wheels, control moment gyros and thrusters have their own members in
/// RobotSetup; every other kind is a member of OtherActuators, and a file of this module contains the rest of it: its
/// law and its signals. CONTRIBUTING.md has the recipe. Public, kept stable.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

class BaseEffector;
struct ActuatorSignal;
struct CaptureProblem;

/// Sources of the torque of base control.
enum class BaseActuatorKind { outside, wheels, thrusters, gyros };
template <>
struct Described<BaseActuatorKind>
    : Enumeration<BaseActuatorKind, "Actuators", "outside", "wheels", "thrusters", "gyros"> {};
inline bool is_other(BaseActuatorKind kind) { return kind > BaseActuatorKind::gyros; }

/// The actuators of kinds besides wheels, gyros and thrusters.
struct OtherActuators {};
template <>
struct Described<OtherActuators> {
  using T = OtherActuators;
  static constexpr std::array<Field, 0> fields{};
  static constexpr Type type = structure<T>("actuators", "Other actuators of the base.", fields);
};

/// The functions of one kind.
struct OtherActuatorKind {
  BaseActuatorKind kind;
  /// Why the problem cannot use the kind for base control, as a sentence; empty: it can.
  std::string (*fault)(const CaptureProblem& problem);
  /// The effector of a phase; without a fault.
  std::shared_ptr<BaseEffector> (*make)(const CaptureProblem& problem);
  /// The signals of the robot's actuators of this kind; empty: it has none.
  std::vector<ActuatorSignal> (*signals)(const OtherActuators& actuators);
};
inline constexpr std::array<const OtherActuatorKind*, 0> kOtherActuators{};

/// The functions of another kind. @throws std::logic_error without is_other(kind).
const OtherActuatorKind& functions_of(BaseActuatorKind kind);

}  // namespace grapnel
