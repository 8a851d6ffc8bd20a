// Closed loops: accelerations with the closures' forces, the impact that closes loops in velocity, and the plastic
// impact of several arms on one target. A workload's name without letters is arms x joints of each.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>

#include "bench/dynamics_bench.hpp"
#include "bench/loop_workload.hpp"
#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel::bench {
namespace {

using Shared = std::shared_ptr<const LoopWorkload>;

void add_loops(const Shared& loops) {
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

// Ends of all arms grip one free body at once, rigidly.
void add_plastic_impact(int arms) {
  ModelBuilder builder = describe_robot(arms, 7, true);
  BodyDescription target;
  target.name = target.joint.name = "target";
  target.joint.type = JointType::free;
  target.mass = 200;
  target.inertia = Symmetric3d::diagonal(30, 40, 50);
  builder.add(target);
  const auto workload = std::make_shared<const Workload>(make_workload(std::to_string(arms) + "x7", builder.build()));
  benchmark::RegisterBenchmark(("plastic_impact/" + workload->name).c_str(), [workload, arms](benchmark::State& timer) {
    const Model& model = workload->model;
    std::vector<std::vector<Grasp>> grasps(Workload::kCases);
    for (int i = 0; i < Workload::kCases; ++i) {
      const Kinematics k = forward_kinematics(model, workload->states[i]);
      for (int arm = 0; arm < arms; ++arm) {
        const int hand = model.body_index("link" + std::to_string(arm) + ".6");
        grasps[i].push_back(
            {hand, model.body_index("target"), GraspModel::rigid, k.X_WB[hand] * Vector3d{1, 0, 0}, {0, 0, 1}});
      }
    }
    int i = 0;
    for (auto _ : timer) {
      benchmark::DoNotOptimize(plastic_impact(model, workload->states[i], grasps[i]));
      i = (i + 1) % Workload::kCases;
    }
  });
}

}  // namespace

void register_loops() {
  for (LoopWorkload& loops : loop_targets()) add_loops(std::make_shared<const LoopWorkload>(std::move(loops)));
  for (LoopWorkload& loops : more_loops()) add_loops(std::make_shared<const LoopWorkload>(std::move(loops)));
  for (int arms : {2, 3, 6}) add_plastic_impact(arms);
}

}  // namespace grapnel::bench
