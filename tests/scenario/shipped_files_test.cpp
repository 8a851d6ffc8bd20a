// Every robot and scenario of the repository loads; those of the thesis have its values.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace shipped_files_test {

using testing::ElementsAre;
using testing::SizeIs;

std::vector<double> list(const Vector3d& v) { return {v[0], v[1], v[2]}; }

Model model_of(const RobotSetup& robot) {
  ModelBuilder builder;
  for (const BodyDescription& body : robot.bodies) builder.add(body);
  for (const FrameDescription& frame : robot.end_effectors) builder.add(frame);
  return builder.build();
}

// Position of an end-effector in the base frame at given joint angles, by multiplying poses up the tree.
Vector3d tip_position(const RobotSetup& robot, const std::string& end_effector, const std::vector<double>& angles) {
  const Model model = model_of(robot);
  std::vector<Posed> X_BL(model.bodies().size(), Posed::identity());
  std::size_t joint = 0;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    if (body.parent < 0) continue;
    Posed motion = Posed::identity();
    if (velocity_count(body.description.joint.type) == 1) {
      motion.R = rotation_about(body.description.joint.axis, angles.at(joint++));
    }
    X_BL[i] = X_BL[static_cast<std::size_t>(body.parent)] * body.description.X_PF * motion;
  }
  const Frame& frame = model.frames()[static_cast<std::size_t>(model.frame_index(end_effector))];
  return (X_BL[static_cast<std::size_t>(frame.body)] * frame.X_BE).p;
}

TEST(ShippedFiles, AllRobotsLoad) {
  ASSERT_THAT(shipped_robots(), testing::Not(testing::IsEmpty()));
  for (const auto& path : shipped_robots()) {
    SCOPED_TRACE(path);
    EXPECT_NO_THROW(model_of(load_robot(path)));
  }
}

TEST(ShippedFiles, AllScenariosLoad) {
  ASSERT_THAT(shipped_scenarios(), testing::Not(testing::IsEmpty()));
  for (const auto& path : shipped_scenarios()) {
    SCOPED_TRACE(path);
    EXPECT_THAT(faults_of_file(path), testing::IsEmpty());
  }
}

// The first YAML block of a page.
std::string example_in(const std::string& page) {
  const std::string text = bytes_of(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "docs/formats" / page),
                    fence = "```yaml\n";
  const std::size_t start = text.find(fence) + fence.size();
  return text.substr(start, text.find("```", start) - start);
}

TEST(ShippedFiles, DocumentedExamplesLoad) {
  EXPECT_THAT(robot_faults_of(example_in("robot.md")), testing::IsEmpty());
  const TemporaryFolder folder;
  for (const char* name : {"robots", "scenarios"}) std::filesystem::create_directory(folder.path() / name);
  for (const auto& path : shipped_robots()) std::filesystem::copy(path, folder.path() / "robots");
  EXPECT_THAT(faults_of_file(folder.write("scenarios/example.yaml", example_in("scenario.md"))), testing::IsEmpty());
}

TEST(ShippedFiles, ThesisRobot) {
  const RobotSetup robot = load_robot(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "robots/planar-dual-arm.yaml");
  EXPECT_EQ(robot.name, "planar dual-arm");
  EXPECT_EQ(robot.base, "base");
  EXPECT_EQ(robot.base_mode, RobotSetup::Base::free);
  ASSERT_THAT(robot.bodies, SizeIs(7));
  EXPECT_DOUBLE_EQ(model_of(robot).mass(), 560);  // Table 4.1
  EXPECT_EQ(robot.bodies[0].inertia.zz, 83.61);
  EXPECT_EQ(robot.bodies[0].joint.type, JointType::free);
  EXPECT_THAT(list(robot.bodies[1].X_PF.p), ElementsAre(0.5, 0, 0));
  EXPECT_THAT(list(robot.bodies[4].X_PF.p), ElementsAre(-0.5, 0, 0));
  for (std::size_t i = 1; i < 7; ++i) {
    EXPECT_EQ(robot.bodies[i].mass, 10);
    EXPECT_EQ(robot.bodies[i].inertia.zz, 1.05);
    EXPECT_THAT(list(robot.bodies[i].com), ElementsAre(0.5, 0, 0));
    EXPECT_THAT(list(robot.bodies[i].joint.axis), ElementsAre(0, 0, 1));
  }
  // Table 4.4's initial end-effector positions at Table 4.3's initial angles, which the mounts must reproduce.
  const std::vector<double> angles{0.698, -1.571, 1.047, 2.444, 1.571, -1.047};
  const Vector3d tip_1 = tip_position(robot, "tip-1", angles), tip_2 = tip_position(robot, "tip-2", angles);
  EXPECT_NEAR(tip_1[0], 2.894, 5e-4);
  EXPECT_NEAR(tip_1[1], 0.050, 5e-4);
  EXPECT_NEAR(tip_2[0], -2.894, 5e-4);
  EXPECT_NEAR(tip_2[1], 0.049, 5e-4);
}

TEST(ShippedFiles, ThesisOpenLoopCases) {
  const double spin[4][2] = {{0.2, 0.2}, {0, 0}, {0.2, -0.2}, {0, 0.2}};
  for (int n = 1; n <= 4; ++n) {
    SCOPED_TRACE(n);
    const CaptureProblem p = load_scenario(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios/thesis" /
                                           ("open-loop-case-" + std::to_string(n) + ".yaml"));
    EXPECT_THAT(p.joint_position, ElementsAre(0.698, -1.571, 1.047, 2.444, 1.571, -1.047));
    ASSERT_TRUE(p.approach && p.impact && p.post_impact);
    EXPECT_THAT(p.approach->final_position, ElementsAre(-0.524, -1.393, -0.035, 2.618, -1.393, -0.035));
    EXPECT_EQ(p.approach->duration, 20);
    EXPECT_EQ(p.approach->profile, JointProfile::quartic);
    EXPECT_EQ(p.approach->match, RateMatch::velocity);
    EXPECT_FALSE(p.approach->final_rates);
    EXPECT_EQ(p.approach->tracking.mode, JointControl::pd);
    EXPECT_EQ(p.approach->tracking.kp, std::vector<double>(6, 49));
    EXPECT_EQ(p.approach->tracking.kd, std::vector<double>(6, 14));
    EXPECT_EQ(p.contact.gap, ContactSetup::Gap::translate_target);
    EXPECT_EQ(p.impact->duration, 1e-3);
    EXPECT_EQ(p.post_impact->duration, 50);
    EXPECT_EQ(p.post_impact->joints, PostImpactSetup::Joints::free);
    ASSERT_THAT(p.targets, SizeIs(2));
    ASSERT_THAT(p.grasps, SizeIs(2));
    for (std::size_t k = 0; k < 2; ++k) {
      const double side = k == 0 ? 1 : -1;
      const TargetSetup& t = p.targets[k];
      EXPECT_EQ(t.mass, 10);
      EXPECT_EQ(t.given_at, TargetSetup::Instant::capture);
      EXPECT_THAT(list(t.X_WT.p), ElementsAre(2 * side, -2 * side, 0));
      EXPECT_THAT(list(t.V_WT.angular), ElementsAre(0, 0, spin[n - 1][k]));
      // The published contact points: (2, -1.5) and (-2, 1.5).
      EXPECT_THAT(list(t.X_WT * t.grasp_points.at(0).X_TG.p), ElementsAre(2 * side, -1.5 * side, 0));
      EXPECT_EQ(p.grasps[k].model, GraspModel::rigid);
      EXPECT_EQ(p.grasps[k].target, t.name);
    }
  }
}

TEST(ShippedFiles, SevenJointRobot) {
  const RobotSetup robot = load_robot(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "robots/seven-joint-dual-arm.yaml");
  const Model model = model_of(robot);
  EXPECT_THAT(model.joints(), SizeIs(14));
  EXPECT_NEAR(model.mass(), 1000 + 2 * 178.17, 1e-9);
  for (const Body& body : model.bodies())
    EXPECT_EQ(inertia_fault(body.description.inertia), "") << body.description.name;

  // Modified Denavit-Hartenberg rows (alpha, a, d) of the source, multiplied independently of the file.
  const double rows[7][3] = {{0, 0, 0.35},     {M_PI_2, 0, 0.2},  {M_PI_2, 0, 0.275}, {0, 0.87, -0.275},
                             {0, 0.63, -0.36}, {M_PI_2, 0, 0.16}, {M_PI_2, 0.55, 0.2}};
  const std::vector<double> arm{0.3, 1.2, -0.4, 0.5, -1.1, -0.7, 0.9};
  std::vector<double> angles = arm;
  angles.insert(angles.end(), arm.begin(), arm.end());
  Posed X = Posed::identity();
  for (std::size_t i = 0; i < 7; ++i) {
    const auto [alpha, a, d] = rows[i];
    const Posed along_x{rotation_about({1, 0, 0}, alpha), {a, 0, 0}},
        along_z{rotation_about({0, 0, 1}, arm[i]), {0, 0, d}};
    X = X * along_x * along_z;
  }
  const Vector3d p = X * Vector3d{0.532, 0, 0};
  const Vector3d tip_1 = tip_position(robot, "tip-1", angles), tip_2 = tip_position(robot, "tip-2", angles);
  EXPECT_NEAR(norm(tip_1 - Vector3d{0.6 + p[0], p[1], 1 + p[2]}), 0, 1e-12);    // measured 2e-16
  EXPECT_NEAR(norm(tip_2 - Vector3d{-0.6 - p[0], -p[1], 1 + p[2]}), 0, 1e-12);  // turned by pi about z
}

}  // namespace shipped_files_test
}  // namespace grapnel::test
