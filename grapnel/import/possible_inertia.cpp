#include "grapnel/import/assembly_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

Symmetric3d tensor_of(const PrincipalMoments& p) {
  return rotate(p.axes, Symmetric3d::diagonal(p.values[0], p.values[1], p.values[2]));
}

// The point of the cone {sum of c_k r_k, c_k >= 0} nearest to v, with the rays r = (0,1,1), (1,0,1), (1,1,0): c_k are
// second moments of mass. It lies on one of the faces that some of the rays span, so it is the nearest of the
// projections onto these whose coefficients are not negative.
Vector3d nearest_in_cone(const Vector3d& v) {
  const std::array<Vector3d, 3> rays{Vector3d{0, 1, 1}, Vector3d{1, 0, 1}, Vector3d{1, 1, 0}};
  Vector3d best = Vector3d::zero();
  double least = norm(v);
  const auto consider = [&](const Vector3d& x) {
    const double distance = norm(x - v);
    if (distance < least) best = x, least = distance;
  };
  for (int i = 0; i < 3; ++i) {
    consider(std::max(0.0, 0.5 * dot(rays[i], v)) * rays[i]);
    // Of two rays: r_i.r_i = 2 and r_i.r_j = 1, so the normal equations have the inverse [2 -1; -1 2] / 3.
    const Vector3d &a = rays[i], &b = rays[(i + 1) % 3];
    const double va = dot(a, v), vb = dot(b, v), ca = (2 * va - vb) / 3, cb = (2 * vb - va) / 3;
    if (ca >= 0 && cb >= 0) consider(ca * a + cb * b);
  }
  // Inside the cone: c_k = (sum of v) / 2 - v_k.
  const double half = 0.5 * (v[0] + v[1] + v[2]);
  if (half >= v[0] && half >= v[1] && half >= v[2]) return v;
  return best;
}

double largest_moment(const Vector3d& values) {
  return std::max({std::abs(values[0]), std::abs(values[1]), std::abs(values[2])});
}

}  // namespace

PrincipalMoments principal_moments(const Symmetric3d& inertia) {
  Eigen::MatrixXd matrix(3, 3);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix(i, j) = inertia(i, j);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  PrincipalMoments result{};
  for (int j = 0; j < 3; ++j) {
    result.values[j] = solver.eigenvalues()(j);
    for (int i = 0; i < 3; ++i) result.axes(i, j) = solver.eigenvectors()(i, j);
  }
  return result;
}

bool is_possible_inertia(const Symmetric3d& inertia) {
  const Vector3d moments = principal_moments(inertia).values;
  return 0.5 * (moments[0] + moments[1] + moments[2]) - moments[2] >= -2.5e-10 * largest_moment(moments);
}

Symmetric3d nearest_possible_inertia(const Symmetric3d& inertia, double flattest) {
  // The set of possible tensors does not depend on the axes, so the nearest one has those of the tensor (the nearest
  // matrix in a set that rotations leave unchanged: A. S. Lewis, Math. Oper. Res. 21 (1996) 576-588).
  PrincipalMoments p = principal_moments(inertia);
  const double least = flattest * largest_moment(p.values);
  const Vector3d offset = 2 * least * Vector3d{1, 1, 1};  // moments of three second moments of `least`
  const Vector3d nearest = nearest_in_cone(p.values - offset) + offset;
  if (norm(nearest - p.values) == 0) return inertia;
  p.values = nearest;
  return tensor_of(p);
}

std::optional<Symmetric3d> disc_of_planar_inertia(const Symmetric3d& inertia) {
  const PrincipalMoments p = principal_moments(inertia);
  const double I = p.values[2];
  if (!(I > 0) || std::abs(p.values[0]) > 1e-12 * I || std::abs(p.values[1]) > 1e-12 * I) return {};
  // I/2 (1 + n n^T) with the axis n.
  const Vector3d n = p.axes.column(2);
  const double h = 0.5 * I;
  return Symmetric3d{h + h * n[0] * n[0], h + h * n[1] * n[1], h + h * n[2] * n[2],
                     h * n[0] * n[1],     h * n[0] * n[2],     h * n[1] * n[2]};
}

}  // namespace grapnel
