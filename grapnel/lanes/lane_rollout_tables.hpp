#pragma once

/// @file
/// Input and output of the lane rollouts: plain tables of numbers. Only these pass between portable code and the
/// translation units of the instruction sets. Filled by Rollout; documented in rollout.hpp.

#include <cstdint>

#include "grapnel/model/tree.hpp"

namespace grapnel::lanes {

/// A joint driven by a control.
struct RolloutJoint {
  int velocity;   // index into the velocities
  double effort;  // limit [N m or N]; infinite: no limit
  bool is_viscous, has_coulomb;
  double viscous, coulomb, inverse_transition;
};

struct RolloutTables {
  const TreeLink<double>* links;
  int link_count;
  int coordinates;
  int velocities;
  const int* quaternions;  // offsets of the coordinates' unit quaternions
  int quaternion_count;
  const RolloutJoint* joints;  // per control
  int controls;
  const std::uint8_t* held;  // per velocity: its acceleration is zero; null: none
  double gravity[3];         // in W [m/s^2]
  double step;               // [s]
  int substeps;              // per control
  bool is_euler;             // semi-implicit Euler, else RK4
};

/// Cases of equal length, one after the other, row-major; a state has coordinates + velocities numbers.
struct RolloutCases {
  const double* initial;  // per case
  const double* control;  // per case and step; null: zero
  double* states;         // per case and step, after it; null: not written
  double* last;           // per case, after its last step; null: not written
  std::int64_t steps;
  std::int64_t begin, end;  // the cases to compute
  /// Polled periodically: returns whether to stop. Null: never.
  bool (*stop)(void* context);
  void* context;
};

// The function of an instruction set, defined in lane_rollout_set.cpp.
template <class Set>
void run_lane_rollout_of(const RolloutTables& tables, const RolloutCases& cases);

}  // namespace grapnel::lanes
