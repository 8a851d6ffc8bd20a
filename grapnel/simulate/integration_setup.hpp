#pragma once

/// @file
/// How a phase is integrated: the user's choice.

namespace grapnel {

struct IntegrationSetup {
  enum class Method { adaptive_8, rk4 };
  Method method = Method::adaptive_8;
  /// recovered: where nothing acts from outside, roots' velocities follow from the momentum at the phase's start (2.3),
  /// so that it cannot drift. integrated: they are integrated like everything else, an independent check.
  enum class RootVelocity { recovered, integrated };
  RootVelocity root_velocity = RootVelocity::recovered;
  /// How loops are kept closed. projection: after every step, and at every output, positions and velocities are brought
  /// back onto the closures in the mass metric. baumgarte: closures act on accelerations, with defects fed back at the
  /// rate 1/baumgarte_time; for comparison. acceleration: on accelerations alone (2.10), as in the thesis; for
  /// comparison: defects stay and grow. open: not at all, loops are cut; for comparison.
  enum class Loops { projection, baumgarte, acceleration, open };
  Loops loops = Loops::projection;
  double baumgarte_time = 0.1;  // [s]
  double relative_tolerance = 1e-12;
  double absolute_tolerance = 1e-13;
  double step = 1e-3;   // for rk4 [s]
  double max_step = 0;  // for adaptive_8; 0: none [s]
  long max_steps = 10'000'000;
  /// Of adaptive_8: step sizes follow how the error changes from step to step (StepControl::predictive). What
  /// integrates sets it where that takes fewer steps.
  bool predictive = false;
  bool operator==(const IntegrationSetup&) const = default;
};

}  // namespace grapnel
