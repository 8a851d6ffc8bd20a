#include "grapnel/capture/load_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/impact_report/internal_loads.hpp"

namespace grapnel {
namespace {

const std::string kBaseControl = "base control";
constexpr const char* kAxes[3] = {"driving/x", "driving/y", "driving/z"};

}  // namespace

const LoadRating& LoadMonitor::rating_of(const std::string& joint_or_hand) const {
  static const LoadRating none;
  for (const auto& [joint, rating] : problem_.robot.ratings) {
    if (joint == joint_or_hand) return rating;
  }
  for (const EndEffectorSetup& e : problem_.robot.end_effectors) {
    if (e.name == joint_or_hand) return e.rating;
  }
  return none;
}

void LoadMonitor::begin_phase(const std::string& name, const CaptureSystem& system, const PhaseDynamics& dynamics) {
  open_ = true;
  name_ = name, system_ = &system;
  bodies_ = carried_bodies(system);
  determined_.clear();
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
    const JointControl control = dynamics.setup().drives[static_cast<std::size_t>(drives_.back())].control;
    const ControlOutput output = output_of(control);
    if (output != ControlOutput::none)
      efforts_.watch(joint.name, channels_.size(), joint.limits.effort, works_by_effort(output));
    channels_.push_back({joint.name, "driving", std::min(rating.driving, joint.limits.effort)});
  }
  for (const HeldGrasp& grasp : system_->grasps) {
    const std::string& hand = problem_.grasps[grasp.grasp].end_effector;
    channels_.push_back({hand, "force", rating_of(hand).force});
    channels_.push_back({hand, "moment", rating_of(hand).moment});
  }
  controls_base_ = dynamics.setup().attitude.has_value();
  if (!controls_base_) return;
  for (int k = 0; k < 3; ++k) {
    const double limit = dynamics.setup().attitude->limit[k];
    efforts_.watch(kBaseControl + " " + "xyz"[k], channels_.size(), limit, true);
    channels_.push_back({kBaseControl, kAxes[k], limit});
  }
}

// Magnitudes, but for efforts, which have signs.
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
    const Wrenchd& F = through[static_cast<std::size_t>(bodies_[i])];
    values[next++] = norm(F.linear);
    values[next++] = norm(F.angular);
    if (drives_[i] >= 0) values[next++] = motor_[static_cast<std::size_t>(drives_[i])];
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

// Nothing is said of what bears nothing and is not rated: free drives, say.
void LoadMonitor::note(PeakLoad load) {
  if (load.peak != 0 || std::isfinite(load.rating)) peaks_.push_back(std::move(load));
}

void LoadMonitor::end_phase() {
  open_ = false;
  const std::span<const Peak> found = search_.peaks();
  const bool seen = !found.empty() && found[0].magnitude >= 0;
  for (std::size_t i = 0; seen && i < channels_.size(); ++i) {
    const Channel& c = channels_[i];
    note({c.of, c.quantity, name_, found[i].magnitude, found[i].time, c.rating, false});
  }
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
  const bool in_time = report.compliant.has_value();
  const auto add = [&](const std::string& of, const char* quantity, double value, double after, double rating) {
    note({of, quantity, phase, value, report.time + after, rating, false});
  };
  // Mean over an assumed time, where the impact takes none.
  const auto mean = [&](const std::string& of, const char* quantity, double impulse, double rating) {
    note({of, quantity, phase, impulse / report.duration, report.time, rating, true});
  };
  for (std::size_t i = 0; i < report.joints.size(); ++i) {
    const JointImpulse& j = report.joints[i];
    const LoadRating& rating = rating_of(j.joint);
    const double impulse = norm(j.impulse), angular = norm(j.angular_impulse), driving = std::abs(j.along_axis);
    add(j.joint, "impulse", impulse, 0, rating.impulse);
    add(j.joint, "angular_impulse", angular, 0, rating.angular_impulse);
    add(j.joint, "driving_impulse", driving, 0, rating.driving_impulse);
    if (in_time) {
      const JointPeakTimes times = i < peaks.size() ? peaks[i] : JointPeakTimes{};
      add(j.joint, "force", j.peak_force, times.force, rating.force);
      add(j.joint, "moment", j.peak_moment, times.moment, rating.moment);
      add(j.joint, "driving", j.peak_driving, times.driving, rating.driving);
    } else {
      mean(j.joint, "force", impulse, rating.force);
      mean(j.joint, "moment", angular, rating.moment);
      mean(j.joint, "driving", driving, rating.driving);
    }
  }
  for (const GraspImpulse& g : report.grasps) {
    const LoadRating& rating = rating_of(g.end_effector);
    const double impulse = norm(g.impulse), angular = norm(g.angular_impulse);
    add(g.end_effector, "impulse", impulse, 0, rating.impulse);
    add(g.end_effector, "angular_impulse", angular, 0, rating.angular_impulse);
    if (g.profile) {
      add(g.end_effector, "force", g.profile->peak_force, g.profile->peak_force_time, rating.force);
      add(g.end_effector, "moment", g.profile->peak_moment, g.profile->peak_moment_time, rating.moment);
    } else {
      mean(g.end_effector, "force", impulse, rating.force);
      mean(g.end_effector, "moment", angular, rating.moment);
    }
  }
}

void LoadMonitor::held(const std::string& phase, double begin, std::span<const std::string> hands,
                       std::span<const CompliantSample> samples) {
  for (std::size_t g = 0; g < hands.size(); ++g) {
    PeakLoad force{hands[g], "force", phase, 0, begin, rating_of(hands[g]).force, false};
    PeakLoad moment{hands[g], "moment", phase, 0, begin, rating_of(hands[g]).moment, false};
    const auto raise = [&](PeakLoad& load, double value, double time) {
      if (!(value <= load.peak)) load.peak = value, load.time = begin + time;
    };
    for (const CompliantSample& sample : samples) {
      raise(force, norm(sample.held_wrenches[g].linear), sample.time);
      raise(moment, norm(sample.held_wrenches[g].angular), sample.time);
    }
    note(std::move(force));
    note(std::move(moment));
  }
}

void LoadMonitor::write(CaptureResult& result) {
  if (open_) end_phase();
  result.peak_loads = peaks_;
  result.grasp_loads = grasps_;
}

}  // namespace grapnel
