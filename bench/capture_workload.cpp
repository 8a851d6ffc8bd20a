#include "bench/capture_workload.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/impact_report.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::bench {
namespace {

// States the plan's final values and rates in the problem, so that the cases of a campaign do not plan again.
void freeze_plan(CaptureProblem& problem, const ApproachPlan& plan) {
  ApproachSetup& approach = *problem.approach;
  approach.plan.reset();
  approach.match.reset();
  approach.final_position = plan.report.final_position;
  approach.final_rates = plan.report.final_rates;
}

}  // namespace

CaptureProblem frozen_scenario(const std::string& name, const std::vector<Override>& overrides) {
  CaptureProblem problem = load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + name + ".yaml", overrides);
  problem.clearance.enabled = false;
  problem.output_interval = 0;
  if (problem.approach) freeze_plan(problem, plan_approach(problem, plan_targets(problem)));
  return problem;
}

CaptureWorkload thesis_capture() {
  CaptureProblem problem = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1.yaml");
  problem.clearance.enabled = false;
  problem.output_interval = 0;
  const TargetPlan targets = plan_targets(problem);
  const ApproachPlan plan = plan_approach(problem, targets);
  freeze_plan(problem, plan);

  CaptureProblem tight = problem;
  tight.integration.relative_tolerance = 1e-13;
  tight.integration.absolute_tolerance = 1e-15;
  const CaptureResult reference = simulate_capture(tight, {}, CaptureDetail::columns);
  if (!reference.post_impact_end) throw std::runtime_error("thesis capture: " + reference.failure);

  CaptureSystem free = make_capture_system(problem);
  State start = initial_servicer_state(problem, free);
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const int body = free.model.frames()[free.target_frames[t]].body;
    set_root_pose(free.model, body, targets.start[t].X_WT, start);
    set_root_twist(free.model, body, targets.start[t].V_WT, start);
  }
  problem.integration.relative_tolerance = problem.integration.absolute_tolerance = 1e-7;
  return {std::move(problem), std::move(free), std::move(start), plan.joints, end_numbers(*reference.post_impact_end)};
}

CapturedSystem weld(const CaptureWorkload& workload, const State& arrived) {
  const CaptureProblem& problem = workload.problem;
  const Contact contact = make_contact(problem, workload.free, arrived);
  const ImpactOutcome outcome = run_impact({problem, workload.free, contact, problem.approach->duration});
  const Kinematics k = forward_kinematics(workload.free.model, outcome.after);
  std::vector<HeldGrasp> grasps;
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) grasps.push_back(hold_grasp(problem, workload.free, k, i));
  return join_targets(workload.free, outcome.after, grasps);
}

std::vector<double> end_numbers(const CaptureSystem& system, const State& state) {
  CaptureProblem nothing_gripped;
  nothing_gripped.robot.base = "base";
  return end_numbers(describe(nothing_gripped, system, state, 0));
}

std::vector<double> end_numbers(const PhaseEnd& end) {
  std::vector<double> numbers;
  const auto add = [&](const auto& values) { numbers.insert(numbers.end(), std::begin(values), std::end(values)); };
  Quaterniond q = end.base.quaternion_wxyz;
  if (q.w < 0) q = {-q.w, -q.x, -q.y, -q.z};
  add(end.base.position.e);
  add(std::vector<double>{q.w, q.x, q.y, q.z});
  add(end.joints.position);
  add(end.base.velocity.e);
  add(end.base.angular_velocity.e);
  add(end.joints.velocity);
  return numbers;
}

double end_error(const CaptureWorkload& workload, const std::vector<double>& numbers) {
  double largest = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double difference = std::abs(numbers[i] - workload.end.at(i));
    if (!(difference <= largest)) largest = difference;
  }
  return largest;
}

}  // namespace grapnel::bench
