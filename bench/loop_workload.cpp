#include "bench/loop_workload.hpp"

#include <random>
#include <stdexcept>

#include "grapnel/constraint/constrained_dynamics.hpp"

namespace grapnel::bench {

LoopWorkload make_loops(const std::string& name, int arms, int joints, bool alternate) {
  LoopWorkload loops{make_workload(name, arms, joints, alternate), {}, {}};
  const Model& model = loops.base.model;
  const State first = loops.base.states[0];
  const Kinematics kinematics = forward_kinematics(model, first);
  for (int arm = 0; arm + 1 < arms; ++arm) {
    LoopClosure closure;
    closure.name = "ends of arms " + std::to_string(arm) + " and " + std::to_string(arm + 1);
    closure.body_a = model.body_index("link" + std::to_string(arm) + "." + std::to_string(joints - 1));
    closure.body_b = model.body_index("link" + std::to_string(arm + 1) + "." + std::to_string(joints - 1));
    closure.X_AC = {Rotationd::identity(), {1, 0, 0}};
    closure.X_BD = inverse(kinematics.X_WB[closure.body_b]) * (kinematics.X_WB[closure.body_a] * closure.X_AC);
    loops.closures.push_back(closure);
  }
  // The first state is consistent. The others: its joint angles are perturbed slightly, then projected onto the
  // closures.
  LoopSolver solver(model, loops.closures);
  Workspace workspace(model);
  std::mt19937_64 generator(4711);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (State& state : loops.base.states) {
    loops.open.push_back(state.v);
    const State drawn = state;
    bool converged = false;
    for (double step = 0.2; step > 1e-3 && !converged; step *= 0.7) {
      state = drawn;
      for (int joint : model.joints()) {
        const int q = model.bodies()[joint].q;
        state.q[q] = first.q[q] + (&state == loops.base.states.data() ? 0 : step * uniform(generator));
      }
      converged = solver.project({}, workspace, state.q, state.v).converged;
    }
    if (!converged) throw std::runtime_error(name + ": no further state of the closed loops found");
  }
  return loops;
}

std::vector<LoopWorkload> loop_targets() {
  std::vector<LoopWorkload> result;
  result.push_back(make_loops("a", 2, 3, false));
  result.push_back(make_loops("b", 2, 7, true));
  return result;
}

std::vector<LoopWorkload> more_loops() {
  std::vector<LoopWorkload> result;
  for (int joints = 14; joints <= 56; joints *= 2) {
    result.push_back(make_loops("2x" + std::to_string(joints), 2, joints, true));
  }
  result.push_back(make_loops("3x7", 3, 7, true));
  result.push_back(make_loops("4x7", 4, 7, true));
  return result;
}

}  // namespace grapnel::bench
