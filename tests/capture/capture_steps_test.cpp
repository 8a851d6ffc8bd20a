/// A capture with external integration of its motion.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "capture/capture_case.hpp"
#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel::testing {
namespace capture_steps_test {

// Integrates a segment as an external caller does and accumulates the measures separately.
struct Elsewhere {
  PhaseOutcome outcome;
  PhaseMeasures measures;
};
// `share`: the fraction of the segment to integrate, from its beginning.
Elsewhere integrate(const MotionTask& task, double share = 1) {
  Elsewhere e;
  PhaseDynamics dynamics(*task.model, *task.setup);
  Kinematics k(*task.model);
  bool first = true;
  StepWatch watch;
  watch.checks = 1'000'000;  // after every step
  watch.check = [&](double, const State& state, const PhaseIntegrals& integrals) {
    forward_kinematics(*task.model, state, k);
    const ConservedQuantities quantities = conserved_quantities(*task.model, k, state);
    PhaseMeasures& m = e.measures;
    if (first) m.trees.resize(quantities.trees.size());
    for (std::size_t i = 0; i < quantities.trees.size(); ++i) {
      TreeMeasures& tree = m.trees[i];
      const GroupQuantities& now = quantities.trees[i];
      if (first) tree.start = now;
      const Momentumd deviation = now.h - tree.start.h;
      tree.linear_deviation = std::max(tree.linear_deviation, norm(deviation.linear));
      tree.angular_deviation = std::max(tree.angular_deviation, norm(deviation.angular));
      // The base is the first root.
      const double work = i == 0 ? integrals.motor_work + integrals.friction_work : 0;
      tree.energy_deviation =
          std::max(tree.energy_deviation, std::abs(now.size.inner_energy - tree.start.size.inner_energy - work));
      const GroupScale<double> scale = group_scale(now.size);
      tree.scale.linear = std::max(tree.scale.linear, scale.linear);
      tree.scale.angular = std::max(tree.scale.angular, scale.angular);
      tree.scale.energy = std::max(tree.scale.energy, scale.energy);
    }
    first = false;
    m.scale.linear_momentum = std::max(m.scale.linear_momentum, quantities.linear_scale);
    m.scale.angular_momentum = std::max(m.scale.angular_momentum, quantities.angular_scale);
    m.scale.energy = std::max(m.scale.energy, quantities.kinetic_energy);
  };
  const double end = share < 1 ? task.begin + share * (task.end - task.begin) : task.end;
  e.outcome = simulate_phase(dynamics, {task.start, task.begin, end}, task.integration, {.watch = watch});
  return e;
}

CaptureProblem problem() {
  CaptureProblem p = thesis_case_pd();
  p.clearance.enabled = false;
  p.contact.gap = ContactSetup::Gap::translate_target;
  p.post_impact = PostImpactSetup{};
  p.post_impact->duration = 10;
  return p;
}

double entry(const CaptureResult& r, const std::string& name) {
  for (const LedgerEntry& e : r.ledger.entries) {
    if (e.name == name) return e.value;
  }
  ADD_FAILURE() << name;
  return NAN;
}

TEST(CaptureSteps, ExternalIntegration) {
  const CaptureProblem p = problem();
  CaptureSteps steps(p, CaptureDetail::columns);
  std::vector<std::string> phases;
  while (const MotionTask* task = steps.next()) {
    EXPECT_EQ(task->only_here, "");
    phases.push_back(task->phase);
    const Elsewhere e = integrate(*task);
    steps.integrated(e.outcome, e.measures);
  }
  const CaptureResult there = steps.finish(), here = simulate_capture(p, {}, CaptureDetail::columns);
  EXPECT_EQ(phases, (std::vector<std::string>{"approach", "post_impact"}));
  ASSERT_EQ(there.status, CaptureStatus::completed) << there.failure;
  EXPECT_TRUE(there.ledger.pass());
  EXPECT_TRUE(there.captured());
  ASSERT_TRUE(there.impact() && here.impact());
  for (std::size_t i = 0; i < here.impact()->grasps.size(); ++i) {
    EXPECT_GT(here.impact()->grasps[i].impulse_magnitude, 0.01);
    EXPECT_EQ(norm(here.impact()->grasps[i].impulse - there.impact()->grasps[i].impulse), 0);
  }
  EXPECT_EQ(here.post_impact_end->joints.position, there.post_impact_end->joints.position);
  EXPECT_EQ(here.post_impact_end->time, there.post_impact_end->time);
  EXPECT_NEAR(here.ledger.scale.energy, there.ledger.scale.energy, 0.05 * here.ledger.scale.energy);
  for (const char* row : {"linear_momentum_drift", "angular_momentum_drift", "work_energy_residual", "energy_drift"}) {
    EXPECT_GT(entry(there, row), 0);
    std::printf("[ measured ] %s: %.2g here, %.2g there\n", row, entry(here, row), entry(there, row));
  }
}

// An external caller integrates the first part of every motion segment, the run the rest: balances equal those of both.
TEST(CaptureSteps, ExternalIntegrationOfFirstPart) {
  const CaptureProblem p = problem();
  const auto begun = [&](double deviation) {
    CaptureSteps steps(p, CaptureDetail::columns);
    while (const MotionTask* task = steps.next()) {
      Elsewhere e = integrate(*task, 0.4);
      EXPECT_TRUE(e.outcome.finished);
      e.measures.trees.back().linear_deviation += deviation;
      steps.integrated_in_part(e.outcome, e.measures, 0.1);
    }
    return steps.finish();
  };
  const CaptureResult there = begun(0), here = simulate_capture(p, {}, CaptureDetail::columns);
  ASSERT_EQ(there.status, CaptureStatus::completed) << there.failure;
  EXPECT_TRUE(there.ledger.pass());
  ASSERT_TRUE(there.impact() && here.impact());
  double off = 0;
  for (std::size_t i = 0; i < here.impact()->grasps.size(); ++i)
    off = std::max(off, norm(here.impact()->grasps[i].impulse - there.impact()->grasps[i].impulse));
  for (std::size_t j = 0; j < here.post_impact_end->joints.position.size(); ++j) {
    off = std::max(off, std::abs(here.post_impact_end->joints.position[j] - there.post_impact_end->joints.position[j]));
  }
  std::printf("[ measured ] a motion in two parts: %.2g off\n", off);
  EXPECT_LT(off, 1e-8);
  EXPECT_EQ(here.post_impact_end->time, there.post_impact_end->time);
  EXPECT_GT(there.cost.at(0).steps, 20);
  EXPECT_NEAR(static_cast<double>(there.cost.at(0).steps), static_cast<double>(here.cost.at(0).steps), 20);
  for (const char* row : {"linear_momentum_drift", "angular_momentum_drift", "work_energy_residual", "energy_drift"})
    EXPECT_LT(entry(there, row), 1e-9);
  EXPECT_GT(entry(begun(1e-3), "linear_momentum_drift"), 1e-5);
}

TEST(CaptureSteps, ExternalDeviationsCount) {
  const CaptureProblem p = problem();
  const auto with = [&](double TreeMeasures::*field, double value) {
    CaptureSteps steps(p, CaptureDetail::columns);
    while (const MotionTask* task = steps.next()) {
      Elsewhere e = integrate(*task);
      e.measures.trees.back().*field += value;
      steps.integrated(e.outcome, e.measures);
    }
    return steps.finish();
  };
  EXPECT_GT(entry(with(&TreeMeasures::linear_deviation, 1), "linear_momentum_drift"), 1e-3);
  EXPECT_GT(entry(with(&TreeMeasures::angular_deviation, 1), "angular_momentum_drift"), 1e-3);
  const CaptureResult r = with(&TreeMeasures::energy_deviation, 1e-3);
  EXPECT_GT(entry(r, "work_energy_residual"), 1e-5);
  EXPECT_GT(entry(r, "energy_drift"), 1e-5);
  EXPECT_FALSE(r.ledger.pass());
}

TEST(CaptureSteps, ExternalFailureFailsRun) {
  const CaptureProblem p = problem();
  CaptureSteps steps(p, CaptureDetail::columns);
  ASSERT_NE(steps.next(), nullptr);
  PhaseOutcome outcome;
  outcome.failure = "too many steps at t = 3";
  steps.integrated(outcome, {});
  EXPECT_EQ(steps.next(), nullptr);
  const CaptureResult r = steps.finish();
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_EQ(r.failure, "approach: too many steps at t = 3");
}

TEST(CaptureSteps, RecordedMotionIsIntegratedInternally) {
  const CaptureProblem p = problem();
  CaptureSteps recorded(p, CaptureDetail::full);
  const MotionTask* task = recorded.next();
  ASSERT_NE(task, nullptr);
  EXPECT_NE(task->only_here, "");
  EXPECT_THROW(recorded.integrated({}, {}), std::logic_error);
}

// Passes a motion segment to its observers, at the maximum interval.
void observe_task(const MotionTask& task) {
  PhaseDynamics dynamics(*task.model, *task.setup);
  const auto observe = [&](const PhaseSample& s) { task.watch(s.time, s.state, s.motor); };
  simulate_phase(dynamics, {task.start, task.begin, task.end, task.longest_look}, task.integration,
                 {.observe = observe});
}

TEST(CaptureSteps, ExternalIntegrationWithChecks) {
  CaptureProblem p = problem();
  watch_closely(p);
  CaptureSteps steps(p, CaptureDetail::columns);
  bool first = true;
  while (const MotionTask* task = steps.next()) {
    ASSERT_EQ(task->only_here, "");
    ASSERT_TRUE(task->watch);
    EXPECT_NEAR(task->longest_look, (task->end - task->begin) / 64, 1e-12);
    observe_task(*task);
    // next() integrates the first segment itself: the observed samples count once.
    if (std::exchange(first, false)) continue;
    const Elsewhere e = integrate(*task);
    steps.integrated(e.outcome, e.measures);
  }
  const CaptureResult there = steps.finish(), here = simulate_capture(p, {}, CaptureDetail::columns);
  ASSERT_EQ(there.status, CaptureStatus::completed) << there.failure;
  for (const char* row : {"joint_position_violation", "joint_rate_violation", "clearance_violation"}) {
    EXPECT_GT(entry(here, row), 1e-3) << row;
    std::printf("[ measured ] %s: %.6g here, %.6g there\n", row, entry(here, row), entry(there, row));
    EXPECT_NEAR(entry(there, row), entry(here, row), 1e-3 * entry(here, row)) << row;
  }
  EXPECT_GT(here.limit_events.size(), 2U);
  EXPECT_EQ(there.limit_events.size(), here.limit_events.size());
  EXPECT_EQ(there.clearance_events.size(), here.clearance_events.size());
  EXPECT_EQ(there.clearance.size(), here.clearance.size());
}

TEST(CaptureSteps, ImpactOnlyNeedsApproachOnly) {
  const CaptureProblem p = problem();
  CaptureSteps steps(p, CaptureDetail::columns, {}, CaptureSteps::Part::impact_only);
  int segments = 0;
  while (const MotionTask* task = steps.next()) {
    ++segments;
    steps.integrated(integrate(*task).outcome, {});
  }
  EXPECT_EQ(segments, 1);
  const CaptureResult there = steps.finish(), here = simulate_impact_only(p);
  ASSERT_TRUE(there.impact() && here.impact()) << there.failure;
  EXPECT_EQ(norm(here.impact()->grasps[0].impulse - there.impact()->grasps[0].impulse), 0);
  EXPECT_TRUE(there.ledger.pass());
}

// Free motion meets its energy bound, independent of the tolerance for driven motion.
TEST(CaptureSteps, LedgerPassesAtCampaignTolerances) {
  CaptureProblem p = problem();
  p.post_impact->duration = 50;
  p.integration.relative_tolerance = p.integration.absolute_tolerance = 1e-7;
  const CaptureResult coarse = simulate_capture(p, {}, CaptureDetail::columns);
  p.integration = {};
  const CaptureResult fine = simulate_capture(p, {}, CaptureDetail::columns);
  EXPECT_TRUE(coarse.ledger.pass());
  EXPECT_LT(entry(coarse, "energy_drift"), 1e-10);
  double error = 0;
  for (std::size_t j = 0; j < fine.post_impact_end->joints.position.size(); ++j)
    error = std::max(error,
                     std::abs(fine.post_impact_end->joints.position[j] - coarse.post_impact_end->joints.position[j]));
  EXPECT_LT(error, 1e-8);
  std::printf("[ measured ] end-state error %.2g at 1e-7 with %ld + %ld right-hand sides; work-energy %.2g\n", error,
              coarse.cost[0].rhs_evaluations, coarse.cost[1].rhs_evaluations, entry(coarse, "work_energy_residual"));
}

}  // namespace capture_steps_test
}  // namespace grapnel::testing
