// The integrals of a phase for its conservation checks: works, external impulses and exchanged magnitudes, in the
// layout of phase_integral.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "grapnel/simulate/joint_motor.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

using namespace phase_integral;

PhaseIntegrals phase_integrals(std::span<const double> s) {
  const auto vector = [&](std::size_t at) { return Vector3d{s[at], s[at + 1], s[at + 2]}; };
  PhaseIntegrals integrals{
      s[kMotorWork], s[kFrictionWork], s[kExternalWork], {vector(kExternalMoment), vector(kExternalForce)}};
  for (std::size_t at = kWholeCount; at < s.size(); at += kTreeCount)
    integrals.trees.push_back({{vector(at + kTreeMoment), vector(at + kTreeForce)}, s[at + kTreeWork]});
  return integrals;
}

// The loads of the ground on a fixed root, and of the wrench that holds a root: add(body, force, point, moment).
template <class Add>
void PhaseDynamics::add_ground(Add&& add) const {
  const Kinematics& k = workspace_.kinematics;
  for (std::size_t i = 0; i < model_.bodies().size(); ++i) {
    const Body& body = model_.bodies()[i];
    const bool held = static_cast<int>(i) == setup_.held_root;
    const bool grounded = body.parent < 0 && body.description.joint.type == JointType::fixed;
    if (!held && !grounded) continue;
    // The root's articulated equation gives the holding wrench; gravity is included in A, so it is not added.
    const LinkScratch<double>& root = workspace_.kernel.links[body.placement.link];
    const Wrenchd F = k.links[body.placement.link].X_WL.R * (root.I * root.A + root.p);
    add(i, F.linear, k.X_WB[i].p, F.angular);
  }
}

// State, time and integrals so far => y of a phase that continues: the inverse of integrals(). Throws
// std::invalid_argument if the numbers of trees or measured joints differ.
std::vector<double> PhaseDynamics::initial(const State& state, double t, const PhaseIntegrals& integrals) {
  if (integrals.trees.size() != (has_external_ ? trees_.size() : 0) || integrals.joints.size() != measured_.size() ||
      integrals.slips.size() != setup_.slips.size() ||
      integrals.contacts.size() != (setup_.contacts ? setup_.contacts->groups() : 0))
    throw std::invalid_argument("PhaseDynamics: the integrals belong to another phase");
  std::vector<double> y = initial(state, t);
  double* whole = y.data() + model_.coordinates() + model_.velocities();
  const auto put = [](const Vector3d& v, double* out) { std::copy(v.e, v.e + 3, out); };
  whole[kMotorWork] = integrals.motor_work, whole[kFrictionWork] = integrals.friction_work;
  whole[kExternalWork] = integrals.external_work;
  put(integrals.external_impulse.angular, whole + kExternalMoment);
  put(integrals.external_impulse.linear, whole + kExternalForce);
  double* at = whole + kWholeCount;
  for (std::size_t i = 0; i < momenta_.size() && only_contacts_; ++i)  // before these impulses
    momenta_[i].h = momenta_[i].h - integrals.trees[i].impulse;
  for (const TreeIntegrals& tree : integrals.trees) {
    at[kTreeWork] = tree.work;
    put(tree.impulse.angular, at + kTreeMoment), put(tree.impulse.linear, at + kTreeForce);
    at += kTreeCount;
  }
  for (const SlipIntegrals& slip : integrals.slips) {
    at[kSlipFriction] = slip.friction, at[kSlipDistance] = slip.distance, at[kSlipAngle] = slip.angle;
    at += kSlipCount;
  }
  for (const JointIntegrals& joint : integrals.joints) {
    at[kJointMotor] = joint.motor_work, at[kJointFriction] = joint.friction_work, at[kJointCopper] = joint.copper_loss;
    at += kJointCount;
  }
  // Without them, the work of dampers is included in that of friction, which only one tree has.
  if (integrals.damper_work.size() == static_cast<std::size_t>(damper_integral_count()))
    std::copy(integrals.damper_work.begin(), integrals.damper_work.end(), at);
  at += damper_integral_count();
  for (const ContactIntegrals& group : integrals.contacts) {
    at[kContactWork] = group.work, at[kContactDamping] = group.damping, at[kContactFriction] = group.friction;
    at[kContactImpulse] = group.impulse, at[kContactSlip] = group.slip;
    at += kContactCount;
  }
  at += stick_count();
  for (const TreeExchange& tree : integrals.exchanged) {
    at[kExchangedImpulse] = tree.impulse, at[kExchangedMoment] = tree.angular_impulse, at[kExchangedWork] = tree.work;
    at += kExchangeCount;
  }
  return y;
}

// Adds the effects of the last response: the work of motors that hold their rates, and the impulse of the ground. An
// impulse works at the mean of the velocities before and after it. `of_contacts`: joints hold their rates as in impacts
// of hard contacts.
void PhaseDynamics::book_impulses(std::span<double> y, bool of_contacts) {
  const std::span<double> integrals = y.subspan(now_.q.size() + now_.v.size(), integral_count());
  for (std::size_t i = 0; i < now_.v.size(); ++i) now_.v[i] += 0.5 * vdot_[i];
  const auto work_of_motor = [&](std::size_t joint) {
    const int v = model_.bodies()[model_.joints()[joint]].v;
    const auto is_in = [v](const std::vector<int>& list) {
      return std::find(list.begin(), list.end(), v) != list.end();
    };
    const bool holds = output_of(setup_.drives[joint].control) == ControlOutput::motion || base_.holds_wheel(v) ||
                       (of_contacts && (is_in(setup_.driven_in_impacts) || is_in(setup_.braked_in_impacts)));
    return holds ? workspace_.force[v] * now_.v[v] : 0.0;
  };
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) integrals[kMotorWork] += work_of_motor(j);
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  double* of_joint = exchanged - contact_integral_count() - damper_integral_count() - joint_integral_count();
  for (std::size_t n = 0; n < measured_.size(); ++n)
    of_joint[kJointCount * n + kJointMotor] += work_of_motor(measured_[n]);
  if (!has_external_) return;
  forward_kinematics(model_, now_, workspace_.kinematics);
  std::fill(pushed_.begin(), pushed_.end(), 1);
  measure_trees();
  add_ground([&](std::size_t body, const Vector3d& force, const Vector3d& p_W, const Vector3d& moment) {
    const std::size_t tree = tree_of_[body];
    add_wrench(integrals.data(), static_cast<int>(tree), trees_[tree], force, p_W, moment, 0.0);
    add_exchange(exchanged + kExchangeCount * tree, trees_[tree], force, p_W, moment, 0.0);
  });
}

// The trees on which something acts from outside: those in contact, or all if there may be something else.
void PhaseDynamics::find_pushed_trees() {
  std::fill(pushed_.begin(), pushed_.end(), only_contacts_ ? 0 : 1);
  for (const ExternalWrench& e : wrenches_) pushed_[tree_of_[e.body]] = 1;
}

// Centres of mass of the pushed trees, and their velocities: of the root, plus the mean difference from it. The sum of
// all velocities would have a rounding error in proportion to the speed, of constant sign, whose power forces
// integrate.
void PhaseDynamics::measure_trees() {
  const Kinematics& k = workspace_.kinematics;
  for (std::size_t i = 0; i < tree_of_.size(); ++i) {
    if (!pushed_[tree_of_[i]]) continue;
    const Body& body = model_.bodies()[i];
    const BodyDescription& d = body.description;
    const Vector3d arm = k.X_WB[i].R * d.com, velocity = shift(k.V_WB[i], arm).linear;
    TreeMotion<double>& tree = trees_[tree_of_[i]];
    if (body.parent < 0) tree.com = Vector3d::zero(), tree.velocity = tree.of_root = velocity;
    tree.com += (d.mass / tree.mass) * (k.X_WB[i].p + arm);
    tree.velocity += (d.mass / tree.mass) * (velocity - tree.of_root);
  }
}

// Power and impulse rates of gravity, loads, the orbit's field, contacts, slipping grasps and attitude control, of
// closures between trees, of the ground under a fixed root, and of the wrench that holds a root; in total and of each
// tree.
void PhaseDynamics::add_external(std::span<double> integrals) {
  find_pushed_trees();
  measure_trees();
  const Kinematics& k = workspace_.kinematics;
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  const auto add = [&](std::size_t body, const Vector3d& force, const Vector3d& p_W, const Vector3d& moment,
                       double power) {
    const std::size_t t = tree_of_[body];
    add_wrench(integrals.data(), static_cast<int>(t), trees_[t], force, p_W, moment, power);
    add_exchange(exchanged + kExchangeCount * t, trees_[t], force, p_W, moment, power);
  };
  for (std::size_t t = 0; t < trees_.size(); ++t) {
    add_weight(integrals.data(), static_cast<int>(t), trees_[t], setup_.gravity);
    exchanged[kExchangeCount * t + kExchangedImpulse] += trees_[t].mass * norm(setup_.gravity);
  }
  add_ground([&](std::size_t body, const Vector3d& force, const Vector3d& p_W, const Vector3d& moment) {
    add(body, force, p_W, moment, 0.0);
  });
  const auto add_at = [&](int body, const Vector3d& p_W, const Wrenchd& F_W) {
    add(body, F_W.linear, p_W, F_W.angular, dot(F_W, shift(k.V_WB[body], p_W - k.X_WB[body].p)));
  };
  for (const ExternalWrench& e : wrenches_) add_at(e.body, e.p_WP, e.F_W);
  int row = 0;
  for (const LoopClosure& closure : setup_.closures) {
    const int rows = row_count(closure.model), first = std::exchange(row, row + rows);
    if (tree_of_[closure.body_a] == tree_of_[closure.body_b]) continue;
    const Posed X_WC = k.X_WB[closure.body_a] * closure.X_AC;
    const Wrenchd F_WC = X_WC.R * closure_wrench(closure, solver_->multipliers().subspan(first, rows));
    add_at(closure.body_a, X_WC.p, F_WC);
    add_at(closure.body_b, X_WC.p, -F_WC);
  }
  if (const int root = base_.root(); base_.acts_from_outside()) {
    const Vector3d torque = k.X_WB[root].R * base_.given();
    add(root, Vector3d::zero(), k.X_WB[root].p, torque, dot(torque, k.V_WB[root].angular));
  }
}

// Last evaluation => rates of the integrals of slipping grasps.
void PhaseDynamics::add_slip_integrals(std::span<double> integrals) const {
  double* at = integrals.data() + kWholeCount + kTreeCount * trees_.size();
  for (const SlipState& slip : slips_) {
    at[kSlipFriction] = slip.friction_power;
    at[kSlipDistance] = norm(slip.V_C.linear), at[kSlipAngle] = norm(slip.V_C.angular);
    at += kSlipCount;
  }
}

// Last evaluation => rates of the damper work per tree and, per measured joint, of motor work, friction work and copper
// loss (19.14) [W].
void PhaseDynamics::add_joint_integrals(std::span<double> integrals) {
  double* dampers =
      integrals.data() + integrals.size() - exchange_count() - contact_integral_count() - damper_integral_count();
  for (const int body : has_dampers_ ? model_.springs() : std::vector<int>{}) {
    const Body& b = model_.bodies()[body];
    dampers[tree_of_[body]] -= b.description.joint.spring->damping * now_.v[b.v] * now_.v[b.v];
  }
  double* at = dampers - joint_integral_count();
  for (std::size_t j : measured_) {
    const Body& body = model_.bodies()[model_.joints()[j]];
    const double rate = now_.v[body.v];
    at[kJointMotor] = motor_[j] * rate;
    at[kJointFriction] = friction_[j] * rate;
    at[kJointCopper] = joint_motor::copper_power(body.description.joint, smooth_effort_[j]);
    at += kJointCount;
  }
}

// Last evaluation => rates of the integrals of each group of contacts, and of deformations.
void PhaseDynamics::add_contact_integrals(std::span<double> integrals) {
  double* at = integrals.data() + integrals.size() - exchange_count() - contact_integral_count();
  for (std::size_t g = 0; g < setup_.contacts->groups(); ++g) {
    const GroupContact& group = setup_.contacts->group(g);
    at[kContactWork] = group.power;
    at[kContactDamping] = group.damping_power;
    at[kContactFriction] = group.friction_power;
    at[kContactImpulse] = group.normal_force;
    at[kContactSlip] = group.slip_speed;
    at += kContactCount;
  }
  setup_.contacts->stick_rates({at, setup_.contacts->stick_count()});
}

MomentumDefect PhaseDynamics::momentum_corrected(std::span<const double> y) {
  MomentumDefect defect;
  if (!recovers()) return defect;
  const int nq = model_.coordinates(), nv = model_.velocities();
  placed_ = false;
  root_momenta<double>(model_.tree(), y.first(nq), y.subspan(nq, nv), workspace_.kernel, drifted_);
  for (std::size_t i = 0; i < momenta_.size(); ++i) {
    defect.linear = std::max(defect.linear, norm(drifted_[i].h.linear - momenta_[i].h.linear));
    defect.angular = std::max(defect.angular, norm(drifted_[i].h.angular - momenta_[i].h.angular));
  }
  return defect;
}

// y => works and impulses of the whole, per tree, per measured joint, of dampers, and the exchanged magnitudes (9.1) to
// (9.3), from the layout of phase_integral.
PhaseIntegrals PhaseDynamics::integrals(std::span<const double> y) const {
  const std::span<const double> numbers = y.subspan(model_.coordinates() + model_.velocities(), integral_count());
  const std::size_t common =
      numbers.size() - exchange_count() - contact_integral_count() - joint_integral_count() - damper_integral_count();
  const std::size_t whole = common - slip_integral_count();
  PhaseIntegrals integrals = phase_integrals(numbers.first(whole));
  for (std::size_t at = whole; at < common; at += kSlipCount)
    integrals.slips.push_back({numbers[at + kSlipFriction], numbers[at + kSlipDistance], numbers[at + kSlipAngle]});
  const std::span<const double> exchanged = numbers.last(exchange_count());
  const double* contact = exchanged.data() - contact_integral_count();
  integrals.damper_work.assign(contact - damper_integral_count(), contact);
  for (; contact != exchanged.data() - stick_count(); contact += kContactCount)
    integrals.contacts.push_back({contact[kContactWork], contact[kContactDamping], contact[kContactFriction],
                                  contact[kContactImpulse], contact[kContactSlip]});
  for (std::size_t t = 0; t < trees_.size(); ++t) {
    const double* of_tree = exchanged.data() + kExchangeCount * t;
    integrals.exchanged.push_back({of_tree[kExchangedImpulse], of_tree[kExchangedMoment], of_tree[kExchangedWork]});
  }
  const double* at = numbers.data() + common;
  for (std::size_t j : measured_) {
    integrals.joints.push_back({j, at[kJointMotor], at[kJointFriction], at[kJointCopper]});
    at += kJointCount;
  }
  return integrals;
}

}  // namespace grapnel
