#pragma once

/// @file
/// The sweep of link_motion.hpp and the rates of coordinates, as templates on the scalar.
/// Included by the translation units that instantiate it: link_motion.cpp and forward_dynamics.cpp for doubles,
/// grapnel/lanes/ for packs.

#include "grapnel/dynamics/link_motion.hpp"

#include "grapnel/dynamics/recursion.hpp"

namespace grapnel {
namespace link_motion_steps {

using namespace recursion;

template <class S>
LinkMotion<S> root_motion(const TreeLink<S>& link, std::span<const S> q, std::span<const S> v) {
  if (link.joint == JointType::fixed) return {link.X_PF, Twist<S>::zero()};
  const Rotation<S> R = rotation_matrix(Quaternion<S>{q[link.q + 3], q[link.q + 4], q[link.q + 5], q[link.q + 6]});
  const Pose<S> X{R, {q[link.q], q[link.q + 1], q[link.q + 2]}};
  return {X, v.empty() ? Twist<S>::zero() : R * root_velocity(link, v)};
}

}  // namespace link_motion_steps

// q and v => pose and twist of every link in W, from parent to child.
template <class S>
void link_motion(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, std::span<LinkMotion<S>> motion) {
  using namespace link_motion_steps;
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    if (link.parent < 0) {
      motion[n] = root_motion(link, q, v);
      continue;
    }
    const LinkMotion<S>& parent = motion[link.parent];
    LinkScratch<S> w;
    visit_joint(link, [&](auto joint) {
      if constexpr (!kIsRoot<decltype(joint)>) {
        place(joint, link, q, w);
        const Rotation<S> R_WF = link.rotated ? parent.X_WL.R * link.X_PF.R : parent.X_WL.R;
        const Vector3<S> arm = parent.X_WL.R * w.p_PL;
        motion[n].X_WL = {joint_rotation(joint, w, R_WF), parent.X_WL.p + arm};
        motion[n].V_WL = shift(parent.V_WL, arm);
        if (!v.empty()) {
          Twist<S> own = Twist<S>::zero();
          add_joint_motion(joint, link, v, own);
          motion[n].V_WL += motion[n].X_WL.R * own;
        }
      }
    });
  }
}

/// Rates of the coordinates: positions move with R v, quaternions by q o (0, w)/2, joints by their rate.
template <class S>
void coordinate_rates(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, std::span<S> qdot) {
  const auto quaternion_part = [&](int offset, int at) {
    const Quaternion<S> rate = quaternion_rate(Quaternion<S>{q[offset], q[offset + 1], q[offset + 2], q[offset + 3]},
                                               Vector3<S>{v[at], v[at + 1], v[at + 2]});
    qdot[offset] = rate.w, qdot[offset + 1] = rate.x, qdot[offset + 2] = rate.y, qdot[offset + 3] = rate.z;
  };
  for (const TreeLink<S>& link : tree.links) {
    if (has_one_axis(link.joint)) {  // most joints: without the loop below
      qdot[link.q] = v[link.v];
      continue;
    }
    const JointTraits& joint = traits_of(link.joint);
    if (joint.quaternion < 0) {
      for (int k = 0; k < joint.velocities; ++k) qdot[link.q + k] = v[link.v + k];
      continue;
    }
    quaternion_part(link.q + joint.quaternion, link.v);
    if (joint.position >= 0) {
      const int at = link.q + joint.quaternion;
      const Vector3<S> velocity = rotation_matrix(Quaternion<S>{q[at], q[at + 1], q[at + 2], q[at + 3]}) *
                                  Vector3<S>{v[link.v + 3], v[link.v + 4], v[link.v + 5]};
      for (int k = 0; k < 3; ++k) qdot[link.q + joint.position + k] = velocity[k];
    }
  }
}

}  // namespace grapnel
