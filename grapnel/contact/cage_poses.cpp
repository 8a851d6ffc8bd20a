#include "grapnel/contact/cage_poses.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace {

std::vector<PlacedContactShape> placed(const std::vector<ContactShape>& shapes) {
  std::vector<PlacedContactShape> all;
  for (const ContactShape& shape : shapes) all.push_back({Posed::identity(), shape});
  return all;
}

// The smallest half width of a shape, up to its rounding [m].
double thinness(const ContactShape& shape) {
  const Vector3d& half = shape.half_extents();
  return std::min({half[0], half[1], half[2]}) + shape.core().rounding;
}

// A hundredth of the body's radius, or a tenth of the smallest half thickness, so that the allowance remains small
// beside all shapes.
double default_resolution(const Cage& cage, double radius) {
  double least = 0.01 * radius;
  for (const ContactShape& shape : cage.moving) least = std::min(least, 0.1 * thinness(shape));
  for (const PlacedContactShape& one : cage.fixed) {
    if (!is_half_space(one.shape)) least = std::min(least, 0.1 * thinness(one.shape));
  }
  return least;
}

// Adds the axes of a shape that are not parallel to those of the list.
void add_axes(const Rotationd& R, std::vector<Vector3d>& axes) {
  constexpr std::size_t kMost = 24;
  constexpr double kSame = 1e-2;  // [rad]
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = R.column(k);
    const auto is_same = [&](const Vector3d& other) { return norm(cross(axis, other)) < kSame; };
    if (axes.size() < kMost && std::ranges::none_of(axes, is_same)) axes.push_back(axis);
  }
}

}  // namespace

Ball ball_around(const std::vector<PlacedContactShape>& shapes) {
  Vector3d low{kFarApart, kFarApart, kFarApart}, high = -low;
  const auto center = [](const PlacedContactShape& one) { return one.X_FB * one.shape.X_BC().p; };
  for (const PlacedContactShape& one : shapes) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], center(one)[k] - one.shape.reach());
      high[k] = std::max(high[k], center(one)[k] + one.shape.reach());
    }
  }
  Ball all{0.5 * (low + high), 0};
  for (const PlacedContactShape& one : shapes)
    all.radius = std::max(all.radius, norm(center(one) - all.center) + one.shape.reach());
  return all;
}

// Cage => bounds of its parts and the allowance (24.3).
CagePoses::CagePoses(const Cage& cage, double resolution, double allowance) : cage_(cage) {
  if (cage.moving.empty()) throw std::invalid_argument("search_cage: the moving body has no shape");
  body_ = ball_around(placed(cage.moving));
  resolution_ = resolution > 0 ? resolution : default_resolution(cage, body_.radius);
  rotations_ = rotation_space(cage.moving, body_.center);
  std::vector<PlacedContactShape> fixed;
  for (const ContactShape& moving : cage.moving) {
    const std::size_t first = inner_.size();
    add_inner_balls(moving);
    const double arm = rotations_.dims > 0 ? arm_of(moving) : 0;
    arm_ = std::max(arm_, arm);
    for (const PlacedContactShape& one : cage.fixed)
      pairs_.push_back({OverlapPair(one, moving), arm, first, inner_.size()});
  }
  for (const PlacedContactShape& one : cage.fixed) {
    if (!is_half_space(one.shape)) fixed.push_back(one);
  }
  for (const ContactShape& shape : cage.moving) add_axes(shape.X_BC().R, moving_axes_);
  for (const PlacedContactShape& one : cage.fixed) add_axes(one.X_FB.R * one.shape.X_BC().R, fixed_axes_);
  for (std::size_t i = 0; i < pairs_.size(); ++i) order_.push_back(i);
  if (!fixed.empty()) {
    const Ball all = ball_around(fixed);
    leave_ = norm(all.center - cage.X_FM * body_.center) + all.radius + body_.radius;
  }
  double overlap = 0;
  for (const Pair& pair : pairs_) {
    if (pair.shapes.distance(cage.X_FM, 0).low < 0) overlap = std::max(overlap, -pair.shapes.separation(cage.X_FM));
  }
  allowance_ = std::max(allowance, 2 * resolution_ + overlap);
}

Posed CagePoses::pose(const Vector3d& displacement, const Rotationd& rotation) const {
  const Rotationd R = cage_.X_FM.R * rotation;
  return {R, cage_.X_FM * body_.center + displacement - R * body_.center};
}

// Largest distance of the core's points from the body's centre.
double CagePoses::arm_of(const ContactShape& shape) const {
  const Vector3d p = inverse(shape.X_BC()) * body_.center;
  const Vector3d& half = shape.core().half;
  const double x = std::abs(half[0]), z = std::abs(p[2]) + std::abs(half[2]);
  if (shape.core().round) return std::hypot(std::hypot(p[0], p[1]) + x, z);
  return std::hypot(std::abs(p[0]) + x, std::abs(p[1]) + std::abs(half[1]), z);
}

CageOverlap CagePoses::overlap(const Posed& X_FM, const CageMotion& motion) {
  CageOverlap found{CageOverlap::Kind::free, -kFarApart, arm_};
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Pair& pair = pairs_[order_[i]];
    const double displacement = motion.translation + pair.arm * motion.angle;
    const DistanceRange distance = pair.shapes.distance(X_FM, displacement - allowance_);
    if (distance.low + allowance_ > displacement) continue;
    found.kind = CageOverlap::Kind::mixed;
    const double ratio = -(distance.low + allowance_) / displacement;
    if (ratio > found.ratio) found.ratio = ratio, found.arm = pair.arm;
    if (!(distance.high + allowance_ < -displacement) && !note_balls(pair, X_FM, motion, found)) continue;
    std::swap(order_[i], order_[0]);  // probably overlaps in the next pose, too
    found.kind = CageOverlap::Kind::blocked;
    break;
  }
  return found;
}

double CagePoses::free_share(const Posed& X_FM, const CageMotion& motion) const {
  double share = 1;
  for (const Pair& pair : pairs_) {
    const double displacement = motion.translation + pair.arm * motion.angle;
    const DistanceRange range = pair.shapes.distance(X_FM, share * displacement - allowance_);
    if (range.low + allowance_ >= share * displacement) continue;
    const double distance = (range.low < range.high ? pair.shapes.separation(X_FM) : range.low) + allowance_;
    if (distance < share * displacement) share = distance / displacement;
    if (share < 0) break;
  }
  return share;
}

// Shape => balls on a grid inside of it, each as large as possible; small ones are left out.
void CagePoses::add_inner_balls(const ContactShape& shape) {
  constexpr int kMostPerSide = 5;
  constexpr double kLeastShare = 0.5;  // of the largest radius
  if (shape.core().is_point()) return;
  const double rounding = shape.core().rounding;
  const Vector3d half = shape.half_extents() + Vector3d{rounding, rounding, rounding};
  const double largest = std::min({half[0], half[1], half[2]});
  const auto count = [&](double extent) {
    const int balls =
        static_cast<int>(std::floor(std::min(2 * extent / largest, 100.0))) | 1;  // odd: one at the centre
    return std::min(balls, kMostPerSide);
  };
  const auto place = [](double extent, int i, int n) { return extent * ((2 * i + 1.0) / n - 1); };
  const int n0 = count(half[0]), n1 = count(half[1]), n2 = count(half[2]);
  for (int i = 0; i < n0; ++i) {
    for (int j = 0; j < n1; ++j) {
      for (int k = 0; k < n2; ++k) {
        const Vector3d p{place(half[0], i, n0), place(half[1], j, n1), place(half[2], k, n2)};
        const double radius = rounding - shape.distance(p).distance;
        if (radius < kLeastShare * largest) continue;
        const Vector3d p_M = shape.X_BC() * p;
        inner_.push_back({p_M, radius, norm(p_M - body_.center)});
      }
    }
  }
}

// Whether a ball inside of the moving shape remains in contact with the fixed one; balls near the centre move less than
// the shape's other points.
bool CagePoses::note_balls(const Pair& pair, const Posed& X_FM, const CageMotion& motion, CageOverlap& found) const {
  if (pair.balls == pair.end) return false;
  const ContactShape& fixed = pair.shapes.fixed();
  const Posed X_CM = inverse(pair.shapes.X_FA()) * X_FM;
  const double rounding = is_half_space(fixed) ? 0 : fixed.core().rounding;
  for (std::size_t i = pair.balls; i < pair.end; ++i) {
    const InnerBall& ball = inner_[i];
    const double displacement = motion.translation + ball.arm * motion.angle;
    if (displacement + allowance_ >= ball.radius + fixed.reach()) continue;
    const Vector3d p_C = X_CM * ball.p_M;
    if (norm(p_C) >= ball.radius + fixed.reach()) continue;
    const double overlap = ball.radius + rounding - fixed.distance(p_C).distance - allowance_;
    if (overlap > found.ratio * displacement) found.ratio = overlap / displacement, found.arm = ball.arm;
    if (overlap > displacement) return true;
  }
  return false;
}

}  // namespace grapnel
