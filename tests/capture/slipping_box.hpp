#pragma once

/// @file
/// Closed forms of a box (held_box.hpp) that slips in its grasp.

#include <fmt/format.h>
#include <string>

#include "capture/held_box.hpp"

namespace grapnel::testing::held_box {

/// Servicer [kg], reduced mass of its relative motion to the box [kg]; the same about the x axis [kg m^2].
inline constexpr double kServicer = kBase + kArm, kReduced = kServicer * kBox / kAll;
inline constexpr double kServicerTurn = 10.1, kReducedTurn = kServicerTurn / kTurn;

/// A force [N] and a moment [N m] along x on the base from t = 1 s to t = 2 s.
inline std::string pulse(double force, double moment = 0) {
  return fmt::format(
      "external_wrenches: [{{body: base, force: [{}, 0, 0], torque: [{}, 0, 0], time: {{shape: constant, start: 1, "
      "end: 2}}}}]\n",
      force, moment);
}

/// Relative motion from rest: its speed grows by `push` [1/s^2] from t = 1 s to t = 2 s, then falls by `brake`.
struct Slide {
  double push, brake;
  double until() const { return 2 + push / brake; }
  double distance() const { return 0.5 * push + 0.5 * push * push / brake; }
};
/// Of the box under a force on the base and friction [N]; and under moments about x [N m].
inline Slide slide(double force, double friction) {
  return {force / kServicer - friction / kReduced, friction / kReduced};
}
inline Slide turn(double moment, double friction) {
  return {moment / kServicerTurn - friction / kReducedTurn, friction / kReducedTurn};
}

}  // namespace grapnel::testing::held_box
