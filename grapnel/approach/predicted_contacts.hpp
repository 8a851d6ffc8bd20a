#pragma once

/// @file
/// Contacts of targets with each other and with obstacles before the capture, as the planner predicts them.

#include <functional>

#include "grapnel/problem/target_motion.hpp"

namespace grapnel {

/// Adds contacts to a motion of the targets without contacts, `free`, from `begin` to `end` [s]: simulates the targets
/// alone with all pairs of CaptureProblem::contacts that contain no link of the servicer. Targets that touch nothing
/// keep their motion in `free`, bit by bit; the others have the simulated motion at `end`, and `instants`. Shapes that
/// overlap at `begin`, as estimates of two targets may, pass through each other until they are apart. `each_step` may
/// throw to end it. @throws std::runtime_error if the integration fails.
TargetPlan predict_contacts(const CaptureProblem& problem, TargetPlan free, double begin, double end,
                            const std::function<void(double t)>& each_step = {});

/// Motion of a target at a time [s] between the begin and the end of a plan; `end`: time of TargetPlan::capture.
/// @throws as propagate_target().
TargetMotion motion_in_plan(const CaptureProblem& problem, const TargetPlan& plan, std::size_t target, double end,
                            double time, const std::function<void(double t)>& each_step = {});

/// Whether contact changes the motion of a target after a time [s].
bool touches_after(const TargetPlan& plan, double time);

}  // namespace grapnel
