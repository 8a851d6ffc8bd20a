#pragma once

/// @file
/// How far an end-effector can be from a place that the arm's motion does not move.
///
/// Momentum conservation says where a floating servicer's centre of mass is, whatever its joints do. With m_i the
/// bodies' masses, M their sum and mu_j the share of it that joint j carries, the end-effector's place relative to the
/// centre of mass is a sum of vectors that are each fixed in one body k, the links of the virtual manipulator (Vafa and
/// Dubowsky, 1990):
///   p_E - p_C = sum_k R_k v_k,   v_k = [k has E] p_kE + sum_(joints j on k) ([j on the way to E] - mu_j) p_kj - m_k/M
///   c_k
///                                                                                                                  (1)
/// Bodies turn as they like at most, so |p_E - p_C| <= sum_k |v_k|. A joint that slides by s adds at most
/// |[j on the way to E] - mu_j| |s|. On a base that stands still the same holds without masses, from the place where
/// the base carries the arm.

#include "grapnel/model/model.hpp"

namespace grapnel {

struct ReachBound {
  /// Of a base that stands still, where the reach is counted from, in the base's frame [m]; of one that floats it is
  /// counted from the centre of mass, and this is zero.
  Vector3d from = Vector3d::zero();
  double length = 0;  // [m]; infinite with a joint that slides without limits
};

/// Of a frame of the tree rooted at `root`. `floats`: by (1), else with the root's body still.
ReachBound reach_bound(const Model& model, int root, int frame, bool floats);

}  // namespace grapnel
