#pragma once

/// @file
/// A Grapnel model in Simbody. Rotors are left out: Simbody's mobilizers have no reflected inertia.
/// Thread safety: one thread per object.

#include "engines/simbody_bridge.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel::testing {

class SimbodyEngine {
 public:
  explicit SimbodyEngine(const Model& model);
  /// Accelerations of Grapnel's velocities.
  std::vector<double> acceleration(const State& state, const Forces& forces);

 private:
  SimbodyBridge bridge_;
};

}  // namespace grapnel::testing
