#pragma once

/// @file
/// What deviations of momentum and energy are measured against, for one group of bodies that touch: the largest sizes
/// of its motion, what it exchanged, and floors from its mass, its size, its place and the duration of the run.
/// Equations: docs/theory, section 9.

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/simulate/phase_integrals.hpp"

namespace grapnel {

/// Mass, size and place of a group; the largest over time.
struct GroupReach {
  double mass = 0;      // [kg]
  double radius = 0;    // of gyration about its centre of mass [m]
  double distance = 0;  // of its centre of mass from the origin of the frame of the computation [m]
  void raise(const GroupReach& other);
};
GroupReach reach_of(const GroupSize<double>& size, const Vector3d& com);

/// How slow a motion may be in a run before rounding and tolerances decide about it.
struct SlowestMotion {
  double rate = 0;   // [1/s]: the largest of 1 / duration of the run and the mean motion of the orbit
  double speed = 0;  // of the fastest group of the run [m/s]
};
/// Its rate; the speed is zero.
SlowestMotion slowest_motion(const CaptureProblem& problem);

/// `motion`: the largest group_scale() over time. Positive if the group has mass and size, and anything moves or the
/// run takes time.
GroupScale<double> ledger_scale(const GroupScale<double>& motion, const TreeExchange& exchanged,
                                const GroupReach& reach, const SlowestMotion& slowest);

}  // namespace grapnel
