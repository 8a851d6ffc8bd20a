#include "grapnel/contact/cage_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace grapnel {
InnerPolyhedron::InnerPolyhedron(const ContactShape& shape) : half_(shape.core().half), round_(shape.core().round) {
  if (shape.core().hull || is_half_space(shape)) return;
  if (!round_) {
    for (int k = 0; k < 3; ++k) {
      if (half_[k] > 0) edges_.push_back(Vector3d::unit(k));
    }
    if (edges_.size() == 3) normals_ = edges_;
    return;
  }
  normals_.push_back({0, 0, 1}), edges_.push_back({0, 0, 1});
  constexpr double kStep = std::numbers::pi / kRimPairs;
  for (int i = 0; i < kRimPairs; ++i) {
    const double corner = kStep * i, middle = kStep * (i + 0.5);
    rim_[i] = {half_[0] * std::cos(corner), half_[0] * std::sin(corner)};
    normals_.push_back({std::cos(middle), std::sin(middle), 0});
    edges_.push_back({-std::sin(middle), std::cos(middle), 0});
  }
  lack_ = half_[0] * (1 - std::cos(0.5 * kStep));
}

double InnerPolyhedron::support(const Vector3d& n) const {
  const double axial = half_[2] * std::abs(n[2]);
  if (!round_) return half_[0] * std::abs(n[0]) + half_[1] * std::abs(n[1]) + axial;
  double radial = 0;
  for (const auto& corner : rim_) radial = std::max(radial, std::abs(n[0] * corner[0] + n[1] * corner[1]));
  return radial + axial;
}

OverlapPair::OverlapPair(const PlacedContactShape& fixed, const ContactShape& moving)
    : X_FA_(fixed.X_FB * fixed.shape.X_BC()),
      fixed_(fixed.shape),
      moving_(moving),
      a_(fixed.shape),
      b_(moving),
      is_exact_(!is_half_space(fixed.shape) && !fixed.shape.core().hull && !moving.core().hull),
      contact_(fixed.shape, moving, ContactLaw{}),
      X_FFixed_(fixed.X_FB) {}

DistanceRange OverlapPair::to_half_space(const Posed& X_FB) const {
  const Vector3d outward = X_FA_.R.column(2);
  const Vector3d lowest = support(moving_.core(), transposed_times(X_FB.R, -outward));
  const double distance = dot(outward, X_FB * lowest - X_FA_.p) - moving_.core().rounding;
  return {distance, distance};
}

// Pose of the moving core in the frame of the fixed one => bounds by the normals of their Minkowski difference. It is
// symmetric about the difference of both origins, so that one of two opposite normals suffices.
DistanceRange OverlapPair::by_normals(const Posed& X_AB, double enough) const {
  const double rounding = fixed_.core().rounding + moving_.core().rounding;
  const double outside = rounding + a_.lack() + b_.lack();
  double depth = kFarApart;  // least over the normals
  const auto is_apart = [&](const Vector3d& n) {
    const double h = a_.support(n) + b_.support(transposed_times(X_AB.R, n)) - std::abs(dot(n, X_AB.p));
    depth = std::min(depth, h);
    return -depth - outside > enough;
  };
  const double length = norm(X_AB.p);
  if (length > 0 && is_apart((1 / length) * X_AB.p)) return {-depth - outside, kFarApart};
  for (const Vector3d& n : a_.normals()) {
    if (is_apart(n)) return {-depth - outside, kFarApart};
  }
  for (const Vector3d& n : b_.normals()) {
    if (is_apart(X_AB.R * n)) return {-depth - outside, kFarApart};
  }
  for (const Vector3d& e : b_.edges()) {
    const Vector3d edge = X_AB.R * e;
    for (const Vector3d& d : a_.edges()) {
      const Vector3d n = cross(d, edge);
      const double size = norm(n);
      if (size > 1e-9 && is_apart((1 / size) * n)) return {-depth - outside, kFarApart};
    }
  }
  if (depth >= 0) return {-depth - outside, -depth - rounding};
  if (rounding == 0) return {-depth - outside, kFarApart};
  const ConvexDistance apart = convex_distance({fixed_.core(), moving_.core(), X_AB});
  if (!apart.separated) return {-depth - outside, -rounding};
  const double distance = norm(apart.difference) - rounding;
  return {distance, distance};
}

DistanceRange OverlapPair::distance(const Posed& X_FM, double enough) const {
  const Posed X_FB = X_FM * moving_.X_BC();
  if (is_half_space(fixed_)) return to_half_space(X_FB);
  const double bound = norm(X_FB.p - X_FA_.p) - fixed_.reach() - moving_.reach();
  if (bound > enough) return {bound, kFarApart};
  if (!is_exact_) {
    const double distance = separation(X_FM);
    return {distance, distance};
  }
  const ConvexCore &a = fixed_.core(), &b = moving_.core();
  if (a.is_segment() && b.is_segment()) {
    const Vector3d d = a.half[2] * X_FA_.R.column(2), e = b.half[2] * X_FB.R.column(2);
    const ConvexDistance apart = segment_distance(X_FA_.p - d, X_FA_.p + d, X_FB.p - e, X_FB.p + e);
    const double distance = norm(apart.difference) - a.rounding - b.rounding;
    return {distance, distance};
  }
  return by_normals(inverse(X_FA_) * X_FB, enough);
}

}  // namespace grapnel
