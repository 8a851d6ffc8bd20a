#include "bench/dynamics_bench.hpp"

#include <benchmark/benchmark.h>

#include <memory>

#include "bench/flexible_workload.hpp"
#include "bench/operation_count.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/dynamics/workspace.hpp"

namespace grapnel::bench {
namespace {

using Shared = std::shared_ptr<const Workload>;

// Registers `body(state, forces)`, which cycles through the cases.
template <class Make>
void add(const std::string& function, const Shared& workload, double flops, Make make) {
  benchmark::RegisterBenchmark((function + "/" + workload->name).c_str(), [=](benchmark::State& loop) {
    auto body = make(*workload);
    int i = 0;
    for (auto _ : loop) {
      body(workload->states[i], workload->forces[i]);
      i = (i + 1) % Workload::kCases;
    }
    if (flops > 0) loop.counters["flops"] = flops;
  });
}

void add_forward_dynamics(const Shared& workload) {
  add("forward_dynamics", workload, count_forward_dynamics(*workload).flops(), [](const Workload& w) {
    return [&w, workspace = Workspace(w.model), vdot = std::vector<double>(w.model.velocities())](
               const State& state, const Forces& forces) mutable {
      forward_dynamics(w.model, state, forces, workspace, vdot);
      benchmark::DoNotOptimize(vdot.data());
      benchmark::ClobberMemory();
    };
  });
}

void add_derivatives(const Shared& workload) {
  add("forward_dynamics_derivatives", workload, 0, [](const Workload& w) {
    return [&w, workspace = make_derivatives_workspace(w.model), result = ForwardDynamicsDerivatives{}](
               const State& state, const Forces& forces) mutable {
      forward_dynamics_derivatives(w.model, state, forces, *workspace, result);
      benchmark::DoNotOptimize(result.dq.data());
      benchmark::ClobberMemory();
    };
  });
  add("inverse_dynamics_derivatives", workload, 0, [](const Workload& w) {
    return [&w, workspace = make_derivatives_workspace(w.model), result = InverseDynamicsDerivatives{}](
               const State& state, const Forces& forces) mutable {
      inverse_dynamics_derivatives(w.model, state, forces.generalized, {}, *workspace, result);
      benchmark::DoNotOptimize(result.dq.data());
      benchmark::ClobberMemory();
    };
  });
}

void add_others(const Shared& workload) {
  add("inverse_dynamics", workload, count_inverse_dynamics(*workload).flops(), [](const Workload& w) {
    // Accelerations differ between cases too; they reuse the numbers of the forces.
    return [&w, workspace = Workspace(w.model), tau = std::vector<double>(w.model.velocities())](
               const State& state, const Forces& forces) mutable {
      inverse_dynamics(w.model, state, forces.generalized, {}, workspace, tau);
      benchmark::DoNotOptimize(tau.data());
      benchmark::ClobberMemory();
    };
  });
  add("bias", workload, 0, [](const Workload& w) {
    return [&w, workspace = Workspace(w.model), c = std::vector<double>(w.model.velocities())](const State& state,
                                                                                               const Forces&) mutable {
      bias(w.model, state, Vector3d::zero(), workspace, c);
      benchmark::DoNotOptimize(c.data());
      benchmark::ClobberMemory();
    };
  });
  add("mass_matrix", workload, count_mass_matrix(*workload).flops(), [](const Workload& w) {
    return [&w, workspace = Workspace(w.model), M = Eigen::MatrixXd(w.model.velocities(), w.model.velocities())](
               const State& state, const Forces&) mutable {
      mass_matrix(w.model, state, workspace, M);
      benchmark::DoNotOptimize(M.data());
      benchmark::ClobberMemory();
    };
  });
  add("generalized_jacobian", workload, 0, [](const Workload& w) {
    return [&w, frame = w.model.frame_index("tip")](const State& state, const Forces&) {
      benchmark::DoNotOptimize(generalized_jacobian(w.model, state, 0, frame));
    };
  });
  add("generalized_inertia", workload, 0, [](const Workload& w) {
    return
        [&w](const State& state, const Forces&) { benchmark::DoNotOptimize(generalized_inertia(w.model, state, 0)); };
  });
}

}  // namespace

void register_dynamics() {
  for (Workload& workload : targets()) {
    const auto shared = std::make_shared<const Workload>(std::move(workload));
    add_forward_dynamics(shared);
    add_derivatives(shared);
    add_others(shared);
  }
  for (FlexibleWorkload& flexible : flexible_targets(Cut::gauss)) {
    benchmark::AddCustomContext("" + flexible.workload.name, flexible.description());
    add_forward_dynamics(std::make_shared<const Workload>(std::move(flexible.workload)));
  }
  for (Workload& workload : chains()) add_forward_dynamics(std::make_shared<const Workload>(std::move(workload)));
}

}  // namespace grapnel::bench
