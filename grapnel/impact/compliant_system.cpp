#include "grapnel/impact/compliant_system.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {

namespace {

double exponent(const CompliantContact& contact) {
  switch (contact.model) {
    case ContactForceModel::kelvin_voigt:
      return 1;
    case ContactForceModel::hertz:
      return 1.5;
    default:
      return contact.exponent;
  }
}

}  // namespace

NormalForce normal_force(const CompliantContact& contact, double deformation, double rate) {
  const double k = contact.stiffness;
  NormalForce f;
  if (contact.model == ContactForceModel::kelvin_voigt) {
    f.elastic = k * deformation;
    f.total = f.elastic + contact.damping * rate;  // (12.4)
    f.energy = 0.5 * f.elastic * deformation;
    return f;
  }
  const double d = std::max(deformation, 0.0), n = exponent(contact);
  f.elastic = k * (n == 1.5 ? d * std::sqrt(d) : std::pow(d, n));  // (12.5)
  f.energy = f.elastic * d / (n + 1);
  f.total = contact.model == ContactForceModel::hertz ? f.elastic : f.elastic * (1 + contact.damping * rate);  // (12.6)
  return f;
}

double largest_deformation(const CompliantContact& contact, double mass, double speed) {
  // k d^(n+1) / (n + 1) = m v^2 / 2
  const double n = exponent(contact);
  return std::pow((n + 1) / 2 * mass * speed * speed / contact.stiffness, 1 / (n + 1));
}

namespace {

Vector3d vector_at(std::span<const double> y, int offset) { return {y[offset], y[offset + 1], y[offset + 2]}; }

void put(const Vector3d& x, std::span<double> y, int offset) {
  for (int k = 0; k < 3; ++k) y[offset + k] = x[k];
}

// The first contact point: displacements have least to cancel near where deformations are.
Vector3d reference_point(std::span<const CompliantContact> contacts, std::span<const CompliantGrasp> grasps) {
  return !contacts.empty() ? contacts[0].p_WC : !grasps.empty() ? grasps[0].grasp.p_WC : Vector3d::zero();
}

std::vector<std::uint8_t> marked(int size, std::span<const int> indices) {
  std::vector<std::uint8_t> marks(size);
  for (int i : indices) marks.at(i) = 1;
  return marks;
}

std::vector<std::uint8_t> momentum_roots(const Model& model, std::span<const std::uint8_t> held) {
  std::vector<std::uint8_t> roots(model.bodies().size());
  for (std::size_t i = 0; i < roots.size(); ++i) {
    const Body& b = model.bodies()[i];
    roots[i] = b.parent < 0 && b.description.joint.type == JointType::free && !held[b.v];
  }
  return roots;
}

int free_root_at(const Model& model, int velocity) {
  const auto is_it = [&](const Body& b) { return b.v == velocity && b.description.joint.type == JointType::free; };
  const std::vector<Body>& bodies = model.bodies();
  return static_cast<int>(std::find_if(bodies.begin(), bodies.end(), is_it) - bodies.begin());
}

// Axis times angle of the smallest turn that maps `from` onto turned `from` (unit vectors), and the angle.
Vector3d turn_between(const Vector3d& from, const Vector3d& change, double& angle) {
  const Vector3d sine = cross(from, change);
  const double s = norm(sine), c = 1 + dot(from, change);
  angle = std::atan2(s, c);
  return s > 1e-150 ? (angle / s) * sine : sine;
}

}  // namespace

CompliantSystem::CompliantSystem(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                                 std::span<const CompliantGrasp> grasps, std::span<const int> held, ImpactDrive* drive)
    : model_(model),
      contacts_(contacts.begin(), contacts.end()),
      grasps_(grasps.begin(), grasps.end()),
      held_(held.begin(), held.end()),
      springs_(model.springs()),
      start_(state),
      now_(state),
      prescribed_(marked(model.velocities(), held)),
      by_momentum_(momentum_roots(model, prescribed_)),
      pose_(model, state, reference_point(contacts, grasps), by_momentum_),
      change_(model.coordinates()),
      displacement_(model.bodies().size()),
      workspace_(model),
      loads_(contacts.size() + grasps.size()),
      zero_(model.velocities()),
      vdot_(model.velocities()),
      qdot_(model.coordinates()),
      effort_(model.velocities()),
      force_(model.velocities()),
      drive_(drive) {
  phase.assign(contacts.size(), ContactPhase::apart);
  const auto touch = [&](int b) { taking_part_.push_back(model.bodies()[b].root); };
  for (int i = 0; i < interfaces(); ++i) touch(body_of(i, true)), touch(body_of(i, false));
  for (const Body& body : model.bodies()) {
    if (velocity_count(body.description.joint.type) > 0 && prescribed_[body.v] != 0) touch(body.root);
  }
  for (const CompliantContact& c : contacts) point_.push_back(c.p_WC);
  for (const CompliantGrasp& g : grasps) point_.push_back(g.grasp.p_WC);
  std::vector<std::uint8_t> recovered(model.velocities());
  momenta_.resize(free_root_count(model.tree()));
  root_momenta<double>(model.tree(), state.q, state.v, workspace_.kernel, momenta_);
  bool all_by_momentum = true;
  Vector3d total = Vector3d::zero();
  for (const TreeLink<double>& link : model.tree().links) {
    all_by_momentum = all_by_momentum && link.joint != JointType::fixed;
    if (link.joint != JointType::free) continue;
    const RootMomentum<double>& m = momenta_[trees_.size()];
    const int body = free_root_at(model, link.v);
    trees_.push_back({body, link.q, link.v, m.h, m.p_WCom, m.mass});
    total += m.h.linear;
    if (by_momentum_[body]) std::fill_n(recovered.begin() + link.v, 6, std::uint8_t{1});
    all_by_momentum = all_by_momentum && by_momentum_[body];
  }
  if (all_by_momentum) drift_ = (1 / model.mass()) * total;
  for (int v = 0; v < model.velocities(); ++v) {
    if (!prescribed_[v] && !recovered[v]) rates_.push_back(v);
  }
  rate_at_ = model.coordinates();
  impulse_at_ = rate_at_ + static_cast<int>(rates_.size());
  loss_at_ = impulse_at_ + 6 * interfaces();
  held_at_ = loss_at_ + interfaces();
  work_at_ = held_at_ + static_cast<int>(held.size());
  for (int i = 0; i < interfaces(); ++i) {
    wrenches_.push_back({body_of(i, true), {}, {}});
    wrenches_.push_back({body_of(i, false), {}, {}});
  }
}

int CompliantSystem::body_of(int interface, bool robot) const {
  if (interface < contact_count()) return robot ? contacts_[interface].robot_body : contacts_[interface].target_body;
  const Grasp& g = grasps_[interface - contact_count()].grasp;
  return robot ? g.robot_body : g.target_body;
}

// Momenta of free trees are those of the start and the impulses since; their roots' velocities follow. (12.1)
void CompliantSystem::recover_roots_at(double t, std::span<const double> y) {
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    const FreeTree& tree = trees_[i];
    Momentumd h = tree.h;
    for (int k = 0; k < interfaces(); ++k) {
      const bool robot = model_.bodies()[body_of(k, true)].root == tree.body;
      const bool target = model_.bodies()[body_of(k, false)].root == tree.body;
      if (robot == target) continue;
      const Impulsed at_point{vector_at(y, impulse_offset(k)), vector_at(y, impulse_offset(k) + 3)};
      const Impulsed P = shift(at_point, tree.com - point_[k]);
      h = h + (robot ? P : -P);
    }
    // About where the centre of mass is now: away by (t / m) p_0 + y, of which the first part is parallel to p_0.
    const Vector3d &p_0 = tree.h.linear, added = h.linear - p_0, strayed = vector_at(y, tree.link_q);
    h.angular -= (t / tree.mass) * cross(p_0, added) + cross(strayed, h.linear);
    momenta_[i] = {h, tree.com + (t / tree.mass) * p_0 + strayed, tree.mass};
  }
  if (trees_.empty()) return;
  recover_roots<double>(model_.tree(), momenta_, 0.0, workspace_.kernel, now_.q, now_.v);
  for (const FreeTree& tree : trees_) {
    if (by_momentum_[tree.body]) continue;  // a held root
    for (int k = 0; k < 3; ++k) now_.q[tree.link_q + k] = start_.q[tree.link_q + k] + y[tree.link_q + k];
    for (int k = 0; k < 6; ++k) now_.v[tree.link_v + k] = start_.v[tree.link_v + k];
  }
}

void CompliantSystem::load(double t, std::span<const double> y) {
  elapsed_ = t;
  const int nq = model_.coordinates();
  for (int i = 0; i < nq; ++i) now_.q[i] = start_.q[i] + y[i], change_[i] = y[i];
  for (int offset : model_.quaternions()) {
    const double* s = &start_.q[offset];
    Quaterniond q =
        Quaterniond{s[0], s[1], s[2], s[3]} * Quaterniond{1 + y[offset], y[offset + 1], y[offset + 2], y[offset + 3]};
    const double scale = 1 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    now_.q[offset] = scale * q.w, now_.q[offset + 1] = scale * q.x;
    now_.q[offset + 2] = scale * q.y, now_.q[offset + 3] = scale * q.z;
  }
  for (std::size_t i = 0; i < rates_.size(); ++i) now_.v[rates_[i]] = start_.v[rates_[i]] + y[rate_at_ + i];
  for (const FreeTree& tree : trees_) {
    if (!by_momentum_[tree.body]) continue;
    put(vector_at(y, tree.link_q) + t * ((1 / tree.mass) * tree.h.linear - drift_), change_, tree.link_q);
  }
  recover_roots_at(t, y);
  pose_.displacements(change_, displacement_);
  forward_kinematics(model_, now_, workspace_.kinematics);
  for (std::size_t i = 0; i < contacts_.size(); ++i) load_contact(i);
  for (std::size_t i = 0; i < grasps_.size(); ++i) load_grasp(i);
}

// By how much the robot's point has left the target's, both at `arm` from o at the start.
Vector3d CompliantSystem::apart_by(int robot_body, int target_body, const Vector3d& arm) const {
  const Displacement &a = displacement_[robot_body], &b = displacement_[target_body];
  return (turned_by(a.turn, arm) - turned_by(b.turn, arm)) + (a.move - b.move);
}

Twistd CompliantSystem::relative_twist(int robot_body, int target_body, const Vector3d& point) const {
  const Kinematics& k = workspace_.kinematics;
  return shift(k.V_WB[robot_body], point - k.X_WB[robot_body].p) -
         shift(k.V_WB[target_body], point - k.X_WB[target_body].p);
}

// (12.3)-(12.7)
void CompliantSystem::load_contact(std::size_t index) {
  const CompliantContact& c = contacts_[index];
  InterfaceLoad& load = loads_[index];
  const Displacement& robot = displacement_[c.robot_body];
  const Vector3d arm = c.p_WC - pose_.origin();
  load.point = c.p_WC + turned_by(robot.turn, arm) + robot.move + elapsed_ * drift_;
  load.u = relative_twist(c.robot_body, c.target_body, load.point);
  const Vector3d n = c.n_W + turned_by(displacement_[c.target_body].turn, c.n_W);
  load.deformation = -dot(n, apart_by(c.robot_body, c.target_body, arm));
  load.rate = -dot(n, load.u.linear);
  const NormalForce law = normal_force(c, load.deformation, load.rate);
  load.signed_force = law.total;
  load.F = Wrenchd::zero();
  load.energy = load.loss = 0;
  if (phase[index] == ContactPhase::pressing) {
    const Vector3d slip = load.u.linear + load.rate * n;
    const double grasp = c.friction * law.total / std::sqrt(dot(slip, slip) + c.slip_speed * c.slip_speed);
    load.F.linear = law.total * n - grasp * slip;
    load.energy = law.energy;
    load.loss = (law.total - law.elastic) * load.rate + grasp * dot(slip, slip);
  } else if (phase[index] == ContactPhase::relaxing) {
    load.energy = law.energy;
    load.loss = -law.elastic * load.rate;
  }
}

// (12.8)-(12.10)
void CompliantSystem::load_grasp(std::size_t index) {
  const CompliantGrasp& g = grasps_[index];
  InterfaceLoad& load = loads_[contacts_.size() + index];
  const Displacement &robot = displacement_[g.grasp.robot_body], &target = displacement_[g.grasp.target_body];
  const Vector3d arm = g.grasp.p_WC - pose_.origin();
  load.point = g.grasp.p_WC + turned_by(robot.turn, arm) + robot.move + elapsed_ * drift_;
  load.u = relative_twist(g.grasp.robot_body, g.grasp.target_body, load.point);
  const Vector3d apart = apart_by(g.grasp.robot_body, g.grasp.target_body, arm);
  load.deformation = norm(apart);
  load.F.linear = -(g.linear_stiffness * apart + g.linear_damping * load.u.linear);
  load.F.angular = Vector3d::zero();
  load.energy = 0.5 * g.linear_stiffness * dot(apart, apart);
  load.loss = g.linear_damping * dot(load.u.linear, load.u.linear);
  load.angle = 0;
  if (g.grasp.model == GraspModel::point) return;
  const Quaterniond back{target.turn.w, -target.turn.x, -target.turn.y, -target.turn.z};
  const Quaterniond turn = robot.turn * back;  // of the end-effector against the target, in W
  Vector3d turned, w = load.u.angular;
  if (g.grasp.model == GraspModel::rigid) {
    const double sign = turn.w < 0 ? -1 : 1;
    const Vector3d v{sign * turn.x, sign * turn.y, sign * turn.z};
    const double s = norm(v);
    load.angle = 2 * std::atan2(s, sign * turn.w);
    turned = s > 1e-150 ? (load.angle / s) * v : 2.0 * v;
  } else {
    const Vector3d hinge_D = g.grasp.hinge_W + turned_by(target.turn, g.grasp.hinge_W);
    const Vector3d change = turned_by(turn, hinge_D), hinge_C = hinge_D + change;
    turned = turn_between(hinge_D, change, load.angle);
    w -= dot(w, hinge_C) * hinge_C;
  }
  load.F.angular = -(g.angular_stiffness * turned + g.angular_damping * w);
  load.energy += 0.5 * g.angular_stiffness * load.angle * load.angle;
  load.loss += g.angular_damping * dot(w, w);
}

double CompliantSystem::kinetic_energy_now() const { return kinetic_energy(model_, workspace_.kinematics, now_); }

bool CompliantSystem::takes_part(int body) const {
  return std::find(taking_part_.begin(), taking_part_.end(), model_.bodies()[body].root) != taking_part_.end();
}

double CompliantSystem::spring_energy_now() const {
  double energy = 0;
  for (const int body : springs_) {
    if (takes_part(body)) energy += spring_energy(model_, now_, body);
  }
  return energy;
}

double CompliantSystem::kinetic_energy_taking_part_now() const {
  return taking_part_.empty() ? 0 : kinetic_energy(model_, workspace_.kinematics, now_, taking_part_);
}

Twistd CompliantSystem::in_target_axes(int grasp) const {
  const Quaterniond& q = displacement_[grasps_[grasp].grasp.target_body].turn;
  const Quaterniond back{q.w, -q.x, -q.y, -q.z};
  const Twistd& u = loads_[contacts_.size() + grasp].u;
  return {u.angular + turned_by(back, u.angular), u.linear + turned_by(back, u.linear)};
}

// Rates of the coordinates' part of y.
void CompliantSystem::coordinate_changes(std::span<const double> y, std::span<double> dydt) const {
  for (const TreeLink<double>& link : model_.tree().links) {
    const JointTraits& joint = traits_of(link.joint);
    const int q = link.q + joint.quaternion, v = link.v;
    if (joint.quaternion < 0) {
      for (int k = 0; k < joint.velocities; ++k) dydt[link.q + k] = now_.v[v + k];
      continue;
    }
    const Quaterniond rate = quaternion_rate(Quaterniond{1 + y[q], y[q + 1], y[q + 2], y[q + 3]},
                                             Vector3d{now_.v[v], now_.v[v + 1], now_.v[v + 2]});
    dydt[q] = rate.w, dydt[q + 1] = rate.x, dydt[q + 2] = rate.y, dydt[q + 3] = rate.z;
  }
  // Free trees: what impulses add to the uniform motion of the centre of mass; held roots: where they go.
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    const FreeTree& tree = trees_[i];
    Vector3d rate = (1 / tree.mass) * (momenta_[i].h.linear - tree.h.linear);
    if (!by_momentum_[tree.body]) {
      const double* q = &now_.q[tree.link_q + 3];
      rate = rotation_matrix(Quaterniond{q[0], q[1], q[2], q[3]}) *
             Vector3d{now_.v[tree.link_v + 3], now_.v[tree.link_v + 4], now_.v[tree.link_v + 5]};
    }
    put(rate, dydt, tree.link_q);
  }
}

std::span<const ExternalWrench> CompliantSystem::wrenches_now() {
  for (int i = 0; i < interfaces(); ++i) {
    wrenches_[2 * i].p_WP = wrenches_[2 * i + 1].p_WP = loads_[i].point;
    wrenches_[2 * i].F_W = loads_[i].F;
    wrenches_[2 * i + 1].F_W = -loads_[i].F;
  }
  return wrenches_;
}

const std::vector<double>& CompliantSystem::accelerations_now() {
  gather_external(model_, wrenches_now(), workspace_);
  if (drive_) {
    std::fill(effort_.begin(), effort_.end(), 0.0);
    drive_->efforts(elapsed_, now_, wrenches_, effort_);
    for (int v : held_) effort_[v] = 0;
  }
  std::copy(effort_.begin(), effort_.end(), force_.begin());
  for (const int body : springs_) {  // (22.1)
    const Body& b = model_.bodies()[body];
    const JointDescription& joint = b.description.joint;
    force_[b.v] += joint.spring->effort(now_.q[b.q]) - joint.spring->damping * now_.v[b.v];
  }
  DynamicsInput<double> in;
  in.q = now_.q, in.v = now_.v, in.force = force_, in.link_wrench = workspace_.link_wrench;
  in.prescribed = prescribed_, in.acceleration = zero_;
  articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  return vdot_;
}

void CompliantSystem::rates(double t, std::span<const double> y, std::span<double> dydt) {
  load(t, y);
  std::fill(dydt.begin(), dydt.end(), 0.0);
  coordinate_changes(y, dydt);
  for (int i = 0; i < interfaces(); ++i) {
    const InterfaceLoad& load = loads_[i];
    const Wrenchd at_start = shift(load.F, point_[i] - load.point);
    put(at_start.angular, dydt, impulse_offset(i));
    put(at_start.linear, dydt, impulse_offset(i) + 3);
    dydt[loss_offset(i)] = load.loss;
  }
  if (rates_.empty() && held_.empty()) return;  // free bodies alone: momenta say everything
  accelerations_now();
  for (std::size_t i = 0; i < rates_.size(); ++i) dydt[rate_at_ + i] = vdot_[rates_[i]];
  for (std::size_t v = 0; drive_ && v < effort_.size(); ++v) dydt[drive_offset()] += effort_[v] * now_.v[v];
  for (const int body : springs_) {
    if (!takes_part(body)) continue;
    const Body& b = model_.bodies()[body];
    dydt[spring_offset()] += b.description.joint.spring->damping * now_.v[b.v] * now_.v[b.v];
  }
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const double effort = workspace_.force[held_[i]];
    dydt[held_at_ + i] = effort;
    dydt[work_at_] += effort * now_.v[held_[i]];
  }
}

void CompliantSystem::event_values(double t, std::span<const double> y, std::span<double> g) {
  load(t, y);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const InterfaceLoad& load = loads_[i];
    double &first = g[2 * i], &second = g[2 * i + 1];
    first = second = 1;
    const bool viscous = contacts_[i].model == ContactForceModel::kelvin_voigt;
    const bool crossley = contacts_[i].model == ContactForceModel::hunt_crossley;
    switch (phase[i]) {
      case ContactPhase::apart:
        first = load.deformation;
        break;
      case ContactPhase::pressing:
        // Kelvin-Voigt's force vanishes once, before the deformation; Hunt and Crossley's by either factor.
        first = viscous ? load.signed_force : load.deformation;
        if (crossley) second = 1 + contacts_[i].damping * load.rate;
        break;
      case ContactPhase::relaxing:
        first = load.deformation;
        second = viscous ? load.signed_force : 1 + contacts_[i].damping * load.rate;
    }
  }
}

void CompliantSystem::event_directions(std::span<int> directions) const {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    directions[2 * i] = phase[i] == ContactPhase::apart ? 1 : -1;
    directions[2 * i + 1] = phase[i] == ContactPhase::relaxing ? 1 : -1;
  }
}

ContactPhase CompliantSystem::phase_after(int contact, int which) const {
  const InterfaceLoad& load = loads_[contact];
  switch (phase[contact]) {
    case ContactPhase::apart:
      return ContactPhase::pressing;
    case ContactPhase::relaxing:
      return which == 0 ? ContactPhase::apart : ContactPhase::pressing;
    default:
      break;
  }
  if (which == 1) return ContactPhase::relaxing;
  const CompliantContact& c = contacts_[contact];
  return c.model == ContactForceModel::kelvin_voigt && c.damping > 0 && load.deformation > 0 ? ContactPhase::relaxing
                                                                                             : ContactPhase::apart;
}

}  // namespace grapnel
