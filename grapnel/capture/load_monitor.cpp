#include "grapnel/capture/load_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "grapnel/capture/impact_figures.hpp"
#include "grapnel/capture/internal_loads.hpp"

namespace grapnel {

namespace {

const std::string kBaseControl = "base control";
constexpr const char* kAxes[3] = {"driving/x", "driving/y", "driving/z"};

}  // namespace

const LoadRating& LoadMonitor::rating_of(const std::string& joint_or_end_effector) const {
  static const LoadRating none;
  for (const auto& [joint, rating] : problem_.robot.ratings) {
    if (joint == joint_or_end_effector) return rating;
  }
  for (const EndEffectorSetup& e : problem_.robot.end_effectors) {
    if (e.name == joint_or_end_effector) return e.rating;
  }
  return none;
}

void LoadMonitor::begin_phase(const std::string& name, const CaptureSystem& system, const PhaseDynamics& dynamics) {
  open_ = true;
  name_ = name, system_ = &system;
  bodies_ = loaded_bodies(system);
  determined_.clear();
  impulses_.clear();
  kinematics_ = Kinematics(system.model);
  motor_.resize(system.model.joints().size());
  efforts_.begin_phase(name);
  add_channels(dynamics);
  search_ = PeakSearch(channels_.size(), channels_.size());
}

// In the order of evaluate().
void LoadMonitor::add_channels(const PhaseDynamics& dynamics) {
  const Model& model = system_->model;
  channels_.clear(), drives_.clear();
  for (int body : bodies_) {
    const JointDescription& joint = model.bodies()[body].description.joint;
    const LoadRating& rating = rating_of(joint.name);
    channels_.push_back({joint.name, "force", rating.force});
    channels_.push_back({joint.name, "moment", rating.moment});
    const auto at = std::find(model.joints().begin(), model.joints().end(), body);
    drives_.push_back(at == model.joints().end() ? -1 : static_cast<int>(at - model.joints().begin()));
    if (drives_.back() < 0) continue;
    const JointControl control = dynamics.setup().drives[drives_.back()].control;
    const ControlOutput output = output_of(control);
    if (output != ControlOutput::none)
      efforts_.watch(joint.name, channels_.size(), joint.limits.effort, works_by_effort(output));
    channels_.push_back({joint.name, "driving", std::min(rating.driving, joint.limits.effort)});
  }
  for (const HeldGrasp& grasp : system_->grasps) {
    const std::string& end_effector = problem_.grasps[grasp.grasp].end_effector;
    channels_.push_back({end_effector, "force", rating_of(end_effector).force});
    channels_.push_back({end_effector, "moment", rating_of(end_effector).moment});
  }
  controls_base_ = dynamics.setup().attitude.has_value();
  if (!controls_base_) return;
  // The limit applies to the command, not to a rating: gyros, and thrusters on or off, may give more or less. In that
  // case SaturationMonitor observes the command.
  const bool torque_equals_command = !base_torque_may_differ(dynamics.setup());
  for (int k = 0; k < 3; ++k) {
    const double limit = dynamics.setup().attitude->limit[k];
    if (torque_equals_command) efforts_.watch(kBaseControl + " " + "xyz"[k], channels_.size(), limit, true);
    channels_.push_back({kBaseControl, kAxes[k], std::numeric_limits<double>::infinity()});
  }
}

// Magnitudes, except for efforts, which have signs.
void LoadMonitor::evaluate(const PhaseSample& sample, std::span<double> values) {
  forward_kinematics(system_->model, sample.state, kinematics_);
  const bool first = determined_.size() != system_->grasps.size();
  const std::vector<GraspWrench> grasps = wrenches_of_grasps(*system_, kinematics_, sample, first);
  std::copy(sample.motor.begin(), sample.motor.end(), motor_.begin());
  if (!system_->closures.empty()) add_self_stress(*system_, kinematics_, grasps, motor_);
  std::vector<Wrenchd> on_robot;
  for (const GraspWrench& grasp : grasps) {
    on_robot.push_back(grasp.F_WC);
    if (first) determined_.push_back(grasp.determined);
  }
  const std::vector<Wrenchd> through = joint_wrenches(*system_, kinematics_, sample, on_robot);
  std::size_t next = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Wrenchd& F = through[bodies_[i]];
    values[next++] = norm(F.linear);
    values[next++] = norm(F.angular);
    if (drives_[i] >= 0) values[next++] = motor_[drives_[i]];
  }
  for (const Wrenchd& F : on_robot) {
    values[next++] = norm(F.linear);
    values[next++] = norm(F.angular);
  }
  if (!controls_base_) return;
  for (int k = 0; k < 3; ++k) values[next++] = sample.dynamics->control_torque()[k];
}

void LoadMonitor::step(const PhaseStep& step) {
  const PeakSearch::Quantities at = [&](double t, std::span<double> values) { evaluate(step.at(t), values); };
  search_.step(step.begin, step.end, step.fresh, at);
  efforts_.step(search_.points(), at);
}

// An impulse => the largest one of its kind in the phase.
void LoadMonitor::raise(const std::string& of, const char* quantity, double value, double time) {
  const auto is_same = [&](const PeakLoad& load) { return load.of == of && load.quantity == quantity; };
  auto load = std::ranges::find_if(impulses_, is_same);
  if (load == impulses_.end()) {
    impulses_.push_back({of, quantity, name_, 0, time, limit_of(rating_of(of), quantity), false});
    load = impulses_.end() - 1;
  }
  if (value > load->peak) load->peak = value, load->time = time;
}

void LoadMonitor::hard_impact(const HardImpact& impact) {
  const Model& model = system_->model;
  const InternalImpulses impulses = internal_impulses(*system_, impact);
  const Kinematics k = forward_kinematics(model, impact.before);
  for (const int body : bodies_) {
    const JointDescription& joint = model.bodies()[body].description.joint;
    const Wrenchd& P = impulses.joints[body];
    const Vector3d axis = k.X_WB[body].R * joint.axis;
    const double driving = slides_along_axis(joint.type) ? dot(axis, P.linear)
                           : has_one_axis(joint.type)    ? dot(axis, P.angular)
                                                         : 0;
    raise(joint.name, "impulse", norm(P.linear), impact.time);
    raise(joint.name, "angular_impulse", norm(P.angular), impact.time);
    raise(joint.name, "driving_impulse", std::abs(driving), impact.time);
  }
  for (std::size_t g = 0; g < system_->grasps.size(); ++g) {
    const std::string& end_effector = problem_.grasps[system_->grasps[g].grasp].end_effector;
    raise(end_effector, "impulse", norm(impulses.grasps[g].linear), impact.time);
    raise(end_effector, "angular_impulse", norm(impulses.grasps[g].angular), impact.time);
  }
}

// Omits loads that are zero and not rated, e.g. of free drives.
void LoadMonitor::note(PeakLoad load) {
  if (load.peak != 0 || std::isfinite(load.rating)) peaks_.push_back(std::move(load));
}

// Peaks of the phase => peak loads of joints, grasps and base control with their ratings, grasp loads, and limit
// events; nothing if no step was observed.
void LoadMonitor::end_phase() {
  open_ = false;
  const std::span<const Peak> found = search_.peaks();
  const bool seen = !found.empty() && found[0].magnitude >= 0;
  for (std::size_t i = 0; seen && i < channels_.size(); ++i) {
    const Channel& c = channels_[i];
    note({c.of, c.quantity, name_, found[i].magnitude, found[i].time, c.rating, false});
  }
  for (PeakLoad& load : impulses_) note(std::move(load));
  impulses_.clear();
  const std::size_t first = channels_.size() - 2 * system_->grasps.size() - (controls_base_ ? 3 : 0);
  for (std::size_t g = 0; seen && g < system_->grasps.size(); ++g) {
    const GraspSetup& grasp = problem_.grasps[system_->grasps[g].grasp];
    const Peak &force = found[first + 2 * g], &moment = found[first + 2 * g + 1];
    grasps_.push_back({name_, grasp.end_effector, grasp.target, force.magnitude, force.time, moment.magnitude,
                       moment.time, determined_[g]});
  }
  events_ = efforts_.end_phase();
}

void LoadMonitor::impact(const std::string& phase, const ImpactReport& report, std::span<const JointPeakTimes> peaks) {
  for (PeakLoad& load : impact_loads(report, peaks)) {
    load.phase = phase, load.rating = limit_of(rating_of(load.of), load.quantity);
    note(std::move(load));
  }
}

void LoadMonitor::begin_held(const std::string& phase, double begin, std::span<const std::string> end_effectors) {
  held_begin_ = begin;
  held_.clear();
  for (const std::string& end_effector : end_effectors) {
    held_.push_back({end_effector, "force", phase, 0, begin, rating_of(end_effector).force, false});
    held_.push_back({end_effector, "moment", phase, 0, begin, rating_of(end_effector).moment, false});
  }
}

void LoadMonitor::check_held_bodies(const CompliantSample& sample) {
  const auto raise = [&](PeakLoad& load, double value) {
    if (!(value <= load.peak)) load.peak = value, load.time = held_begin_ + sample.time;
  };
  for (std::size_t g = 0; 2 * g < held_.size(); ++g) {
    raise(held_[2 * g], norm(sample.held_wrenches[g].linear));
    raise(held_[2 * g + 1], norm(sample.held_wrenches[g].angular));
  }
}

void LoadMonitor::end_held() {
  for (PeakLoad& load : held_) note(std::move(load));
  held_.clear();
}

void LoadMonitor::write(CaptureResult& result) {
  if (open_) end_phase();
  result.peak_loads = peaks_;
  result.grasp_loads = grasps_;
}

}  // namespace grapnel
