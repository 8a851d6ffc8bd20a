#pragma once

/// @file
/// Converts a problem's settings to objectives and path constraints of planning (path_constraints.hpp).

#include <functional>
#include <memory>

#include "grapnel/approach/capture_goals.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/problem/problem_clearance.hpp"

namespace grapnel {

/// The objective's terms with their weights.
std::vector<Objective::Term> objective_terms(const PlanSetup& plan);

/// PathConstraints::end_measure: the capture at the end of a segment with rigid grasps; joints during the impact are
/// free, or held by drives or brakes, as the problem states. impulse: PlannedImpulse::energy; impulse_index: its mean.
/// `base` is scratch, of the servicer; `motion` gives its motion at `end`; `targets` move as at the capture. The result
/// refers to `base` alone.
std::function<double(Objective::Kind kind, std::span<const double> position, std::span<const double> rate,
                     const Posed& X_WB)>
capture_measure(const CaptureProblem& problem, FloatingBase& base, const FreeMotion& motion, double end,
                const std::vector<TargetMotion>& targets);

/// PathConstraints::wheels: for the servicer's wheels that hold its base at R_WD. `X_WB`: base pose at `begin`, when
/// the wheels have the rates of the problem; `motion`: of the servicer with its wheels fixed to the base.
WheelMomentum planned_wheels(const CaptureProblem& problem, const FreeMotion& motion, const Rotationd& R_WB,
                             const Rotationd& R_WD, double begin);

/// The bodies of `clearance`, pairs of `contacts` unless PlanSetup::contacts allows them to touch, links with
/// obstacles, and end-effectors with their own targets. The latter, and links that the end-effector carries and that
/// may touch the target by `contacts`, may touch within PlanSetup::near_grasp of the grasp point; its default is the
/// extent of the gripper's shapes from the end-effector plus the required clearance. `target_at`: motion of a target at
/// a time. The result refers only to what `target_at` refers to.
std::shared_ptr<const ConstraintBodies> constraint_bodies(
    const CaptureProblem& problem, const CaptureSystem& servicer,
    std::function<TargetMotion(std::size_t target, double time)> target_at);

}  // namespace grapnel
