#pragma once

/// @file
/// Equations (1) to (7) of floating_base.hpp for a generic scalar: doubles for one set of joint values, or packs with
/// one instant per lane. Both give the same bits, since the packs round every product (grapnel/spatial/rounded.hpp).

#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {

/// The servicer in the form of the equations: links in topological order starting with the root, and the maps between
/// links and joints.
template <class S>
struct ServicerTree {
  const TreeLink<S>* links;
  int link_count;
  const int *joint_link, *link_joint;
  int joints;
};

/// Pointers to the arrays of PlacedLinks, per link or joint as there.
template <class S>
struct PlacedNumbers {
  Pose<S>* X_BL;
  Twist<S>* axis;
  RigidBodyInertia<S>*composite, *inertia;
  Momentum<S>* joint_momentum;
  Vector3<S>* k;
  Vector3<S>* com;
  S* mass;
  Symmetric3<S>* H_inverse;
};

/// Computes poses and axes. `q`: coordinates in the order of Tree; those of the root are ignored.
template <class S>
void place_poses(const ServicerTree<S>& tree, std::span<const S> q, const PlacedNumbers<S>& at) {
  at.X_BL[0] = Pose<S>::identity();
  at.axis[0] = Twist<S>::zero();
  for (int i = 1; i < tree.link_count; ++i) {
    const TreeLink<S>& link = tree.links[i];
    const Pose<S>& parent = at.X_BL[link.parent];
    Pose<S>& X = at.X_BL[i];
    LinkScratch<S> w;
    recursion::visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
      if constexpr (!recursion::kIsRoot<decltype(joint)>) {
        recursion::place(joint, link, q, w);
        X.p = parent.p + parent.R * w.p_PL;
        X.R = recursion::joint_rotation(joint, w, link.rotated ? parent.R * link.X_PF.R : parent.R);
      }
    });
    const Vector3<S> a = S(link.sign) * X.R.column(link.axis);
    const bool slides = traits_of(link.joint).axis == AxisMotion::slide;
    at.axis[i] = slides ? Twist<S>{Vector3<S>::zero(), a} : Twist<S>{a, cross(X.p, a)};
  }
}

/// Spin momentum per unit joint rate of the rotor of a link's joint, in B.
template <class S>
GRAPNEL_INLINE Vector3<S> rotor_momentum(const TreeLink<S>& link, const PlacedNumbers<S>& at) {
  return at.X_BL[link.parent].R * (S(link.sign) * link.rotor);
}

/// Computes inertias, after place_poses(); `floats`: also the quantities of (5); `turns`: (7) does not apply.
template <class S>
void place_inertias(const ServicerTree<S>& tree, bool floats, bool turns, const PlacedNumbers<S>& at) {
  for (int i = 0; i < tree.link_count; ++i) {
    at.inertia[i] = at.X_BL[i] * tree.links[i].inertia;
    at.composite[i] = at.inertia[i];
  }
  for (int i = tree.link_count; i-- > 1;) at.composite[tree.links[i].parent] += at.composite[i];
  const RigidBodyInertia<S>& all = at.composite[0];
  *at.mass = all.mass;
  *at.com = all.com();
  if (!floats) return;
  *at.H_inverse = Symmetric3<S>::zero();  // (7)
  if (turns) {
    const SymmetricFactor3<S> H(all.rotational_about_com());
    const Vector3<S> x = H.solve(Vector3<S>::unit(0)), y = H.solve(Vector3<S>::unit(1)),
                     z = H.solve(Vector3<S>::unit(2));
    *at.H_inverse = {x[0], y[1], z[2], y[0], z[0], z[1]};
  }
  for (int j = 0; j < tree.joints; ++j) {
    const int i = tree.joint_link[j];
    Momentum<S> F = at.composite[i] * at.axis[i];
    if (tree.links[i].has_rotor) F.angular += rotor_momentum(tree.links[i], at);
    at.joint_momentum[j] = F;
    at.k[j] = F.angular - cross(*at.com, F.linear);
  }
}

/// The sum in (5).
template <class S>
GRAPNEL_INLINE Vector3<S> momentum_of_rates(int joints, const Vector3<S>* k, const S* rates) {
  Vector3<S> sum = Vector3<S>::zero();
  for (int j = 0; j < joints; ++j) sum += rates[j] * k[j];
  return sum;
}

/// Scratch of the following functions, per link; dh per joint.
template <class S>
struct MotionNumbers {
  Twist<S>* V;
  Momentum<S>* h;  // of the subtree
  Momentum<S>* dh;
};

/// dh/dtheta_j of (2) for a base moving with V_B; also V and h.
template <class S>
void momentum_per_angle(const ServicerTree<S>& tree, const PlacedNumbers<S>& at, const S* rates, const Twist<S>& V_B,
                        const MotionNumbers<S>& motion) {
  Twist<S>* const V = motion.V;
  Momentum<S>* const h = motion.h;
  V[0] = V_B;
  h[0] = at.inertia[0] * V[0];
  for (int i = 1; i < tree.link_count; ++i) {
    V[i] = V[tree.links[i].parent] + rates[tree.link_joint[i]] * at.axis[i];
    h[i] = at.inertia[i] * V[i];
  }
  // A rotor and its spin momentum rotate with the link that carries it.
  for (int i = 1; i < tree.link_count; ++i) {
    const TreeLink<S>& link = tree.links[i];
    if (link.has_rotor) h[link.parent].angular += rates[tree.link_joint[i]] * rotor_momentum(link, at);
  }
  for (int i = tree.link_count; i-- > 1;) h[tree.links[i].parent] += h[i];
  for (int j = 0; j < tree.joints; ++j) {
    const int i = tree.joint_link[j];
    const Wrench<S> change =
        cross_force(at.axis[i], h[i]) - at.composite[i] * cross_motion(at.axis[i], V[tree.links[i].parent]);
    motion.dh[j] = {change.angular, change.linear};  // (2)
  }
}

/// g_j of (6) at the base's angular velocity w_B. The base moves such that the centre of mass is fixed; its translation
/// due to a joint rotation does not contribute.
template <class S>
void angular_momentum_per_angle(const ServicerTree<S>& tree, const PlacedNumbers<S>& at, const S* rates,
                                const Vector3<S>& w_B, const MotionNumbers<S>& motion, Vector3<S>* g) {
  Vector3<S> p = Vector3<S>::zero();
  for (int j = 0; j < tree.joints; ++j) p += rates[j] * at.joint_momentum[j].linear;
  const Vector3<S> com = *at.com;
  const S per_mass = S(-1.0) / *at.mass;
  momentum_per_angle(tree, at, rates, Twist<S>{w_B, per_mass * p - cross(w_B, com)}, motion);
  for (int j = 0; j < tree.joints; ++j) g[j] = motion.dh[j].angular - cross(com, motion.dh[j].linear);
}

}  // namespace grapnel
