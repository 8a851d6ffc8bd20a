#include "grapnel/impact/compliant_system.hpp"

#include <cmath>

namespace grapnel {
namespace {

// The turn of a body whose quaternion, relative to the start and in the body's axes then, is (1, 0, 0, 0) + change.
Quaterniond turn_in_world(const Rotationd& R_WB, std::span<const double> change) {
  const double w = 1 + change[0];
  const Vector3d v_B{change[1], change[2], change[3]};
  const double scale = 1 / std::sqrt(w * w + dot(v_B, v_B));
  const Vector3d v = scale * (R_WB * v_B);
  return {scale * w, v[0], v[1], v[2]};
}

}  // namespace

StartPose::StartPose(const Model& model, const State& state, const Vector3d& origin_W, std::vector<std::uint8_t> by_com)
    : by_com_(std::move(by_com)), origin_W_(origin_W) {
  const Kinematics k = forward_kinematics(model, state);
  std::vector<double> tree_mass(model.bodies().size(), 0.0);
  for (const Body& b : model.bodies()) tree_mass[b.root] += b.description.mass;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& b = model.bodies()[i];
    const Posed& X_WB = k.X_WB[i];
    bodies_.push_back({b.description.joint.type, b.parent, b.root, b.q, X_WB.R * b.description.joint.axis,
                       X_WB.p - origin_W, X_WB * b.description.com - origin_W, X_WB.R,
                       b.description.mass / tree_mass[b.root]});
  }
}

// The motion the body's own joint adds, seen in W with everything before it at the start.
Displacement StartPose::own_motion(const Start& start, std::span<const double> change) const {
  Displacement own;
  const JointTraits& joint = traits_of(start.type);
  if (joint.axis == AxisMotion::slide) {
    own.move = change[start.q] * start.axis;
    return own;
  }
  if (joint.axis == AxisMotion::turn) {
    const double half = 0.5 * change[start.q];
    const Vector3d v = std::sin(half) * start.axis;
    own.turn = {std::cos(half), v[0], v[1], v[2]};
  } else if (joint.quaternion >= 0) {
    own.turn = turn_in_world(start.R_WB, change.subspan(start.q + joint.quaternion, 4));
  } else {
    return own;
  }
  if (joint.position >= 0) return own;         // its translation comes at last
  own.move = turned_by(own.turn, -start.arm);  // the joint stays where it is
  return own;
}

void StartPose::displacements(std::span<const double> change, std::span<Displacement> of_bodies) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Start& start = bodies_[i];
    const Displacement own = own_motion(start, change);
    if (start.parent < 0) {
      of_bodies[i] = own;
    } else {
      const Displacement& carrier = of_bodies[start.parent];
      of_bodies[i] = {carrier.turn * own.turn, carrier.move + own.move + turned_by(carrier.turn, own.move)};
    }
  }
  // Free trees turn about o so far: shift each to where its centre of mass, or its root, is to be.
  for (std::size_t root = 0; root < bodies_.size(); ++root) {
    const Start& start = bodies_[root];
    if (start.type != JointType::free) continue;
    Vector3d shift{change[start.q], change[start.q + 1], change[start.q + 2]};
    if (by_com_[root]) {
      for (std::size_t i = root; i < bodies_.size(); ++i) {
        if (bodies_[i].root != static_cast<int>(root)) continue;
        shift -= bodies_[i].share * (turned_by(of_bodies[i].turn, bodies_[i].com) + of_bodies[i].move);
      }
    } else {
      shift -= turned_by(of_bodies[root].turn, start.arm);
    }
    for (std::size_t i = root; i < bodies_.size(); ++i) {
      if (bodies_[i].root == static_cast<int>(root)) of_bodies[i].move += shift;
    }
  }
}

}  // namespace grapnel
