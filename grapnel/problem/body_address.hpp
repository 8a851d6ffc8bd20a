#pragma once

/// @file
/// What a body of a capture's model belongs to, so that bodies of two models of one problem are matched by structure
/// rather than by their names.

#include <compare>
#include <cstddef>

namespace grapnel {

/// Address of a body, the same in every model of one problem that has the body (servicer alone, free targets, captured
/// targets).
struct BodyAddress {
  /// inside_base: a wheel, or a part of a control moment gyro.
  enum class Owner { robot, inside_base, target };
  Owner owner = Owner::robot;
  std::size_t target = 0;  // owner target: in CaptureProblem::targets
  /// robot: in the bodies of the modelled robot. target: 0 is the target itself, then its panels' pieces. inside_base:
  /// wheels, then gimbal and rotor of each gyro.
  std::size_t part = 0;

  bool is_target_itself() const { return owner == Owner::target && part == 0; }
  auto operator<=>(const BodyAddress&) const = default;
};

}  // namespace grapnel
