#pragma once

/// @file
/// From a model and a phase's setup to what run_lanes() integrates: the structure that cases share, and the numbers of
/// one.

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/lanes/lane_phase.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {

/// Why run_lanes() cannot integrate such a phase; empty if it can. It knows gravity, loads, an orbit's field, attitude
/// control, from outside or by reaction wheels below their largest rates, sampled control of any kind, thrusters under
/// it, loops of a tree that are kept closed by projection on a base that floats, fixed roots and a held one, but no
/// method but adaptive_8.
std::string lane_obstacle(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration);
/// The same for the phase from t0 to t1, in which a prescribed joint must not stand still with a rate, as it would
/// beyond the end of a trajectory that does not end at rest: roots' motion is integrated within steps, and follows from
/// a motion of the joints only where that is one.
std::string lane_obstacle(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration, double t0,
                          double t1);

/// The structure of a phase. Cases made for it may differ from this one in all numbers, but for joints whose axes would
/// turn from one coordinate axis to another; a structure for elliptic orbits serves circular ones, up to rounding.
/// @throws std::invalid_argument if a load is invalid;
/// @throws std::invalid_argument with lane_obstacle() if there is one.
LaneStructure lane_structure(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration);

/// The driven joints' trajectories and the loads from t0 to t1 >= t0, broken where any is not smooth, and at what the
/// setup's clock, which stays as it is, will do in between.
/// @throws std::invalid_argument if t1 < t0, what acts from outside has another structure, a piece has more
/// coefficients than the structure provides for, or a prescribed joint would stand still with a rate (see
/// lane_obstacle).
std::shared_ptr<const LaneMotion> lane_motion(const LaneStructure& structure, const Model& model,
                                              const PhaseSetup& setup, double t0, double t1);

/// A case that starts from `state` and follows `motion`. Reuses what is in `result`.
/// @throws std::invalid_argument if model or setup have another structure.
void lane_case(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, const State& state,
               std::shared_ptr<const LaneMotion> motion, LaneCase& result);

/// LaneControl of a case of that structure, under ControlTable::by_case: its own scalar dynamics, made of its model and
/// setup, read sensors, ask laws and controllers, and switch valves as simulate_phase() has them do, and what they hold
/// is what acts. The setup's clock, sensors, controller and thrusters are at the end where they would be after
/// simulate_phase(), once PhaseDynamics::end_control() has been called with the time reached.
/// @throws ControllerError, and what sensors and controllers throw.
double take_turn(const LaneStructure& structure, PhaseDynamics& dynamics, const LaneTurn& turn,
                 std::span<double> command);

/// Sets a clock, which is as it was when the motion was made of it, to where a case whose laws spoke in lanes has left
/// it, that is finished or has been handed back.
void end_control(const LaneMotion& motion, const LaneOutcome& outcome, ControlClock& clock);

}  // namespace grapnel::lanes
