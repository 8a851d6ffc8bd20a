#pragma once

/// @file
/// Rollouts: motion of a model from given initial states under given joint torques, many cases simultaneously, one per
/// SIMD lane on any number of threads. Intended for sampling, learning and predictive control with a fixed step.
/// Captures are integrated with error control (lane_phase.hpp).
///
/// The result of a case depends on this case alone, bit for bit: not on other cases, their number, threads, nor on the
/// instruction set among those with fused products. Thread safety: several threads may run one Rollout concurrently.

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "grapnel/lanes/lane_rollout_tables.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel::lanes {

/// rk4: the classical Runge-Kutta method of order 4. euler: semi-implicit Euler, velocities first, then coordinates
/// with the new velocities (order 1).
enum class RolloutMethod { rk4, euler };

struct RolloutSetup {
  double step = 0;   // [s]
  int substeps = 1;  // number of steps per control
  RolloutMethod method = RolloutMethod::rk4;
  Vector3d gravity = Vector3d::zero();  // uniform, in W [m/s^2]
  bool friction = true;                 // joint friction of the model
  std::vector<int> held;                // free roots (bodies) held against acceleration by an ideal wrench
};

/// Input and output: row-major, case after case. A state is [q; v]. A control is an effort per joint of Model::joints()
/// [N m or N], clipped at the joint's limit and constant for `substeps` steps.
struct RolloutData {
  std::int64_t cases = 0;
  std::int64_t steps = 0;           // controls per case
  std::span<const double> initial;  // cases x state
  std::span<const double> control;  // cases x steps x joints; empty: zero
  std::span<double> states;         // cases x steps x state, after each control; empty: not written
  std::span<double> last;           // cases x state, after the last control; empty: not written
};

class Rollout {
 public:
  /// The model must outlive it. @throws std::invalid_argument that states the invalid setting; std::runtime_error if
  /// GRAPNEL_LANES names an instruction set that this processor lacks.
  Rollout(const Model& model, const RolloutSetup& setup);
  Rollout(const Rollout&) = delete;
  Rollout& operator=(const Rollout&) = delete;

  int state_size() const { return tables_.coordinates + tables_.velocities; }
  int control_size() const { return tables_.controls; }

  /// `threads`: 0: one per processor. After an overflow the states are NaN. After a stop request, results not yet
  /// computed are left unchanged. @throws std::invalid_argument if sizes do not match.
  void run(const RolloutData& data, int threads = 0, const std::stop_token& stop = {}) const;

 private:
  std::vector<RolloutJoint> joints_;
  std::vector<std::uint8_t> held_;
  RolloutTables tables_{};
  void (*run_)(const RolloutTables&, const RolloutCases&) = nullptr;
  int width_ = 1;
};

}  // namespace grapnel::lanes
