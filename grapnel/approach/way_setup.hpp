#pragma once

/// @file
/// From a problem's settings to what planning makes least and keeps on the way (way.hpp).

#include <functional>
#include <memory>

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/plan/reach.hpp"

namespace grapnel {

/// A body's name as a user knows it: a target without its prefix.
std::string shown_name(const std::string& name);
/// Bodies that a fixed joint ties to this one.
std::vector<int> tied_to(const Model& model, int body);
/// What CaptureProblem::clearance watches in a model of the problem, captured targets included. `checked`: per grasp,
/// whether its end-effector is checked against its target as well; empty: none is.
ClearanceModel make_clearance_model(const CaptureProblem& problem, const CaptureSystem& system,
                                    const std::vector<bool>& checked = {});
/// The pairs of such a model that are the end-effector and the target of a checked grasp.
std::vector<int> hand_pairs(const CaptureProblem& problem, const CaptureSystem& system, const ClearanceModel& model,
                            const std::vector<bool>& checked);

/// The objective's terms with their weights.
std::vector<Objective::Term> objective_terms(const PlanSetup& plan);

/// WaySetup::end_measure: the capture at the end of a segment, its grasps rigid and everything else about joints in the
/// impact as the problem has it (free, or kept by drives or brakes). impulse: PlannedImpulse::energy; impulse_index:
/// its mean. `base` is scratch, the servicer's; `motion` tells what it does at `end`; `targets` move as at the capture.
/// The result refers to `base` alone.
std::function<double(Objective::Kind kind, std::span<const double> position, std::span<const double> rate,
                     const Posed& X_WB)>
capture_measure(const CaptureProblem& problem, FloatingBase& base, const FreeMotion& motion, double end,
                const std::vector<TargetMotion>& targets);

/// WaySetup::wheels: of the servicer's wheels, that keep its base at R_WD. `X_WB`: of the base at `begin`, when the
/// wheels have the rates of the problem; `motion`: of the servicer with its wheels at rest in the base.
WheelMomentum planned_wheels(const CaptureProblem& problem, const FreeMotion& motion, const Rotationd& R_WB,
                             const Rotationd& R_WD, double begin);

/// The bodies that `clearance` watches, and besides them end-effectors with their own targets: these may touch within
/// PlanSetup::near_grasp of the grasp point, by default as far as the shapes of the hand reach from its end-effector,
/// and the clearance asked for. `target_at`: motion of a target at a time. The result refers to none of the arguments
/// but what `target_at` refers to.
std::shared_ptr<const WayBodies> way_bodies(const CaptureProblem& problem, const CaptureSystem& servicer,
                                            std::function<TargetMotion(std::size_t target, double time)> target_at);

}  // namespace grapnel
