/// Planning: joint trajectories from targets and grasp points, for shipped scenarios.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>

#include "bench/dynamics_bench.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "tests/capture/impossible_plans.hpp"
#include "tests/plan/tilted_arms.hpp"

namespace grapnel::bench {
namespace {

// `objective` replaces that of the scenario, which may also state the final joint values.
void plan(benchmark::State& state, const char* file, std::optional<ObjectiveKind> objective) {
  CaptureProblem problem = load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + file);
  if (objective) {
    problem.approach->final_position.clear();
    problem.approach->plan = PlanSetup{};
    problem.approach->plan->objective = *objective;
  }
  const TargetPlan targets = plan_targets(problem);
  long evaluations = 0;
  for (auto _ : state) {
    const ApproachPlan result = plan_approach(problem, targets);
    if (!result.failure.empty()) return state.SkipWithError(result.failure.c_str());
    evaluations = result.report.rhs_evaluations;
  }
  state.counters["rhs"] = static_cast<double>(evaluations);
}

// The time to find that no plan exists.
void refuse(benchmark::State& state, const testing::ImpossiblePlan& impossible) {
  const CaptureProblem problem = impossible.problem();
  long evaluations = 0;
  for (auto _ : state) {
    const testing::PlanAnswer result = testing::answer(problem);
    if (result.failure.find(impossible.reason) == std::string::npos)
      return state.SkipWithError(("not refused for the reason expected: " + result.failure).c_str());
    evaluations = result.rhs_evaluations;
  }
  state.counters["rhs"] = static_cast<double>(evaluations);
}

// Two arms with tilted axes, drawn from 50 seeds: the search alone. Its time is the median of the minimum times of the
// cases.
void plan_tilted(benchmark::State& state) {
  constexpr unsigned kCases = 50;
  std::vector<testing::TiltedArms> cases;
  for (unsigned seed = 0; seed < kCases; ++seed) cases.push_back(testing::tilted_arms(seed));
  std::vector<double> times(kCases, std::numeric_limits<double>::infinity());
  for (auto _ : state) {
    for (unsigned i = 0; i < kCases; ++i) {
      FloatingBase base(cases[i].model, true);
      const auto begin = std::chrono::steady_clock::now();
      const ReachSolution result = plan_reach(base, cases[i].problem);
      const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
      if (!result.found) return state.SkipWithError(result.failure.c_str());
      times[i] = std::min(times[i], took.count());
    }
  }
  std::nth_element(times.begin(), times.begin() + kCases / 2, times.end());
  state.counters["microseconds"] = times[kCases / 2];
}

}  // namespace

void register_plan() {
  benchmark::RegisterBenchmark("plan/tilted_arms", plan_tilted);
  const std::pair<const char*, const char*> workloads[] = {{"plan/thesis6", "thesis/open-loop-case-1-planned.yaml"},
                                                           {"plan/first6", "first-plan.yaml"},
                                                           {"plan/dual14", "dual-arm-tumbling-targets.yaml"},
                                                           {"plan/six42", "six-arm-servicer.yaml"}};
  for (const auto& [name, file] : workloads) {
    const char* path = file;
    benchmark::RegisterBenchmark(name, [path](benchmark::State& state) { plan(state, path, std::nullopt); });
  }
  for (const testing::ImpossiblePlan& impossible : testing::impossible_plans()) {
    benchmark::RegisterBenchmark(("plan/refused/" + impossible.name).c_str(),
                                 [impossible](benchmark::State& state) { refuse(state, impossible); });
  }
  const std::pair<const char*, ObjectiveKind> objectives[] = {{"plan/effort14", ObjectiveKind::effort},
                                                              {"plan/base_motion14", ObjectiveKind::base_motion},
                                                              {"plan/impulse14", ObjectiveKind::impulse}};
  for (const auto& [name, objective] : objectives) {
    const ObjectiveKind kind = objective;
    benchmark::RegisterBenchmark(
        name, [kind](benchmark::State& state) { plan(state, "seven-joint-dual-capture.yaml", kind); });
  }
}

}  // namespace grapnel::bench
