#include "grapnel/approach/planning_task.hpp"

#include <algorithm>

#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/approach/planned_base.hpp"
#include "grapnel/approach/predicted_contacts.hpp"
#include "grapnel/model/coupling.hpp"

namespace grapnel {
namespace {

long max_evaluations(const CaptureProblem& problem) {
  return problem.approach->plan.value_or(PlanSetup{}).max_evaluations;
}

WorkWatch::Callback progress_callback(const CaptureProgress& progress, long limit) {
  if (!progress) return {};
  return [&progress, limit](long done) { progress(kPlanning, static_cast<double>(done), static_cast<double>(limit)); };
}

std::function<void(double)> shown_on(const CaptureProgress& progress) {
  if (!progress) return {};
  return [&progress](double) { progress(kPlanning, 0, 0); };
}

// Holds coupled joints, and joints without an end-effector of a grasp if the plan states it.
void hold_idle_joints(PlanningTask& task) {
  const Model& model = task.servicer.model;
  const bool all_idle = task.approach.plan && task.approach.plan->idle_joints == PlanSetup::IdleJoints::held;
  if (!all_idle && model.couplings().empty()) return;
  std::vector<bool> held(static_cast<std::size_t>(task.base.joints()));
  for (int j = 0; j < task.base.joints(); ++j) {
    const auto carries = [&](const GraspSetup& g) { return task.base.carries(j, model.frame_index(g.end_effector)); };
    held[static_cast<std::size_t>(j)] = is_coupled(model, model.joints()[static_cast<std::size_t>(j)]) ||
                                        (all_idle && std::ranges::none_of(task.problem.grasps, carries));
  }
  task.base.hold(std::move(held));
}

// Duration of the shortest part of the approach, for motions from rest to rest. Includes all parts even if only the
// remaining approach is replanned.
double shortest_motion(const ApproachSetup& approach) {
  const double end = approach.duration - (approach.straight_in ? approach.straight_in->duration : 0);
  double shortest = approach.straight_in ? std::min(end, approach.straight_in->duration) : end, begin = 0;
  for (const Waypoint& w : approach.waypoints) shortest = std::min(shortest, w.time - begin), begin = w.time;
  return begin > 0 ? std::min(shortest, end - begin) : shortest;
}

// Attitude-controlled base => base at its desired attitude from the start, about the same centre of mass, if the
// control holds it.
void hold_attitude(PlanningTask& task) {
  PlacedLinks links;
  task.base.place(task.problem.joint_position, links);
  const Symmetric3d inertia = links.composite[0].rotational_about_com();
  if (!holds_attitude(*task.approach.base_control, inertia, shortest_motion(task.approach))) return;
  task.base.hold_attitude();
  task.X_WB.R = attitude_control(*task.approach.base_control, task.simulated_servicer, task.simulated_start).R_WD;
  task.X_WB.p = task.motion.p_WCom - task.X_WB.R * links.com;
}

}  // namespace

PlanningTask::PlanningTask(const CaptureProblem& stated, const TargetPlan& free_targets, CaptureDetail wanted,
                           const CaptureProgress& progress, double begins)
    : problem(stated),
      approach(*stated.approach),
      targets(predict_contacts(stated, free_targets, begins, stated.approach->duration, shown_on(progress))),
      detail(wanted),
      begin(begins),
      servicer(make_servicer(stated)),
      simulated_servicer(make_moving_servicer(stated)),
      simulated_start(initial_servicer_state(stated, simulated_servicer)),
      base(servicer.model, stated.robot.base_mode == RobotSetup::Base::free),
      motion(free_motion(servicer.model, without_inner_motion(simulated_servicer, simulated_start, servicer), begin,
                         stated.gravity)),
      X_WB(stated.X_WB),
      watch(max_evaluations(stated), progress_callback(progress, max_evaluations(stated))) {
  base.be_watched_by(&watch);
  hold_idle_joints(*this);
  for (int j : servicer.robot_joints) {
    const JointLimits& limits = servicer.model.bodies()[servicer.model.joints()[j]].description.joint.limits;
    lower.push_back(limits.lower), upper.push_back(limits.upper);
    rate_limit.push_back(limits.rate), effort_limit.push_back(limits.effort);
  }
  if (approach.base_control && base.floats()) hold_attitude(*this);
}

TargetMotion PlanningTask::target_at(std::size_t target, double time) const {
  return motion_in_plan(problem, targets, target, approach.duration, time, each_step());
}

std::function<void(double)> PlanningTask::each_step() const {
  constexpr long kOfOneStep = 12;  // evaluations per step of the method of order 8
  return [this](double) { watch.count(kOfOneStep); };
}

PlanDraft begin_draft(const PlanningTask& task) {
  const std::size_t n = task.servicer.robot_joints.size();
  PlanDraft draft{task.begin, task.problem.joint_position, task.problem.joint_rate, task.X_WB, {}};
  if (draft.rate.empty()) draft.rate.assign(n, 0.0);
  draft.plan.joints.resize(n);
  for (int j : task.servicer.robot_joints) {
    draft.plan.report.joints.push_back(
        task.servicer.model.bodies()[task.servicer.model.joints()[j]].description.joint.name);
  }
  return draft;
}

SegmentStart segment_to(const PlanningTask& task, const PlanDraft& draft, double end) {
  return {draft.time, end, task.approach.profile, draft.position, draft.rate, draft.X_WB};
}

ReachProblem reach_to(const PlanningTask& task, const PlanDraft& draft, double end, std::vector<Goal> goals,
                      RateDemand demand) {
  ReachProblem reach;
  reach.start = segment_to(task, draft, end);
  reach.motion = task.motion;
  reach.goals = std::move(goals);
  reach.demand = demand;
  reach.lower = task.lower, reach.upper = task.upper;
  for (std::size_t j = 0; j < draft.position.size(); ++j) {
    if (task.base.is_held(static_cast<int>(j))) reach.lower[j] = reach.upper[j] = draft.position[j];
  }
  reach.rate_limit = task.rate_limit;
  reach.guess = draft.position;
  reach.objective = Objective(Objective::Kind::excursion, reach.start, reach.guess, task.lower, task.upper);
  return reach;
}

void advance(PlanningTask& task, PlanDraft& draft, double end, const SegmentValues& values) {
  SegmentStart start = segment_to(task, draft, end);
  start.knots = values.knots;
  PathSegment segment(task.base, start, task.motion);
  SegmentEnd at_end;
  // The base pose at this time is needed by later segments and as a check.
  if (end < task.approach.duration || task.detail == CaptureDetail::full) {
    at_end = segment.integrate(values.position, values.rate, false, SegmentAccuracy::full, values.coefficients);
    if (!at_end.finished) throw std::runtime_error("planning the approach: " + at_end.failure);
  }
  for (std::size_t j = 0; j < values.position.size(); ++j) {
    const auto segments =
        segment.joint_segments(static_cast<int>(j), values.position[j], values.rate[j], values.coefficients);
    draft.plan.joints[j].segments.insert(draft.plan.joints[j].segments.end(), segments.begin(), segments.end());
  }
  task.rhs_evaluations += segment.rhs_evaluations();
  draft.time = end, draft.position = values.position, draft.rate = values.rate, draft.X_WB = at_end.X_WB;
}

}  // namespace grapnel
