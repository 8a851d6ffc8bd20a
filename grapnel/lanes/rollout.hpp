#pragma once

/// @file
/// Rollouts: what a model does from given states under given joint torques, many cases at once, one in every SIMD lane
/// and on as many threads as are wanted. For sampling, learning and predictive control, where a fixed step is enough;
/// captures are integrated with error control (lane_phase.hpp).
///
/// A case's numbers depend on the case alone, bit for bit: not on the cases beside it, their number, threads, nor on
/// the instruction set among those with fused products. Thread safety: a Rollout may be run by several threads at once.

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "grapnel/lanes/lane_rollout_tables.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel::lanes {

/// rk4: the classic Runge-Kutta method of order 4. euler: semi-implicit Euler, velocities first, then coordinates with
/// the new ones (order 1).
enum class RolloutMethod { rk4, euler };

struct RolloutSetup {
  double step = 0;   // [s]
  int substeps = 1;  // steps of this length under one control
  RolloutMethod method = RolloutMethod::rk4;
  Vector3d gravity = Vector3d::zero();  // uniform, in W [m/s^2]
  bool friction = true;                 // of the joints, as the model describes it
  std::vector<int> held;                // free roots (bodies) that an ideal wrench keeps from accelerating
};

/// What goes in and comes out: row-major, case after case. A state is [q; v], a control an effort per joint of
/// Model::joints() [N m or N], cut at the joint's limit and constant for `substeps` steps.
struct RolloutData {
  std::int64_t cases = 0;
  std::int64_t steps = 0;           // controls per case
  std::span<const double> initial;  // cases x state
  std::span<const double> control;  // cases x steps x joints; empty: zero
  std::span<double> states;         // cases x steps x state, after each control; empty: not wanted
  std::span<double> last;           // cases x state, after the last one; empty: not wanted
};

class Rollout {
 public:
  /// The model must outlive it. @throws std::invalid_argument naming what is wrong with the setup; std::runtime_error
  /// if GRAPNEL_LANES names an instruction set that does not run here.
  Rollout(const Model& model, const RolloutSetup& setup);
  Rollout(const Rollout&) = delete;
  Rollout& operator=(const Rollout&) = delete;

  int state_size() const { return tables_.coordinates + tables_.velocities; }
  int control_size() const { return tables_.controls; }

  /// `threads`: 0: one per processor. Where numbers overflow the states go on as not-a-number. After a stop request
  /// what has not been computed is left as it is. @throws std::invalid_argument if sizes do not fit.
  void run(const RolloutData& data, int threads = 0, const std::stop_token& stop = {}) const;

 private:
  std::vector<RolloutJoint> joints_;
  std::vector<std::uint8_t> held_;
  RolloutTables tables_{};
  void (*run_)(const RolloutTables&, const RolloutCases&) = nullptr;
  int width_ = 1;
};

}  // namespace grapnel::lanes
