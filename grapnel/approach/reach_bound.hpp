#pragma once

/// @file
/// Upper bound of the distance between an end-effector and a point that is invariant under joint motion.
///
/// Momentum conservation determines the centre of mass of a floating servicer independently of its joints. With m_i the
/// bodies' masses, M their sum and mu_j the share of M that joint j carries, the end-effector's position relative to
/// the centre of mass is a sum of vectors. Each vector is fixed in one body k; these are the links of the virtual
/// manipulator (Vafa and Dubowsky, 1990):
///   p_E - p_C = sum_k R_k v_k,
///   v_k = [k has E] p_kE + sum_(joints j on k) ([j is in the chain to E] - mu_j) p_kj - m_k/M c_k                  (1)
/// For arbitrary rotations of the bodies, |p_E - p_C| <= sum_k |v_k|. A prismatic joint with displacement s adds at
/// most |[j is in the chain to E] - mu_j| |s|. For a fixed base the same bound holds without masses, measured from the
/// point at which the base carries the arm.

#include "grapnel/model/model.hpp"

namespace grapnel {

struct ReachBound {
  /// Fixed base: the point from which the reach is measured, in the base's frame [m]. Floating base: zero, since the
  /// reach is measured from the centre of mass.
  Vector3d from = Vector3d::zero();
  double length = 0;  // [m]; infinite for a prismatic joint without limits
};

/// Bound for a frame of the tree rooted at `root`. `floats`: by (1), otherwise with a fixed root body.
ReachBound reach_bound(const Model& model, int root, int frame, bool floats);

}  // namespace grapnel
