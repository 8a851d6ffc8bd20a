#pragma once

/// @file
/// Momentum and energy of whole systems in packs, link by link from poses and twists: the definitions of
/// capture/bookkeeper, independent of the kernel that accelerates and of what it conserves. Thread safety: one thread
/// at a time.

#include "grapnel/lanes/lane_kernels.hpp"
#include "grapnel/lanes/lane_phase_array.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"

namespace grapnel::lanes {

/// LaneBooks in packs.
template <class S>
struct PackBooks {
  Vector3<S> linear, angular, com;
  S kinetic_energy, linear_scale, angular_scale;

  GRAPNEL_INLINE void take(const typename S::Mask& lanes, const PackBooks& b) {
    for (int k = 0; k < 3; ++k) {
      linear[k] = select(lanes, b.linear[k], linear[k]);
      angular[k] = select(lanes, b.angular[k], angular[k]);
      com[k] = select(lanes, b.com[k], com[k]);
    }
    kinetic_energy = select(lanes, b.kinetic_energy, kinetic_energy);
    linear_scale = select(lanes, b.linear_scale, linear_scale);
    angular_scale = select(lanes, b.angular_scale, angular_scale);
  }
  LaneBooks get(int lane) const {
    LaneBooks b;
    for (int k = 0; k < 3; ++k) {
      b.linear[k] = linear[k].get(lane), b.angular[k] = angular[k].get(lane), b.com[k] = com[k].get(lane);
    }
    b.kinetic_energy = kinetic_energy.get(lane);
    b.linear_scale = linear_scale.get(lane);
    b.angular_scale = angular_scale.get(lane);
    return b;
  }
};

/// Takes the books of states.
template <class S>
class LaneBookkeeper {
 public:
  explicit LaneBookkeeper(int links) : motion_(links), momentum_(links), center_(links) {}

  PackBooks<S> operator()(const Tree<S>& tree, std::span<const S> q, std::span<const S> v);

 private:
  LaneArray<S, LinkMotion<S>> motion_;
  LaneArray<S, Momentum<S>> momentum_;  // about the link's centre of mass, in W
  LaneArray<S, Vector3<S>> center_;     // of mass, in W
};

template <class S>
PackBooks<S> LaneBookkeeper<S>::operator()(const Tree<S>& tree, std::span<const S> q, std::span<const S> v) {
  const int count = static_cast<int>(tree.links.size());
  link_motion<S>(tree, q, v, std::span<LinkMotion<S>>(motion_.data(), tree.links.size()));
  PackBooks<S> books;
  S mass(0.0), twice(0.0);
  Vector3<S> first_moment = Vector3<S>::zero();
  books.linear = books.angular = Vector3<S>::zero();
  books.linear_scale = books.angular_scale = S(0.0);
  for (int n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[static_cast<std::size_t>(n)];
    const LinkMotion<S>& m = motion_[n];
    const Vector3<S> com_L = link.inertia.com();
    const Vector3<S> arm = m.X_WL.R * com_L;
    const Twist<S> V_WC = shift(m.V_WL, arm);
    const Vector3<S> w_L = transposed_times(m.X_WL.R, V_WC.angular);
    const Vector3<S> h_L = link.inertia.rotational_about_com() * w_L;
    momentum_[n] = {m.X_WL.R * h_L, link.inertia.mass * V_WC.linear};
    center_[n] = m.X_WL.p + arm;
    mass += link.inertia.mass;
    first_moment += link.inertia.mass * center_[n];
    books.linear += momentum_[n].linear;
    books.linear_scale += norm(momentum_[n].linear);
    twice += dot(w_L, h_L) + link.inertia.mass * dot(V_WC.linear, V_WC.linear);
    if (link.joint == LinkJoint::revolute || link.joint == LinkJoint::prismatic) {
      const S rate = v[static_cast<std::size_t>(link.v)];
      twice += S(link.armature * rate) * rate;
    }
  }
  books.com = S(S(1.0) / mass) * first_moment;
  for (int n = 0; n < count; ++n) {
    const Vector3<S> moment = cross(Vector3<S>(center_[n] - books.com), momentum_[n].linear);
    books.angular += momentum_[n].angular + moment;
    books.angular_scale += norm(momentum_[n].angular) + norm(moment);
  }
  books.kinetic_energy = S(0.5) * twice;
  return books;
}

}  // namespace grapnel::lanes
