#include "grapnel/problem/capture_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grapnel {

double JointSensors::position_quantum() const {
  return counts_per_turn > 0 ? 2 * std::numbers::pi / counts_per_turn : quantum;
}

double GyroSensor::deviation(double period) const {
  return angle_random_walk > 0 ? angle_random_walk / std::sqrt(sample_time > 0 ? sample_time : period) : noise;
}

// --- Names ---

namespace {

template <class Items>
std::size_t index_of(const Items& items, const std::string& name) {
  const auto at = std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  return static_cast<std::size_t>(at - items.begin());
}

}  // namespace

std::vector<Geometry> shapes_of(const RobotSetup& robot, const std::string& body) {
  std::vector<Geometry> shapes;
  for (const auto& [name, shape] : robot.geometry) {
    if (name == body) shapes.push_back(shape);
  }
  return shapes;
}

const char* phases_key(const CaptureProblem& problem) { return problem.impact ? "post_impact" : "motion"; }

std::string phase_name(const CaptureProblem& problem, std::size_t phase) {
  const std::string& own = problem.post_impact.at(phase).name;
  if (!own.empty()) return own;
  return problem.post_impact.size() == 1 ? phases_key(problem) : fmt::format("phase_{}", phase + 1);
}

std::size_t target_index(const CaptureProblem& problem, const std::string& target) {
  return index_of(problem.targets, target);
}

const TargetSetup& target_of(const CaptureProblem& problem, const GraspSetup& grasp) {
  return problem.targets.at(target_index(problem, grasp.target));
}

const GraspPoint& grasp_point_of(const CaptureProblem& problem, const GraspSetup& grasp) {
  const std::vector<GraspPoint>& points = target_of(problem, grasp).grasp_points;
  return points.at(index_of(points, grasp.grasp_point));
}

const EndEffectorSetup& end_effector_of(const CaptureProblem& problem, const GraspSetup& grasp) {
  const std::vector<EndEffectorSetup>& all = problem.robot.end_effectors;
  return all.at(index_of(all, grasp.end_effector));
}

std::optional<Vector3d> contact_normal(const TargetSetup& target, const GraspPoint& point) {
  if (point.normal) return point.normal;
  if (point.approach_direction) return -*point.approach_direction;
  if (target.geometry.size() != 1 || target.geometry[0].shape != Geometry::Shape::sphere) return {};
  const Vector3d out = point.X_TG.p - target.geometry[0].X_BG.p;
  const double distance = norm(out);
  if (!(distance > 0)) return {};
  return (1 / distance) * out;
}

// --- The orbit ---

CentralBody central_body(OrbitSetup::Body body) {
  switch (body) {
    case OrbitSetup::Body::moon:
      return {4.9028e12, 1.7381e6};
    case OrbitSetup::Body::mars:
      return {4.282837e13, 3.3962e6};
    case OrbitSetup::Body::earth:
      break;
  }
  return {3.986004418e14, 6.378137e6};
}

ReferenceOrbit reference_orbit(const OrbitSetup& setup) {
  const CentralBody body = central_body(setup.body);
  ReferenceOrbit orbit;
  orbit.mu = setup.mu.value_or(body.mu);
  orbit.semi_major_axis = setup.altitude ? body.radius + *setup.altitude : setup.semi_major_axis.value_or(0);
  orbit.eccentricity = setup.eccentricity, orbit.true_anomaly = setup.true_anomaly;
  orbit.radial = setup.radial, orbit.along_track = setup.along_track;
  orbit.position = setup.position, orbit.velocity = setup.velocity;
  return orbit;
}

// --- Motion stated in pieces ---

namespace {

constexpr int kPolynomialDegree = 5;
// A sine over one period has the Chebyshev coefficients J_k(pi) (Bessel functions). The next one is 1e-18; higher
// degrees would only add rounding errors to the derivatives.
constexpr int kCycloidalDegree = 21;

std::vector<double> series_of(const JointSegment& segment) {
  if (const auto* series = std::get_if<ChebyshevSegment>(&segment.shape)) return series->coefficients;
  const JointPath& path = std::get<JointPath>(segment.shape);
  const int degree = path.profile == JointProfile::cycloidal ? kCycloidalDegree : kPolynomialDegree;
  std::vector<double> values;
  for (int k = 0; k <= degree; ++k)
    values.push_back(evaluate(path, chebyshev_point(0, path.duration, k, degree)).position);
  return chebyshev_interpolant(values).coefficients;
}

// Adds a cubic to the series of a segment, so that it begins with the final position and rate of the previous one, if
// they differ by more than rounding errors and as little as problems accept; those at its end do not change.
void join(const JointSegment& before, JointSegment& segment) {
  constexpr double kRounding = 1e-13, kMost = 1e-5;
  const auto at = [](const JointSegment& s, double t) {
    JointTrajectory alone;
    alone.segments.push_back(s);
    return evaluate(alone, t, 0.5 * (s.begin + s.end));
  };
  const JointPoint last = at(before, segment.begin), first = at(segment, segment.begin);
  const double position = last.position - first.position, rate = last.rate - first.rate;
  if (std::abs(position) <= kRounding * std::max(1.0, std::abs(last.position)) &&
      std::abs(rate) <= kRounding * std::max(1.0, std::abs(last.rate)))
    return;
  if (std::abs(position) > kMost || std::abs(rate) > kMost) return;
  const double times[] = {segment.begin, segment.end}, positions[] = {position, 0}, rates[] = {rate, 0};
  const JointTrajectory cubic = interpolate_samples(times, positions, rates);
  const std::vector<double>& more = std::get<ChebyshevSegment>(cubic.segments[0].shape).coefficients;
  std::vector<double>& series = std::get<ChebyshevSegment>(segment.shape).coefficients;
  series.resize(std::max(series.size(), more.size()), 0.0);
  for (std::size_t k = 0; k < more.size(); ++k) series[k] += more[k];
}

}  // namespace

JointTrajectory trajectory_of(std::span<const MotionPiece> segments, std::size_t joint) {
  JointTrajectory trajectory;
  double begin = 0;
  for (const MotionPiece& segment : segments) {
    JointSegment next{begin, segment.until, ChebyshevSegment{segment.series[joint]}};
    if (!trajectory.segments.empty()) join(trajectory.segments.back(), next);
    trajectory.segments.push_back(std::move(next));
    begin = segment.until;
  }
  return trajectory;
}

std::vector<MotionPiece> motion_segments(std::span<const JointTrajectory> joints) {
  std::vector<MotionPiece> segments(joints.empty() ? 0 : joints[0].segments.size());
  for (const JointTrajectory& joint : joints) {
    double begin = 0;
    if (joint.segments.size() != segments.size()) throw std::invalid_argument("motion pieces: joints differ in number");
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const JointSegment& segment = joint.segments[i];
      if (segment.begin != begin || segment.end != joints[0].segments[i].end)
        throw std::invalid_argument("motion pieces: joints differ in the times of their pieces");
      begin = segments[i].until = segment.end;
      segments[i].series.push_back(series_of(segment));
    }
  }
  return segments;
}

}  // namespace grapnel
