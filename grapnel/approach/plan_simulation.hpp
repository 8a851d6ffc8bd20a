#pragma once

/// @file
/// Effects outside the momentum integral (loads, an orbital field, attitude control, rotors, flexible links), and
/// forward simulations of the planned servicer with all of them.

#include <string>
#include <vector>

#include "grapnel/approach/planning_task.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

bool bends(const PlanningTask& task);
bool loaded(const PlanningTask& task);
bool has_rotors(const PlanningTask& task);
/// Whether any of these effects acts. Then joint motion and constant momentum do not determine the base motion.
bool disturbed(const PlanningTask& task);
/// Whether loads act on a target that is to be grasped.
bool targets_loaded(const PlanningTask& task);
/// Names of the active disturbances.
std::string disturbances(const PlanningTask& task);
/// Differences between planned and simulated robot as a predicate ("is rigid and has no loads"); empty if none.
std::string planned_robot(const PlanningTask& task);

/// Joint trajectories => state of the servicer at `end` in a simulation of all loads with exact tracking; with a probe
/// in at least 400 steps. @throws std::runtime_error if the simulation fails.
State simulate(PlanningTask& task, const std::vector<JointTrajectory>& joints, double end, StepWatch watch = {});
/// The same for the draft and one more segment.
State simulate_segment(PlanningTask& task, const PlanDraft& draft, const ReachProblem& reach,
                       const SegmentValues& values, const StepWatch& watch = {});
/// Such a state as one of the planned servicer.
State planned_state(const PlanningTask& task, const State& simulated);
/// Residual angular velocity of an attitude-controlled base, in B [rad/s]. `servicer`: of planned_state().
Vector3d turn_beside(const PlanningTask& task, const State& servicer);

}  // namespace grapnel
