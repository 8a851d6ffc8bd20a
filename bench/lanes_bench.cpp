// Forward dynamics in lanes, per state: `forward_dynamics@avx512/a` and so on, with whatever sets run here.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <new>

#include "bench/dynamics_bench.hpp"
#include "bench/operation_count.hpp"
#include "bench/workload.hpp"
#include "grapnel/lanes/dispatch.hpp"
#include "lane_kernels/kernel_table.hpp"

namespace grapnel::bench {
namespace {

using lanes::InstructionSet;

// Numbers in lanes: entry i of a pack's lane l at [i * width + l], pack after pack.
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

// A workload's states, eight or fewer to a pack, and a model with the robot in every lane.
struct LaneWorkload {
  const lanes::KernelTable& kernels;
  int packs;
  Packed q, v, force, vdot, applied;
  std::unique_ptr<void, void (*)(void*)> model;

  LaneWorkload(const Workload& w, InstructionSet set)
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
    model.reset(kernels.create({links.data(), static_cast<int>(tree.links.size()), tree.coordinates, tree.velocities}));
    for (int i = 0; i < Workload::kCases; ++i) {
      q.put(i, w.states[i].q), v.put(i, w.states[i].v), force.put(i, w.forces[i].generalized);
    }
  }
  void run(int p) {
    kernels.forward_dynamics(model.get(), {q.pack(p), v.pack(p), force.pack(p), nullptr, nullptr, nullptr, nullptr},
                             vdot.pack(0), applied.pack(0));
  }
};

void add(const std::shared_ptr<const Workload>& workload, InstructionSet set) {
  const std::string name = "forward_dynamics@" + std::string(lanes::name(set)) + "/" + workload->name;
  const double flops = count_forward_dynamics(*workload).flops();
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& loop) {
    LaneWorkload lanes(*workload, set);
    int p = 0;
    // A batch is a pack: times are per state.
    while (loop.KeepRunningBatch(lanes.kernels.width)) {
      lanes.run(p);
      benchmark::ClobberMemory();
      p = (p + 1) % lanes.packs;
    }
    loop.counters["flops"] = flops;
  });
}

}  // namespace

void register_lanes() {
  for (Workload& workload : targets()) {
    const auto shared = std::make_shared<const Workload>(std::move(workload));
    for (const InstructionSet set : lanes::supported_instruction_sets()) add(shared, set);
  }
}

}  // namespace grapnel::bench
