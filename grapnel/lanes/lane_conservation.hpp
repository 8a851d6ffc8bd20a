#pragma once

/// @file
/// Conservation checks in packs: momentum and energy of trees, computed link by link from poses and twists. They are
/// independent of the forward dynamics kernel and of the momenta that it conserves. Definitions as in
/// capture/conservation_monitor.cpp, which sums over the bodies of a Model and also over all trees. Lanes have links
/// only, which merge bodies on fixed joints. Loop defects are measured from the same poses and twists, as in
/// constraint/loop_closure.cpp.

#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/lanes/lane_closure.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

/// LaneTree in packs, with the terms of its scales.
template <class S>
struct PackTree {
  Vector3<S> com, linear, angular, velocity;  // velocity: of the centre of mass
  GroupSize<S> size;

  GRAPNEL_INLINE void take(const typename S::Mask& lanes, const PackTree& b) {
    for (int k = 0; k < 3; ++k) {
      com[k] = select(lanes, b.com[k], com[k]);
      linear[k] = select(lanes, b.linear[k], linear[k]);
      angular[k] = select(lanes, b.angular[k], angular[k]);
    }
    size.mass = select(lanes, b.size.mass, size.mass);
    size.linear = select(lanes, b.size.linear, size.linear);
    size.angular = select(lanes, b.size.angular, size.angular);
    size.second_moment = select(lanes, b.size.second_moment, size.second_moment);
    size.inner_energy = select(lanes, b.size.inner_energy, size.inner_energy);
    size.energy = select(lanes, b.size.energy, size.energy);
  }
  LaneTree get(int lane) const {
    LaneTree b;
    for (int k = 0; k < 3; ++k) {
      b.com[k] = com[k].get(lane), b.linear[k] = linear[k].get(lane), b.angular[k] = angular[k].get(lane);
    }
    b.size = {size.mass.get(lane),          size.linear.get(lane),       size.angular.get(lane),
              size.second_moment.get(lane), size.inner_energy.get(lane), size.energy.get(lane)};
    return b;
  }
};

/// Exchanges of a tree since the start of its case.
template <class S>
struct PackIntegrals {
  Vector3<S> linear, angular;  // external impulse and angular impulse about the moving centre of mass
  S work;                      // of motors, friction and, in the frame of the centre of mass, external loads
};

/// Maximum deviations of one tree since the start of its case, and their reference scales.
template <class S>
struct PackDeviation {
  S linear, angular, energy;
  GroupScale<S> scale;
  S largest_linear, largest_angular, largest_energy;
  S exchanged[phase_integral::kExchangeCount];
  S radius, distance;

  GRAPNEL_INLINE void begin(const typename S::Mask& lanes, const GroupSize<S>& size) {
    const GroupScale<S> first = group_scale(size);
    const S zero(0.0);
    linear = select(lanes, zero, linear), angular = select(lanes, zero, angular), energy = select(lanes, zero, energy);
    scale.linear = select(lanes, first.linear, scale.linear);
    scale.angular = select(lanes, first.angular, scale.angular);
    scale.energy = select(lanes, first.energy, scale.energy);
    largest_linear = select(lanes, size.linear, largest_linear);
    largest_angular = select(lanes, size.angular, largest_angular);
    largest_energy = select(lanes, size.energy, largest_energy);
    for (S& amount : exchanged) amount = select(lanes, zero, amount);
    radius = select(lanes, zero, radius), distance = select(lanes, zero, distance);
  }
  /// Adds the exchange of a tree at these rates (TreeExchange) over `duration`.
  GRAPNEL_INLINE void exchange(const S* rates, const S& duration) {
    for (int k = 0; k < phase_integral::kExchangeCount; ++k) exchanged[k] += rates[k] * duration;
  }
  GRAPNEL_INLINE void update(const PackTree<S>& start, const PackTree<S>& now, const PackIntegrals<S>& since) {
    linear = max(linear, norm(Vector3<S>(now.linear - start.linear - since.linear)));
    angular = max(angular, norm(Vector3<S>(now.angular - start.angular - since.angular)));
    energy = max(energy, abs(S((now.size.inner_energy - start.size.inner_energy) - since.work)));
    const GroupScale<S> here = group_scale(now.size);
    scale.linear = max(scale.linear, here.linear);
    scale.angular = max(scale.angular, here.angular);
    scale.energy = max(scale.energy, here.energy);
    largest_linear = max(largest_linear, now.size.linear);
    largest_angular = max(largest_angular, now.size.angular);
    largest_energy = max(largest_energy, now.size.energy);
    radius = max(radius, S(sqrt(S(now.size.second_moment / now.size.mass))));
    distance = max(distance, norm(now.com));
  }
  LaneTreeRecord get(int lane, const PackTree<S>& start, const PackTree<S>& end) const {
    return {start.get(lane),          end.get(lane),
            linear.get(lane),         angular.get(lane),
            energy.get(lane),         scale.linear.get(lane),
            scale.angular.get(lane),  scale.energy.get(lane),
            largest_linear.get(lane), largest_angular.get(lane),
            largest_energy.get(lane), {exchanged[0].get(lane), exchanged[1].get(lane), exchanged[2].get(lane)},
            radius.get(lane),         distance.get(lane)};
  }
};

/// Evaluates the conserved quantities of states.
template <class S>
class LaneConservation {
 public:
  explicit LaneConservation(const PhaseTables& tables)
      : tables_(tables),
        motion_(tables.link_count),
        momentum_(tables.link_count),
        center_(tables.link_count),
        at_origin_(tables.loop_count > 0 ? tables.coordinates : 0) {}

  /// Writes one entry per tree. `spring_energy(n)`: energy of the spring at a link's joint, if any.
  template <class SpringEnergy>
  void operator()(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, SpringEnergy&& spring_energy,
                  PackTree<S>* trees);
  /// Loop defects of the state evaluated last. `closure(k)`: parameters of the k-th closure.
  template <class Closure>
  LaneDefect<S> loop_defects(Closure&& closure) const;

 private:
  /// Only with loops: position of the link's root.
  Vector3<S> root_place(int n, std::span<const S> q) const {
    while (tables_.links[n].parent >= 0) n = tables_.links[n].parent;
    const std::size_t at = static_cast<std::size_t>(tables_.links[n].q);
    return {q[at], q[at + 1], q[at + 2]};
  }
  void move(const Tree<S>& tree, std::span<const S> q, std::span<const S> v);

  const PhaseTables& tables_;
  LaneArray<S, LinkMotion<S>> motion_;  // with loops: relative to the roots' origins
  LaneArray<S, Momentum<S>> momentum_;  // about the link's centre of mass, in W
  LaneArray<S, Vector3<S>> center_;     // of mass, in W
  LaneArray<S> at_origin_;              // coordinates, with loops
};

// Poses and twists of the links. Closures are relative, so rounding errors due to a large distance of the roots from
// the origin must not count as closure defects. Therefore, if closures exist, links are placed with their roots at the
// origin.
template <class S>
void LaneConservation<S>::move(const Tree<S>& tree, std::span<const S> q, std::span<const S> v) {
  const std::span<LinkMotion<S>> motion(motion_.data(), tree.links.size());
  if (tables_.loop_count == 0) return link_motion<S>(tree, q, v, motion);
  for (int i = 0; i < tables_.coordinates; ++i) at_origin_[i] = q[static_cast<std::size_t>(i)];
  for (int n = 0; n < tables_.link_count; ++n) {
    if (tables_.links[n].joint != JointType::free) continue;
    for (int k = 0; k < 3; ++k) at_origin_[tables_.links[n].q + k] = S(0.0);
  }
  link_motion<S>(tree, std::span<const S>(at_origin_.data(), q.size()), v, motion);
}

template <class S>
template <class Closure>
LaneDefect<S> LaneConservation<S>::loop_defects(Closure&& closure) const {
  LaneDefect<S> largest = LaneDefect<S>::none();
  for (int k = 0; k < tables_.loop_count; ++k) {
    const LaneClosure<S>& c = closure(k);
    const LinkMotion<S>&a = motion_[tables_.loops[k].link_a], &b = motion_[tables_.loops[k].link_b];
    const Pose<S> X_WC = a.X_WL * c.X_aC, X_WD = b.X_WL * c.X_bD;
    const Twist<S> V_C = shift(a.V_WL, Vector3<S>(X_WC.p - a.X_WL.p)),
                   V_D = shift(b.V_WL, Vector3<S>(X_WC.p - b.X_WL.p));
    LaneDefect<S> d = LaneDefect<S>::none();
    d.position = norm(Vector3<S>(X_WD.p - X_WC.p));
    d.velocity = norm(Vector3<S>(V_D.linear - V_C.linear));
    Vector3<S> w = V_D.angular - V_C.angular;
    // Angles from chords, twice the sine of half the angle: accurate for small angles.
    if (tables_.loops[k].turns == 3) {
      S sum(0.0);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          const S difference = X_WD.R(i, j) - X_WC.R(i, j);
          sum += difference * difference;
        }
      }
      d.angle = sqrt(S(S(0.5) * sum));
    } else if (tables_.loops[k].turns == 2) {
      const Vector3<S> h = X_WC.R * c.hinge_C;
      d.angle = norm(Vector3<S>(X_WD.R * c.hinge_C - h));
      w -= dot(w, h) * h;
    }
    if (tables_.loops[k].turns > 0) d.angular_velocity = norm(w);
    largest.raise(d);
  }
  return largest;
}

template <class S>
template <class SpringEnergy>
void LaneConservation<S>::operator()(const Tree<S>& tree, std::span<const S> q, std::span<const S> v,
                                     SpringEnergy&& spring_energy, PackTree<S>* trees) {
  const int count = tables_.link_count;
  move(tree, q, v);
  const S zero(0.0), half(0.5);
  for (int t = 0; t < tables_.tree_count; ++t) {
    trees[t].com = trees[t].linear = trees[t].angular = Vector3<S>::zero();
    trees[t].size = {zero, zero, zero, zero, zero, zero};
  }
  for (int n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[static_cast<std::size_t>(n)];
    const LinkMotion<S>& m = motion_[n];
    PackTree<S>& b = trees[tables_.tree_of[n]];
    if (has_one_axis(link.joint)) {
      const S rate = v[static_cast<std::size_t>(link.v)];
      b.size.inner_energy += S(half * S(link.armature * rate)) * rate;
      if (tables_.links[n].has_spring) b.size.inner_energy += spring_energy(n);
    }
    if (tables_.links[n].is_massless) continue;
    const Vector3<S> arm = m.X_WL.R * link.inertia.com();
    const Twist<S> V_WC = shift(m.V_WL, arm);
    const Vector3<S> w_L = transposed_times(m.X_WL.R, V_WC.angular);
    const Symmetric3<S> I = link.inertia.rotational_about_com();
    const Vector3<S> h_L = I * w_L;
    momentum_[n] = {m.X_WL.R * h_L, link.inertia.mass * V_WC.linear};
    center_[n] = m.X_WL.p + arm;
    if (tables_.loop_count > 0) center_[n] += root_place(n, q);
    b.size.mass += link.inertia.mass;
    b.com += link.inertia.mass * center_[n];
    b.linear += momentum_[n].linear;
    b.size.linear += norm(momentum_[n].linear);
    b.size.second_moment += half * S(S(I.xx + I.yy) + I.zz);
    b.size.inner_energy += half * dot(w_L, h_L);
  }
  for (int t = 0; t < tables_.tree_count; ++t) {
    const S inverse = S(1.0) / trees[t].size.mass;
    trees[t].com = inverse * trees[t].com;
    trees[t].velocity = inverse * trees[t].linear;
  }
  for (int n = 0; n < count; ++n) {
    if (tables_.links[n].is_massless) continue;
    const S mass = tree.links[static_cast<std::size_t>(n)].inertia.mass;
    PackTree<S>& b = trees[tables_.tree_of[n]];
    const Vector3<S> r = center_[n] - b.com, own = momentum_[n].linear - mass * b.velocity;
    const Vector3<S> moment = cross(r, own);
    b.angular += momentum_[n].angular + moment;
    b.size.angular += norm(momentum_[n].angular) + norm(moment);
    b.size.second_moment += mass * dot(r, r);
    b.size.inner_energy += half * S(dot(own, own) / mass);
  }
  for (int t = 0; t < tables_.tree_count; ++t)
    trees[t].size.energy = trees[t].size.inner_energy + half * dot(trees[t].linear, trees[t].velocity);
}

}  // namespace grapnel::lanes
