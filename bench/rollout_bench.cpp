// Rollouts with a fixed step size, on one thread, per step of a case: `rollout_rk4@avx512/a` etc.
#include <benchmark/benchmark.h>

#include <memory>
#include <string>

#include "bench/dynamics_bench.hpp"
#include "bench/rollout_workload.hpp"
#include "grapnel/lanes/rollout.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel::bench {
namespace {

void add(const std::shared_ptr<const RolloutWorkload>& workload, lanes::RolloutMethod method) {
  const auto set = lanes::best_instruction_set().value_or(lanes::InstructionSet::one_lane);
  const std::string name = std::string(method == lanes::RolloutMethod::rk4 ? "rollout_rk4" : "rollout_euler") + "@" +
                           std::string(lanes::name(set)) + "/" + workload->base.name;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& loop) {
    lanes::RolloutSetup setup;
    setup.step = RolloutWorkload::kStep, setup.method = method;
    const lanes::Rollout rollout(workload->base.model, setup);
    std::vector<double> states(workload->initial.size() * RolloutWorkload::kSteps);
    lanes::RolloutData data;
    data.cases = RolloutWorkload::kCases, data.steps = RolloutWorkload::kSteps;
    data.initial = workload->initial, data.control = workload->control, data.states = states;
    while (loop.KeepRunningBatch(RolloutWorkload::kCases * RolloutWorkload::kSteps)) {
      rollout.run(data, 1);
      benchmark::ClobberMemory();
    }
  });
}

}  // namespace

void register_rollouts() {
  for (RolloutWorkload& workload : rollout_targets()) {
    const auto shared = std::make_shared<const RolloutWorkload>(std::move(workload));
    add(shared, lanes::RolloutMethod::rk4);
    add(shared, lanes::RolloutMethod::euler);
  }
}

}  // namespace grapnel::bench
