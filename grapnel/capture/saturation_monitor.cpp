#include "grapnel/capture/saturation_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

using Actuator = SaturationReport::Actuator;
using Quantity = SaturationReport::Quantity;

// Relative distance from a limit below which an actuator is at it.
constexpr double kAtLimit = 1e-9;
// Instants that differ by less are equal [s].
constexpr double kSameInstant = 1e-9;

bool is_at(double value, double limit) { return std::isfinite(limit) && std::abs(value) >= limit * (1 - kAtLimit); }

}  // namespace

bool base_torque_may_differ(const PhaseSetup& setup) {
  return setup.actuators.steering || !setup.effectors.empty() ||
         (setup.actuators.thrusters && !setup.actuators.dumping);
}

// Problem => one item per limit of wheels, gyros, thrusters and base control axes, and one for the singularity of the
// gyro array.
SaturationMonitor::SaturationMonitor(const CaptureProblem& problem) {
  const auto item = [](Actuator actuator, const std::string& name, Quantity quantity, double limit) {
    Item made;
    made.report.actuator = actuator, made.report.name = name;
    made.report.quantity = quantity, made.report.limit = limit;
    return made;
  };
  for (const WheelSetup& wheel : problem.robot.wheels) {
    wheel_rates_.push_back(item(Actuator::wheel, wheel.name, Quantity::rate, wheel.rate));
    wheel_torques_.push_back(item(Actuator::wheel, wheel.name, Quantity::torque, wheel.torque));
  }
  for (const MomentGyroSetup& gyro : problem.robot.gyros) {
    gimbal_rates_.push_back(item(Actuator::gyro, gyro.name, Quantity::rate, gyro.rate));
    gimbal_torques_.push_back(item(Actuator::gyro, gyro.name, Quantity::torque, gyro.torque));
  }
  for (const ThrusterSetup& thruster : problem.robot.thrusters)
    thrusters_.push_back(item(Actuator::thruster, thruster.name, Quantity::duty, 1));
  for (const char* axis : {"x", "y", "z"})
    base_.push_back(item(Actuator::base_control, axis, Quantity::torque, std::numeric_limits<double>::infinity()));
  gyros_ = item(Actuator::gyros, "array", Quantity::singularity, 0);
}

// System, dynamics => flags of the actuators that are observed in this phase; limits of base control and of the array's
// singularity; items begin unsaturated.
void SaturationMonitor::begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) {
  system_ = &system;
  const PhaseSetup& setup = dynamics.setup();
  const auto is_limited = [](const Item& item) { return std::isfinite(item.report.limit); };
  const auto any = [&](const std::vector<Item>& items) { return std::any_of(items.begin(), items.end(), is_limited); };
  drives_wheels_ = !setup.wheels.empty() && (any(wheel_rates_) || any(wheel_torques_));
  steers_ = !setup.gyros.empty() && (setup.actuators.steering || setup.actuators.one_by_one);
  fires_ = setup.actuators.thrusters != nullptr;
  if (setup.actuators.steering) gyros_.report.limit = dynamics.base().find<GyroEffector>()->array().steering().near;
  observes_ = drives_wheels_ || steers_ || fires_;
  commands_base_ = setup.attitude && base_torque_may_differ(setup);
  for (int k = 0; commands_base_ && k < 3; ++k)
    base_[static_cast<std::size_t>(k)].report.limit = setup.attitude->limit[k];
  for (auto* items : {&wheel_rates_, &wheel_torques_, &gimbal_rates_, &gimbal_torques_, &thrusters_, &base_}) {
    for (Item& item : *items) item.was = item.now = item.report.at_end = false;
  }
  gyros_.was = gyros_.now = gyros_.report.at_end = false;
}

void SaturationMonitor::note(Item& item, double begin, double end, bool saturated, bool was) {
  item.now = saturated && was;
  item.was = saturated;
  item.report.at_end = saturated;
  if (!item.now) return;
  if (!(item.report.duration > 0)) item.report.first_time = begin;
  item.report.duration += end - begin;
}

void SaturationMonitor::step(double begin, const PhaseSample& reached) {
  if (drives_wheels_) step_wheels(begin, reached);
  if (steers_) step_gyros(begin, reached);
  if (fires_) step_thrusters(begin, reached);
  for (std::size_t k = 0; commands_base_ && k < 3; ++k) {
    const double commanded = reached.dynamics->base().commanded_torque()[static_cast<int>(k)];
    note(base_[k], begin, reached.time, is_at(commanded, base_[k].report.limit), true);
  }
}

// A rate is continuous: a step counts if both its ends are at the limit. Commands of motors may jump between steps.
void SaturationMonitor::step_wheels(double begin, const PhaseSample& reached) {
  const Model& model = system_->model;
  for (std::size_t w = 0; w < system_->wheels.size(); ++w) {
    const int joint = system_->wheels[w];
    const double rate = reached.state.v[model.bodies()[model.joints()[joint]].v];
    const bool at_rate = is_at(rate, wheel_rates_[w].report.limit);
    note(wheel_rates_[w], begin, reached.time, at_rate, wheel_rates_[w].was);
    const double torque = reached.motor[static_cast<std::size_t>(joint)];
    // A motor that keeps a wheel at its maximum rate gives the required torque.
    note(wheel_torques_[w], begin, reached.time, !at_rate && is_at(torque, wheel_torques_[w].report.limit), true);
  }
}

void SaturationMonitor::step_gyros(double begin, const PhaseSample& reached) {
  const GyroArray& array = reached.dynamics->base().find<GyroEffector>()->array();
  for (std::size_t g = 0; g < system_->gyros.size(); ++g) {
    const double rate = g < array.commanded().size() ? array.commanded()[g] : 0;
    note(gimbal_rates_[g], begin, reached.time, is_at(rate, gimbal_rates_[g].report.limit), true);
    const double torque = reached.motor[static_cast<std::size_t>(system_->gyros[g].gimbal)];
    note(gimbal_torques_[g], begin, reached.time, is_at(torque, gimbal_torques_[g].report.limit), true);
  }
  if (gyros_.report.limit > 0)
    note(gyros_, begin, reached.time, array.singularity_measure() < gyros_.report.limit, true);
}

// Step => time of thrusters at full duty: open, and commanded for the whole period or with full force (18.2). Momentum
// dumping has no command.
void SaturationMonitor::step_thrusters(double begin, const PhaseSample& reached) {
  const BaseActuation& base = reached.dynamics->base();
  const ThrusterBank& bank = *base.thrusters();
  const PhaseSetup& setup = reached.dynamics->setup();
  std::vector<double> shares;  // of the time, or of the force, commanded
  if (setup.actuators.one_by_one) {
    shares = setup.clock->held().actuators.thruster;
  } else if (!setup.actuators.dumping) {
    shares = bank.allocation().on_times(base.commanded_torque()).value_or(std::vector<double>());
  }
  for (std::size_t i = 0; i < thrusters_.size() && i < bank.size(); ++i) {
    const bool is_full = i < shares.size() && shares[i] >= 1 - kAtLimit;
    note(thrusters_[i], begin, reached.time, bank.is_open(i) && is_full, true);
  }
}

bool SaturationMonitor::base_is_saturated() const {
  const auto is_now = [](const Item& item) { return item.now; };
  for (const auto* items : {&wheel_rates_, &wheel_torques_, &gimbal_rates_, &gimbal_torques_, &thrusters_, &base_}) {
    if (std::any_of(items->begin(), items->end(), is_now)) return true;
  }
  return false;
}

namespace {

// Saturated drives of joints and base control, each over all phases.
std::vector<SaturationReport> saturated_drives(const CaptureResult& result, double end) {
  const std::string base = "base control ";
  std::vector<SaturationReport> all;
  for (const LimitEvent& e : result.limit_events) {
    if (e.kind != LimitKind::effort_saturated) continue;
    const bool of_base = e.joint.starts_with(base);
    SaturationReport one;
    one.actuator = of_base ? Actuator::base_control : Actuator::joint;
    one.name = of_base ? e.joint.substr(base.size()) : e.joint;
    one.quantity = of_base ? Quantity::torque : Quantity::effort;
    one.limit = std::abs(e.limit), one.first_time = e.begin_time;
    const auto same = [&](const auto& s) { return s.actuator == one.actuator && s.name == one.name; };
    auto at = std::find_if(all.begin(), all.end(), same);
    if (at == all.end()) at = all.insert(all.end(), one);
    at->first_time = std::min(at->first_time, e.begin_time);
    at->duration += e.end_time - e.begin_time;
    at->at_end = at->at_end || e.end_time >= end - kSameInstant * std::max(1.0, end);
  }
  return all;
}

}  // namespace

void SaturationMonitor::write(double end, CaptureResult& result) const {
  std::vector<SaturationReport> all = saturated_drives(result, end);
  for (const auto* items : {&wheel_rates_, &wheel_torques_, &gimbal_rates_, &gimbal_torques_, &thrusters_, &base_}) {
    for (const Item& item : *items) all.push_back(item.report);
  }
  all.push_back(gyros_.report);
  std::erase_if(all, [](const SaturationReport& s) { return !(s.duration > 0); });
  for (SaturationReport& s : all) s.share = simulated_ > 0 ? std::min(1.0, s.duration / simulated_) : 0;
  std::ranges::stable_sort(all, std::greater<>(), &SaturationReport::duration);
  result.saturation = std::move(all);
  for (const std::string& warning : saturation_warnings(result)) result.warnings.push_back(warning);
}

}  // namespace grapnel
