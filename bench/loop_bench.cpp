// Closed loops: accelerations with the constraint forces of the closures, and the impact that closes loops in velocity.
// A workload name without letters gives arms x joints per arm.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>

#include "bench/dynamics_bench.hpp"
#include "bench/loop_workload.hpp"
#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/constraint/loop_derivatives.hpp"

namespace grapnel::bench {
namespace {

using SharedLoops = std::shared_ptr<const LoopWorkload>;

void add_loops(const SharedLoops& loops) {
  benchmark::RegisterBenchmark(("loop_dynamics/" + loops->base.name).c_str(), [loops](benchmark::State& timer) {
    const Workload& w = loops->base;
    LoopSolver solver(w.model, loops->closures);
    Workspace workspace(w.model);
    std::vector<double> vdot(w.model.velocities()), force(vdot);
    int i = 0;
    for (auto _ : timer) {
      DynamicsInput<double> in;
      in.q = w.states[i].q, in.v = w.states[i].v, in.force = w.forces[i].generalized;
      solver.accelerations(in, 0, workspace, vdot, force);
      benchmark::DoNotOptimize(vdot.data());
      benchmark::ClobberMemory();
      i = (i + 1) % Workload::kCases;
    }
  });
  benchmark::RegisterBenchmark(("loop_dynamics_derivatives/" + loops->base.name).c_str(),
                               [loops](benchmark::State& timer) {
                                 const Workload& w = loops->base;
                                 LoopDerivatives derivatives(w.model, loops->closures);
                                 LoopDynamicsDerivatives result;
                                 int i = 0;
                                 for (auto _ : timer) {
                                   derivatives.evaluate(w.states[i], w.forces[i], {}, 0, result);
                                   benchmark::DoNotOptimize(result.motion.dq.data());
                                   benchmark::ClobberMemory();
                                   i = (i + 1) % Workload::kCases;
                                 }
                               });
  benchmark::RegisterBenchmark(("loop_impact/" + loops->base.name).c_str(), [loops](benchmark::State& timer) {
    const Workload& w = loops->base;
    LoopSolver solver(w.model, loops->closures);
    Workspace workspace(w.model);
    std::vector<double> v(w.model.velocities());
    int i = 0;
    for (auto _ : timer) {
      std::copy(loops->open[i].begin(), loops->open[i].end(), v.begin());
      solver.close_velocities(w.states[i].q, {}, workspace, v);
      benchmark::DoNotOptimize(v.data());
      benchmark::ClobberMemory();
      i = (i + 1) % Workload::kCases;
    }
  });
}

}  // namespace

void register_loops() {
  for (LoopWorkload& loops : loop_targets()) add_loops(std::make_shared<const LoopWorkload>(std::move(loops)));
  for (LoopWorkload& loops : more_loops()) add_loops(std::make_shared<const LoopWorkload>(std::move(loops)));
}

}  // namespace grapnel::bench
