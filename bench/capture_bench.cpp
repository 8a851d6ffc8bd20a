// A whole capture as a case of a campaign: approach, impact and post-impact motion in double. Every timed run checks
// the ledger's bounds and the end-state error.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <memory>
#include <string>

#include "bench/capture_workload.hpp"
#include "bench/dynamics_bench.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/simulate/tracking_noise.hpp"
#include "grapnel/spatial/scalar.hpp"

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

// n, n', n'' of the tracking noise of one joint; the baseline evaluates one tone after the other.
void tracking_noise(benchmark::State& state, bool by_tone) {
  const NoiseSignal noise(TrackingNoise{.position = 2e-5, .bandwidth = 5, .seed = 1}, 0);
  double t = 0;
  for (auto _ : state) {
    JointPoint n;
    if (by_tone) {
      for (const NoiseSignal::Tone& tone : noise.tones()) {
        const double w = tone.angular_frequency;
        const auto [sine, cosine] = sine_cosine(w * t + tone.phase);
        n.position += noise.amplitude() * cosine;
        n.rate -= w * (noise.amplitude() * sine);
        n.acceleration -= w * w * (noise.amplitude() * cosine);
      }
    } else {
      n = noise.at(t);
    }
    benchmark::DoNotOptimize(n);
    t += 1e-3;
  }
}

// The cost of a case without its motion: the same capture with phases of one or two steps.
void capture_alone(benchmark::State& state, CaptureProblem problem) {
  problem.approach->duration = problem.post_impact->duration = 1e-3;
  problem.integration.relative_tolerance = problem.integration.absolute_tolerance = 1e-3;
  problem.integration.max_step = 1;
  for (auto _ : state) {
    const CaptureResult result = simulate_capture(problem, {}, CaptureDetail::columns);
    if (!result.captured()) return state.SkipWithError(result.failure.c_str());
  }
}

// The same capture with driven joints. Controllers: none (prescribed approach, free joints afterwards), continuous, or
// sampled at 100 Hz. Recorded as a case of a campaign, or as a complete run.
CaptureProblem driven(CaptureProblem problem, bool has_controller, bool sampled) {
  if (has_controller) {
    const std::size_t joints = problem.joint_position.size();
    TrackingSetup& tracking = problem.approach->tracking;
    PostImpactSetup& after = *problem.post_impact;
    tracking.mode = JointControl::computed_torque, after.joints = PostImpactSetup::Joints::computed_torque;
    tracking.kp.assign(joints, 4), tracking.kd.assign(joints, 4);
    after.kp.assign(joints, 4), after.kd.assign(joints, 4);
  }
  problem.contact = {};  // captures despite small gaps
  if (sampled) problem.control.emplace().timing = {0.01, 0.01};
  return problem;
}

void controlled(benchmark::State& state, const CaptureProblem& problem, CaptureDetail detail) {
  long evaluations = 0, steps = 0;
  for (auto _ : state) {
    const CaptureResult result = simulate_capture(problem, {}, detail);
    if (!result.ledger.pass() || !result.post_impact_end)
      return state.SkipWithError("the ledger's bounds are not held");
    evaluations = steps = 0;
    for (const PhaseCost& cost : result.cost) evaluations += cost.rhs_evaluations, steps += cost.steps;
  }
  state.counters["rhs"] = static_cast<double>(evaluations);
  state.counters["steps"] = static_cast<double>(steps);
}

void register_controlled(const CaptureProblem& problem) {
  struct Case {
    const char* name;
    bool has_controller, sampled;
  };
  for (const Case& c :
       {Case{"none", false, false}, Case{"computed_torque", true, false}, Case{"computed_torque_100hz", true, true}}) {
    // With the tolerances and the output of `grapnel run`.
    const CaptureProblem file = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1.yaml");
    CaptureProblem bare = driven(problem, c.has_controller, c.sampled);
    bare.integration = file.integration;
    CaptureProblem run = bare;
    run.clearance = file.clearance, run.output_interval = file.output_interval;
    const std::string name = c.name;
    benchmark::RegisterBenchmark(("capture_controller/case/" + name).c_str(),
                                 [bare](benchmark::State& state) { controlled(state, bare, CaptureDetail::columns); });
    benchmark::RegisterBenchmark(("capture_controller/run/" + name).c_str(),
                                 [run](benchmark::State& state) { controlled(state, run, CaptureDetail::full); });
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
  register_controlled(workload->problem);
  benchmark::RegisterBenchmark("tracking_noise/joint", [](benchmark::State& state) { tracking_noise(state, false); });
  benchmark::RegisterBenchmark("tracking_noise/by_tone", [](benchmark::State& state) { tracking_noise(state, true); });
  benchmark::RegisterBenchmark("capture_without_motion/thesis1",
                               [workload](benchmark::State& state) { capture_alone(state, workload->problem); });
}

}  // namespace grapnel::bench
