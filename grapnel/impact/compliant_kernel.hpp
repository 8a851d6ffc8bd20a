#pragma once

/// @file
/// The equations of a compliant impact, (12.1) to (12.11), for any scalar: doubles, or packs with a different instant
/// in each lane. compliant_system.hpp instantiates them for doubles; the translation units compliant_packs_SET.cpp for
/// packs.

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/dynamics/link_motion.hpp"
#include "grapnel/dynamics/root_velocity.hpp"
#include "grapnel/impact/compliant_tables.hpp"

namespace grapnel {

/// (turn - 1) x without cancellation for small turns.
template <class S>
GRAPNEL_INLINE Vector3<S> turned_by(const Quaternion<S>& turn, const Vector3<S>& x) {
  const Vector3<S> v{turn.x, turn.y, turn.z};
  const Vector3<S> t = S(2.0) * cross(v, x);
  return turn.w * t + cross(v, t);
}

namespace compliant_kernel {

// Counterparts for doubles of the functions for packs in grapnel/spatial/pack.hpp.
GRAPNEL_INLINE double select(bool condition, double a, double b) { return condition ? a : b; }
GRAPNEL_INLINE double power(double x, double exponent) { return __builtin_pow(x, exponent); }
GRAPNEL_INLINE double turn_per_sine(double s, double w) {
  const double size = __builtin_fabs(w);
  const double turn = s > 1e-150 ? 2 * __builtin_atan2(s, size) / s : 2 / size;
  return w < 0 ? -turn : turn;
}
template <class S>
GRAPNEL_INLINE S positive(const S& x) {
  return select(x > S(0.0), x, S(0.0));
}

template <class S>
GRAPNEL_INLINE Vector3<S> broadcast(const Vector3d& x) {
  return {S(x[0]), S(x[1]), S(x[2])};
}
template <class S>
GRAPNEL_INLINE Vector3<S> vector_at(const S* y, int offset) {
  return {y[offset], y[offset + 1], y[offset + 2]};
}
template <class S>
GRAPNEL_INLINE void put(const Vector3<S>& x, S* y, int offset) {
  for (int k = 0; k < 3; ++k) y[offset + k] = x[k];
}
template <class S>
GRAPNEL_INLINE Quaternion<S> conjugate(const Quaternion<S>& q) {
  return {q.w, -q.x, -q.y, -q.z};
}

// Normal force of a compliant contact over its deformation.
template <class S>
struct NormalForce {
  S elastic;  // of the spring only [N]
  S total;    // with the damper, signed: negative values mean no contact [N]
  S energy;   // of the spring [J]
};

/// (12.4)-(12.6). `deformation` d [m], zero force for d <= 0 (except for kelvin_voigt's damper, which is independent of
/// d); `rate` d' [m/s]. `contact`: members of CompliantContact or InterfaceTable.
template <class Contact, class S>
NormalForce<S> normal_force(const Contact& contact, const S& deformation, const S& rate) {
  using std::sqrt;
  const S k(contact.stiffness), damping(contact.damping);
  if (contact.model == ContactForceModel::kelvin_voigt) {
    const S elastic = k * deformation;
    return {elastic, S(elastic + damping * rate), S(S(S(0.5) * elastic) * deformation)};  // (12.4)
  }
  const S d = positive(deformation);
  const bool hertz = contact.model == ContactForceModel::hertz;
  const double n = hertz ? 1.5 : contact.exponent;
  const S elastic = n == 1.5 ? S(S(k * d) * sqrt(d)) : S(k * power(d, n));    // (12.5)
  const S total = hertz ? elastic : S(elastic * S(S(1.0) + damping * rate));  // (12.6)
  return {elastic, total, S(S(elastic * d) / S(n + 1))};
}

/// Displacements of bodies, from the change of the coordinates in the layout of State::q: for joints the difference;
/// for quaternions those of conj(start) o now from (1, 0, 0, 0); for a free root the displacement in W of its tree's
/// centre of mass, or of its origin if it is held. (12.2)
template <class S>
class Displacements {
 public:
  explicit Displacements(const CompliantTables& tables)
      : tables_(tables), of_(static_cast<std::size_t>(tables.body_count)) {}

  void update(const S* change) {
    for (int i = 0; i < tables_.body_count; ++i) {
      const StartBody& start = tables_.bodies[i];
      const BasicDisplacement<S> own = own_motion(start, change);
      if (start.parent < 0) {
        at(i) = own;
        continue;
      }
      const BasicDisplacement<S>& carrier = at(start.parent);
      at(i) = {carrier.turn * own.turn, carrier.move + own.move + turned_by(carrier.turn, own.move)};
    }
    // Free trees are rotated about o so far: shifts each so that its centre of mass, or its root, has the right
    // position.
    for (int t = 0; t < tables_.tree_count; ++t) place(tables_.trees[t], change);
  }

  GRAPNEL_INLINE const BasicDisplacement<S>& operator[](int body) const { return of_[static_cast<std::size_t>(body)]; }

 private:
  GRAPNEL_INLINE BasicDisplacement<S>& at(int body) { return of_[static_cast<std::size_t>(body)]; }

  // The rotation of a body whose quaternion, relative to its initial axes, is (1, 0, 0, 0) + change.
  static Quaternion<S> turn_in_world(const Rotationd& R_WB, const S* change) {
    using std::sqrt;
    const S w = S(1.0) + change[0];
    const Vector3<S> v_B{change[1], change[2], change[3]};
    const S scale = S(1.0) / sqrt(S(w * w + dot(v_B, v_B)));
    Vector3<S> v;
    for (int k = 0; k < 3; ++k)
      v[k] = scale * S(S(R_WB.m[k][0]) * v_B[0] + S(R_WB.m[k][1]) * v_B[1] + S(R_WB.m[k][2]) * v_B[2]);
    return {S(scale * w), v[0], v[1], v[2]};
  }

  // The motion due to the body's own joint, in W, with all joints before it at the start.
  static BasicDisplacement<S> own_motion(const StartBody& start, const S* change) {
    BasicDisplacement<S> own{{S(1.0), S(0.0), S(0.0), S(0.0)}, Vector3<S>::zero()};
    const JointTraits& joint = traits_of(start.type);
    if (joint.axis == AxisMotion::slide) {
      own.move = change[start.q] * broadcast<S>(start.axis);
      return own;
    }
    if (joint.axis == AxisMotion::turn) {
      const SineCosine<S> half = sine_cosine(S(S(0.5) * change[start.q]));
      const Vector3<S> v = half.sine * broadcast<S>(start.axis);
      own.turn = {half.cosine, v[0], v[1], v[2]};
    } else if (joint.quaternion >= 0) {
      own.turn = turn_in_world(start.R_WB, change + start.q + joint.quaternion);
    } else {
      return own;
    }
    if (joint.position >= 0) return own;                       // its translation is added last
    own.move = turned_by(own.turn, broadcast<S>(-start.arm));  // the joint's position is fixed
    return own;
  }

  void place(const StartTree& tree, const S* change) {
    const int root = tree.body;
    Vector3<S> shift = vector_at(change, tree.q);
    if (tree.by_momentum) {
      for (int i = root; i < tables_.body_count; ++i) {
        const StartBody& body = tables_.bodies[i];
        if (body.root == root) shift -= S(body.share) * (turned_by(at(i).turn, broadcast<S>(body.com)) + at(i).move);
      }
    } else {
      shift -= turned_by(at(root).turn, broadcast<S>(tables_.bodies[root].arm));
    }
    for (int i = root; i < tables_.body_count; ++i) {
      if (tables_.bodies[i].root == root) at(i).move += shift;
    }
  }

  const CompliantTables& tables_;
  std::vector<BasicDisplacement<S>> of_;  // per body
};

}  // namespace compliant_kernel

/// A wrench on a link, about a point of W.
template <class S>
struct LinkForce {
  int link;
  Vector3<S> point;
  Wrench<S> F;
};

template <class S>
class CompliantKernel {
 public:
  /// `tables` must outlive it.
  CompliantKernel(const CompliantTables& tables, Tree<S> tree)
      : tables_(tables),
        tree_(std::move(tree)),
        workspace_(tree_),
        displacement_(tables),
        motion_(tree_.links.size()),
        link_wrench_(tree_.links.size()),
        momenta_(count(tables.tree_count)),
        loads_(count(tables.interface_count())),
        q_(count(tables.coordinates)),
        change_(count(tables.coordinates)),
        v_(count(tables.velocities), S(0.0)),
        zero_(count(tables.velocities), S(0.0)),
        force_(count(tables.velocities)),
        solved_(count(tables.velocities)),
        vdot_(count(tables.velocities)) {
    for (int i = 0; i < tables.velocities; ++i) v_[count(i)] = S(tables.v[i]);
  }

  /// Reads the state from y and evaluates all interfaces.
  void load(const S& t, const S* y);
  /// Further forces, which accelerate() adds to those of interfaces, until the next call.
  void set_forces(std::span<const LinkForce<S>> forces) { forces_ = forces; }
  /// Accelerations under the current loads and these efforts (per velocity; null: none). Those of held velocities are
  /// zero.
  void accelerate(const S* effort);
  /// The input of the last accelerate(), and its results replaced by those of another solution.
  DynamicsInput<S> input() const {
    DynamicsInput<S> in;
    in.q = q_, in.v = v_, in.force = force_, in.link_wrench = link_wrench_;
    in.prescribed = {tables_.prescribed, count(tables_.velocities)}, in.acceleration = zero_;
    return in;
  }
  void replace_accelerations(std::span<const S> vdot, std::span<const S> force) {
    std::copy(vdot.begin(), vdot.end(), vdot_.begin());
    std::copy(force.begin(), force.end(), solved_.begin());
  }
  /// Whether the rates of y need accelerations: for free bodies momenta suffice.
  bool has_rates() const { return tables_.rate_count + tables_.held_count > 0; }
  /// The rates of y; needs the accelerations if has_rates(). `effort`: as above.
  void rates(const S* y, const S* effort, S* dydt);

  const std::vector<S>& q() const { return q_; }
  const std::vector<S>& v() const { return v_; }
  const std::vector<S>& acceleration() const { return vdot_; }
  const std::vector<BasicInterfaceLoad<S>>& loads() const { return loads_; }
  BasicInterfaceLoad<S>& load_of(int interface) { return loads_[count(interface)]; }
  const compliant_kernel::Displacements<S>& displacements() const { return displacement_; }

 private:
  static GRAPNEL_INLINE std::size_t count(int n) { return static_cast<std::size_t>(n); }
  const LinkMotion<S>& motion(const InterfaceSide& side) const { return motion_[count(side.link)]; }
  void recover(const S& t, const S* y);
  Vector3<S> apart_by(const InterfaceTable& at) const;
  void begin_load(const InterfaceTable& at, const S& t, BasicInterfaceLoad<S>& load) const;
  void load_contact(int index, BasicInterfaceLoad<S>& load) const;
  void load_grasp(const InterfaceTable& at, BasicInterfaceLoad<S>& load) const;
  void push(int link, const Vector3<S>& point, const Wrench<S>& F);
  void coordinate_changes(const S* y, S* dydt) const;

  const CompliantTables& tables_;
  Tree<S> tree_;
  DynamicsWorkspace<S> workspace_;
  compliant_kernel::Displacements<S> displacement_;
  std::vector<LinkMotion<S>> motion_;
  std::vector<Wrench<S>> link_wrench_;
  std::vector<RootMomentum<S>> momenta_;
  std::vector<BasicInterfaceLoad<S>> loads_;
  std::span<const LinkForce<S>> forces_;
  std::vector<S> q_, change_, v_, zero_, force_, solved_, vdot_;
};

// Momenta of free trees are the initial ones plus the impulses; their roots' velocities follow. (12.1)
template <class S>
void CompliantKernel<S>::recover(const S& t, const S* y) {
  using namespace compliant_kernel;
  for (int i = 0; i < tables_.tree_count; ++i) {
    const StartTree& tree = tables_.trees[i];
    const Vector3<S> p_0 = broadcast<S>(tree.h.linear);
    Momentum<S> h{broadcast<S>(tree.h.angular), p_0};
    for (int k = 0; k < tables_.interface_count(); ++k) {
      const InterfaceTable& at = tables_.interfaces[k];
      const bool robot = at.robot.tree == i, target = at.target.tree == i;
      if (robot == target) continue;
      const int offset = tables_.impulse_at + 6 * k;
      const Impulse<S> at_point{vector_at(y, offset), vector_at(y, offset + 3)};
      const Impulse<S> P = shift(at_point, broadcast<S>(tree.com - at.point));
      h = h + (robot ? P : -P);
    }
    for (int k = 0; k < tables_.channel_count; ++k) {
      const ImpulseChannel& channel = tables_.channels[k];
      if (channel.first != i && channel.second != i) continue;
      const int offset = tables_.channel_at + 6 * k;
      const Impulse<S> P = shift(Impulse<S>{vector_at(y, offset), vector_at(y, offset + 3)},
                                 broadcast<S>(tree.com - tables_.channel_point));
      h = h + (channel.first == i ? P : -P);
    }
    // About the current centre of mass: displaced by (t / m) p_0 + y, of which the first part is parallel to p_0.
    const Vector3<S> added = h.linear - p_0, strayed = vector_at(y, tree.q);
    const S elapsed = t / S(tree.mass);
    h.angular -= elapsed * cross(p_0, added) + cross(strayed, h.linear);
    momenta_[count(i)] = {h, broadcast<S>(tree.com) + elapsed * p_0 + strayed, S(tree.mass)};
  }
  if (tables_.tree_count == 0) return;
  recover_roots<S>(tree_, momenta_, S(0.0), workspace_, q_, v_);
  for (int i = 0; i < tables_.tree_count; ++i) {
    const StartTree& tree = tables_.trees[i];
    if (tree.by_momentum) continue;  // a held root
    for (int k = 0; k < 3; ++k) q_[count(tree.q + k)] = S(tables_.q[tree.q + k]) + y[tree.q + k];
    for (int k = 0; k < 6; ++k) v_[count(tree.v + k)] = S(tables_.v[tree.v + k]);
  }
}

template <class S>
void CompliantKernel<S>::load(const S& t, const S* y) {
  using namespace compliant_kernel;
  using std::sqrt;
  for (int i = 0; i < tables_.coordinates; ++i) {
    q_[count(i)] = S(tables_.q[i]) + y[i];
    change_[count(i)] = y[i];
  }
  for (int i = 0; i < tables_.quaternion_count; ++i) {
    const int at = tables_.quaternions[i];
    const double* s = tables_.q + at;
    const Quaternion<S> q = Quaternion<S>{S(s[0]), S(s[1]), S(s[2]), S(s[3])} *
                            Quaternion<S>{S(S(1.0) + y[at]), y[at + 1], y[at + 2], y[at + 3]};
    const S scale = S(1.0) / sqrt(S(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z));
    S* const now = &q_[count(at)];
    now[0] = scale * q.w, now[1] = scale * q.x, now[2] = scale * q.y, now[3] = scale * q.z;
  }
  for (int i = 0; i < tables_.rate_count; ++i) {
    const int v = tables_.rates[i];
    v_[count(v)] = S(tables_.v[v]) + y[tables_.rate_at + i];
  }
  for (int i = 0; i < tables_.tree_count; ++i) {
    const StartTree& tree = tables_.trees[i];
    if (!tree.by_momentum) continue;
    const Vector3d relative = (1 / tree.mass) * tree.h.linear - tables_.drift;
    put(Vector3<S>(vector_at(y, tree.q) + t * broadcast<S>(relative)), change_.data(), tree.q);
  }
  recover(t, y);
  displacement_.update(change_.data());
  link_motion<S>(tree_, q_, v_, motion_);
  for (int i = 0; i < tables_.interface_count(); ++i) {
    const InterfaceTable& at = tables_.interfaces[i];
    BasicInterfaceLoad<S>& load = load_of(i);
    begin_load(at, t, load);
    if (i < tables_.contact_count) {
      load_contact(i, load);
    } else {
      load_grasp(at, load);
    }
  }
}

// The displacement of the robot's point relative to the target's; both coincide at the start.
template <class S>
Vector3<S> CompliantKernel<S>::apart_by(const InterfaceTable& at) const {
  const BasicDisplacement<S>&a = displacement_[at.robot.body], &b = displacement_[at.target.body];
  const Vector3<S> arm = compliant_kernel::broadcast<S>(at.arm);
  return (turned_by(a.turn, arm) - turned_by(b.turn, arm)) + (a.move - b.move);
}

// The current point, and the bodies' motion there.
template <class S>
void CompliantKernel<S>::begin_load(const InterfaceTable& at, const S& t, BasicInterfaceLoad<S>& load) const {
  using namespace compliant_kernel;
  const BasicDisplacement<S>& robot = displacement_[at.robot.body];
  load.point = broadcast<S>(at.point) + turned_by(robot.turn, broadcast<S>(at.arm)) + robot.move +
               t * broadcast<S>(tables_.drift);
  const LinkMotion<S>&a = motion(at.robot), &b = motion(at.target);
  const Twist<S> V_a = shift(a.V_WL, load.point - a.X_WL.p), V_b = shift(b.V_WL, load.point - b.X_WL.p);
  load.u = {V_a.angular - V_b.angular, V_a.linear - V_b.linear};
  load.u_T = Twist<S>::zero();
  load.F = Wrench<S>::zero();
  load.rate = load.signed_force = load.angle = load.energy = load.loss = S(0.0);
}

// (12.3)-(12.7)
template <class S>
void CompliantKernel<S>::load_contact(int index, BasicInterfaceLoad<S>& load) const {
  using namespace compliant_kernel;
  using std::sqrt;
  const InterfaceTable& c = tables_.interfaces[index];
  const Vector3<S> normal = broadcast<S>(c.normal);
  const Vector3<S> n = normal + turned_by(displacement_[c.target.body].turn, normal);
  load.deformation = -dot(n, apart_by(c));
  load.rate = -dot(n, load.u.linear);
  const NormalForce<S> law = normal_force(c, load.deformation, load.rate);
  load.signed_force = law.total;
  if (tables_.phase[index] == ContactPhase::pressing) {
    const Vector3<S> slip = load.u.linear + load.rate * n;
    const S square = dot(slip, slip);
    const S grasp = S(S(c.friction) * law.total) / sqrt(S(square + S(c.slip_speed * c.slip_speed)));
    load.F.linear = law.total * n - grasp * slip;
    load.energy = law.energy;
    load.loss = S(law.total - law.elastic) * load.rate + grasp * square;
  } else if (tables_.phase[index] == ContactPhase::relaxing) {
    load.energy = law.energy;
    load.loss = -S(law.elastic * load.rate);
  }
}

// (12.8)-(12.10)
template <class S>
void CompliantKernel<S>::load_grasp(const InterfaceTable& g, BasicInterfaceLoad<S>& load) const {
  using namespace compliant_kernel;
  using std::sqrt;
  const Quaternion<S>&robot = displacement_[g.robot.body].turn, &target = displacement_[g.target.body].turn;
  const Quaternion<S> back = conjugate(target);
  load.u_T = {load.u.angular + turned_by(back, load.u.angular), load.u.linear + turned_by(back, load.u.linear)};
  const Vector3<S> apart = apart_by(g);
  const S square = dot(apart, apart);
  load.deformation = sqrt(square);
  load.F.linear = -(S(g.stiffness) * apart + S(g.damping) * load.u.linear);
  load.energy = S(0.5 * g.stiffness) * square;
  load.loss = S(g.damping) * dot(load.u.linear, load.u.linear);
  if (g.turns == GraspTurns::free) return;
  const Quaternion<S> turn = robot * back;  // of the end-effector relative to the target, in W
  Vector3<S> turned, w = load.u.angular;
  if (g.turns == GraspTurns::none) {
    const Vector3<S> v{turn.x, turn.y, turn.z};
    const S s = norm(v), per_sine = turn_per_sine(s, turn.w);  // of the shorter rotation, with the sign of w
    turned = per_sine * v;
    load.angle = S(select(per_sine < S(0.0), -per_sine, per_sine)) * s;
  } else {
    // Axis times angle of the smallest turn that maps the target's axis onto the end-effector's, both unit vectors.
    const Vector3<S> hinge = broadcast<S>(g.hinge);
    const Vector3<S> hinge_D = hinge + turned_by(target, hinge);
    const Vector3<S> change = turned_by(turn, hinge_D), hinge_C = hinge_D + change;
    const Vector3<S> sine = cross(hinge_D, change);
    const S s = norm(sine), c = S(1.0) + dot(hinge_D, change);
    const S half = S(0.5) * turn_per_sine(s, c);  // atan2(s, |c|) / s, with the sign of c
    const S rest = S(3.14159265358979323846) / S(s + S(1e-150)) + half;
    const S per_sine = select(c < S(0.0), rest, half);
    turned = per_sine * sine;
    load.angle = per_sine * s;
    w -= dot(w, hinge_C) * hinge_C;
  }
  load.F.angular = -(S(g.angular_stiffness) * turned + S(g.angular_damping) * w);
  load.energy += S(0.5 * g.angular_stiffness) * S(load.angle * load.angle);
  load.loss += S(g.angular_damping) * dot(w, w);
}

// A wrench about a point of W.
template <class S>
void CompliantKernel<S>::push(int link, const Vector3<S>& point, const Wrench<S>& F) {
  const Pose<S>& X_WL = motion_[count(link)].X_WL;
  link_wrench_[count(link)] += transposed_times(X_WL.R, shift(F, X_WL.p - point));
}

template <class S>
void CompliantKernel<S>::accelerate(const S* effort) {
  using compliant_kernel::select;
  for (Wrench<S>& F : link_wrench_) F = Wrench<S>::zero();
  for (int i = 0; i < tables_.interface_count(); ++i) {
    const BasicInterfaceLoad<S>& load = load_of(i);
    push(tables_.interfaces[i].robot.link, load.point, load.F);
    push(tables_.interfaces[i].target.link, load.point, -load.F);
  }
  for (const LinkForce<S>& force : forces_) push(force.link, force.point, force.F);
  for (int v = 0; v < tables_.velocities; ++v) force_[count(v)] = effort != nullptr ? effort[v] : S(0.0);
  for (int i = 0; i < tables_.spring_count; ++i) {  // (22.1)
    const SpringTable& spring = tables_.springs[i];
    S x = q_[count(spring.q)] - S(spring.rest);
    if (spring.backlash > 0) {
      const S slack(0.5 * spring.backlash);
      x = select(x > slack, S(x - slack), select(x < -slack, S(x + slack), S(0.0)));
    }
    force_[count(spring.v)] -= S(spring.stiffness) * x + S(spring.damping) * v_[count(spring.v)];
  }
  articulated_body<S>(tree_, input(), workspace_, vdot_, solved_);
}

// Rates of the coordinates in y.
template <class S>
void CompliantKernel<S>::coordinate_changes(const S* y, S* dydt) const {
  using namespace compliant_kernel;
  for (const TreeLink<S>& link : tree_.links) {
    const JointTraits& joint = traits_of(link.joint);
    const int q = link.q + joint.quaternion, v = link.v;
    if (joint.quaternion < 0) {
      for (int k = 0; k < joint.velocities; ++k) dydt[link.q + k] = v_[count(v + k)];
      continue;
    }
    const Quaternion<S> rate =
        quaternion_rate(Quaternion<S>{S(S(1.0) + y[q]), y[q + 1], y[q + 2], y[q + 3]}, vector_at(v_.data(), v));
    dydt[q] = rate.w, dydt[q + 1] = rate.x, dydt[q + 2] = rate.y, dydt[q + 3] = rate.z;
  }
  // Free trees: deviation of the centre of mass from uniform motion due to impulses; held roots: their motion.
  for (int i = 0; i < tables_.tree_count; ++i) {
    const StartTree& tree = tables_.trees[i];
    Vector3<S> rate = S(1 / tree.mass) * (momenta_[count(i)].h.linear - broadcast<S>(tree.h.linear));
    if (!tree.by_momentum) {
      const S* const q = &q_[count(tree.q + 3)];
      rate = rotation_matrix(Quaternion<S>{q[0], q[1], q[2], q[3]}) * vector_at(v_.data(), tree.v + 3);
    }
    put(rate, dydt, tree.q);
  }
}

template <class S>
void CompliantKernel<S>::rates(const S* y, const S* effort, S* dydt) {
  using namespace compliant_kernel;
  for (int i = 0; i < tables_.size; ++i) dydt[i] = S(0.0);
  coordinate_changes(y, dydt);
  for (int i = 0; i < tables_.interface_count(); ++i) {
    const BasicInterfaceLoad<S>& load = load_of(i);
    const Wrench<S> at_start = shift(load.F, broadcast<S>(tables_.interfaces[i].point) - load.point);
    put(at_start.angular, dydt, tables_.impulse_at + 6 * i);
    put(at_start.linear, dydt, tables_.impulse_at + 6 * i + 3);
    dydt[tables_.loss_at + i] = load.loss;
  }
  for (int i = 0; i < tables_.rate_count; ++i) dydt[tables_.rate_at + i] = vdot_[count(tables_.rates[i])];
  if (tables_.driven) {
    S power(0.0);
    for (int v = 0; effort != nullptr && v < tables_.velocities; ++v) power += effort[v] * v_[count(v)];
    dydt[tables_.drive_at()] = power;
  }
  for (int i = 0; i < tables_.spring_count; ++i) {
    const SpringTable& spring = tables_.springs[i];
    const S rate = v_[count(spring.v)];
    if (spring.counted) dydt[tables_.spring_at()] += S(spring.damping) * S(rate * rate);
  }
  for (int i = 0; i < tables_.held_count; ++i) {
    const int v = tables_.held[i];
    dydt[tables_.held_at + i] = solved_[count(v)];
    dydt[tables_.work_at] += solved_[count(v)] * v_[count(v)];
  }
}

}  // namespace grapnel
