#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

// Unit axis and angle of the rotation from one orientation to another, in the first one's frame.
std::pair<Vector3d, double> turn_between(const Quaterniond& from, const Quaterniond& to) {
  const Vector3d turn = rotation_vector(transpose(rotation_matrix(from)) * rotation_matrix(to));
  const double angle = norm(turn);
  return {angle > 0 ? (1 / angle) * turn : Vector3d{1, 0, 0}, angle};
}

}  // namespace

EscapeTree::EscapeTree(const CagePoses& poses, long& count) : poses_(poses), count_(count) {
  nodes_.push_back({Vector3d::zero(), Quaterniond::identity()});
}

bool EscapeTree::grow(long evaluations) {
  if (has_left(nodes_[0])) return true;
  constexpr double kAlongAxes = 0.5;  // share of the walks
  for (const long end = count_ + evaluations; count_ < end;) {
    if (uniform(0, 1) < kAlongAxes) {
      if (walk_along_axes()) return true;
      continue;
    }
    const CageWaypoint goal = random_goal();
    if (has_left(advance(nearest(goal), goal))) return true;
  }
  return false;
}

// From a node: turns that align axes, one after the other, then a translation along an axis. Openings of grippers, and
// bodies that pass them, often have parallel edges. Whether it leads out.
bool EscapeTree::walk_along_axes() {
  if (poses_.fixed_axes().empty()) return false;
  CageWaypoint at = nodes_[uniform(0, 1) < 0.5 ? 0 : random_index(nodes_.size())];
  if (poses_.rotations().dims > 0 && uniform(0, 1) < 0.75) {
    for (int i = 0; i < 2; ++i) at = advance(at, turned(at));
  }
  return has_left(advance(at, pushed(at)));
}

// A pose in which an axis of the body is parallel to one of the fixed shapes.
CageWaypoint EscapeTree::turned(const CageWaypoint& at) {
  const Vector3d& axis = poses_.moving_axes()[random_index(poses_.moving_axes().size())];
  const Vector3d& to = poses_.fixed_axes()[random_index(poses_.fixed_axes().size())];
  const Rotationd R = poses_.present() * rotation_matrix(at.q);
  const Vector3d from = R * axis;
  const Rotationd turn = rotation_between(from, dot(from, to) < 0 ? -to : to);
  return {at.p, quaternion_from(transpose(poses_.present()) * turn * R)};
}

// A pose outside, along an axis of the fixed shapes.
CageWaypoint EscapeTree::pushed(const CageWaypoint& at) {
  const Vector3d& axis = poses_.fixed_axes()[random_index(poses_.fixed_axes().size())];
  const double length = (uniform(0, 1) < 0.5 ? -2.5 : 2.5) * poses_.leave();
  return {at.p + length * axis, at.q};
}

std::size_t EscapeTree::random_index(std::size_t size) {
  return static_cast<std::size_t>(uniform(0, static_cast<double>(size)));
}

bool EscapeTree::follow(const std::vector<CageWaypoint>& goals, long evaluations) {
  const long end = count_ + evaluations;
  return std::ranges::any_of(
      goals, [&](const CageWaypoint& goal) { return count_ < end && has_left(advance(nearest(goal), goal)); });
}

double EscapeTree::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
}

// A pose of the region, or one at the exit with a rotation of the tree.
CageWaypoint EscapeTree::random_goal() {
  const double leave = 1.5 * poses_.leave();
  Vector3d p;
  do {
    for (int k = 0; k < 3; ++k) p[k] = uniform(-1, 1);
  } while (dot(p, p) > 1 || dot(p, p) == 0);
  const bool out = uniform(0, 1) < 0.5;
  p = (out ? leave / norm(p) : leave * uniform(0, 1)) * p;
  const CageWaypoint& some = nodes_[random_index(nodes_.size())];
  if (out || poses_.rotations().dims == 0) return {p, some.q};
  Vector3d turn = Vector3d::zero();
  const double most = std::numbers::pi * uniform(0, 1);
  for (int k = 0; k < poses_.rotations().dims; ++k)
    turn = turn + uniform(-1, 1) * poses_.rotations().axes[static_cast<std::size_t>(k)];
  const double size = norm(turn);
  const Vector3d near = uniform(0, 1) < 0.5 ? some.p + (0.1 / 1.5) * p : p;
  return {near, size > 0 ? quaternion_from(rotation_about((1 / size) * turn, most)) : some.q};
}

// A metric of poses [m].
double EscapeTree::way(const CageWaypoint& from, const CageWaypoint& to) const {
  const Quaterniond &a = from.q, &b = to.q;
  const double c = std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
  return norm(to.p - from.p) + poses_.body().radius * 2 * std::acos(std::min(1.0, c));
}

const CageWaypoint& EscapeTree::nearest(const CageWaypoint& goal) const {
  const CageWaypoint* best = &nodes_[0];
  double least = way(*best, goal);
  for (const CageWaypoint& node : nodes_) {
    if (norm(goal.p - node.p) >= least) continue;
    if (const double d = way(node, goal); d < least) least = d, best = &node;
  }
  return *best;
}

// Moves from a node towards a goal through free poses => the last of them, which becomes a node; beyond the exit, it
// ends.
CageWaypoint EscapeTree::advance(CageWaypoint at, const CageWaypoint& goal) {
  constexpr int kSteps = 50;
  constexpr std::size_t kMaxNodes = 5000;
  const CageWaypoint start = at;
  for (int i = 0; i < kSteps && !has_left(at); ++i) {
    const double length = way(at, goal);
    if (length < poses_.resolution()) break;
    const auto [axis, angle] = turn_between(at.q, goal.q);
    ++count_;
    const Rotationd R = rotation_matrix(at.q);
    const double share = 0.99 * poses_.free_share(poses_.pose(at.p, R), {norm(goal.p - at.p), angle});
    if (share * length < 0.1 * poses_.resolution()) break;
    // Spherical interpolation.
    at = {at.p + share * (goal.p - at.p), quaternion_from(R * rotation_about(axis, share * angle))};
  }
  if (way(start, at) > poses_.resolution() && nodes_.size() < kMaxNodes) nodes_.push_back(at);
  return at;
}

}  // namespace grapnel
