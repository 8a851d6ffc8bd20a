#include "capture/recorded.hpp"

#include <algorithm>
#include <stdexcept>

namespace grapnel::testing {

Twistd twist_at(const CaptureResult& result, const std::string& group, std::size_t sample) {
  return {vector_at(result, group + "/angular_velocity", sample), vector_at(result, group + "/velocity", sample)};
}

GraspError grasp_error(const CaptureProblem& problem, const CaptureResult& result, std::size_t grasp,
                       std::size_t sample) {
  const GraspSetup& g = problem.grasps.at(grasp);
  const auto named = [](const auto& items, const std::string& name) {
    return *std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  };
  const TargetSetup target = named(problem.targets, g.target);
  const GraspPoint point = named(target.grasp_points, g.grasp_point);
  const EndEffectorSetup end_effector = named(problem.robot.end_effectors, g.end_effector);
  const Posed X_WT = pose_at(result, "targets/" + g.target, sample);
  const Twistd V_WT = twist_at(result, "targets/" + g.target, sample);
  GraspError m;
  m.X_WE = pose_at(result, "end_effectors/" + g.end_effector, sample);
  m.V_WE = twist_at(result, "end_effectors/" + g.end_effector, sample);
  m.X_WG = {X_WT.R * point.X_TG.R, X_WT.p + X_WT.R * point.X_TG.p};
  m.V_WG = {V_WT.angular, V_WT.linear + cross(V_WT.angular, X_WT.R * point.X_TG.p)};
  m.direction_W = X_WT.R * point.approach_direction.value_or(Vector3d::zero());
  m.axis_W = m.X_WE.R * end_effector.approach_axis.value_or(Vector3d::zero());
  return m;
}

GraspError::Deviation GraspError::deviation(GraspSetup::Orientation orientation, const StraightIn& in) const {
  Deviation m;
  m.distance = distance();
  m.velocity = norm(relative_velocity() - in.final_speed * direction_W);
  const double along = dot(relative_spin(), direction_W), across = norm(cross(direction_W, relative_spin()));
  const bool rolls = in.roll == StraightIn::Roll::matched;
  switch (orientation) {
    case GraspSetup::Orientation::free:
      m.spin = rolls ? std::abs(along) : 0;
      break;
    case GraspSetup::Orientation::axis:
      m.angle = axis_angle();
      m.spin = rolls ? std::hypot(along, across) : across;
      break;
    case GraspSetup::Orientation::pose:
      m.angle = pose_angle();
      m.spin = std::hypot(along, across);
      break;
  }
  return m;
}

std::size_t last_sample(const CaptureResult& result, const std::string& phase) {
  for (std::size_t s = result.series.time.size(); s-- > 0;) {  // from the end: callers repeat this for every sample
    if (result.series.phases.at(static_cast<std::size_t>(result.series.phase[s])) == phase) return s;
  }
  throw std::out_of_range("no sample of phase " + phase);
}

std::size_t sample_at(const CaptureResult& result, const std::string& phase, double time) {
  for (std::size_t s = 0; s < result.series.time.size(); ++s) {
    if (result.series.phases.at(static_cast<std::size_t>(result.series.phase[s])) == phase &&
        std::abs(result.series.time[s] - time) < 1e-9)
      return s;
  }
  throw std::out_of_range("no sample of phase " + phase + " at that time");
}

std::vector<double> joints_at(const CaptureResult& result, const std::string& path, std::size_t sample) {
  const Series& s = series(result, path);
  const auto begin = s.data.begin() + static_cast<std::ptrdiff_t>(sample) * s.width();
  return {begin, begin + s.width()};
}

bool warns(const CaptureResult& result, const std::string& text) {
  return std::any_of(result.warnings.begin(), result.warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

namespace {

// Places the target so that its grasp point has the pose X_WG and the twist V_WG.
void place(TargetSetup& target, const Posed& X_WG, const Twistd& V_WG) {
  const Posed& X_TG = target.grasp_points.at(0).X_TG;
  target.given_at = TargetSetup::Instant::capture;
  target.X_WT = X_WG * inverse(X_TG);
  target.V_WT = {V_WG.angular, V_WG.linear - cross(V_WG.angular, target.X_WT.R * X_TG.p)};
}

}  // namespace

std::optional<CaptureProblem> random_plan(int index, GraspSetup::Orientation orientation,
                                          std::optional<RateMatch> match,
                                          const std::function<void(CaptureProblem&)>& change) {
  CaptureProblem p = random_capture(index);
  Random random(1000 + index);
  p.impact.reset(), p.post_impact.reset();
  p.approach->tracking = {};
  p.output_interval = 1;
  std::vector<Twistd> V_WG;
  for (std::size_t i = 0; i < p.targets.size(); ++i) {
    V_WG.push_back({random.vector(0.2), random.vector(0.1)});
    place(p.targets[i], {random.rotation(), random.vector(1)}, V_WG[i]);
    p.robot.end_effectors[i].approach_axis = random.direction();
  }
  if (change) change(p);
  if (match) p.approach->final_rates.reset();
  p.approach->match = match;
  const CaptureResult simulated = simulate_capture(p);
  if (!simulated.approach_end) return std::nullopt;
  for (std::size_t i = 0; i < p.targets.size(); ++i) {
    const Posed X_WE =
        pose_at(simulated, "end_effectors/" + p.grasps[i].end_effector, last_sample(simulated, "approach"));
    const Vector3d axis_W = X_WE.R * *p.robot.end_effectors[i].approach_axis;
    const bool pose = orientation == GraspSetup::Orientation::pose;
    p.grasps[i].orientation = orientation;
    place(p.targets[i], {pose ? X_WE.R : random.rotation(), X_WE.p}, V_WG[i]);
    p.targets[i].grasp_points[0].approach_direction = transposed_times(p.targets[i].X_WT.R, axis_W);
  }
  p.approach->plan.emplace();
  p.approach->plan->objective = PlanSetup::Objective::as_found;
  p.approach->plan->guess = p.approach->final_position;
  for (double& x : p.approach->plan->guess) x += random.uniform(-0.03, 0.03);
  p.approach->final_position.clear();
  return p;
}

}  // namespace grapnel::testing
