#pragma once

/// @file
/// The planar linkages as Grapnel models: a spanning tree and the closure of the loop. Their plane is the xy plane of
/// the base body, whose origin is at pivot A.

#include "grapnel/constraint/loop_closure.hpp"
#include "oracle/five_bar.hpp"
#include "oracle/four_bar.hpp"

namespace grapnel::oracle {

/// Position of the loop closure. pin_hinge, pin_point: at the last pivot, with five or three rows, of which two are
/// independent in the plane. cut: the last bar is divided into two coincident halves, welded by a rigid closure (three
/// of six rows).
enum class LinkageCut { pin_hinge, pin_point, cut };

struct Linkage {
  Model model;
  std::vector<LoopClosure> closures;
};

/// Bodies "base", "crank", "coupler", "rocker" and, for a cut rocker, "half" on the coupler. With a fixed root the base
/// is at `X_WA`. `thickness`: offset of the centres of mass from the plane, alternately above and below [m]; then the
/// motion is planar only on the ground.
Linkage four_bar_model(const FourBar& bars, LinkageCut cut, bool floating, const Posed& X_WA, double thickness = 0);
/// The joints' part of q or v, for the crank at angle f (turning at `rate`): fills the joints' entries of `state`.
void set_four_bar(const FourBar& bars, const Model& model, double f, double rate, State& state);

/// Bodies "base", "crank0", "crank1", "coupler0", "coupler1" and, for a cut second coupler, "half" on coupler0.
Linkage five_bar_model(const FiveBar& bars, LinkageCut cut, const Posed& X_WA, double thickness = 0);
void set_five_bar(const FiveBar& bars, const Model& model, const Vector2& x, const Vector2& rate, State& state);

/// Coordinate and velocity of a body's joint.
double joint_angle(const Model& model, const State& state, const char* body);
double joint_value(const Model& model, const std::vector<double>& values, const char* body);

}  // namespace grapnel::oracle
