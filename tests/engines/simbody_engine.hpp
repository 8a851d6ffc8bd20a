#pragma once

/// @file
/// A Grapnel model in Simbody, without rotors: Simbody's mobilizers have no reflected inertia.

#include "engines/simbody_bridge.hpp"
#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel::testing {

std::array<double, 3> plain(const Vector3d& v);
std::array<double, 9> plain(const Rotationd& R);  // row by row
std::vector<SimbodyBody> plain_bodies(const Model& model);

class SimbodyEngine {
 public:
  explicit SimbodyEngine(const Model& model, std::span<const LoopClosure> closures = {});
  /// Accelerations of Grapnel's velocities, with the closures enforced.
  std::vector<double> acceleration(const State& state, const Forces& forces);
  /// Velocity after the impulses that close all loops.
  std::vector<double> closed_velocity(const State& state) { return bridge_.closed_velocity(state.q, state.v); }

 private:
  SimbodyBridge bridge_;
};

}  // namespace grapnel::testing
