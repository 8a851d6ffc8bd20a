/// Planning: from targets and grasp points to joint trajectories, for scenarios that are shipped.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include "bench/dynamics_bench.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "tests/plan/tilted_arms.hpp"

namespace grapnel::bench {
namespace {

void plan(benchmark::State& state, const char* file) {
  const CaptureProblem problem = load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + file);
  const TargetPlan targets = plan_targets(problem);
  long evaluations = 0;
  for (auto _ : state) {
    const ApproachPlan result = plan_approach(problem, targets);
    if (!result.failure.empty()) return state.SkipWithError(result.failure.c_str());
    evaluations = result.report.rhs_evaluations;
  }
  state.counters["rhs"] = static_cast<double>(evaluations);
}

// Two arms with tilted axes, drawn from a seed: the search alone.
void plan_tilted(benchmark::State& state, unsigned first, unsigned count) {
  std::vector<testing::TiltedArms> cases;
  for (unsigned i = 0; i < count; ++i) cases.push_back(testing::tilted_arms(first + i));
  long evaluations = 0;
  std::vector<double> times(count, std::numeric_limits<double>::infinity());  // least, per case
  for (auto _ : state) {
    for (unsigned i = 0; i < count; ++i) {
      FloatingBase base(cases[i].model, true);
      const auto begin = std::chrono::steady_clock::now();
      const ReachSolution result = plan_reach(base, cases[i].problem);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      if (!result.found) return state.SkipWithError(result.failure.c_str());
      times[i] = std::min(times[i], took.count());
      evaluations = result.rhs_evaluations;
    }
  }
  std::sort(times.begin(), times.end());
  state.counters["median_ms"] = 1e3 * times[times.size() / 2];
  state.counters["rhs"] = static_cast<double>(evaluations);
}

}  // namespace

void register_plan() {
  benchmark::RegisterBenchmark("plan/tilted_arms/0", [](benchmark::State& state) { plan_tilted(state, 0, 1); });
  benchmark::RegisterBenchmark("plan/tilted_arms/50", [](benchmark::State& state) {
    plan_tilted(state, 0, 50);
  })->Unit(benchmark::kMillisecond);
  const std::pair<const char*, const char*> workloads[] = {{"plan/thesis6", "thesis/open-loop-case-1-planned.yaml"},
                                                           {"plan/first6", "first-plan.yaml"},
                                                           {"plan/dual14", "dual-arm-tumbling-targets.yaml"},
                                                           {"plan/six42", "six-arm-servicer.yaml"}};
  for (const auto& [name, file] : workloads) {
    const char* path = file;
    benchmark::RegisterBenchmark(name, [path](benchmark::State& state) { plan(state, path); });
  }
}

}  // namespace grapnel::bench
