#pragma once

/// @file
/// Which tensors are inertias: a body's principal moments are sums of two of three second moments of its mass, none of
/// which is negative. Hence no moment is above the sum of the others.

#include <optional>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// I = axes diag(values) axes^T, values in ascending order.
struct PrincipalMoments {
  Vector3d values;
  Rotationd axes;
};
PrincipalMoments principal_moments(const Symmetric3d& inertia);

/// Whether a body, though it may be thin or a point, can have it: no second moment is below zero by more than
/// 2.5e-10 of the largest moment, as rounded data are.
bool is_possible_inertia(const Symmetric3d& inertia);

/// The possible inertia nearest in the Frobenius norm; itself if it is possible. `flattest`: how small second moments
/// may be, relative to the largest moment; above 0 the result is positive definite unless `inertia` is zero.
Symmetric3d nearest_possible_inertia(const Symmetric3d& inertia, double flattest = 0);

/// Of a tensor with one principal moment I alone, as models in the plane have: that of a thin disc across its axis,
/// with I/2 about the other two. Empty for any other tensor.
std::optional<Symmetric3d> disc_of_planar_inertia(const Symmetric3d& inertia);

}  // namespace grapnel
