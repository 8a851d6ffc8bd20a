#pragma once

/// @file
/// Converts a model and a phase's setup to the input of run_lanes(): the structure shared by all cases, and the numbers
/// of one case.

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/lanes/lane_phase.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {

/// Why run_lanes() cannot integrate such a phase; empty if it can. Supported: gravity, loads, an orbital field,
/// attitude control by an external torque or by reaction wheels below their maximum rates, sampled control of any kind
/// and thrusters under it, loops within a tree closed by projection on a floating base, fixed roots and one held root.
/// The supported methods are adaptive_8 and automatic, whose steps are then all explicit.
std::string lane_obstacle(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration);
/// Likewise for the phase from t0 to t1. A prescribed joint must not have a rate while its position is constant, as
/// happens beyond the end of a trajectory that does not end at rest: the roots' motion is integrated within steps and
/// requires consistent joint motion.
std::string lane_obstacle(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration, double t0,
                          double t1);

/// The structure of a phase. Its cases may differ in all numbers, unless a joint axis changes from one coordinate axis
/// to another. A structure for elliptic orbits also serves circular ones, up to rounding error. @throws
/// std::invalid_argument if a load is invalid, or with lane_obstacle() if there is one.
LaneStructure lane_structure(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration);

/// The driven joints' trajectories and the loads from t0 to t1 >= t0, split at every point that is not smooth, and the
/// ticks of the setup's clock, which is not changed. @throws std::invalid_argument if t1 < t0, the external loads have
/// another structure, a segment has more coefficients than the structure provides, or a prescribed joint has a rate at
/// constant position (see lane_obstacle).
std::shared_ptr<const LaneMotion> lane_motion(const LaneStructure& structure, const Model& model,
                                              const PhaseSetup& setup, double t0, double t1);

/// Creates a case that starts from `state` and follows `motion`. Reuses the memory of `result`. @throws
/// std::invalid_argument if model or setup have another structure.
void lane_case(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, const State& state,
               std::shared_ptr<const LaneMotion> motion, LaneCase& result);

/// LaneControl of a case under ControlTable::by_case. The case's scalar dynamics, created from its model and setup,
/// reads sensors, evaluates laws and controllers, and switches valves as simulate_phase() does; the result is the
/// active command. After the case, call PhaseDynamics::end_control() with the time reached. The setup's clock, sensors,
/// controller and thrusters then have the state that simulate_phase() would leave. @throws ControllerError, and
/// exceptions of sensors and controllers.
double take_turn(const LaneStructure& structure, PhaseDynamics& dynamics, const LaneTurn& turn,
                 std::span<double> command);

/// Advances a clock to the end of a finished or handed-back case whose laws were evaluated in lanes. The clock must be
/// in the state from which the motion was created.
void end_control(const LaneMotion& motion, const LaneOutcome& outcome, ControlClock& clock);

}  // namespace grapnel::lanes
