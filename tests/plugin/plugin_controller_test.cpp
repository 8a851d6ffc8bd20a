/// Plugins by themselves: what they see, what they may ask, and how they fail.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/lanes/lane_phase_setup.hpp"
#include "grapnel/plugin/plugin_controller.hpp"
#include "grapnel/simulate/controller.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {
namespace plugin_controller_test {

// A base with two joints, and the frame "tip" on the last body.
Model two_joints() {
  BodyDescription base, upper, lower;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 20, base.com = {0.1, 0, -0.05}, base.inertia = Symmetric3d::diagonal(3, 4, 5);
  upper.name = "upper", upper.joint.name = "shoulder", upper.parent = "base";
  upper.joint.type = JointType::revolute, upper.joint.axis = {0, 1, 0}, upper.joint.limits.effort = 30;
  upper.X_PF.p = {0.5, 0.1, 0}, upper.mass = 3, upper.com = {0.4, 0, 0};
  upper.inertia = Symmetric3d::diagonal(0.1, 0.3, 0.3);
  lower = upper;
  lower.name = "lower", lower.joint.name = "elbow", lower.parent = "upper", lower.joint.axis = {0, 0, 1};
  return ModelBuilder()
      .add(base)
      .add(upper)
      .add(lower)
      .add(FrameDescription{"tip", "lower", {Rotationd::identity(), {0.8, 0, 0}}})
      .build();
}

// In the other order than the model's.
ControlledRobot robot_of() {
  ControlledRobot robot;
  robot.base = "base", robot.joints = {"elbow", "shoulder"}, robot.end_effectors = {"tip"};
  robot.origin = {1, 2, 3}, robot.velocity = {0.5, 0, -0.25};
  return robot;
}

State moving(const Model& model) {
  State state = zero_state(model);
  Random random(3);
  set_root_pose(model, 0, {random.rotation(), {0.3, -0.2, 0.1}}, state);
  for (double& v : state.v) v = random.uniform(-0.3, 0.3);
  state.q[7] = 0.4, state.q[8] = -0.7;
  return state;
}

std::unique_ptr<PluginController> make(const std::string& parameters, const Model& model) {
  return std::make_unique<PluginController>(open_plugin(GRAPNEL_TEST_PLUGIN, "it.so"), ControlTiming{0.01, 0.02},
                                            parameters, robot_of(), model);
}

struct Asked {
  std::vector<JointPoint> reference, sensed;
  std::vector<double> effort;
};
ControlCommand ask(PluginController& controller, const Model& model, const State& state, Asked& a, double t = 2) {
  a.reference = {{1, 2, 3}, {4, 5, 6}}, a.sensed = {{0.4, 0.1, 0}, {-0.7, 0.2, 0}};
  a.effort.assign(2, 0);
  ControlCommand command{a.effort};
  controller.update({t, model, state, a.reference, a.sensed, {}}, command);
  return command;
}

std::string error_of(const std::function<void()>& act) {
  try {
    act();
    return {};
  } catch (const ControllerError& error) {
    return error.what();
  }
}

TEST(PluginController, AnswersModelQueries) {
  const Model model = two_joints();
  const State state = moving(model);
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "grapnel_plugin_asks.txt";
  const auto controller = make("{\"does\":\"asks\",\"file\":\"" + file.string() + "\"}", model);
  controller->begin_piece(model, 0);
  Asked a;
  ask(*controller, model, state, a);
  std::ifstream in(file);
  std::string description;
  std::getline(in, description);
  EXPECT_NE(description.find(R"("base":{"name":"base","is_free":true})"), std::string::npos) << description;
  EXPECT_LT(description.find("\"name\":\"elbow\",\"type\":\"revolute\""), description.find("\"name\":\"shoulder\""));
  EXPECT_NE(description.find(R"("effort":30.0)"), std::string::npos) << description;
  EXPECT_NE(description.find(R"("end_effectors":["tip"])"), std::string::npos) << description;
  int n = 0, found = -1, unknown = -1;
  in >> n >> found >> unknown;
  ASSERT_EQ(n, 8);
  EXPECT_EQ(found, 0);
  EXPECT_EQ(unknown, 1);
  const auto next = [&] {
    double x = NAN;
    in >> x;
    return x;
  };
  const std::vector<int> order = {0, 1, 2, 3, 4, 5, 7, 6};  // elbow before shoulder
  const Eigen::MatrixXd M = mass_matrix(model, state);
  double off = 0;
  for (const int r : order) {
    for (const int c : order) off = std::max(off, std::abs(next() - M(r, c)));
  }
  Workspace workspace(model);
  std::vector<double> c(8);
  bias(model, state, Vector3d::zero(), workspace, c);
  for (const int r : order) off = std::max(off, std::abs(next() - c[r]));
  const Kinematics k = forward_kinematics(model, state);
  const Momentumd h = momentum_about(model, k, center_of_mass(model, k));
  const Vector3d linear = h.linear + 26.0 * robot_of().velocity;
  for (int i = 0; i < 3; ++i) off = std::max(off, std::abs(next() - h.angular[i]));
  for (int i = 0; i < 3; ++i) off = std::max(off, std::abs(next() - linear[i]));
  const Eigen::MatrixXd J = generalized_jacobian(model, state, 0, model.frame_index("tip"));
  for (int r = 0; r < 6; ++r) {
    for (const int j : {1, 0}) off = std::max(off, std::abs(next() - J(r, j)));
  }
  const Posed X = root_pose(model, state, 0);
  const Twistd V = root_twist(model, state, 0);
  const Vector3d p = X.p + Vector3d{1, 2, 3} + 2.0 * robot_of().velocity, v = V.linear + robot_of().velocity;
  for (int i = 0; i < 3; ++i) off = std::max(off, std::abs(next() - p[i]));
  Quaterniond q;
  q.w = next(), q.x = next(), q.y = next(), q.z = next();
  const Quaterniond r = quaternion_from(X.R);
  off = std::max(off, std::abs(std::abs(q.w * r.w + q.x * r.x + q.y * r.y + q.z * r.z) - 1));
  for (int i = 0; i < 3; ++i) off = std::max(off, std::abs(next() - v[i]));
  for (int i = 0; i < 3; ++i) off = std::max(off, std::abs(next() - state.v[i]));
  std::printf("[ measured ] input of a plugin: %.3g\n", off);
  EXPECT_LT(off, 1e-13);
  EXPECT_GT(norm(h.angular), 0.1);
  std::filesystem::remove(file);
}

TEST(PluginController, SampledInLanes) {
  const Model model = two_joints();
  PhaseSetup setup;
  EXPECT_EQ(lanes::lane_obstacle(model, setup, {}), "");
  setup.controller = make("{}", model);
  EXPECT_EQ(lanes::lane_obstacle(model, setup, {}), "a custom controller without a clock");
  setup.clock = std::make_shared<ControlClock>(ControlTiming{0.1}, model.joints().size());
  EXPECT_EQ(lanes::lane_obstacle(model, setup, {}), "");
}

TEST(PluginController, SavesAndRestoresState) {
  const Model model = two_joints();
  const auto one = make("{}", model), two = make("{}", model);
  Asked a;
  one->begin_piece(model, 0);
  two->begin_piece(model, 0);
  ask(*one, model, moving(model), a);
  ask(*one, model, moving(model), a);
  const std::vector<unsigned char> bytes = one->save();
  double sum = 0;
  ASSERT_EQ(bytes.size(), sizeof(sum));
  std::memcpy(&sum, bytes.data(), sizeof(sum));
  EXPECT_NEAR(sum, 2 * (0.4 - 0.7), 1e-15);
  EXPECT_NE(two->save(), bytes);  // a separate instance
  two->restore(bytes);
  EXPECT_EQ(two->save(), bytes);
  EXPECT_NE(error_of([&] { two->restore({1, 2}); }).find("restore() of the plugin 'it.so' failed"), std::string::npos);
  one->begin_piece(model, 1);  // continues
  EXPECT_EQ(one->save(), bytes);
}

TEST(PluginController, ReportsLibraryErrors) {
  EXPECT_NE(plugin_fault("/no/such/file.so", "file.so").find("the plugin 'file.so' cannot be loaded: "),
            std::string::npos);
  EXPECT_EQ(plugin_fault(GRAPNEL_TEST_PLUGIN_WITHOUT_SYMBOL, "x.so"),
            "'x.so' is not a plugin: it does not export the function grapnel_controller(), which grapnel_controller.h "
            "declares (in "
            "C++ as extern \"C\")");
  EXPECT_EQ(plugin_fault(GRAPNEL_TEST_PLUGIN_OF_ANOTHER_VERSION, "x.so"),
            "the plugin 'x.so' has version 7 of the controller interface, expected 1; build it with the "
            "grapnel_controller.h of this Grapnel");
  EXPECT_EQ(plugin_fault(GRAPNEL_TEST_PLUGIN_WITHOUT_UPDATE, "x.so"), "the plugin 'x.so' has no function update()");
  EXPECT_EQ(plugin_fault(GRAPNEL_TEST_PLUGIN, "x.so"), "");
}

TEST(PluginController, ForwardsPluginErrors) {
  const Model model = two_joints();
  EXPECT_EQ(error_of([&] { make("{\"does\":\"refuses\"}", model); }),
            "the plugin 'it.so' created no controller: not with 2 joints every 0.01 s");
  const auto failing = make("{\"does\":\"fails\"}", model);
  failing->begin_piece(model, 0);
  Asked a;
  EXPECT_EQ(error_of([&] { ask(*failing, model, moving(model), a, 0.25); }),
            "at t = 0.25 s update() of the plugin 'it.so' failed: the sun is out");
  EXPECT_EQ(error_of([&] { ask(*failing, model, moving(model), a, 0.05); }), "");
}

TEST(PluginControllerDeathTest, NamesThePluginThatCrashes) {
  ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const Model model = two_joints();
  const auto run = [&](const char* parameters) {
    const auto controller = make(parameters, model);
    controller->begin_piece(model, 0);
    Asked a;
    ask(*controller, model, moving(model), a, 1.25);
  };
  EXPECT_EXIT(run("{\"does\":\"crashes\"}"), ::testing::ExitedWithCode(1),
              "grapnel: the plugin 'it.so' crashed \\(segmentation fault\\) in update\\(\\) at t = 1.250000 s");
  EXPECT_EXIT(run("{\"does\":\"aborts\"}"), ::testing::ExitedWithCode(1),
              "'it.so' crashed \\(abort\\) in update\\(\\)");
}

// A fault that is not the plugin's stays what it was.
TEST(PluginControllerDeathTest, LeavesOtherCrashesAlone) {
  ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  open_plugin(GRAPNEL_TEST_PLUGIN, "it.so");
  EXPECT_EXIT(std::abort(), ::testing::KilledBySignal(SIGABRT), "");
}

}  // namespace plugin_controller_test
}  // namespace grapnel::testing
