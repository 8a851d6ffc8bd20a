#pragma once

/// @file
/// Settings of the integration of a phase.

namespace grapnel {

struct IntegrationSetup {
  /// automatic: adaptive_8, and radau_9 where a motion with contacts is stiff (AutomaticStepper). adaptive_8: explicit,
  /// of order 8. radau_9: implicit, of order 9. rk4: explicit, with fixed steps. All but rk4 control the error.
  enum class Method { automatic, adaptive_8, radau_9, rk4 };
  Method method = Method::automatic;
  /// recovered: without external effects, velocities of roots follow from the momentum at the phase's start (2.3), so
  /// that it cannot drift. integrated: they are integrated like the other velocities, as an independent check.
  enum class RootVelocity { recovered, integrated };
  RootVelocity root_velocity = RootVelocity::recovered;
  /// Treatment of closed loops. projection: after every step, and at every output, positions and velocities are
  /// projected onto the closures in the mass metric. baumgarte: closures act on accelerations, with feedback of defects
  /// at the rate 1/baumgarte_time; for comparison. acceleration: closures act only on accelerations (2.10), as in the
  /// thesis; for comparison: defects remain and grow. open: loops are cut; for comparison.
  enum class Loops { projection, baumgarte, acceleration, open };
  Loops loops = Loops::projection;
  double baumgarte_time = 0.1;  // [s]
  double relative_tolerance = 1e-12;
  double absolute_tolerance = 1e-13;
  double step = 1e-3;   // for rk4 [s]
  double max_step = 0;  // with error control; 0: none [s]
  long max_steps = 10'000'000;
  /// Of explicit steps with error control: step sizes follow the change of the error between steps
  /// (StepControl::predictive). Set internally where it saves steps.
  bool predictive = false;
  bool operator==(const IntegrationSetup&) const = default;
};

}  // namespace grapnel
