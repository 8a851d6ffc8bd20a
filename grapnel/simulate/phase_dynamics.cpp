#include "grapnel/simulate/phase_dynamics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/simulate/arm_reaction.hpp"
#include "grapnel/simulate/joint_motor.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

using namespace phase_integral;

double friction_force(const JointFriction& f, double rate) {
  return control_law::friction(true, f.viscous, f.coulomb != 0, f.coulomb, rate,
                               [&] { return std::tanh(rate / f.transition_rate); });
}

}  // namespace

double break_resolution(double t0, double t1) {
  return 64 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t0), std::abs(t1));
}

// Setup and interval => break times of trajectories, loads and clock, sorted from t0 to t1. Times nearer than
// break_resolution() to each other count once; those at the ends are omitted.
std::vector<double> phase_breaks(const PhaseSetup& setup, double t0, double t1) {
  const double resolution = break_resolution(t0, t1);
  const double first = std::min(t0, t1) + resolution, last = std::max(t0, t1) - resolution;
  std::vector<double> times;
  const auto add = [&](const std::vector<double>& more) {
    for (double t : more) {
      if (t > first && t < last) times.push_back(t);
    }
  };
  for (const JointDrive& drive : setup.drives) {
    if (drive.control != JointControl::free) add(break_times(drive.trajectory));
  }
  for (const ExternalLoad& load : setup.loads) add(break_times(load));
  if (setup.clock && t1 > t0) add(setup.clock->break_times(t0, t1));
  std::sort(times.begin(), times.end());
  const auto near = [&](double a, double b) { return b - a <= resolution; };
  times.erase(std::unique(times.begin(), times.end(), near), times.end());
  if (t1 < t0) std::reverse(times.begin(), times.end());
  return times;
}

PhaseDynamics::PhaseDynamics(const Model& model, PhaseSetup setup)
    : model_(model),
      setup_(std::move(setup)),
      workspace_(model),
      now_(zero_state(model)),
      reference_(model.joints().size()),
      desired_(model.joints().size()),
      sensed_(model.joints().size()),
      commanded_effort_(model.joints().size()),
      channel_of_(model.joints().size(), -1),
      motor_(model.joints().size()),
      friction_(model.joints().size()),
      spring_(model.joints().size()),
      force_(model.velocities()),
      prescribed_(model.velocities()),
      commanded_(model.velocities()),
      acceleration_(model.velocities()),
      vdot_(model.velocities()),
      wrenches_(setup_.loads.size() + (setup_.orbit ? model.bodies().size() : 0)),
      momenta_(free_root_count(model.tree())),
      drifted_(momenta_) {
  if (setup_.drives.empty()) setup_.drives.resize(model.joints().size());
  if (!setup_.closures.empty() || !model.couplings().empty()) solver_.emplace(model_, setup_.closures);
  base_ = BaseActuation(model_, setup_.attitude, setup_.commanded_root, setup_.wheels, setup_.gyros, setup_.actuators,
                        setup_.clock, setup_.effectors);
  first_slip_ = wrenches_.size();
  slips_.resize(setup_.slips.size());
  wrenches_.resize(first_slip_ + 2 * slips_.size() + base_.wrench_count());
  steady_wrenches_ = wrenches_.size();
  if (setup_.contacts) wrenches_.reserve(steady_wrenches_ + setup_.contacts->most_wrenches());
  for (std::size_t i = 0; setup_.contacts && i < model.bodies().size(); ++i)
    reaches_.push_back(setup_.contacts->reach_of(static_cast<int>(i)));
  if (setup_.law_model) {
    law_workspace_.emplace(*setup_.law_model);
    law_vdot_.resize(model.velocities());
    if (solver_) law_solver_.emplace(*setup_.law_model, setup_.closures);
  }
  loaded_.resize(now_.q.size() + now_.v.size());
  check_and_classify();
}

// setup_ => flags per velocity (prescribed, commanded), joint modes, trees with their masses and which effects exist.
// Throws std::invalid_argument for the errors listed at the constructor.
void PhaseDynamics::check_and_classify() {
  const std::vector<Body>& bodies = model_.bodies();
  const auto is_free_root = [&](int body) {
    const Body& root = bodies.at(body);
    return root.parent < 0 && root.description.joint.type == JointType::free;
  };
  if (setup_.drives.size() != model_.joints().size()) {
    throw std::invalid_argument("PhaseDynamics: one drive per joint is needed");
  }
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    validate(drive.trajectory);
    const Body& body = bodies[model_.joints()[j]];
    const bool is_computed = output_of(drive.control) == ControlOutput::acceleration;
    const bool is_prescribed = output_of(drive.control) == ControlOutput::motion;
    const JointFriction& friction = body.description.joint.friction;
    prescribed_[body.v] = is_prescribed;
    commanded_[body.v] = is_prescribed || is_computed;
    any_computed_ = any_computed_ || is_computed;
    has_friction_ = has_friction_ || (!is_prescribed && (friction.viscous > 0 || friction.coulomb > 0));
    const JointDescription& joint = body.description.joint;
    has_dampers_ = has_dampers_ || (joint.spring && joint.spring->damping > 0);
    has_friction_ = has_friction_ || (!is_prescribed && joint.spring && joint.spring->damping > 0);
    if (joint.motor || joint.limits.stop || friction.model == JointFriction::Model::sticking) measured_.push_back(j);
  }
  modes_ = JointModes(model_, prescribed_);
  smooth_effort_.assign(motor_.size(), 0.0);
  at_rest_.assign(now_.v.size(), 0.0);
  if (setup_.held_root >= 0) {
    if (!is_free_root(setup_.held_root)) throw std::invalid_argument("PhaseDynamics: only a free root can be held");
    const int v = bodies[setup_.held_root].v;
    for (int k = 0; k < 6; ++k) prescribed_[v + k] = commanded_[v + k] = 1;
  }
  if (setup_.attitude && (!is_free_root(setup_.attitude->root) || setup_.attitude->root == setup_.held_root)) {
    throw std::invalid_argument("PhaseDynamics: only a free root that is not held can be under attitude control");
  }
  check_control();
  check_effectors();
  check_tendons();
  for (const ExternalLoad& load : setup_.loads) {
    validate(load);
    if (load.body < 0 || load.body >= static_cast<int>(bodies.size())) {
      throw std::invalid_argument("PhaseDynamics: the body of a load is not in the model");
    }
    if (load.frame == LoadFrame::orbit && !setup_.orbit) {
      throw std::invalid_argument("PhaseDynamics: a load is in the axes of an orbit, but no orbit is set");
    }
  }
  if (setup_.orbit) {
    if (const std::string fault = fault_of(*setup_.orbit); !fault.empty())
      throw std::invalid_argument("PhaseDynamics: the orbit: " + fault);
  }
  for (const Body& b : bodies) {
    if (b.parent < 0) trees_.emplace_back();
    tree_of_.push_back(b.parent < 0 ? trees_.size() - 1 : tree_of_[b.root]);
    trees_[tree_of_.back()].mass += b.description.mass;
  }
  pushed_.assign(trees_.size(), 1);
  has_external_ = setup_.held_root >= 0 || dot(setup_.gravity, setup_.gravity) > 0 || !setup_.loads.empty() ||
                  setup_.orbit.has_value() || !setup_.slips.empty() || base_.acts_from_outside() ||
                  base_.wrench_count() > 0;
  for (const Body& b : bodies) {
    has_external_ = has_external_ || (b.parent < 0 && b.description.joint.type == JointType::fixed);
  }
  only_contacts_ = setup_.contacts && !has_external_ && setup_.closures.empty();
  has_external_ = has_external_ || setup_.contacts;
}

Tolerances PhaseDynamics::tolerances(double relative, double absolute) const {
  Tolerances found{relative, absolute, {}};
  if (stick_count() == 0) return found;
  found.atol_components.assign(size(), absolute);
  const auto sticks = found.atol_components.end() - exchange_count() - stick_count();
  std::fill_n(sticks, stick_count(), absolute + relative);
  return found;
}

Manifold PhaseDynamics::manifold() const {
  Manifold manifold;
  manifold.size = size();
  manifold.quaternions = model_.quaternions();
  manifold.controlled = size() - exchange_count();
  return manifold;
}

// With contacts alone, the impulses of the trees take the place of the velocities of their roots, (8.3a).
void PhaseDynamics::coupled(std::vector<int>& numbers) const {
  const int nq = model_.coordinates(), motion = nq + model_.velocities();
  const bool by_impulses = only_contacts_ && setup_.recover_roots;
  std::vector<bool> omitted(static_cast<std::size_t>(motion), false);
  for (const Body& body : model_.bodies()) {
    for (int k = 0; k < 6 && by_impulses && body.parent < 0; ++k) omitted[nq + body.v + k] = true;
  }
  for (int i = 0; i < motion; ++i) {
    if (!omitted[i]) numbers.push_back(i);
  }
  for (int t = 0; t < static_cast<int>(trees_.size()) && by_impulses; ++t) {
    const int tree = motion + kWholeCount + kTreeCount * t;
    for (int k = 0; k < 3; ++k) numbers.push_back(tree + kTreeMoment + k);
    for (int k = 0; k < 3; ++k) numbers.push_back(tree + kTreeForce + k);
  }
  if (setup_.contacts) setup_.contacts->add_active_sticks(size() - exchange_count() - stick_count(), numbers);
}

void PhaseDynamics::still(std::vector<NumberRange>& ranges) const {
  if (!setup_.contacts || setup_.contacts->touches()) return;
  const int whole = model_.coordinates() + model_.velocities();
  const int trees_end = whole + kWholeCount + kTreeCount * static_cast<int>(trees_.size());
  if (only_contacts_) ranges.push_back({whole + kExternalWork, trees_end});
  const int contacts_end = size() - exchange_count();
  ranges.push_back({contacts_end - contact_integral_count(), contacts_end});
}

std::vector<double> PhaseDynamics::initial(const State& state, double t) {
  momenta_time_ = t;
  placed_ = false;
  root_momenta<double>(model_.tree(), state.q, state.v, workspace_.kernel, momenta_);
  modes_.begin(state.q, state.v);
  hold_joints();
  if (setup_.contacts) {
    forward_kinematics(model_, state, workspace_.kinematics);
    setup_.contacts->begin(t, workspace_.kinematics);
    setup_.contacts->rebase_stick();
  }
  std::vector<double> y(size(), 0.0);
  std::copy(state.q.begin(), state.q.end(), y.begin());
  std::copy(state.v.begin(), state.v.end(), y.begin() + model_.coordinates());
  return y;
}

void PhaseDynamics::load(double t, std::span<const double> y) {
  load_integrated(t, y);
  recover(t);
}

// Reads the state from y and overwrites prescribed joints by their references. With contacts alone, the poses are those
// of load(), which takes the velocities of roots from their momenta instead.
void PhaseDynamics::load_integrated(double t, std::span<const double> y) {
  placed_ = false;
  const int nq = model_.coordinates(), nv = model_.velocities();
  std::copy(y.begin(), y.begin() + nq, now_.q.begin());
  std::copy(y.begin() + nq, y.begin() + nq + nv, now_.v.begin());
  if (setup_.contacts) setup_.contacts->set_stick(y.last(exchange_count() + stick_count()).first(stick_count()));
  for (std::size_t i = 0; i < momenta_.size() && only_contacts_; ++i) {  // (8.3a)
    const double* impulse = y.data() + nq + nv + kWholeCount + kTreeCount * i;
    for (int k = 0; k < 3; ++k) {
      drifted_[i].h.angular[k] = momenta_[i].h.angular[k] + impulse[kTreeMoment + k];
      drifted_[i].h.linear[k] = momenta_[i].h.linear[k] + impulse[kTreeForce + k];
    }
  }
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    if (drive.control == JointControl::free) continue;
    const ControlOutput output = output_of(drive.control);
    if (output != ControlOutput::motion && !laws_command()) continue;
    JointPoint& reference = reference_[j];
    const JointPoint noise = drive.noise.at(t);
    desired_[j] = evaluate(drive.trajectory, t, inside_.value_or(t));
    reference = control_law::reference(output, desired_[j], noise);
    sensed_[j] = {noise.position, noise.rate, 0};
    if (output != ControlOutput::motion) continue;
    const Body& body = model_.bodies()[model_.joints()[j]];
    now_.q[body.q] = reference.position;
    now_.v[body.v] = reference.rate;
    acceleration_[body.v] = reference.acceleration;
  }
  base_.prescribe({now_.v, prescribed_, commanded_, acceleration_});
  for (const JointModes::Joint& joint : modes_.joints()) {
    if (joint.mode == JointModes::Mode::held) now_.v[joint.v] = 0;
  }
  if (setup_.held_root >= 0) {
    for (int k = 0; k < 6; ++k) now_.v[model_.bodies()[setup_.held_root].v + k] = 0;
  }
}

// Velocities of the roots, and without external effects their positions, from the momenta of their trees: the conserved
// ones, or with contacts alone those after their impulses (8.3a).
void PhaseDynamics::recover(double t) {
  placed_ = recovers() || (only_contacts_ && setup_.recover_roots);
  if (recovers()) recover_roots<double>(model_.tree(), momenta_, t - momenta_time_, workspace_.kernel, now_.q, now_.v);
  if (!only_contacts_ || !setup_.recover_roots) return;
  std::copy(now_.q.begin(), now_.q.end(), loaded_.begin());
  recover_roots<double>(model_.tree(), drifted_, 0.0, workspace_.kernel, now_.q, now_.v);
  std::copy_n(loaded_.begin(), now_.q.size(), now_.q.begin());
}

// Sets dependent joints by their couplings. A coupling that is open by a rounding error would let its effort work,
// without an end in a gripper that presses for a long time.
void PhaseDynamics::follow(double t) {
  if (model_.couplings().empty()) return;
  follow_couplings(model_, now_.q, now_.v);
  recover(t);
}

// Projects the current state onto the closures. A closure is relative, so roots may be recovered afterwards.
ProjectionResult PhaseDynamics::close_loops(double t) {
  const ProjectionResult result = solver_->project(prescribed_, workspace_, now_.q, now_.v);
  recover(t);
  return result;
}

// The current wrench of a load.
ExternalWrench PhaseDynamics::wrench_of(const ExternalLoad& load, double t, const OrbitPoint& at) const {
  const Posed& X_WB = workspace_.kinematics.X_WB[load.body];
  const double inside = inside_.value_or(t);
  Wrenchd F = wrench_at(load, t, inside);
  if (load.frame == LoadFrame::body) F = X_WB.R * F;
  if (load.frame == LoadFrame::orbit) F = at.R_WO * F;
  if (load.stream) {
    const Vector3d& d = load.stream->direction;
    const Vector3d direction = load.frame == LoadFrame::orbit ? at.R_WO * d : d;
    F.linear +=
        factor_at(load.profile, t, inside) * stream_force(*load.stream, direction, X_WB.R * load.stream->normal);
  }
  return {load.body, X_WB * load.p_BP, F};
}

// The field near the orbit, on each body at its centre of mass: (14.2), (14.3).
void PhaseDynamics::act_on_orbit(const OrbitPoint& at) {
  for (std::size_t i = 0; i < model_.bodies().size(); ++i) {
    const BodyDescription& body = model_.bodies()[i].description;
    const Posed& X_WB = workspace_.kinematics.X_WB[i];
    const Vector3d p_WC = X_WB * body.com;
    wrenches_[setup_.loads.size() + i] = {
        static_cast<int>(i),
        p_WC,
        {gravity_gradient_torque(at, X_WB.R, body.inertia), body.mass * tidal_acceleration(at, p_WC)}};
  }
}

// Kinematics, and the wrenches of loads, the orbit's field, slipping grasps, attitude control and contacts; of contacts
// that are apart, and nothing else, neither.
void PhaseDynamics::act_from_outside(double t) {
  if (is_left_alone()) {
    wrenches_.clear();
    setup_.contacts->evaluate(workspace_.kinematics, wrenches_);
    return;
  }
  forward_kinematics(model_, now_, workspace_.kinematics);
  const OrbitPoint at = setup_.orbit ? orbit_point(*setup_.orbit, t) : OrbitPoint{};
  for (std::size_t i = 0; i < setup_.loads.size(); ++i) wrenches_[i] = wrench_of(setup_.loads[i], t, at);
  if (setup_.orbit) act_on_orbit(at);
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    const GraspSlip& slip = setup_.slips[i];
    slips_[i] = slip_state(slip, workspace_.kinematics);
    wrenches_[first_slip_ + 2 * i] = {slip.body_a, slips_[i].p_WC, slips_[i].F_WC};
    wrenches_[first_slip_ + 2 * i + 1] = {slip.body_b, slips_[i].p_WC, -slips_[i].F_WC};
  }
  if (const std::size_t count = base_.wrench_count(); count > 0)
    base_.push(t, workspace_.kinematics.X_WB[base_.root()],
               std::span(wrenches_).subspan(steady_wrenches_ - count, count));
  if (setup_.contacts) {
    wrenches_.resize(steady_wrenches_);
    setup_.contacts->evaluate(workspace_.kinematics, wrenches_);
  }
  if (!wrenches_.empty() || setup_.contacts) gather_external(model_, wrenches_, workspace_);
}

// Friction, and the output of the control laws: efforts, or accelerations.
void PhaseDynamics::actuate() {
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    const Body& body = model_.bodies()[model_.joints()[j]];
    friction_[j] = friction_of(j);
    if (const auto& spring = body.description.joint.spring) spring_[j] = spring->effort(now_.q[body.q]);  // (22.1)
    motor_[j] = smooth_effort_[j] = 0;
    const ControlOutput output = output_of(drive.control);
    if (!works_by_effort(output)) continue;
    if (!laws_command()) {
      if (channel_of_[j] >= 0) motor_[j] = output_of_motor(j, setup_.clock->held().effort[channel_of_[j]]);
      continue;
    }
    if (output == ControlOutput::command) {
      motor_[j] = output_of_motor(j, commanded_effort_[j]);
      continue;
    }
    const double law_value = law_output(j);
    if (output == ControlOutput::effort) {
      motor_[j] = output_of_motor(j, law_value);
    } else {
      acceleration_[body.v] = law_value;
    }
  }
}

// Time and state => tensions (19.24), and the efforts of the tendons' joints (19.22), added to `effort`.
void PhaseDynamics::pull_tendons(double t, std::span<double> effort) {
  for (std::size_t i = 0; i < setup_.tendons.size(); ++i) {
    const Tendon& tendon = setup_.tendons[i];
    tensions_[i] = tendon.tension_at(t, now_.q);
    for (const Tendon::Arm& a : tendon.arms) effort[static_cast<std::size_t>(a.joint)] += a.arm * tensions_[i];
  }
}

// Friction of a moving joint. For a joint at rest, friction follows from the motion.
double PhaseDynamics::friction_of(std::size_t joint) const {
  const Body& body = model_.bodies()[model_.joints()[joint]];
  const JointModes::Joint* modes = modes_.of(joint);
  if (!modes || !modes->sticks) {
    const JointDescription& d = body.description.joint;
    return friction_force(d.friction, now_.v[body.v]) - (d.spring ? d.spring->damping * now_.v[body.v] : 0);
  }
  return modes->mode == JointModes::Mode::held ? 0 : JointModes::sliding_friction(*modes, now_.v[body.v]);
}

// The motor's effort for a commanded effort.
double PhaseDynamics::output_of_motor(std::size_t joint, double commanded) {
  const Body& body = model_.bodies()[model_.joints()[joint]];
  smooth_effort_[joint] = joint_motor::within_line(body.description.joint, commanded, now_.v[body.v]);
  return joint_motor::with_ripple(body.description.joint, smooth_effort_[joint], now_.q[body.q]);
}

// Accelerations under force_, and the forces of the prescribed ones.
void PhaseDynamics::solve(std::span<const std::uint8_t> prescribed) {
  DynamicsInput<double> in;
  in.q = now_.q, in.v = now_.v, in.force = force_, in.gravity = setup_.gravity;
  in.prescribed = prescribed, in.acceleration = acceleration_, in.placed = placed_;
  if (steady_wrenches_ > 0 || (setup_.contacts && !is_left_alone())) in.link_wrench = workspace_.link_wrench;
  if (solver_) {
    in.placed = false;
    solver_->accelerations(in, setup_.loop_feedback, workspace_, vdot_, workspace_.force);
  } else {
    articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  }
}

// The forces of the commanded accelerations, by the model that the laws use, in which no contacts act: a controller
// does not measure them.
const std::vector<double>& PhaseDynamics::commanded_forces() {
  if (!setup_.law_model) {
    solve(commanded_);
    return workspace_.force;
  }
  DynamicsInput<double> in;
  in.q = now_.q, in.v = now_.v, in.force = force_, in.gravity = setup_.gravity;
  in.prescribed = commanded_, in.acceleration = acceleration_;
  if (steady_wrenches_ > 0 || (setup_.contacts && !is_left_alone())) in.link_wrench = workspace_.link_wrench;
  if (law_solver_) {
    law_solver_->accelerations(in, setup_.loop_feedback, *law_workspace_, law_vdot_, law_workspace_->force);
  } else {
    articulated_body<double>(setup_.law_model->tree(), in, law_workspace_->kernel, law_vdot_, law_workspace_->force);
  }
  return law_workspace_->force;
}

// Accelerations, and the motor and friction efforts of all joints.
void PhaseDynamics::accelerate(double t) {
  open_stresses_.reset();
  if (has_controller_ && laws_command()) call_controller(t);
  if (has_external_) act_from_outside(t);
  actuate();
  pull_tendons(t, motor_);
  if (base_.root() >= 0) drive_root(t);
  base_.turn(t, now_, commands(), {now_.v, prescribed_, commanded_, acceleration_});
  const auto velocity_of = [&](std::size_t j) { return model_.bodies()[model_.joints()[j]].v; };
  bool as_commanded = false;
  if (any_computed_ && laws_command()) {
    // The controller's model of the robot: without friction, moving as commanded. The kernel computes the torques and,
    // without disturbances or limits, also the accelerations.
    for (std::size_t j = 0; j < motor_.size(); ++j) force_[velocity_of(j)] = motor_[j] + spring_[j];
    const bool in_contact = setup_.contacts && setup_.contacts->touches();
    if (in_contact) gather_external(model_, std::span(wrenches_).first(steady_wrenches_), workspace_);
    const std::vector<double>& forces = commanded_forces();
    if (in_contact) gather_external(model_, wrenches_, workspace_);
    as_commanded = !has_friction_ && !modes_.any_held() && !setup_.law_model && !in_contact;
    for (std::size_t j = 0; j < motor_.size(); ++j) {
      if (output_of(setup_.drives[j].control) != ControlOutput::acceleration) continue;
      const double torque = forces[velocity_of(j)];
      motor_[j] = output_of_motor(j, torque);
      as_commanded = as_commanded && motor_[j] == torque;
    }
  }
  if (!as_commanded) {
    hold_joints();  // the laws may have written accelerations
    for (std::size_t j = 0; j < motor_.size(); ++j) force_[velocity_of(j)] = motor_[j] + friction_[j] + spring_[j];
    solve(prescribed_);
  }
  // Motors that would exceed their torque.
  while (base_.cut(workspace_.force, prescribed_, motor_)) {
    for (std::size_t j = 0; j < motor_.size(); ++j) force_[velocity_of(j)] = motor_[j] + friction_[j] + spring_[j];
    solve(prescribed_);
  }
  for (std::size_t j = 0; j < motor_.size(); ++j) {
    if (output_of(setup_.drives[j].control) == ControlOutput::motion) {
      motor_[j] = smooth_effort_[j] = workspace_.force[velocity_of(j)] - friction_[j] - spring_[j];
    }
  }
  for (const JointModes::Joint& joint : modes_.joints()) {
    if (joint.mode == JointModes::Mode::held)
      friction_[joint.joint] = workspace_.force[joint.v] - motor_[joint.joint] - spring_[joint.joint];
  }
  base_.conclude(workspace_.force, friction_, motor_);
}

// Accelerations at the state in y, with the base's current modes.
std::span<const double> PhaseDynamics::accelerations_in(double t, std::span<const double> y) {
  load(t, y);
  if (const auto tried = base_.tried_rate()) {
    now_.v[tried->first] = tried->second;
    recover(t);
  }
  if (projects()) close_loops(t);
  accelerate(t);
  return vdot_;
}

double PhaseDynamics::switch_margin(double t, std::span<const double> y) {
  load_integrated(t, y);
  double least = modes_.moving_margin(now_.q, now_.v);
  if (setup_.contacts) {
    place_bodies_now();
    least = std::min(least, setup_.contacts->margin(t, workspace_.kinematics));
  }
  if (modes_.any_held()) {
    accelerations_in(t, y);
    least = std::min(least, modes_.holding_margin(friction_, open_efforts()));
    load_integrated(t, y);
  }
  if (!base_.switches()) return least;
  recover(t);
  return std::min(least, base_.margin(std::vector<double>(now_.v), [&] { return accelerations_in(t, y); }));
}

// The present state => the poses of all bodies in the workspace; their twists are zero.
void PhaseDynamics::place_bodies_now() {
  link_motion<double>(model_.tree(), now_.q, {}, workspace_.kinematics.links);
  place_bodies(model_, workspace_.kinematics);
}

void PhaseDynamics::choose_modes(double t, std::span<const double> y) {
  if (setup_.contacts) {
    load(t, y);
    forward_kinematics(model_, now_, workspace_.kinematics);
    setup_.contacts->choose_modes(t, workspace_.kinematics);
  }
  if (!modes_.empty()) choose_joint_modes(t, y);
  if (!base_.switches()) return;
  base_.choose_modes(t, y.subspan(model_.coordinates(), model_.velocities()), [&] { return accelerations_in(t, y); });
}

// Time and y => y after impacts at stops (19.2). First, residual rates after reversals are set to zero by impulses;
// energy lost and impulses are added to the integrals in y.
void PhaseDynamics::apply_stop_impacts(double t, std::span<double> y) {
  if (modes_.empty()) return;
  const std::size_t nq = now_.q.size(), nv = now_.v.size();
  const std::span<double> v = y.subspan(nq, nv);
  if (const auto changes = modes_.overshoots(v); !changes.empty()) {
    load(t, y);
    respond_to(changes, true);
    book_impulses(y);
    for (std::size_t i = 0; i < nv; ++i) v[i] += vdot_[i];
    for (const JointModes::RateChange& r : changes) v[r.v] = 0;
  }
  load(t, y);
  const auto respond = [&](std::span<const JointModes::RateChange> changes) { return respond_to(changes, false); };
  if (modes_.apply_stop_impacts(t, y.first(nq), v, respond)) {
    y[nq + nv + kFrictionWork] -= modes_.last_energy_lost();
    book_impulses(y);
  }
  hold_joints();
}

// The response of the system at rest to changes of some rates, as to accelerations: M change = J^T P and the stops'
// impulses, (19.3). `friction_holds`: held joints remain held; not in impacts, where friction has no effect.
// `link_impulse`: of contacts, per link of the kernels' tree.
JointModes::ImpulseResponse PhaseDynamics::respond_to(std::span<const JointModes::RateChange> changes,
                                                      bool friction_holds, std::span<const Wrenchd> link_impulse) {
  for (const JointModes::Joint& joint : modes_.joints())
    prescribed_[joint.v] = friction_holds && joint.mode == JointModes::Mode::held;
  std::fill(acceleration_.begin(), acceleration_.end(), 0.0);
  for (const int v : base_.velocities().rate_controlled) prescribed_[v] = 0;  // motors give no impulses
  for (const JointModes::RateChange& r : changes) prescribed_[r.v] = 1, acceleration_[r.v] = r.change;
  std::fill(force_.begin(), force_.end(), 0.0);
  DynamicsInput<double> in;
  in.q = now_.q, in.v = at_rest_, in.force = force_, in.prescribed = prescribed_, in.acceleration = acceleration_;
  in.link_wrench = link_impulse;
  if (solver_) {
    solver_->accelerations(in, 0, workspace_, vdot_, workspace_.force);
  } else {
    articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  }
  return {vdot_, workspace_.force};
}

// Time and y => dy/dt: coordinate rates, accelerations by (4.8) to (4.12) or, with closures, (8.6), powers and external
// wrenches as rates of the integrals. Contradicting closures give NaN, and loop_failure_ records the cause.
void PhaseDynamics::operator()(double t, std::span<const double> y, std::span<double> dydt) {
  const int nq = model_.coordinates(), nv = model_.velocities();
  load(t, y);
  if (projects()) follow(t);
  accelerate(t);
  if (solver_ && !(solver_->contradiction() <= loop_limits::kContradiction)) {
    // No motion satisfies the closures: returns non-finite rates; a shorter step may avoid this.
    if (std::isfinite(solver_->contradiction())) {
      loop_failure_ =
          LoopFailure{t, solver_->contradiction(), solver_->rank(), solver_->min_pivot(), solver_->contradicting_row()};
    }
    std::fill(dydt.begin(), dydt.end(), std::numeric_limits<double>::quiet_NaN());
    return;
  }
  loop_failure_.reset();
  coordinate_rates(model_, now_.q, now_.v, dydt.first(nq));
  std::copy(vdot_.begin(), vdot_.end(), dydt.begin() + nq);
  const std::span<double> integrals = dydt.subspan(nq + nv, integral_count());
  std::fill(integrals.begin(), integrals.end(), 0.0);
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const int body = model_.joints()[j];
    const double rate = now_.v[model_.bodies()[body].v];
    integrals[kMotorWork] += motor_[j] * rate;
    integrals[kFrictionWork] += friction_[j] * rate;
    exchanged[kExchangeCount * tree_of_[body] + kExchangedWork] +=
        (std::abs(motor_[j]) + std::abs(friction_[j])) * std::abs(rate);
  }
  if (has_external_ && !is_left_alone()) add_external(integrals);
  add_joint_integrals(integrals);
  if (setup_.contacts && setup_.contacts->touches()) add_contact_integrals(integrals);
  add_slip_integrals(integrals);
}

const State& PhaseDynamics::unprojected_state(double t, std::span<const double> y) {
  load(t, y);
  return now_;
}

const State& PhaseDynamics::state(double t, std::span<const double> y) {
  load(t, y);
  if (projects()) close_loops(t);
  return now_;
}

// Time and y => y on the closures, by (8.9) and (8.10), and the size of the correction; the integrals do not change.
ProjectionResult PhaseDynamics::project(double t, std::span<double> y, double negligible) {
  load(t, y);
  const std::size_t nq = now_.q.size();
  loaded_.resize(nq + now_.v.size());
  std::copy(now_.q.begin(), now_.q.end(), loaded_.begin());
  std::copy(now_.v.begin(), now_.v.end(), loaded_.begin() + static_cast<std::ptrdiff_t>(nq));
  const ProjectionResult result = solver_->project(prescribed_, workspace_, now_.q, now_.v, negligible);
  if (!result.changed) return result;
  // Only the change: roots' integrated positions and velocities remain a check of the recovered ones.
  for (std::size_t i = 0; i < nq; ++i) y[i] += now_.q[i] - loaded_[i];
  for (std::size_t i = 0; i < now_.v.size(); ++i) y[nq + i] += now_.v[i] - loaded_[nq + i];
  return result;
}

ClosureDefect PhaseDynamics::loop_defect(double t, std::span<const double> y) {
  load(t, y);
  ClosureDefect largest;
  const auto raise_by = [&](bool one_tree) {
    forward_kinematics(model_, now_, workspace_.kinematics);
    for (const LoopClosure& closure : setup_.closures) {
      if ((tree_of_[closure.body_a] == tree_of_[closure.body_b]) == one_tree)
        largest.raise(closure_defect(closure, workspace_.kinematics));
    }
  };
  raise_by(false);
  move_roots_to_origin(model_, now_);  // less rounding; the place of a tree does not matter
  raise_by(true);
  largest.raise(coupling_defects(model_, now_));
  return largest;
}

std::string PhaseDynamics::loop_failure() const {
  if (!loop_failure_) return {};
  return fmt::format(
      "at t = {:.9g} s no motion satisfies the closed loops: {} contradicts the other closures or prescribed joints "
      "({:.2g} of the current accelerations; rank {} of {} rows, least pivot {:.2g}): a singular configuration, or "
      "joints that are driven against the loop",
      loop_failure_->time, loop_failure_->row, loop_failure_->contradiction, loop_failure_->rank, solver_->rows(),
      loop_failure_->min_pivot);
}

void PhaseDynamics::efforts(double t, std::span<const double> y, std::span<double> motor, std::span<double> friction) {
  load(t, y);
  if (projects()) close_loops(t);
  accelerate(t);
  settle_friction();
  std::copy(motor_.begin(), motor_.end(), motor.begin());
  std::copy(friction_.begin(), friction_.end(), friction.begin());
}

}  // namespace grapnel
