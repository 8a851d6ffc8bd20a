#include "grapnel/simulate/phase_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace {

// Offsets in the integrals' part of y.
constexpr int kMotorWork = 0, kFrictionWork = 1, kExternalWork = 2, kExternalMoment = 3, kExternalForce = 6;

double friction_force(const JointFriction& f, double rate) {
  return f.coulomb == 0 ? -f.viscous * rate : -(f.viscous * rate + f.coulomb * std::tanh(rate / f.transition_rate));
}

}  // namespace

PhaseDynamics::PhaseDynamics(const Model& model, PhaseSetup setup)
    : model_(model),
      setup_(std::move(setup)),
      workspace_(model),
      now_(zero_state(model)),
      reference_(model.joints().size()),
      motor_(model.joints().size()),
      friction_(model.joints().size()),
      force_(model.velocities()),
      prescribed_(model.velocities()),
      acceleration_(model.velocities()),
      vdot_(model.velocities()),
      momenta_(free_root_count(model.tree())),
      drifted_(momenta_) {
  if (setup_.drives.empty()) setup_.drives.resize(model.joints().size());
  if (setup_.drives.size() != model.joints().size()) {
    throw std::invalid_argument("PhaseDynamics: one drive per joint is needed");
  }
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const bool is_prescribed = setup_.drives[j].control == JointControl::prescribed;
    prescribed_[model.bodies()[model.joints()[j]].v] = is_prescribed;
    any_prescribed_ = any_prescribed_ || is_prescribed;
  }
  if (setup_.held_root >= 0) {
    const Body& root = model.bodies().at(setup_.held_root);
    if (root.parent >= 0 || root.description.joint.type != JointType::free) {
      throw std::invalid_argument("PhaseDynamics: only a free root can be held");
    }
    for (int k = 0; k < 6; ++k) prescribed_[root.v + k] = 1;
    any_prescribed_ = true;
  }
  has_external_ = setup_.held_root >= 0 || dot(setup_.gravity, setup_.gravity) > 0;
  for (const Body& b : model.bodies()) {
    has_external_ = has_external_ || (b.parent < 0 && b.description.joint.type == JointType::fixed);
  }
}

Manifold PhaseDynamics::manifold() const {
  Manifold manifold;
  manifold.size = size();
  manifold.quaternions = model_.quaternions();
  return manifold;
}

std::vector<double> PhaseDynamics::initial(const State& state, double t) {
  momenta_time_ = t;
  root_momenta<double>(model_.tree(), state.q, state.v, workspace_.kernel, momenta_);
  std::vector<double> y(size(), 0.0);
  std::copy(state.q.begin(), state.q.end(), y.begin());
  std::copy(state.v.begin(), state.v.end(), y.begin() + model_.coordinates());
  return y;
}

// Takes the state out of y and overwrites prescribed joints by their references.
void PhaseDynamics::load(double t, std::span<const double> y) {
  const int nq = model_.coordinates(), nv = model_.velocities();
  std::copy(y.begin(), y.begin() + nq, now_.q.begin());
  std::copy(y.begin() + nq, y.begin() + nq + nv, now_.v.begin());
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    if (drive.control == JointControl::free) continue;
    reference_[j] = evaluate(drive.path, t - setup_.start_time);
    if (drive.control != JointControl::prescribed) continue;
    const Body& body = model_.bodies()[model_.joints()[j]];
    now_.q[body.q] = reference_[j].position;
    now_.v[body.v] = reference_[j].rate;
    acceleration_[body.v] = reference_[j].acceleration;
  }
  if (setup_.held_root >= 0) {
    for (int k = 0; k < 6; ++k) now_.v[model_.bodies()[setup_.held_root].v + k] = 0;
  }
  if (recovers()) {
    recover_roots<double>(model_.tree(), momenta_, t - momenta_time_, workspace_.kernel, now_.q, now_.v);
  }
}

// Accelerations, and the motor and friction efforts of all joints.
void PhaseDynamics::accelerate(double) {
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    const Body& body = model_.bodies()[model_.joints()[j]];
    const double rate = now_.v[body.v];
    friction_[j] = friction_force(body.description.joint.friction, rate);
    motor_[j] = 0;
    if (drive.control == JointControl::pd) {
      const double effort = body.description.joint.limits.effort;
      motor_[j] =
          std::clamp(drive.kp * (reference_[j].position - now_.q[body.q]) + drive.kd * (reference_[j].rate - rate),
                     -effort, effort);  // (4.1)
    }
    force_[body.v] = motor_[j] + friction_[j];
  }
  DynamicsInput<double> in;
  in.q = now_.q, in.v = now_.v, in.force = force_, in.gravity = setup_.gravity;
  if (any_prescribed_) in.prescribed = prescribed_, in.acceleration = acceleration_;
  articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    if (setup_.drives[j].control != JointControl::prescribed) continue;
    motor_[j] = workspace_.force[model_.bodies()[model_.joints()[j]].v] - friction_[j];
  }
}

// Power and rates of impulse of gravity, of the ground under a fixed root, and of the wrench that holds a root.
void PhaseDynamics::add_external(std::span<double> integrals) {
  forward_kinematics(model_, now_, workspace_.kinematics);
  const Kinematics& k = workspace_.kinematics;
  const auto add = [&](const Vector3d& force, const Vector3d& moment_about_origin) {
    for (int i = 0; i < 3; ++i) {
      integrals[kExternalMoment + i] += moment_about_origin[i];
      integrals[kExternalForce + i] += force[i];
    }
  };
  for (std::size_t i = 0; i < model_.bodies().size(); ++i) {
    const Body& body = model_.bodies()[i];
    const Vector3d arm = k.X_WB[i].R * body.description.com;
    const Vector3d weight = body.description.mass * setup_.gravity;
    add(weight, cross(k.X_WB[i].p + arm, weight));
    integrals[kExternalWork] += dot(weight, shift(k.V_WB[i], arm).linear);
    const bool held = static_cast<int>(i) == setup_.held_root;
    const bool grounded = body.parent < 0 && body.description.joint.type == JointType::fixed;
    if (!held && !grounded) continue;
    // The root's articulated equation gives the wrench that keeps it where it is; gravity is in A, hence not in it.
    const LinkScratch<double>& root = workspace_.kernel.links[body.placement.link];
    const Wrenchd F = k.links[body.placement.link].X_WL.R * (root.I * root.A + root.p);
    add(F.linear, F.angular + cross(k.X_WB[i].p, F.linear));
  }
}

void PhaseDynamics::operator()(double t, std::span<const double> y, std::span<double> dydt) {
  const int nq = model_.coordinates(), nv = model_.velocities();
  load(t, y);
  accelerate(t);
  coordinate_rates(model_, now_.q, now_.v, dydt.first(nq));
  std::copy(vdot_.begin(), vdot_.end(), dydt.begin() + nq);
  const std::span<double> integrals = dydt.subspan(nq + nv, kIntegrals);
  std::fill(integrals.begin(), integrals.end(), 0.0);
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const double rate = now_.v[model_.bodies()[model_.joints()[j]].v];
    integrals[kMotorWork] += motor_[j] * rate;
    integrals[kFrictionWork] += friction_[j] * rate;
  }
  if (has_external_) add_external(integrals);
}

State PhaseDynamics::state(double t, std::span<const double> y) {
  load(t, y);
  return now_;
}

MomentumDefect PhaseDynamics::momentum_mended(std::span<const double> y) {
  MomentumDefect defect;
  if (!recovers()) return defect;
  const int nq = model_.coordinates(), nv = model_.velocities();
  root_momenta<double>(model_.tree(), y.first(nq), y.subspan(nq, nv), workspace_.kernel, drifted_);
  for (std::size_t i = 0; i < momenta_.size(); ++i) {
    defect.linear = std::max(defect.linear, norm(drifted_[i].h.linear - momenta_[i].h.linear));
    defect.angular = std::max(defect.angular, norm(drifted_[i].h.angular - momenta_[i].h.angular));
  }
  return defect;
}

PhaseIntegrals PhaseDynamics::integrals(std::span<const double> y) const {
  const std::span<const double> s = y.subspan(model_.coordinates() + model_.velocities(), kIntegrals);
  return {s[kMotorWork],
          s[kFrictionWork],
          s[kExternalWork],
          {{s[kExternalMoment], s[kExternalMoment + 1], s[kExternalMoment + 2]},
           {s[kExternalForce], s[kExternalForce + 1], s[kExternalForce + 2]}}};
}

void PhaseDynamics::efforts(double t, std::span<const double> y, std::span<double> motor, std::span<double> friction) {
  load(t, y);
  accelerate(t);
  std::copy(motor_.begin(), motor_.end(), motor.begin());
  std::copy(friction_.begin(), friction_.end(), friction.begin());
}

}  // namespace grapnel
