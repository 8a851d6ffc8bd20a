#pragma once

/// @file
/// Input of rollouts with Grapnel and other engines: cases of one robot with efforts that change from step to step.

#include <vector>

#include "bench/workload.hpp"

namespace grapnel::bench {

struct RolloutWorkload {
  static constexpr int kCases = 64, kSteps = 20;
  static constexpr double kStep = 0.01;  // [s]
  Workload base;
  std::vector<double> initial;  // kCases x [q; v]
  std::vector<double> control;  // kCases x kSteps x joints
  int state_size = 0, control_size = 0;
};

/// For the robots (a) and (b) of targets().
inline std::vector<RolloutWorkload> rollout_targets() {
  std::vector<RolloutWorkload> result;
  for (Workload& base : targets()) {
    RolloutWorkload w{std::move(base), {}, {}};
    w.state_size = w.base.model.coordinates() + w.base.model.velocities();
    w.control_size = static_cast<int>(w.base.model.joints().size());
    for (int i = 0; i < RolloutWorkload::kCases; ++i) {
      const State& state = w.base.states[i % Workload::kCases];
      w.initial.insert(w.initial.end(), state.q.begin(), state.q.end());
      w.initial.insert(w.initial.end(), state.v.begin(), state.v.end());
      for (int k = 0; k < RolloutWorkload::kSteps; ++k) {
        const std::vector<double>& force = w.base.forces[(i + k) % Workload::kCases].generalized;
        w.control.insert(w.control.end(), force.begin() + 6, force.end());
      }
    }
    result.push_back(std::move(w));
  }
  return result;
}

}  // namespace grapnel::bench
