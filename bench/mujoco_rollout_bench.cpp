// MuJoCo's steps of the same robots, states and efforts, with the same methods and step sizes, on one thread.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "bench/dynamics_bench.hpp"
#include "bench/rollout_workload.hpp"
#include "engines/mujoco_rollout.hpp"
#include "grapnel/lanes/rollout.hpp"

namespace grapnel::bench {
namespace {

// Both must give the same result before they are timed: the same steps by Euler's method, the same motion by RK4, for
// which the engines integrate quaternions differently.
void check(const RolloutWorkload& w, bool rk4) {
  const std::size_t size = static_cast<std::size_t>(w.state_size), steps = RolloutWorkload::kSteps;
  std::vector<double> ours(w.initial.size() * steps), theirs(size * steps);
  lanes::RolloutSetup setup;
  setup.step = RolloutWorkload::kStep;
  setup.method = rk4 ? lanes::RolloutMethod::rk4 : lanes::RolloutMethod::euler;
  lanes::RolloutData data;
  data.cases = RolloutWorkload::kCases, data.steps = RolloutWorkload::kSteps;
  data.initial = w.initial, data.control = w.control, data.states = ours;
  lanes::Rollout(w.base.model, setup).run(data, 1);
  testing::MujocoRollout peer(w.base.model, RolloutWorkload::kStep, rk4);
  double largest = 0;
  for (std::size_t i = 0; i < RolloutWorkload::kCases; ++i) {
    peer.run({w.initial.data() + i * size, size},
             {w.control.data() + i * steps * static_cast<std::size_t>(w.control_size),
              steps * static_cast<std::size_t>(w.control_size)},
             theirs);
    for (std::size_t k = 0; k < theirs.size(); ++k)
      largest = std::max(largest, std::abs(ours[i * size * steps + k] - theirs[k]));
  }
  const double bound = rk4 ? 1e-3 : 1e-8;
  if (!(largest <= bound))
    throw std::runtime_error(fmt::format("rollout/{}: MuJoCo's states differ by {:.3g}", w.base.name, largest));
  fmt::print(stderr, "rollout_{}/{}: largest difference to MuJoCo's states {:.2g}\n", rk4 ? "rk4" : "euler",
             w.base.name, largest);
}

void add(const std::shared_ptr<const RolloutWorkload>& workload, bool rk4) {
  check(*workload, rk4);
  const std::string name = fmt::format("mujoco:rollout_{}/{}", rk4 ? "rk4" : "euler", workload->base.name);
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& loop) {
    testing::MujocoRollout peer(workload->base.model, RolloutWorkload::kStep, rk4);
    const std::size_t size = static_cast<std::size_t>(workload->state_size), steps = RolloutWorkload::kSteps;
    const std::size_t controls = steps * static_cast<std::size_t>(workload->control_size);
    std::vector<double> states(size * steps);
    std::size_t i = 0;
    while (loop.KeepRunningBatch(RolloutWorkload::kSteps)) {
      peer.run_as_it_is({workload->initial.data() + i * size, size},
                        {workload->control.data() + i * controls, controls}, states);
      benchmark::ClobberMemory();
      i = (i + 1) % RolloutWorkload::kCases;
    }
  });
}

}  // namespace

void register_mujoco_rollouts() {
  for (RolloutWorkload& workload : rollout_targets()) {
    const auto shared = std::make_shared<const RolloutWorkload>(std::move(workload));
    add(shared, true);
    add(shared, false);
  }
}

}  // namespace grapnel::bench
