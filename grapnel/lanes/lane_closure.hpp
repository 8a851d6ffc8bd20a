#pragma once

/// @file
/// Loop closures in packs: poses of their frames and closure defects. Constraints: constraint/loop_closure.hpp. Rows
/// for a single case: constraint/loop_columns.hpp.

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/spatial/pack.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel::lanes {

/// The parameters of one closure, as in LoopPath.
template <class S>
struct LaneClosure {
  Pose<S> X_aC, X_bD;
  Vector3<S> hinge_C;
  Vector3<S> turn_C[3];  // directions of the angular rows
  S angular_scale, linear_scale;

  const S& scale(const LoopTable& table, int row) const { return row < table.turn_rows ? angular_scale : linear_scale; }

  /// Loads a case's numbers (lane_phase_tables.hpp) into a lane.
  void load(int lane, const double* n) {
    load_pose(lane, n + kLoopAC, X_aC);
    load_pose(lane, n + kLoopBD, X_bD);
    for (int k = 0; k < 3; ++k) {
      hinge_C[k].set(lane, n[kLoopHinge + k]);
      for (int c = 0; c < 3; ++c) turn_C[k][c].set(lane, n[kLoopTurns + 3 * k + c]);
    }
    angular_scale.set(lane, n[kLoopAngularScale]);
    linear_scale.set(lane, n[kLoopLinearScale]);
  }

 private:
  static void load_pose(int lane, const double* n, Pose<S>& X) {
    for (int k = 0; k < 3; ++k) {
      X.p[k].set(lane, n[k]);
      for (int c = 0; c < 3; ++c) X.R.m[k][c].set(lane, n[3 + 3 * k + c]);
    }
  }
};

/// ClosureDefect in packs.
template <class S>
struct LaneDefect {
  S position, angle, velocity, angular_velocity;

  static LaneDefect none() { return {S(0.0), S(0.0), S(0.0), S(0.0)}; }
  /// Componentwise maximum.
  GRAPNEL_INLINE void raise(const LaneDefect& b) {
    position = max(position, b.position), angle = max(angle, b.angle);
    velocity = max(velocity, b.velocity), angular_velocity = max(angular_velocity, b.angular_velocity);
  }
  GRAPNEL_INLINE void take(const typename S::Mask& lanes, const LaneDefect& b) {
    position = select(lanes, b.position, position), angle = select(lanes, b.angle, angle);
    velocity = select(lanes, b.velocity, velocity);
    angular_velocity = select(lanes, b.angular_velocity, angular_velocity);
  }
  GRAPNEL_INLINE S largest_of_place() const { return max(position, angle); }
  GRAPNEL_INLINE S largest_of_motion() const { return max(velocity, angular_velocity); }
  GRAPNEL_INLINE S largest() const { return max(largest_of_place(), largest_of_motion()); }
  LaneLoopDefect get(int lane) const {
    return {position.get(lane), angle.get(lane), velocity.get(lane), angular_velocity.get(lane)};
  }
};

}  // namespace grapnel::lanes
