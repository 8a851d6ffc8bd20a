#include "grapnel/approach/plan_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/approach/plan_simulation.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/enumeration_names.hpp"

namespace grapnel {
namespace {

// Figures of a solution => report of its path: smallest margins and clearance, largest shares of limits, base rotation
// [rad] and wheel shares (6.27).
PlannedPath planned_path(const PlanningTask& task, const ReachProblem& reach, const ReachSolution& solution) {
  const PathFigures& f = *solution.figures;
  PlannedPath path;
  path.knots = solution.knots;
  if (std::isfinite(f.position_margin)) path.position_margin = f.position_margin;
  path.rate_share = f.rate_share > 0 ? std::optional(f.rate_share) : std::nullopt;
  path.effort_share = f.effort_share;
  if (f.clearance.pair >= 0) {
    path.clearance = f.clearance.distance, path.clearance_time = f.clearance_time;
    path.body_a = reach.constraints.bodies->names[static_cast<std::size_t>(f.clearance.body_a)];
    path.body_b = reach.constraints.bodies->names[static_cast<std::size_t>(f.clearance.body_b)];
  }
  path.attitude_held = task.attitude_held();
  path.base_turn = f.base_turn;
  for (std::size_t i = 0; i < f.wheel_share.size(); ++i)
    path.wheels.push_back({reach.constraints.wheels->wheels[i].name, f.wheel_share[i]});
  return path;
}

}  // namespace

void report(const PlanningTask& task, PlanDraft& draft, const ReachProblem& reach, const ReachSolution& solution) {
  PlanReport& r = draft.plan.report;
  r.searched = true;
  r.found = solution.found;
  r.objective = !task.approach.plan           ? "excursion"
                : task.approach.plan->weights ? "weights"
                                              : name_of(task.approach.plan->objective);
  r.objective_value = solution.objective;
  r.terms.clear();
  for (std::size_t i = 0; i < solution.terms.size(); ++i) {
    const Objective::Term& term = reach.objective.terms()[i];
    r.terms.push_back({name_of(term.kind), term.weight, solution.terms[i]});
  }
  if (solution.figures) r.path = planned_path(task, reach, solution);
  r.miss.clear();
  for (std::size_t i = 0; i < reach.goals.size(); ++i) {
    r.miss.push_back({reach.goals[i].name, solution.miss[i].distance, solution.miss[i].angle});
  }
  r.starts = solution.starts, r.solutions = solution.solutions, r.distinct_solutions = solution.distinct;
  r.iterations = solution.iterations;
  r.smallest_singular_value = solution.smallest_singular_value;
  r.unmet_rate = solution.unmet_rate;
  if (!solution.found) draft.position = solution.position, draft.rate = solution.rate;
}

void report_gaps(const std::vector<GoalGap>& gaps, PlanReport& report) {
  for (std::size_t g = 0; g < gaps.size(); ++g) {
    PlannedMiss& miss = report.miss[g];
    miss.distance = norm(gaps[g].position), miss.angle = norm(gaps[g].turn);
    miss.velocity = norm(gaps[g].velocity), miss.angular_velocity = norm(gaps[g].spin);
  }
}

void report_contacts(const PlanningTask& task, ApproachPlan& plan) {
  if (task.problem.contacts.empty() || task.problem.grasps.empty())
    return;  // without grasps there is no capture to disturb
  plan.report.assumes =
      "targets touch each other and obstacles as predicted without the servicer, and the servicer touches nothing";
  for (const TargetContact& contact : task.targets.contacts) {
    const std::string a = contact_name(task.problem, contact.a), b = contact_name(task.problem, contact.b);
    plan.report.contacts.push_back({a, b, contact.time});
    for (const BodyName& body : {contact.a, contact.b}) {
      if (!body.target || task.problem.targets[*body.target].given_at == TargetSetup::Instant::start) continue;
      plan.warnings.push_back(fmt::format(
          "targets.{}.state: it is stated at the capture, t = {:.6g} s, but {} and {} touch before, at t = {:.6g} s: "
          "target '{}' moves differently from then on and does not have this state at the capture; state it at the "
          "start, or move what it touches",
          task.problem.targets[*body.target].name, task.approach.duration, a, b, contact.time,
          task.problem.targets[*body.target].name));
    }
  }
}

void warn_of_approximation(const ReachProblem& reach, const ReachSolution& s, ApproachPlan& plan) {
  for (std::size_t i = 0; i < reach.goals.size(); ++i) {
    if (s.miss[i].distance <= kArrived && s.miss[i].angle <= kArrived) continue;
    plan.warnings.push_back(fmt::format(
        "approach: end-effector '{}' does not reach its demanded pose exactly; the plan ends {:.3g} m and {:.3g} rad "
        "from it, within half its envelope; joint motion cannot reduce this error",
        reach.goals[i].name, s.miss[i].distance, s.miss[i].angle));
  }
}

void warn_of_rates(const PlanningTask& task, PlanDraft& draft, const std::vector<double>& rates, double unmet,
                   double end) {
  constexpr double kUnmet = 1e-9;                 // of the largest rate
  constexpr double kSwing = 0.19;                 // of rate times duration: the largest |e(x)| of (6.1)
  constexpr double kWide = 2 * std::numbers::pi;  // [rad or m]
  double largest = 1e-3;
  for (double r : rates) largest = std::max(largest, std::abs(r));
  if (unmet > kUnmet * largest) {
    draft.plan.warnings.push_back(fmt::format(
        "approach: no joint rates give the end-effectors the demanded motion at the final configuration; the largest "
        "unmet component is {:.3g} (m/s or rad/s)",
        unmet));
  }
  std::size_t widest = 0;
  double swing = 0;
  for (std::size_t j = 0; j < rates.size(); ++j) {
    if (std::abs(rates[j]) > task.rate_limit[j]) {
      draft.plan.warnings.push_back(fmt::format(
          "approach: the demanded final motion requires a rate of {:.4g} at joint '{}', whose limit is {:.4g}{}",
          rates[j], draft.plan.report.joints[j], task.rate_limit[j],
          !task.approach.plan ? ""
          : disturbed(task)   ? "; the plan includes corrections from a forward simulation"
                              : "; no solution within the rate limits was found"));
    }
    const double out = kSwing * std::abs(rates[j]) * (end - draft.time);
    if (out > swing) swing = out, widest = j;
  }
  if (swing <= kWide) return;
  draft.plan.warnings.push_back(
      fmt::format("approach: joints overshoot to reach their final rates, '{}' by about {:.3g} (rad or m) for {:.4g} "
                  "on a segment of {:.4g} s; a shorter last segment (waypoints, straight_in) reduces the overshoot",
                  draft.plan.report.joints[widest], swing, rates[widest], end - draft.time));
}

void warn_of_thrusters(const PlanningTask& task, ApproachPlan& plan) {
  const std::optional<BaseControlSetup>& control = task.approach.base_control;
  if (!control ||
      control->actuators.value_or(BaseControlSetup::Actuators::wheels) == BaseControlSetup::Actuators::wheels)
    return;
  plan.warnings.push_back(
      "approach: the plan assumes a base torque equal to the attitude control's demand at all times, and no force; the "
      "thrusters switch on and off, and the end-effectors miss their goals by the resulting error");
}

}  // namespace grapnel
