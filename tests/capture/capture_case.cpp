#include "capture/capture_case.hpp"

#include <algorithm>
#include <limits>

#include "impact/thesis_robot.hpp"

namespace grapnel::testing {

CaptureProblem thesis_case() {
  CaptureProblem p;
  p.name = "case 1";
  p.robot.name = "planar dual-arm";
  p.robot.base = "base";
  p.robot.bodies = thesis_robot();
  for (const FrameDescription& tip : thesis_tips()) p.robot.end_effectors.push_back({tip});
  p.joint_position = {0.698, -1.571, 1.047, 2.444, 1.571, -1.047};
  for (int i = 1; i <= 2; ++i) {
    const double side = i == 1 ? 1 : -1;
    TargetSetup t;
    t.name = "target-" + std::to_string(i);
    t.mass = 10;
    t.inertia = Symmetric3d::diagonal(1, 1, 1);
    t.X_WT.p = {2 * side, -2 * side, 0};
    t.V_WT = {{0, 0, 0.2}, {0, 0, 0}};
    t.grasp_points = {{"grasp", {Rotationd::identity(), {0, 0.5 * side, 0}}}};
    p.targets.push_back(t);
    p.grasps.push_back({"tip-" + std::to_string(i), t.name, "grasp", GraspModel::rigid, {0, 0, 1}});
  }
  p.approach.emplace();
  p.approach->duration = 20;
  p.approach->final_position = {-0.524, -1.393, -0.035, 2.618, -1.393, -0.035};
  p.approach->match = RateMatch::velocity;
  p.contact.largest_gap = std::numeric_limits<double>::infinity();  // tests choose the gaps
  p.impact.emplace();
  p.output_interval = 1;
  return p;
}

void use_pd(CaptureProblem& problem, double kp, double kd) {
  problem.approach->tracking.mode = JointControl::pd;
  problem.approach->tracking.kp.assign(problem.joint_position.size(), kp);
  problem.approach->tracking.kd.assign(problem.joint_position.size(), kd);
}

void watch_closely(CaptureProblem& p) {
  for (BodyDescription& body : p.robot.bodies) {
    JointLimits& limits = body.joint.limits;
    limits.lower = -1, limits.upper = 1, limits.rate = 0.02, limits.effort = 0.2;
  }
  p.clearance.enabled = true;
  p.clearance.required = 5;
  Geometry ball;
  ball.shape = Geometry::Shape::sphere, ball.size = {0.2, 0, 0};
  for (TargetSetup& target : p.targets) target.geometry = {ball};
  p.robot.geometry = {{p.robot.bodies[0].name, ball}};
}

CaptureProblem thesis_case_pd() {
  CaptureProblem p = thesis_case();
  use_pd(p, 49, 14);
  return p;
}

namespace {

TargetSetup random_target(const std::string& name, const Vector3d& near, Random& random) {
  TargetSetup t;
  t.name = name;
  t.mass = random.log_uniform(2, 100);
  t.com = random.vector(0.3);
  t.inertia = random_inertia(t.mass, 0.8, random);
  t.given_at = random.chance(0.5) ? TargetSetup::Instant::start : TargetSetup::Instant::capture;
  t.X_WT = {random.rotation(), near + random.vector(2)};
  t.V_WT = {random.vector(0.5), random.vector(0.2)};
  t.grasp_points = {{"handle", {random.rotation(), random.vector(0.5)}}};
  return t;
}

void settings(CaptureProblem& p, int index, Random& random) {
  const std::size_t joints = p.joint_position.size();
  p.approach.emplace();
  p.approach->duration = 3;
  p.approach->profile = index % 2 == 0 ? JointProfile::quintic : JointProfile::cycloidal;
  p.approach->final_rates.emplace();
  for (std::size_t j = 0; j < joints; ++j) {
    p.approach->final_position.push_back(p.joint_position[j] + random.uniform(-0.8, 0.8));
    p.approach->final_rates->push_back(random.uniform(-0.2, 0.2));
    p.joint_rate.push_back(random.uniform(-0.1, 0.1));
  }
  if (index % 3 != 0) use_pd(p, 30, 10);
  if (index % 2 == 0) {
    p.V_WB = Twistd{random.vector(0.2), random.vector(0.3)};
  } else {
    p.momentum = Momentumd{random.vector(5), random.vector(10)};
  }
  p.contact.gap = index % 4 == 3 ? ContactSetup::Gap::translate_target : ContactSetup::Gap::weld_as_found;
  p.contact.largest_gap = std::numeric_limits<double>::infinity();  // targets are anywhere
  p.impact.emplace();
  p.post_impact.emplace();
  p.post_impact->duration = 4;
  p.post_impact->joints = index % 5 == 0   ? PostImpactSetup::Joints::braked
                          : index % 5 == 1 ? PostImpactSetup::Joints::pd
                                           : PostImpactSetup::Joints::free;
  p.post_impact->kp.assign(joints, 20);
  p.post_impact->kd.assign(joints, 8);
}

}  // namespace

CaptureProblem random_capture(int index) {
  Random random(index);
  RobotOptions options;
  options.min_bodies = 6;
  options.max_bodies = 12;
  const Model model = random_model(options, random);
  CaptureProblem p;
  p.name = "random " + std::to_string(index);
  p.robot.name = "random";
  p.robot.base = "b0";
  std::vector<std::string> links;
  for (const Body& b : model.bodies()) {
    p.robot.bodies.push_back(b.description);
    if (b.description.name != "b0") links.push_back(b.description.name);
  }
  for (std::size_t j = 0; j < model.joints().size(); ++j) p.joint_position.push_back(random.uniform(-1, 1));
  p.X_WB = {random.rotation(), random.vector(5)};
  const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
  for (int i = 0; i < 2; ++i) {
    const std::string n = std::to_string(i);
    // Two different links: the last of the list and a random other one.
    const int link =
        i == 0 ? static_cast<int>(links.size()) - 1 : random.integer(0, static_cast<int>(links.size()) - 2);
    p.robot.end_effectors.push_back({{"hand" + n, links[link], {random.rotation(), random.vector(0.4)}}});
    p.targets.push_back(random_target("target" + n, p.X_WB.p, random));
    p.grasps.push_back({"hand" + n, "target" + n, "handle", models[(index + i) % 3], random.direction()});
  }
  settings(p, index, random);
  p.output_interval = 0.25;
  return p;
}

const Series& series(const CaptureResult& result, const std::string& path) {
  for (const Series& s : result.series.series) {
    if (s.path == path) return s;
  }
  throw std::out_of_range("no series " + path);
}
double value_at(const CaptureResult& result, const std::string& path, std::size_t sample, int component) {
  const Series& s = series(result, path);
  return s.data.at(sample * static_cast<std::size_t>(s.width()) + static_cast<std::size_t>(component));
}
Vector3d vector_at(const CaptureResult& result, const std::string& path, std::size_t sample) {
  return {value_at(result, path, sample, 0), value_at(result, path, sample, 1), value_at(result, path, sample, 2)};
}
Posed pose_at(const CaptureResult& result, const std::string& group, std::size_t sample) {
  const std::string q = group + "/quaternion_wxyz";
  return {rotation_matrix(Quaterniond{value_at(result, q, sample, 0), value_at(result, q, sample, 1),
                                      value_at(result, q, sample, 2), value_at(result, q, sample, 3)}),
          vector_at(result, group + "/position", sample)};
}
std::size_t first_sample(const CaptureResult& result, const std::string& phase) {
  const auto name = std::find(result.series.phases.begin(), result.series.phases.end(), phase);
  const int number = static_cast<int>(name - result.series.phases.begin());
  const auto at = std::find(result.series.phase.begin(), result.series.phase.end(), number);
  return static_cast<std::size_t>(at - result.series.phase.begin());
}

const LedgerEntry& row(const CaptureResult& result, const std::string& name) {
  for (const LedgerEntry& e : result.ledger.entries) {
    if (e.name == name) return e;
  }
  throw std::out_of_range("no ledger row " + name);
}

void expect_passes(const CaptureResult& result) {
  EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
  std::string nearest;
  double share = 0;
  for (const LedgerEntry& e : result.ledger.entries) {
    if (e.kind == LedgerEntry::Kind::feasibility) continue;  // feasibility is checked separately
    EXPECT_TRUE(e.pass()) << e.name << " " << e.value << " > " << e.bound;
    if (e.applies && !(e.value / e.bound <= share)) share = e.value / e.bound, nearest = e.name;
  }
  EXPECT_GE(result.ledger.entries.size(), 6u);
  std::printf("[ measured ] ledger: %.2g of the bound, %s\n", share, nearest.c_str());
}

}  // namespace grapnel::testing
