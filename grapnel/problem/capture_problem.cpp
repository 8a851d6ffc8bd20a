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

std::vector<double> series_of(const JointPiece& piece) {
  if (const auto* series = std::get_if<ChebyshevPiece>(&piece.shape)) return series->coefficients;
  const JointPath& path = std::get<JointPath>(piece.shape);
  const int degree = path.profile == JointProfile::cycloidal ? kCycloidalDegree : kPolynomialDegree;
  std::vector<double> values;
  for (int k = 0; k <= degree; ++k)
    values.push_back(evaluate(path, chebyshev_point(0, path.duration, k, degree)).position);
  return chebyshev_interpolant(values).coefficients;
}

}  // namespace

JointTrajectory trajectory_of(std::span<const MotionPiece> pieces, std::size_t joint) {
  JointTrajectory trajectory;
  double begin = 0;
  for (const MotionPiece& piece : pieces) {
    trajectory.pieces.push_back({begin, piece.until, ChebyshevPiece{piece.series[joint]}});
    begin = piece.until;
  }
  return trajectory;
}

std::vector<MotionPiece> motion_segments(std::span<const JointTrajectory> joints) {
  std::vector<MotionPiece> pieces(joints.empty() ? 0 : joints[0].pieces.size());
  for (const JointTrajectory& joint : joints) {
    double begin = 0;
    if (joint.pieces.size() != pieces.size()) throw std::invalid_argument("motion pieces: joints differ in number");
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const JointPiece& piece = joint.pieces[i];
      if (piece.begin != begin || piece.end != joints[0].pieces[i].end)
        throw std::invalid_argument("motion pieces: joints differ in the times of their pieces");
      begin = pieces[i].until = piece.end;
      pieces[i].series.push_back(series_of(piece));
    }
  }
  return pieces;
}

}  // namespace grapnel
