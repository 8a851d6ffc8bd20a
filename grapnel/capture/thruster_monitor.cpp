#include "grapnel/capture/thruster_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel {
namespace {

// Check points of a shape: corners of a box, midpoints of its edges and faces, centres of a cylinder's or capsule's
// ends, and the centre; in the body's frame.
std::vector<Vector3d> points_of(const Geometry& shape) {
  std::vector<Vector3d> points{shape.X_BG.p};
  if (shape.shape == Geometry::Shape::box) {
    for (int place = 0; place < 27; ++place) {
      const Vector3d at{place % 3 - 1.0, place / 3 % 3 - 1.0, place / 9 - 1.0};
      Vector3d half;
      for (int k = 0; k < 3; ++k) half[k] = 0.5 * at[k] * shape.size[k];
      points.push_back(shape.X_BG * half);
    }
  }
  if (shape.shape == Geometry::Shape::cylinder || shape.shape == Geometry::Shape::capsule) {
    for (const double end : {0.5, -0.5}) points.push_back(shape.X_BG * Vector3d{0, 0, end * shape.size[1]});
  }
  return points;
}

}  // namespace

// System, dynamics => points that plumes may hit, on all visible bodies outside the base: check points of their shapes,
// or the centre of mass of a body without shape. None without thrusters or plumes.
void ThrusterMonitor::begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) {
  system_ = &system;
  watched_.clear();
  const BaseActuators& actuators = dynamics.setup().actuators;
  fires_ = actuators.thrusters != nullptr;
  if (!fires_) return;
  bank_ = actuators.thrusters;
  dumps_ = dumps_ || actuators.dumping.has_value();
  const std::vector<ThrusterSetup>& thrusters = problem_.robot.thrusters;
  if (std::none_of(thrusters.begin(), thrusters.end(), [](const ThrusterSetup& t) { return t.plume.has_value(); }))
    return;
  kinematics_ = Kinematics(system.model);
  const std::vector<PlacedShape> shapes = shapes_in_model(problem_, system);
  for (int body = 0; body < static_cast<int>(system.model.bodies().size()); ++body) {
    const BodyDescription& description = system.model.bodies()[body].description;
    if (body == system.base || is_inside_base(system, body) || is_unseen(description)) continue;
    const std::string name = shown_name(system, body);
    bool any = false;
    for (const PlacedShape& shape : shapes) {
      if (shape.body != body) continue;
      any = true;
      for (const Vector3d& p : points_of(shape.geometry)) watched_.push_back({body, p, name});
    }
    if (!any) watched_.push_back({body, description.com, name});
  }
}

// Whether a plume hits a point in the base's frame.
bool ThrusterMonitor::plume_hits(std::size_t i, const Vector3d& p_base) const {
  const ThrusterSetup& thruster = problem_.robot.thrusters[i];
  const Vector3d away = p_base - thruster.position;
  const double distance = norm(away), along = -dot(away, thrust_direction(thruster));
  return distance <= thruster.plume->range && along >= distance * std::cos(thruster.plume->half_angle);
}

// Step => duration of plume hits per thruster and body, from positions at mid-step; each body counts once per thruster.
void ThrusterMonitor::step(const PhaseStep& step) {
  const PhaseSample sample = step.at(0.5 * (step.begin + step.end));
  const std::span<const double> thrusts = sample.dynamics->base().thrusts();
  if (std::none_of(thrusts.begin(), thrusts.end(), [](double f) { return f > 0; })) return;
  forward_kinematics(system_->model, sample.state, kinematics_);
  const Posed X_BW = inverse(kinematics_.X_WB[system_->base]);
  for (std::size_t i = 0; i < thrusts.size(); ++i) {
    if (!(thrusts[i] > 0) || !problem_.robot.thrusters[i].plume) continue;
    int last = -1;  // last body counted
    for (const Point& point : watched_) {
      if (point.body == last || !plume_hits(i, X_BW * (kinematics_.X_WB[point.body] * point.p_B))) continue;
      last = point.body;
      const std::string& thruster = problem_.robot.thrusters[i].name;
      const auto is_it = [&](const PlumeHazard& h) { return h.thruster == thruster && h.body == point.name; };
      auto at = std::find_if(hazards_.begin(), hazards_.end(), is_it);
      if (at == hazards_.end()) at = hazards_.insert(at, {thruster, point.name, step.begin, 0});
      at->duration += step.end - step.begin;
    }
  }
}

std::vector<Series> ThrusterMonitor::series() const {
  if (problem_.robot.thrusters.empty()) return {};
  std::vector<std::string> names;
  for (const ThrusterSetup& thruster : problem_.robot.thrusters) names.push_back(thruster.name);
  return {{"thrusters/force", "N", "forces of the thrusters at this instant, within or between pulses", names, {}},
          {"thrusters/impulse", "N s", "impulse of each thruster since the start", names, {}},
          {"thrusters/propellant", "kg", "propellant used since the start", {"propellant"}, {}}};
}

// The impulse up to a sample of the current segment, or so far [N s]; zero before the first phase with thrusters.
double ThrusterMonitor::impulse(std::size_t thruster, const PhaseSample& s) const {
  return bank_ ? bank_->use(thruster, std::max(s.dynamics ? s.time : 0, bank_->time())).impulse : 0.0;
}

// Thruster forces, zero in phases without active thrusters; impulses and propellant.
void ThrusterMonitor::put(const CaptureSystem&, const PhaseSample& s, SeriesRow& row) const {
  const std::size_t count = problem_.robot.thrusters.size();
  if (count == 0) return;
  const auto thrusts = s.dynamics ? s.dynamics->base().thrusts() : std::span<const double>();
  double propellant = 0;
  for (std::size_t i = 0; i < count; ++i)
    propellant += impulse(i, s) / (problem_.robot.thrusters[i].specific_impulse * kStandardGravity);
  row.put_each(count, [&](std::size_t i) { return thrusts.empty() ? 0.0 : thrusts[i]; });
  row.put_each(count, [&](std::size_t i) { return impulse(i, s); });
  row.put(propellant);
}

// Thruster bank => firings, on-time [s], impulse [N s], duty and propellant [kg] = impulse / (I_sp g_0) per thruster;
// hazards and momentum dumping.
void ThrusterMonitor::write(CaptureResult& result) const {
  if (problem_.robot.thrusters.empty()) return;
  ThrustersReport& report = result.thrusters.emplace();
  for (std::size_t i = 0; i < problem_.robot.thrusters.size(); ++i) {
    const ThrusterSetup& thruster = problem_.robot.thrusters[i];
    ThrusterReport& each = report.each.emplace_back();
    each.name = thruster.name;
    if (!bank_) continue;
    const ThrusterBank::Use use = bank_->use(i);
    each.firings = use.firings, each.on_time = use.on_time, each.impulse = use.impulse;
    each.duty = at_work_ > 0 ? std::min(1.0, use.on_time / at_work_) : 0;
    each.propellant = use.impulse / (thruster.specific_impulse * kStandardGravity);
    report.propellant += each.propellant;
  }
  report.available = problem_.robot.propellant.value_or(std::numeric_limits<double>::quiet_NaN());
  report.hazards = hazards_;
  if (!dumps_) return;
  const ThrusterBank::Dumped& d = bank_->dumped();
  report.dumping = {d.begun, d.first_begin, d.time + (d.active ? bank_->time() - d.since : 0), d.active,
                    d.largest_momentum};
}

}  // namespace grapnel
