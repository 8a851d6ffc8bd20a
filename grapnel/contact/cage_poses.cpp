#include "grapnel/contact/cage_poses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace grapnel {
namespace {

// Ball around balls, with the mean of their bounding box as its centre.
Ball ball_around(const std::vector<Ball>& balls) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Vector3d low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  for (const Ball& ball : balls) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], ball.center[k] - ball.radius);
      high[k] = std::max(high[k], ball.center[k] + ball.radius);
    }
  }
  Ball all{0.5 * (low + high), 0};
  for (const Ball& ball : balls) all.radius = std::max(all.radius, norm(ball.center - all.center) + ball.radius);
  return all;
}

std::vector<Ball> balls_of(const std::vector<ContactShape>& shapes) {
  std::vector<Ball> balls;
  for (const ContactShape& shape : shapes) balls.push_back({shape.X_BC().p, shape.reach()});
  return balls;
}

bool is_sphere(const ContactShape& shape) { return shape.kind() == ContactShape::Kind::sphere; }

bool is_round(const ContactShape& shape) {
  return is_sphere(shape) || shape.kind() == ContactShape::Kind::capsule ||
         shape.kind() == ContactShape::Kind::cylinder;
}

RotationSpace rotation_space(const std::vector<ContactShape>& shapes, const Vector3d& center, double size) {
  const double negligible = 1e-12 * size;
  RotationSpace space;
  if (!std::ranges::all_of(shapes, is_round)) return space;
  const auto axial = std::ranges::find_if_not(shapes, is_sphere);
  if (axial == shapes.end()) {
    if (std::ranges::all_of(shapes, [&](const auto& s) { return norm(s.X_BC().p - center) <= negligible; }))
      space.dims = 0;
    return space;
  }
  const Rotationd& R = axial->X_BC().R;
  const Vector3d axis = R.column(2);
  const auto coaxial = [&](const ContactShape& shape) {
    if (norm(cross(axis, shape.X_BC().p - center)) > negligible) return false;
    return is_sphere(shape) || norm(cross(axis, shape.X_BC().R.column(2))) <= 1e-12;
  };
  if (std::ranges::all_of(shapes, coaxial)) space = {2, {R.column(0), R.column(1), axis}};
  return space;
}

bool is_half_space(const ContactShape& shape) { return shape.kind() == ContactShape::Kind::half_space; }

}  // namespace

// Cage => bounds of its parts and the allowance (24.3).
CagePoses::CagePoses(const Cage& cage, double resolution, double allowance) : cage_(cage) {
  if (cage.moving.empty()) throw std::invalid_argument("search_cage: the moving body has no shape");
  body_ = ball_around(balls_of(cage.moving));
  rotations_ = rotation_space(cage.moving, body_.center, body_.radius);
  for (const ContactShape& shape : cage.moving) add_inner_balls(shape);
  std::vector<Ball> fixed;
  for (const PlacedContactShape& one : cage.fixed) {
    for (const ContactShape& moving : cage.moving)
      pairs_.push_back({one.X_FB, PairContact(one.shape, moving, ContactLaw{}), one.shape, moving});
    if (!is_half_space(one.shape)) fixed.push_back({one.X_FB * one.shape.X_BC().p, one.shape.reach()});
  }
  for (std::size_t i = 0; i < pairs_.size(); ++i) order_.push_back(i);
  if (!fixed.empty()) {
    const Ball all = ball_around(fixed);
    leave_ = norm(all.center - cage.X_FM * body_.center) + all.radius + body_.radius;
  }
  resolution_ = resolution > 0 ? resolution : 0.01 * body_.radius;
  const double overlap = -distance(cage.X_FM, std::numeric_limits<double>::infinity());
  allowance_ = std::max(allowance, 2 * resolution_ + std::max(0.0, overlap));
}

Ball CagePoses::inner_ball() const {
  const InnerBall& ball = *std::ranges::max_element(inner_, {}, &InnerBall::radius);
  return {ball.p_M, ball.radius};
}

Posed CagePoses::pose(const Vector3d& displacement, const Rotationd& rotation) const {
  const Rotationd R = cage_.X_FM.R * rotation;
  return {R, cage_.X_FM * body_.center + displacement - R * body_.center};
}

// Lower bound of the distance, by spheres.
double CagePoses::Pair::bound(const Posed& X_FM) const {
  const Vector3d center = X_FM * moving.X_BC().p, p = X_FB * fixed.X_BC().p;
  if (is_half_space(fixed)) return dot(X_FB.R * fixed.X_BC().R.column(2), center - p) - moving.reach();
  return norm(center - p) - moving.reach() - fixed.reach();
}

double CagePoses::distance(const Posed& X_FM, double enough) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Pair& pair = pairs_[order_[i]];
    if (pair.bound(X_FM) + allowance_ > std::min(least, enough)) continue;
    least = std::min(least, pair.contact.separation(pair.X_FB, X_FM).distance + allowance_);
    if (least >= -enough) continue;
    std::swap(order_[i], order_[0]);  // probably overlaps in the next pose, too
    break;
  }
  return least;
}

// Shape => balls on a grid inside of it, each as large as possible; small ones are left out.
void CagePoses::add_inner_balls(const ContactShape& shape) {
  constexpr int kMostPerSide = 7;
  constexpr double kLeastShare = 0.5;  // of the largest radius
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

bool CagePoses::overlaps_inner(const PlacedContactShape& fixed, const Posed& X_FM, const CageMotion& motion) const {
  const Posed X_CM = inverse(fixed.X_FB * fixed.shape.X_BC()) * X_FM;
  const double rounding = fixed.shape.kind() == ContactShape::Kind::half_space ? 0 : fixed.shape.core().rounding;
  if (norm(X_CM * body_.center) > fixed.shape.reach() + body_.radius) return false;
  return std::ranges::any_of(inner_, [&](const InnerBall& ball) {
    const double moves = motion.translation + ball.arm * motion.angle + allowance_;
    if (moves >= ball.radius + fixed.shape.reach()) return false;
    return ball.radius + rounding - fixed.shape.distance(X_CM * ball.p_M).distance > moves;
  });
}

bool CagePoses::stays_overlapping(const Posed& X_FM, const CageMotion& motion) {
  if (!cage_.fixed.empty() && overlaps_inner(cage_.fixed[last_overlap_], X_FM, motion)) return true;
  for (std::size_t i = 0; i < cage_.fixed.size(); ++i) {
    if (i == last_overlap_ || !overlaps_inner(cage_.fixed[i], X_FM, motion)) continue;
    last_overlap_ = i;
    return true;
  }
  return false;
}

}  // namespace grapnel
