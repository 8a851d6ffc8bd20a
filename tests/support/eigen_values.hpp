#pragma once

/// @file
/// Conversion of Grapnel's values to Eigen's, for tests with linear algebra.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel::testing {

inline Eigen::Map<const Eigen::VectorXd> eigen(const std::vector<double>& x) {
  return {x.data(), static_cast<Eigen::Index>(x.size())};
}
inline Eigen::Vector3d eigen(const Vector3d& x) { return {x[0], x[1], x[2]}; }
inline Eigen::Matrix3d eigen(const Rotationd& R) {
  Eigen::Matrix3d m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m(i, j) = R(i, j);
  }
  return m;
}
inline Eigen::Matrix3d eigen(const Symmetric3d& A) {
  Eigen::Matrix3d m;
  m << A.xx, A.xy, A.xz, A.xy, A.yy, A.yz, A.xz, A.yz, A.zz;
  return m;
}
template <SpatialKind kKind>
Eigen::Matrix<double, 6, 1> eigen(const SpatialVector<kKind, double>& V) {
  Eigen::Matrix<double, 6, 1> v;
  v << eigen(V.angular), eigen(V.linear);
  return v;
}
inline std::vector<double> values(const Eigen::VectorXd& x) { return {x.data(), x.data() + x.size()}; }

/// |a - b| / |b|, or |a| if b is zero.
template <class A, class B>
double relative_difference(const A& a, const B& b) {
  const double size = b.norm();
  return (a - b).norm() / (size > 0 ? size : 1);
}

}  // namespace grapnel::testing
