// Ready-made robots and targets. Their data are physically possible and plausible; each robot captures and each target
// is captured in a small scenario; including them by name is equivalent to stating them in full.
#include "grapnel/scenario/ready_made.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "grapnel/campaign/study_files.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace ready_made_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Kind = ReadyMade::Kind;

std::vector<std::string> names(Kind kind) {
  std::vector<std::string> all;
  for (const ReadyMade& one : ready_made(kind)) all.emplace_back(one.name);
  return all;
}
std::vector<std::string> files_below(const std::string& folder) {
  std::vector<std::string> all;
  for (const auto& entry : std::filesystem::directory_iterator(GRAPNEL_SOURCE_DIR "/" + folder))
    all.push_back(entry.path().stem().string());
  return all;
}

// Detects files that the build does not list.
TEST(ReadyMade, AreAllFilesOfTheirFolders) {
  EXPECT_THAT(names(Kind::robots), testing::UnorderedElementsAreArray(files_below("robots")));
  EXPECT_THAT(names(Kind::targets), testing::UnorderedElementsAreArray(files_below("targets")));
  EXPECT_THAT(names(Kind::templates), testing::UnorderedElementsAreArray(files_below("templates")));
  for (const ReadyMade& one : all_ready_made()) {
    EXPECT_FALSE(one.description().empty()) << one.name;
    EXPECT_LT(one.description().size(), 400u) << one.name;
    const char* folder = one.kind == Kind::robots ? "robots/" : one.kind == Kind::targets ? "targets/" : "templates/";
    EXPECT_EQ(one.text, bytes_of(GRAPNEL_SOURCE_DIR "/" + (folder + std::string(one.name)) + ".yaml"));
    if (one.kind != Kind::templates) {
      EXPECT_THAT(std::string(one.text.substr(0, 2000)), testing::AnyOf(HasSubstr("# Origin"), HasSubstr("thesis")))
          << one.name;
    }
  }
}

TEST(ReadyMade, AreInTheDocumentation) {
  const std::string page = bytes_of(GRAPNEL_SOURCE_DIR "/docs/ready-made.md");
  for (const ReadyMade& one : all_ready_made()) {
    if (one.name == "campaign-scenario") continue;
    EXPECT_THAT(page, HasSubstr("| `" + std::string(one.name) + "` | " + one.description() + " |\n"));
  }
}

// Positive definite, triangle inequality, and consistent with the size of the body: the moments are at most those of
// its mass at the ends of its shape's diagonal. `slack`: published links have housings and motors without shapes.
void expect_possible(double mass, const Symmetric3d& I, const Geometry& geometry, double slack,
                     const std::string& what) {
  Eigen::Matrix3d matrix;
  matrix << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
  const Eigen::Vector3d p = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues();
  EXPECT_GT(mass, 0) << what;
  EXPECT_GT(p[0], 0) << what;
  EXPECT_GE(p[0] + p[1], p[2] * (1 - 1e-12)) << what;
  double half = 0;  // of the diagonal
  using Shape = Geometry::Shape;
  if (geometry.shape == Shape::box) half = norm(geometry.size) / 2;
  if (geometry.shape == Shape::cylinder) half = std::hypot(geometry.size[0], geometry.size[1] / 2);
  if (geometry.shape == Shape::capsule) half = geometry.size[0] + geometry.size[1] / 2;
  if (half > 0) {
    EXPECT_LT(std::sqrt(p[2] / mass), slack * half) << what;
  }
}

TEST(ReadyMadeRobots, ArePossible) {
  for (const std::string& name : names(Kind::robots)) {
    std::vector<Fault> warnings;
    const RobotSetup robot = load_robot(name, &warnings);
    for (const Fault& doubt : warnings) ADD_FAILURE() << doubt.text();
    ASSERT_FALSE(robot.end_effectors.empty()) << name;
    for (const BodyDescription& body : robot.bodies) {
      Geometry shape;
      for (const auto& [of, one] : robot.geometry) {
        if (of == body.name) shape = one;
      }
      expect_possible(body.mass, body.inertia, shape, 2.2, name + "/" + body.name);
    }
  }
}

TEST(ReadyMadeTargets, ArePossible) {
  for (const std::string& name : names(Kind::targets)) {
    std::vector<Fault> warnings;
    const TargetSetup target = load_ready_made_target(name, &warnings);
    for (const Fault& doubt : warnings) ADD_FAILURE() << doubt.text();
    EXPECT_FALSE(target.grasp_points.empty()) << name;
    ASSERT_EQ(target.geometry.size(), 1u) << name;
    expect_possible(target.mass, target.inertia, target.geometry[0], 1, name);
    for (const GraspPoint& point : target.grasp_points) EXPECT_TRUE(point.approach_direction) << name;
  }
}

// ---- Each in a small scenario ----

std::string list_of(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "[" : ", ") + std::to_string(value);
  return text.empty() ? "[]" : text + "]";
}

CaptureProblem problem_of(const std::string& text) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text));
}

void expect_sound(const CaptureResult& result, const std::string& what) {
  EXPECT_EQ(result.failure, "") << what;
  EXPECT_TRUE(result.captured()) << what;
  EXPECT_TRUE(result.ledger.pass()) << what;
}

// The first end-effector moves from joint positions within the limits to the position for other joint positions with
// the base at rest.
TEST(ReadyMadeRobots, PlanAndCaptureACubeSat) {
  int number = 0;
  for (const std::string& name : names(Kind::robots)) {
    if (test::kSanitized && number++ % 4 != 0) continue;
    CaptureProblem alone;
    alone.robot = load_robot(name);
    if (test::kSanitized && is_flexible(alone.robot)) continue;  // slow; tests/flexible has shorter simulations
    const CaptureSystem system = make_servicer(alone);
    std::vector<double> begin;
    State there = zero_state(system.model);
    for (const int body : system.model.joints()) {
      const Body& link = system.model.bodies()[static_cast<std::size_t>(body)];
      const JointLimits& limits = link.description.joint.limits;
      begin.push_back(std::clamp(begin.size() % 2 == 0 ? 0.3 : 0.9, limits.lower + 0.1, limits.upper - 0.5));
      there.q[link.q] = begin.back() + 0.05;
    }
    const Vector3d tip = frame_pose(system.model, forward_kinematics(system.model, there), system.end_effectors[0]).p;
    const std::string& end_effector = alone.robot.end_effectors[0].name;
    const std::string duration = is_flexible(alone.robot) ? "20" : "2 min";  // flexible bodies move slowly
    const CaptureProblem problem = problem_of(
        "name: " + name + "\nrobot: " + name + "\ninitial: {joints: " + list_of(begin) +
        "}\ntargets:\n  - {name: cube, ready_made: cubesat-27u, state: {position: " +
        list_of({tip[0], tip[1], tip[2] - 0.17}) + "}}\ngrasps: [{end_effector: " + end_effector +
        ", target: cube, point: end-plate, model: point, orientation: free}]\n"
        "approach: {duration: " +
        duration +
        ", profile: quintic, plan: {objective: as_found}}\ncontact: {largest_gap: 1 mm}\n"
        "impact: {duration: 10 ms}\npost_impact: {duration: 2 s}\nclearance: {enabled: false}\noutput: {interval: 1 "
        "s}\n");
    const CaptureResult result = simulate_capture(problem);
    expect_sound(result, name);
  }
}

TEST(ReadyMadeTargets, AreCapturedAtEveryPoint) {
  for (const std::string& name : names(Kind::targets)) {
    const TargetSetup target = load_ready_made_target(name);
    for (const GraspPoint& point : target.grasp_points) {
      const CaptureProblem problem = problem_of(
          "name: t\nrobot: seven-joint-single-arm\ninitial: {joints: [0, 90 deg, 0, 0, -90 deg, -90 deg, 0]}\n"
          "targets:\n  - {ready_made: " +
          name +
          ", state: {position: [3, 0, 2], angular_velocity: [1 deg/s, 0, 2 "
          "deg/s]}}\ngrasps: [{end_effector: tip, target: " +
          name + ", point: " + point.name +
          ", orientation: free}]\ncontact: {gap: translate_target, largest_gap: any}\nimpact: {duration: 10 ms}\n"
          "post_impact: {duration: 2 s}\nclearance: {enabled: false}\noutput: {interval: 1 s}\n");
      const CaptureResult result = simulate_capture(problem);
      expect_sound(result, name + "/" + point.name);
      EXPECT_GT(result.impact()->grasps.at(0).impulse_magnitude, 0) << name;
    }
  }
}

// ---- By name ----

const char* const kByName = R"(name: by name
robot: heavy-lift-single-arm
initial: {joints: [0.3, 0.1, -1.4, 2.75, -1.35, -0.1, 0]}
targets:
  - name: stage
    ready_made: rocket-stage
    mass: 1.5 t
    state: {position: [3, 0, 2], angular_velocity: [0, 0, 2 deg/s]}
grasps: [{end_effector: hand, target: stage, point: adapter-1}]
contact: {gap: translate_target, largest_gap: any}
impact: {}
)";

TEST(ByName, IsTheSameAsInFull) {
  const ReadyMade& stage = *find_ready_made(Kind::targets, "rocket-stage");
  std::string in_full = edited(
      kByName, {{"    ready_made: rocket-stage\n", ""},
                {"robot: heavy-lift-single-arm", "robot: " GRAPNEL_SOURCE_DIR "/robots/heavy-lift-single-arm.yaml"}});
  const std::string text(stage.text);
  std::string keys;
  for (const char* key : {"com:", "inertia:", "geometry:"}) {
    const std::size_t at = text.find("\n" + std::string(key)) + 1;
    keys += "    " + text.substr(at, text.find('\n', at) + 1 - at);
  }
  keys +=
      "    grasp_points: [{name: adapter-1, position: [0.5, 0, 3.25], approach_direction: [0, 0, -1]}, {name: "
      "adapter-2, position: [-0.5, 0, 3.25], approach_direction: [0, 0, -1]}, {name: nozzle, position: [0, 0, "
      "-3.25], approach_direction: [0, 0, 1]}]\n";
  in_full = edited(in_full, {{"    mass: 1.5 t\n", "    mass: 1500\n" + keys}});
  const CaptureProblem by_name = problem_of(kByName), full = problem_of(in_full);
  EXPECT_TRUE(problem_bytes(by_name) == problem_bytes(full));
  EXPECT_EQ(by_name.targets[0].mass, 1500);
  // The hash of the input covers included files.
  EXPECT_NE(by_name.sha256,
            problem_of(edited(kByName, {{"ready_made: rocket-stage", "ready_made: rocket-stage # "}})).sha256);
  EXPECT_NE(by_name.sha256, full.sha256);
}

TEST(ByName, OverridesReachInside) {
  const TemporaryFolder folder;
  const auto path = folder.write("scenario.yaml", kByName);
  const std::vector<Override> overrides{{"targets.stage.com", "[0, 0, -1]"},
                                        {"targets.stage.grasp_points.nozzle.position", "[0, 0, -3 m]"},
                                        {"robot.links.link-1.mass", "16"}};
  const CaptureProblem problem = load_scenario(path, overrides);
  EXPECT_EQ(problem.targets[0].com[2], -1);
  EXPECT_EQ(problem.targets[0].grasp_points[2].X_TG.p[2], -3);
  EXPECT_EQ(problem.robot.bodies[2].mass, 16);
  const std::vector<Override> other{{"targets.stage.ready_made", "cubesat-6u"}, {"grasps.hand.point", "rail-1"}};
  EXPECT_NEAR(load_scenario(path, other).targets[0].inertia.xx, 12 * (0.01 + 0.133956) / 12, 1e-6);
}

TEST(ByName, ErrorsListAvailableNames) {
  EXPECT_THAT(faults_of(edited(kByName, {{"ready_made: rocket-stage", "ready_made: rocket"}})),
              ElementsAre("scenario.yaml:6:17: error: no ready-made target 'rocket'; did you mean 'rocket-stage'?"));
  EXPECT_THAT(
      faults_of(edited(kByName, {{"heavy-lift-single-arm", "heavy-lift-singel-arm"}})),
      ElementsAre("scenario.yaml:2:8: error: no ready-made robot 'heavy-lift-singel-arm'; did you mean "
                  "'heavy-lift-single-arm'? (the name of a robot file needs its extension, such as robot.yaml)"));
  EXPECT_THAT(faults_of(edited(kByName, {{"point: adapter-1", "point: adapter-3"}})),
              ElementsAre(HasSubstr("unknown grasp point 'adapter-3'")));
}

// Scenarios written by studies and campaigns contain their changes, and read back as the same problem.
TEST(ByName, IsWrittenBack) {
  const TemporaryFolder folder;
  folder.write("scenario.yaml", kByName);
  const Campaign campaign =
      load_campaign(folder.write("campaign.yaml",
                                 "name: c\nscenario: scenario.yaml\nsimulate: impact\ncases: 3\nuncertain:\n"
                                 "  - {path: targets.stage.mass, as: factor, uniform: {from: 0.5, to: 2}}\n"
                                 "  - {path: targets.stage.inertia, as: factor, uniform: {from: 1, to: 1.1}}\n"
                                 "  - {path: robot.base.mass, as: factor, uniform: {from: 0.5, to: 2}}\n"));
  const Campaign study =
      load_study(folder.write("study.yaml",
                              "name: s\nscenario: scenario.yaml\nsimulate: impact\naxes:\n"
                              "  - {path: targets.stage.ready_made, values: [rocket-stage, envisat-class]}\n"
                              "  - {quantity: mass_ratio, values: [1, 2]}\n"));
  for (const Campaign* one : {&campaign, &study}) {
    for (std::uint64_t k = 0; k < 3; ++k) {
      const auto place = folder.path() / "case.yaml";
      CaptureProblem read = load_scenario(folder.write("case.yaml", one->scenario_text(k, place, "a comment")));
      CaptureProblem problem = one->problem(k).problem;
      read.name = problem.name;
      EXPECT_TRUE(problem_bytes(problem) == problem_bytes(read)) << k;
    }
  }
  EXPECT_THAT(study.scenario_text(0, folder.path() / "case.yaml", ""), HasSubstr("robot: heavy-lift-single-arm"));
}

}  // namespace ready_made_test
}  // namespace grapnel::test
