#pragma once

/// @file
/// What all parts of the planning of one approach share: the task (inputs, models, scratch) and the draft of the plan
/// (output so far). Joints are those of the servicer alone, in the order of the robot's joints.

#include <functional>
#include <stdexcept>
#include <vector>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/plan/reach.hpp"

namespace grapnel {

/// Ends planning; its message becomes ApproachPlan::failure.
struct Unplannable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Inputs of a plan, the models made from them, and scratch. All arguments must outlive the object.
struct PlanningTask {
  /// As plan_approach(); `free_targets`: their motion without contacts.
  PlanningTask(const CaptureProblem& stated, const TargetPlan& free_targets, CaptureDetail wanted,
               const CaptureProgress& progress, double begins);
  PlanningTask(const PlanningTask&) = delete;
  PlanningTask& operator=(const PlanningTask&) = delete;

  /// Whether the plan assumes that the base keeps its attitude.
  bool attitude_held() const { return base.floats() && !base.turns(); }
  TargetMotion target_at(std::size_t target, double time) const;
  /// Counts steps of integrations of the full dynamics as work.
  std::function<void(double)> each_step() const;

  const CaptureProblem& problem;
  const ApproachSetup& approach;
  const TargetPlan targets;  // with contacts
  const CaptureDetail detail;
  const double begin;                      // [s]
  const CaptureSystem servicer;            // for planning by momentum: wheels are fixed to the base
  const CaptureSystem simulated_servicer;  // with rotating wheels
  const State simulated_start;             // of simulated_servicer
  std::vector<double> lower, upper, rate_limit, effort_limit;
  FloatingBase base;  // scratch
  FreeMotion motion;
  Posed X_WB;                // base pose that the plan begins with
  mutable WorkWatch watch;   // evaluations of the servicer's motion: limit and progress
  long rhs_evaluations = 0;  // of the report
};

/// The plan up to a time: its trajectories and report, and the state at its end.
struct PlanDraft {
  double time = 0;                     // [s]
  std::vector<double> position, rate;  // of the joints
  Posed X_WB = Posed::identity();
  ApproachPlan plan;
};
PlanDraft begin_draft(const PlanningTask& task);

/// Final joint values and rates of a segment, and its spline, as PathSegment::integrate() takes it.
struct SegmentValues {
  std::vector<double> position, rate;
  int knots = 0;
  std::vector<double> coefficients = {};
};
inline SegmentValues values_of(const ReachSolution& s) { return {s.position, s.rate, s.knots, s.coefficients}; }

/// A segment from the end of the draft.
SegmentStart segment_to(const PlanningTask& task, const PlanDraft& draft, double end);
/// The problem of such a segment: limits (held joints: their values), the present joints as the guess, excursion (6.8a)
/// as the objective.
ReachProblem reach_to(const PlanningTask& task, const PlanDraft& draft, double end, std::vector<Goal> goals,
                      RateDemand demand);
/// Adds a segment to the draft. The base is integrated by (6.5) only if a later segment or a check needs its pose.
void advance(PlanningTask& task, PlanDraft& draft, double end, const SegmentValues& values);

}  // namespace grapnel
