#include "grapnel/capture/gyro_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/approach/phase_setups.hpp"

namespace grapnel {
namespace {

// Consecutive steps, to within rounding, form one interval near a singularity.
constexpr double kSameTime = 1e-9;

void raise_size(double& largest, double value) {
  if (!(std::abs(value) <= largest)) largest = std::abs(value);
}

}  // namespace

GyroMonitor::GyroMonitor(const CaptureProblem& problem) : problem_(problem) {
  for (const MomentGyroSetup& gyro : problem.robot.gyros) {
    GyroReport& report = report_.each.emplace_back();
    report.name = gyro.name, report.momentum = gyro.inertia * gyro.spin_rate;
    report.rate_limit = gyro.rate, report.torque_limit = gyro.torque;
  }
}

void GyroMonitor::begin_phase(const CaptureSystem&, const PhaseDynamics& dynamics) {
  steered_ = dynamics.setup().actuators.steering.has_value();
  if (!steered_) return;
  report_.near = dynamics.base().find<GyroEffector>()->array().steering().near;
  if (!report_.steered) report_.largest_torque_lacking = 0, report_.steered = true;
}

// Step => minimum singularity measure and largest torque deficit [N m] at mid-step; steps below `near` extend the
// current hazard, or begin one (docs/theory, section 17, Control moment gyros).
void GyroMonitor::step(const PhaseStep& step) {
  const PhaseSample sample = step.at(0.5 * (step.begin + step.end));
  const GyroArray& array = sample.dynamics->base().find<GyroEffector>()->array();
  const double measure = array.singularity_measure();
  report_.least_singularity_measure = std::min(report_.least_singularity_measure, measure);
  raise_size(report_.largest_torque_lacking, norm(array.lacking()));
  if (!(measure < array.steering().near)) return;
  std::vector<SingularityHazard>& hazards = report_.hazards;
  if (hazards.empty() || step.begin - hazards.back().end > kSameTime)
    hazards.push_back({step.begin, step.end, measure, 0});
  SingularityHazard& hazard = hazards.back();
  hazard.end = step.end;
  hazard.least_measure = std::min(hazard.least_measure, measure);
  hazard.largest_torque_lacking = std::max(hazard.largest_torque_lacking, norm(array.lacking()));
}

GyroMonitor::Posture GyroMonitor::posture(const CaptureSystem& system, const State& state) const {
  Posture at;
  for (std::size_t g = 0; g < system.gyros.size(); ++g) {
    at.gyros.push_back(moment_gyro(problem_.robot.gyros[g], system, g));
    at.angles.push_back(state.q[at.gyros.back().gimbal_coordinate]);
  }
  return at;
}

std::vector<Series> GyroMonitor::series() const {
  if (report_.each.empty()) return {};
  std::vector<std::string> names;
  for (const GyroReport& report : report_.each) names.push_back(report.name);
  return {
      {"gyros/angle", "rad", "angles of the control moment gyros' gimbals", names, {}},
      {"gyros/rate", "rad/s", "their rates relative to the base", names, {}},
      {"gyros/rotor_rate", "rad/s", "rates of the rotors relative to their gimbals", names, {}},
      {"gyros/torque", "N m", "of the gimbals' motors, on the gimbals", names, {}},
      {"gyros/spin_torque", "N m", "of the rotors' motors, on the rotors", names, {}},
      {"gyros/momentum", "N m s", "of all rotors relative to their gimbals, in the base's axes", {"x", "y", "z"}, {}},
      {"gyros/singularity_measure",
       "1",
       "root of det(A A^T) of the array: 0 where it is singular",
       {"singularity_measure"},
       {}}};
}

// Sample => gimbal angles and rates, rotor rates, motor torques, momentum of the rotors in the base's axes (17.7) and
// singularity measure of the array.
void GyroMonitor::put(const CaptureSystem& system, const PhaseSample& s, SeriesRow& row) const {
  if (report_.each.empty()) return;
  const auto [gyros, angles] = posture(system, s.state);
  const std::size_t count = gyros.size();
  Vector3d momentum = Vector3d::zero();
  std::vector<double> rotor_rates;
  for (std::size_t g = 0; g < count; ++g) {
    rotor_rates.push_back(s.state.v[gyros[g].rotor_velocity]);
    momentum += momentum_of(gyros[g], angles[g], rotor_rates[g]);
  }
  const std::vector<MomentGyro>& all = gyros;
  row.put_all(angles);
  row.put_each(count, [&](std::size_t g) { return s.state.v[all[g].gimbal_velocity]; });
  row.put_all(rotor_rates);
  row.put_each(count, [&](std::size_t g) { return s.motor[all[g].gimbal]; });
  row.put_each(count, [&](std::size_t g) { return s.motor[all[g].rotor]; });
  row.put(momentum);
  row.put(singularity_measure(gyros, angles));
}

// State, motor efforts or none => per gyro its gimbal angle, largest gimbal rate and largest motor torques so far;
// minimum singularity measure of the array.
void GyroMonitor::observe(const CaptureSystem& system, const State& state, std::span<const double> motor) {
  if (system.gyros.empty()) return;
  for (std::size_t g = 0; g < system.gyros.size(); ++g) {
    GyroReport& report = report_.each[g];
    const CaptureSystem::Gyro joints = system.gyros[g];
    const Body& gimbal = system.model.bodies()[system.model.joints()[joints.gimbal]];
    report.angle_after = state.q[gimbal.q];
    if (!any_) report.angle_before = report.angle_after;
    report.largest_rate = std::max(report.largest_rate, std::abs(state.v[gimbal.v]));
    if (motor.empty()) continue;
    raise_size(report.largest_torque, motor[joints.gimbal]);
    raise_size(report.largest_spin_torque, motor[joints.rotor]);
  }
  const Posture at = posture(system, state);
  report_.least_singularity_measure =
      std::min(report_.least_singularity_measure, singularity_measure(at.gyros, at.angles));
  any_ = true;
}

// Observed gyros => report and, if the array was near a singularity, a warning with total time [s], minimum measure and
// torque deficit [N m].
void GyroMonitor::write(CaptureResult& result) const {
  if (!any_) return;
  result.gyros = report_;
  if (report_.hazards.empty()) return;
  double time = 0, lacking = 0;
  for (const SingularityHazard& hazard : report_.hazards)
    time += hazard.duration(), lacking = std::max(lacking, hazard.largest_torque_lacking);
  result.warnings.push_back(
      fmt::format("gyros: for {:.4g} s, first at t = {:.6g} s, the array was near a singularity (measure down to "
                  "{:.3g}, below {:g}), "
                  "where the torque was up to {:.3g} N m below the command",
                  time, report_.hazards.front().begin, report_.least_singularity_measure, report_.near, lacking));
}

}  // namespace grapnel
