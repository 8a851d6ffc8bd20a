#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

// A pose that can be reached: displacement of the centre, and rotation.
struct Node {
  Vector3d p;
  Quaterniond q;
  double free;  // no pose whose points are displaced by less overlaps [m]
};

// A tree of poses that grows into random directions (S. LaValle, J. Kuffner, Int. J. Robotics Research 20 (2001)
// 378-400). Its edges are free as a whole, because each of their steps is shorter than the distance at its begin
// (24.1).
class EscapeTree {
 public:
  EscapeTree(CagePoses& poses, long& count) : poses_(poses), count_(count) {
    nodes_.push_back(node_at(Vector3d::zero(), {1, 0, 0, 0}));
  }

  // Whether the tree reaches the exit within a number of evaluations.
  bool grow(long evaluations) {
    for (const long end = count_ + evaluations; count_ < end;) {
      const Node goal = random_goal();
      if (extend(nearest(goal), goal)) return true;
    }
    return false;
  }

 private:
  static constexpr std::size_t kMaxNodes = 5000;

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }

  Node node_at(const Vector3d& p, const Quaterniond& q) {
    ++count_;
    return {p, q, poses_.distance(poses_.pose(p, rotation_matrix(q)), poses_.body().radius)};
  }

  // A pose of the region, or one at the exit with a rotation of the tree.
  Node random_goal() {
    const double leave = 1.5 * poses_.leave();
    Vector3d p;
    do {
      for (int k = 0; k < 3; ++k) p[k] = uniform(-1, 1);
    } while (dot(p, p) > 1 || dot(p, p) == 0);
    const bool out = uniform(0, 1) < 0.5;
    p = (out ? leave / norm(p) : leave * uniform(0, 1)) * p;
    const Node& some = nodes_[static_cast<std::size_t>(uniform(0, static_cast<double>(nodes_.size())))];
    if (out || poses_.rotations().dims == 0) return {p, some.q, 0};
    Vector3d turn = Vector3d::zero();
    const double most = std::numbers::pi * uniform(0, 1);
    for (int k = 0; k < poses_.rotations().dims; ++k)
      turn = turn + uniform(-1, 1) * poses_.rotations().axes[static_cast<std::size_t>(k)];
    const double size = norm(turn);
    const Vector3d near = uniform(0, 1) < 0.5 ? some.p + (0.1 / 1.5) * p : p;
    return {near, size > 0 ? quaternion_from(rotation_about((1 / size) * turn, most)) : some.q, 0};
  }

  // A metric of poses [m].
  double way(const Node& from, const Node& to) const {
    const Quaterniond &a = from.q, &b = to.q;
    const double c = std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
    return norm(to.p - from.p) + poses_.body().radius * 2 * std::acos(std::min(1.0, c));
  }

  const Node& nearest(const Node& goal) const {
    const Node* best = &nodes_[0];
    double least = way(*best, goal);
    for (const Node& node : nodes_) {
      if (norm(goal.p - node.p) >= least) continue;
      if (const double d = way(node, goal); d < least) least = d, best = &node;
    }
    return *best;
  }

  // Moves from a node towards a goal through free poses; whether that leaves the cage.
  bool extend(Node at, const Node& goal) {
    constexpr int kSteps = 50;
    const Node start = at;
    for (int i = 0; i < kSteps && !has_left(at); ++i) {
      const double length = way(at, goal);
      if (!(at.free > 0.1 * poses_.resolution()) || length < poses_.resolution()) break;
      const double share = std::min(1.0, 0.99 * at.free / length);
      at = node_at(at.p + share * (goal.p - at.p), turned(at.q, goal.q, share));
    }
    if (at.free < 0) return false;
    if (has_left(at)) return true;
    if (way(start, at) > poses_.resolution() && nodes_.size() < kMaxNodes) nodes_.push_back(at);
    return false;
  }

  bool has_left(const Node& node) const { return norm(node.p) >= poses_.leave() && node.free > 0; }

  // Unit axis and angle of the rotation from one orientation to another, in the first one's frame.
  static std::pair<Vector3d, double> turn_between(const Quaterniond& from, const Quaterniond& to) {
    const Vector3d turn = rotation_vector(transpose(rotation_matrix(from)) * rotation_matrix(to));
    const double angle = norm(turn);
    return {angle > 0 ? (1 / angle) * turn : Vector3d{1, 0, 0}, angle};
  }
  // Spherical interpolation.
  static Quaterniond turned(const Quaterniond& from, const Quaterniond& to, double share) {
    const auto [axis, angle] = turn_between(from, to);
    return quaternion_from(rotation_matrix(from) * rotation_about(axis, share * angle));
  }

  CagePoses& poses_;
  long& count_;
  std::mt19937_64 random_{1};
  std::vector<Node> nodes_;
};

}  // namespace

bool find_escape(CagePoses& poses, long evaluations, long& count) {
  if (poses.leave() == 0) return true;
  return EscapeTree(poses, count).grow(evaluations);
}

}  // namespace grapnel
