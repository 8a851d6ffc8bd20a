/// Planning: from targets and grasp points to joint trajectories, for scenarios that are shipped.

#include <benchmark/benchmark.h>

#include "bench/dynamics_bench.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/scenario/scenario.hpp"

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

}  // namespace

void register_plan() {
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
