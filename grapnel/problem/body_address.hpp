#pragma once

/// @file
/// Addresses of bodies in a capture's model, so that bodies of two models of one problem are matched by structure
/// instead of by name.

#include <compare>
#include <cstddef>

namespace grapnel {

/// Address of a body, equal in every model of one problem that contains the body (servicer alone, free targets,
/// captured targets).
struct BodyAddress {
  /// inside_base: a wheel or a part of a control moment gyro.
  enum class Owner { robot, inside_base, target };
  Owner owner = Owner::robot;
  std::size_t target = 0;  // index in CaptureProblem::targets, if owner is target
  /// robot: index in the bodies of the modelled robot. target: 0 is the target's own body, followed by its panels'
  /// pieces. inside_base: wheels, then gimbal and rotor of each gyro.
  std::size_t part = 0;

  bool is_target_itself() const { return owner == Owner::target && part == 0; }
  auto operator<=>(const BodyAddress&) const = default;
};

}  // namespace grapnel
