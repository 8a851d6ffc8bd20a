// Forward dynamics in lanes, per state: `forward_dynamics@avx512/a` etc. for all instruction sets supported here; with
// closed loops `loop_dynamics@avx512/a` etc.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <stdexcept>

#include "bench/dynamics_bench.hpp"
#include "bench/loop_workload.hpp"
#include "bench/operation_count.hpp"
#include "bench/workload.hpp"
#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/lanes/lane_loops_setup.hpp"
#include "grapnel/lanes/states.hpp"
#include "grapnel/spatial/dispatch.hpp"
#include "lane_kernels/kernel_table.hpp"

namespace grapnel::bench {
namespace {

using lanes::InstructionSet;

// Numbers in lanes, pack after pack: entry i of lane l of a pack is at [i * width + l].
class Packed {
 public:
  Packed(int packs, int entries, int width)
      : entries_(entries),
        width_(width),
        values_(
            static_cast<double*>(::operator new(static_cast<std::size_t>(packs* padded()) * sizeof(double), kAlign))) {}
  double* pack(int p) const { return values_.get() + p * padded(); }
  void put(int state, const std::vector<double>& x) {
    double* to = pack(state / width_) + state % width_;
    for (int i = 0; i < entries_; ++i) to[i * width_] = x[i];
  }

 private:
  static constexpr std::align_val_t kAlign{lanes::kLaneAlignment};
  struct Free {
    void operator()(double* x) const { ::operator delete(x, kAlign); }
  };
  int padded() const { return (entries_ * width_ + 7) / 8 * 8; }
  int entries_, width_;
  std::unique_ptr<double, Free> values_;
};

// A workload's states, at most eight per pack, and a model with the robot in every lane.
struct LaneWorkload {
  const lanes::KernelTable& kernels;
  int packs;
  Packed q, v, force, vdot, applied;
  std::vector<lanes::LoopTable> loops;
  std::unique_ptr<void, void (*)(void*)> model;

  LaneWorkload(const Workload& w, const std::vector<LoopClosure>& closures, InstructionSet set)
      : kernels(lanes::kernels(set)),
        packs(Workload::kCases / kernels.width),
        q(packs, w.model.coordinates(), kernels.width),
        v(packs, w.model.velocities(), kernels.width),
        force(packs, w.model.velocities(), kernels.width),
        vdot(1, w.model.velocities(), kernels.width),
        applied(1, w.model.velocities(), kernels.width),
        model(nullptr, kernels.destroy) {
    const Tree<double>& tree = w.model.tree();
    const std::vector<const TreeLink<double>*> links(static_cast<std::size_t>(kernels.width), tree.links.data());
    PhaseSetup setup;
    setup.closures = closures;
    loops = lanes::loop_tables(w.model, setup);
    const std::vector<double> numbers = lanes::loop_numbers(w.model, setup);
    const std::vector<const double*> same(links.size(), numbers.data());
    model.reset(kernels.create({links.data(), static_cast<int>(tree.links.size()), tree.coordinates, tree.velocities,
                                loops.data(), static_cast<int>(loops.size()), same.data()}));
    for (int i = 0; i < Workload::kCases; ++i) {
      q.put(i, w.states[i].q), v.put(i, w.states[i].v), force.put(i, w.forces[i].generalized);
    }
  }
  void run(int p) {
    const auto dynamics = loops.empty() ? kernels.forward_dynamics : kernels.loop_dynamics;
    dynamics(model.get(), {q.pack(p), v.pack(p), force.pack(p), nullptr, nullptr, nullptr, nullptr}, vdot.pack(0),
             applied.pack(0));
  }
};

// Stops if a state's accelerations differ from those computed without lanes.
void check(const LoopWorkload& workload, LaneWorkload& lanes) {
  const Workload& w = workload.base;
  const int width = lanes.kernels.width, n = w.model.velocities();
  LoopSolver solver(w.model, workload.closures);
  Workspace workspace(w.model);
  std::vector<double> alone(static_cast<std::size_t>(n)), force(alone);
  for (int i = 0; i < width * lanes.packs; ++i) {
    if (i % width == 0) lanes.run(i / width);
    DynamicsInput<double> in;
    in.q = w.states[i].q, in.v = w.states[i].v, in.force = w.forces[i].generalized;
    if (workload.closures.empty()) {
      articulated_body<double>(w.model.tree(), in, workspace.kernel, alone, force);
    } else {
      solver.accelerations(in, 0, workspace, alone, force);
    }
    double size = 0, apart = 0;
    for (int k = 0; k < n; ++k) {
      const double own = lanes.vdot.pack(0)[k * width + i % width];
      size = std::max(size, std::abs(alone[k])), apart = std::max(apart, std::abs(own - alone[k]));
    }
    if (!(apart <= 1e-10 * size)) throw std::runtime_error(w.name + ": accelerations in lanes differ");
  }
}

// `flops`: operations per state; 0: not counted.
void add(const std::string& function, const std::shared_ptr<const LoopWorkload>& workload, InstructionSet set,
         double flops) {
  const std::string name = function + "@" + std::string(lanes::name(set)) + "/" + workload->base.name;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& loop) {
    LaneWorkload lanes(workload->base, workload->closures, set);
    check(*workload, lanes);
    int p = 0;
    // A batch is one pack; times are per state.
    while (loop.KeepRunningBatch(lanes.kernels.width)) {
      lanes.run(p);
      benchmark::ClobberMemory();
      p = (p + 1) % lanes.packs;
    }
    if (flops > 0) loop.counters["flops"] = flops;
  });
}

// Derivatives of forward dynamics of 64 states at a time, as batches of grapnel::lanes::States, which convert the model
// and write results in rows. Times are per state.
void add_derivatives(const std::shared_ptr<const LoopWorkload>& workload, InstructionSet set) {
  const std::string name = "forward_dynamics_derivatives@" + std::string(lanes::name(set)) + "/" + workload->base.name;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& loop) {
    constexpr int kStates = 4 * Workload::kCases;
    const Workload& w = workload->base;
    const std::int64_t n = w.model.velocities();
    std::vector<double> q, v, force;
    for (int i = 0; i < kStates; ++i) {
      const int k = i % Workload::kCases;
      q.insert(q.end(), w.states[k].q.begin(), w.states[k].q.end());
      v.insert(v.end(), w.states[k].v.begin(), w.states[k].v.end());
      force.insert(force.end(), w.forces[k].generalized.begin(), w.forces[k].generalized.end());
    }
    std::vector<double> vdot(static_cast<std::size_t>(kStates * n)), dq(vdot.size() * static_cast<std::size_t>(n)),
        dv(dq), dtau(dq);
    lanes::StateCases in;
    in.count = kStates;
    in.q = {q.data(), w.model.coordinates()}, in.v = {v.data(), n}, in.force = {force.data(), n};
    in.forward = {vdot.data(), dq.data(), dv.data(), dtau.data(), nullptr};
    const lanes::States states(w.model, set);
    while (loop.KeepRunningBatch(kStates)) {
      states.run(in);
      benchmark::ClobberMemory();
    }
  });
}

}  // namespace

void register_lanes() {
  for (Workload& workload : targets()) {
    const double flops = count_forward_dynamics(workload).flops();
    const auto shared = std::make_shared<const LoopWorkload>(LoopWorkload{std::move(workload), {}, {}});
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      add("forward_dynamics", shared, set, flops);
      add_derivatives(shared, set);
    }
  }
  for (LoopWorkload& loops : loop_targets()) {
    const auto shared = std::make_shared<const LoopWorkload>(std::move(loops));
    for (const InstructionSet set : lanes::supported_instruction_sets()) add("loop_dynamics", shared, set, 0);
  }
}

}  // namespace grapnel::bench
