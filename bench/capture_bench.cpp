// A whole capture as a case of a campaign: approach, impact and motion afterwards in plain double. The ledger's bounds
// and the end-state error are checked in every timed run.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <memory>

#include "bench/capture_workload.hpp"
#include "bench/dynamics_bench.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel::bench {
namespace {

void capture(benchmark::State& state, const CaptureWorkload& workload) {
  long evaluations = 0;
  for (auto _ : state) {
    const CaptureResult result = simulate_capture(workload.problem, {}, CaptureDetail::columns);
    if (!result.ledger.pass() || !result.captured()) return state.SkipWithError("the ledger's bounds are not held");
    if (end_error(workload, end_numbers(*result.post_impact_end)) > kEndError)
      return state.SkipWithError("the end state is not reached");
    evaluations = result.cost[0].rhs_evaluations + result.cost[1].rhs_evaluations;
  }
  state.counters["rhs"] = static_cast<double>(evaluations);
}

// What a case costs besides its motion: the same capture with phases that are over in a step or two.
void capture_alone(benchmark::State& state, CaptureProblem problem) {
  problem.approach->duration = problem.post_impact->duration = 1e-3;
  problem.integration.relative_tolerance = problem.integration.absolute_tolerance = 1e-3;
  problem.integration.max_step = 1;
  for (auto _ : state) {
    const CaptureResult result = simulate_capture(problem, {}, CaptureDetail::columns);
    if (!result.captured()) return state.SkipWithError(result.failure.c_str());
  }
}

}  // namespace

void register_capture() {
  const auto workload = std::make_shared<const CaptureWorkload>(thesis_capture());
  const CaptureResult once = simulate_capture(workload->problem, {}, CaptureDetail::columns);
  fmt::print(stderr, "capture/thesis1: end-state error {:.2g} with {} + {} right-hand sides\n",
             end_error(*workload, end_numbers(*once.post_impact_end)), once.cost[0].rhs_evaluations,
             once.cost[1].rhs_evaluations);
  for (const LedgerEntry& e : once.ledger.entries) {
    if (e.applies && e.bound > 0) fmt::print(stderr, "  {} {:.2g} (bound {:.0e})\n", e.name, e.value, e.bound);
  }
  benchmark::RegisterBenchmark("capture/thesis1", [workload](benchmark::State& state) { capture(state, *workload); });
  benchmark::RegisterBenchmark("capture_without_motion/thesis1",
                               [workload](benchmark::State& state) { capture_alone(state, workload->problem); });
}

}  // namespace grapnel::bench
