#pragma once

/// @file
/// The list of the kinds of actuators of the base. Wheels, control moment gyros and thrusters have their own members in
/// RobotSetup; every other kind is a member of OtherActuators, and a file of this module contains the rest of it: its
/// law and its signals. CONTRIBUTING.md has the recipe. Public, kept stable.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

class BaseEffector;
struct ActuatorSignal;
struct CaptureProblem;

/// Sources of the torque of base control.
enum class BaseActuatorKind { outside, wheels, thrusters, gyros, magnetic_torquers };
template <>
struct Described<BaseActuatorKind>
    : Enumeration<BaseActuatorKind, "Actuators", "outside", "wheels", "thrusters", "gyros", "magnetic_torquers"> {};
inline bool is_other(BaseActuatorKind kind) { return kind > BaseActuatorKind::gyros; }

/// A coil of the base with a dipole moment along an axis fixed in the base. In the Earth's magnetic field it gives a
/// torque.
struct MagneticTorquerSetup {
  std::string name;
  Vector3d axis{0, 0, 1};  // unit, in the base's frame
  double dipole = 0;       // maximum, in both directions [A m^2]
};
template <>
struct Described<MagneticTorquerSetup> {
  using T = MagneticTorquerSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among torquers.").required(),
      field<&T::axis>("axis", "", "Direction of its dipole moment, in the base's frame.").as("unit vector").required(),
      field<&T::dipole>("dipole", "A m^2", "Maximum dipole moment, in both directions.").above(0).required(),
  });
  static constexpr Type type =
      structure<T>("magnetic_torquer", "A coil with a dipole moment, which the Earth's magnetic field turns.", fields);
};

/// The actuators of kinds besides wheels, gyros and thrusters.
struct OtherActuators {
  std::vector<MagneticTorquerSetup> magnetic_torquers;
};
template <>
struct Described<OtherActuators> {
  using T = OtherActuators;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::magnetic_torquers>("magnetic_torquers", "", "Magnetic torquers of the base.").items(0, 100),
  });
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
extern const OtherActuatorKind kMagneticTorquers;
inline const OtherActuatorKind* const kOtherActuators[] = {&kMagneticTorquers};

/// The functions of another kind. @throws std::logic_error without is_other(kind).
const OtherActuatorKind& functions_of(BaseActuatorKind kind);

}  // namespace grapnel
