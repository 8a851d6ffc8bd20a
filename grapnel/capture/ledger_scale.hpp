#pragma once

/// @file
/// Scales for deviations of momentum and energy of one group of touching bodies: the maximum size of its motion, its
/// exchange, and floors from its mass, size, position and the duration of the run. Equations: docs/theory, section
/// 9.

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/simulate/phase_integrals.hpp"

namespace grapnel {

/// Mass, size and position of a group; maxima over time.
struct GroupReach {
  double mass = 0;      // [kg]
  double radius = 0;    // of gyration about its centre of mass [m]
  double distance = 0;  // of its centre of mass from the origin of the frame of the computation [m]
  void raise(const GroupReach& other);
};
GroupReach reach_of(const GroupSize<double>& size, const Vector3d& com);

/// The slowest motion in a run that is resolved, given rounding and tolerances.
struct SlowestMotion {
  double rate = 0;   // [1/s]: the maximum of 1 / duration of the run and the mean motion of the orbit
  double speed = 0;  // of the fastest group of the run [m/s]
};
/// Sets the rate; the speed is zero.
SlowestMotion slowest_motion(const CaptureProblem& problem);

/// `motion`: the maximum group_scale() over time. Positive if the group has mass and size, and anything moves or the
/// run has a duration.
GroupScale<double> ledger_scale(const GroupScale<double>& motion, const TreeExchange& exchanged,
                                const GroupReach& reach, const SlowestMotion& slowest);

}  // namespace grapnel
