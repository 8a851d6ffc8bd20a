#pragma once

/// @file
/// State of a model: coordinates and generalized velocities. Public, kept stable.

#include <vector>

#include "grapnel/model/model.hpp"

namespace grapnel {

/// The coordinates q and velocities v are documented in Model.
template <class S>
struct BasicState {
  std::vector<S> q;
  std::vector<S> v;
};
using State = BasicState<double>;

/// State at rest: all joints at zero, free roots at the world's origin, unit quaternions.
State zero_state(const Model& model);

/// Pose of a free root (or the constant pose of a fixed one) X_WB.
Posed root_pose(const Model& model, const State& state, int body);
void set_root_pose(const Model& model, int body, const Posed& X_WB, State& state);
/// Twist of a free root, V_WB at B's origin, expressed in W (zero for a fixed root).
Twistd root_twist(const Model& model, const State& state, int body);
void set_root_twist(const Model& model, int body, const Twistd& V_WB, State& state);

/// Moves all free roots to the world's origin and keeps the velocities: for quantities relative to a tree, which would
/// lose accuracy at a large distance.
void move_roots_to_origin(const Model& model, State& state);

}  // namespace grapnel
