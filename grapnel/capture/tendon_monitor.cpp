#include "grapnel/capture/tendon_monitor.hpp"

#include <array>
#include <cmath>

#include "grapnel/approach/phase_setups.hpp"

namespace grapnel {
namespace {

// The rate of a tendon's excursion in a state [m/s].
double excursion_rate(const Tendon& tendon, const Model& model, const State& state) {
  double sum = 0;
  for (const Tendon::Arm& a : tendon.arms)
    sum += a.arm * state.v[model.joint_body(static_cast<std::size_t>(a.joint)).v];
  return sum;
}

}  // namespace

TendonMonitor::TendonMonitor(const CaptureProblem& problem) : problem_(problem) {}

std::vector<Series> TendonMonitor::series() const {
  if (problem_.robot.tendons.empty()) return {};
  std::vector<std::string> names;
  for (const TendonSetup& tendon : problem_.robot.tendons) names.push_back(tendon.name);
  return {{"tendons/tension", "N", "of the tendons; 0 without a command", names, {}},
          {"tendons/excursion", "m", "sum of moment arm times joint value", names, {}}};
}

// Sample => tension of every tendon of the robot, zero without a command, and excursion.
void TendonMonitor::put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const {
  const std::vector<TendonSetup>& all = problem_.robot.tendons;
  if (all.empty()) return;
  std::vector<double> tensions(all.size(), 0.0);
  for (std::size_t i = 0; sample.dynamics && i < sample.dynamics->tensions().size(); ++i) {
    const TendonSetup* tendon = tendon_named(problem_.robot, reports_[active_[i]].name);
    tensions[static_cast<std::size_t>(tendon - all.data())] = sample.dynamics->tensions()[i];
  }
  row.put_all(tensions);
  row.put_each(all.size(),
               [&](std::size_t i) { return Tendon{.arms = tendon_arms(all[i], system)}.excursion(sample.state.q); });
}

std::size_t TendonMonitor::report_of(const std::string& name) {
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    if (reports_[i].name == name) return i;
  }
  reports_.push_back({.name = name, .excursion_before = NAN});
  return reports_.size() - 1;
}

// Tendons of the phase => their reports, in the order of the phase's commands.
void TendonMonitor::begin_phase(const CaptureSystem&, const PhaseDynamics& dynamics) {
  active_.clear();
  for (std::size_t i = 0; i < dynamics.setup().tendons.size(); ++i)
    active_.push_back(report_of(problem_.post_impact->tendons[i].tendon));
}

// Step => work by (19.25), with three Gauss points, excursions at its ends, and the largest tension at all of these.
void TendonMonitor::step(const PhaseStep& step) {
  const double half = 0.5 * (step.end - step.begin), middle = step.begin + half;
  const double apart = std::sqrt(0.6) * half;
  struct Point {
    double time, weight;
  };
  const std::array<Point, 5> points{
      {{step.begin, 0}, {middle - apart, 5.0 / 9}, {middle, 8.0 / 9}, {middle + apart, 5.0 / 9}, {step.end, 0}}};
  for (const Point& point : points) {
    const PhaseSample sample = step.at(point.time);
    const PhaseDynamics& dynamics = *sample.dynamics;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      const Tendon& tendon = dynamics.setup().tendons[i];
      TendonReport& report = reports_[active_[i]];
      const double tension = dynamics.tensions()[i];
      report.largest_tension = std::max(report.largest_tension, tension);
      report.work += half * point.weight * tension * excursion_rate(tendon, dynamics.model(), sample.state);
      report.excursion_after = tendon.excursion(sample.state.q);
      if (std::isnan(report.excursion_before)) report.excursion_before = report.excursion_after;
    }
  }
}

// Tendons that have acted for at least a step.
void TendonMonitor::write(CaptureResult& result) const {
  for (const TendonReport& report : reports_) {
    if (!std::isnan(report.excursion_before)) result.tendons.push_back(report);
  }
}

}  // namespace grapnel
