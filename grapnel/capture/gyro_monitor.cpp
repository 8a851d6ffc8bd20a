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

void GyroMonitor::begin_phase(const PhaseDynamics& dynamics) {
  steered_ = dynamics.setup().actuators.steering.has_value();
  if (!steered_) return;
  report_.near = dynamics.base().gyros().steering().near;
  if (!report_.steered) report_.largest_torque_lacking = 0, report_.steered = true;
}

void GyroMonitor::step(const PhaseStep& step) {
  const PhaseSample sample = step.at(0.5 * (step.begin + step.end));
  const GyroArray& array = sample.dynamics->base().gyros();
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

double GyroMonitor::singularity_measure(const CaptureSystem& system, const State& state) const {
  std::vector<MomentGyro> gyros;
  std::vector<double> angles;
  for (std::size_t g = 0; g < system.gyros.size(); ++g) {
    gyros.push_back(moment_gyro(problem_.robot.gyros[g], system, g));
    angles.push_back(state.q[gyros.back().gimbal_coordinate]);
  }
  return grapnel::singularity_measure(gyros, angles);
}

void GyroMonitor::look(const CaptureSystem& system, const State& state, std::span<const double> motor) {
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
  report_.least_singularity_measure = std::min(report_.least_singularity_measure, singularity_measure(system, state));
  any_ = true;
}

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
