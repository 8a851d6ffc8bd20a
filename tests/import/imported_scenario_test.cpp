// Scenarios whose robots come from URDF files, alone or on a bus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/study_files/changed_scenario.hpp"
#include "import/urdf_files.hpp"

namespace grapnel {
namespace imported_scenario_test {

using testing::body_of;
using testing::bytes_of;
using testing::carried_by;
using testing::corpus;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr const char* kBus = R"(schema: grapnel-robot/1
name: bus
base: {name: satellite, mass: 500, inertia: [80, 90, 100], geometry: {shape: box, size: [1, 1, 2]}}
links:
  - name: panel
    parent: satellite
    joint: {name: panel-hinge, type: revolute, axis: [0, 0, 1], origin: {position: [0, 1, 0]}}
    mass: 10
    inertia: [1, 2, 2.5]
end_effectors:
  - {name: hook, link: satellite, position: [0, 0, 1]}
)";

class ImportedScenario : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / ("grapnel-" + std::string(info->name()) + "-" + std::to_string(getpid()));
    fs::create_directories(folder_ / "models");
    for (const char* name : {"arm.urdf", "massless-root.urdf", "limits.urdf"})
      fs::copy_file(corpus(name), folder_ / "models" / name, fs::copy_options::overwrite_existing);
    write("bus.yaml", kBus);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  // A scenario of a robot alone; all joints at 0.1.
  CaptureProblem load(const std::string& robot, std::vector<Override> overrides = {},
                      const std::string& joints = "[0.1, 0.1]") {
    write("scenario.yaml", "name: s\n" + robot + "\ninitial: {joints: " + joints +
                               "}\napproach: {duration: 1, final_joints: " + joints + "}\n");
    return load_scenario(folder_ / "scenario.yaml", overrides, &warnings_);
  }
  std::string faults(const std::string& robot, std::vector<Override> overrides = {}) {
    try {
      load(robot, std::move(overrides));
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string prefix = folder_.string() + "/";
      for (std::size_t at; (at = text.find(prefix)) != std::string::npos;) text.erase(at, prefix.size());
      return text;
    }
    return {};
  }

  fs::path folder_;
  std::vector<Fault> warnings_;
};

TEST_F(ImportedScenario, TakesAUrdfFileAndTheChoicesOfImport) {
  const CaptureProblem problem = load("robot: models/massless-root.urdf");
  EXPECT_EQ(problem.robot.name, "massless-root");
  EXPECT_EQ(problem.robot.bodies.size(), 3u);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_THAT(warnings_[0].text(), HasSubstr("scenario.yaml:2:8: warning: "));
  EXPECT_THAT(warnings_[0].message, HasSubstr("decisions on importing the robot; grapnel import lists them"));
  ASSERT_EQ(problem.source->files.size(), 2u);
  EXPECT_EQ(problem.source->files[1].part, "robot");
  EXPECT_EQ(problem.source->files[1].text, bytes_of(corpus("massless-root.urdf")));

  const CaptureProblem chosen = load(
      "robot: models/massless-root.urdf\nimport: {base: lower, lock: {elbow: 0.2}, end_effectors: [battery, tool0]}",
      {}, "[0.1]");
  EXPECT_EQ(chosen.robot.base, "lower");
  EXPECT_EQ(chosen.robot.bodies.size(), 2u);
  EXPECT_EQ(chosen.robot.end_effectors[0].name, "battery");
  EXPECT_NE(chosen.sha256, problem.sha256);
  // The same by --set, in whatever order.
  const CaptureProblem set =
      load("robot: models/massless-root.urdf",
           {{"robot.base.mass", "77"}, {"import.lock.elbow", "0.2"}, {"import.base", "lower"}}, "[0.1]");
  EXPECT_EQ(set.robot.bodies.size(), 2u);
  EXPECT_EQ(set.robot.bodies[0].mass, 77);
}

TEST_F(ImportedScenario, HashSeesTheModel) {
  const std::string before = load("robot: models/massless-root.urdf").sha256;
  write("models/massless-root.urdf", bytes_of(corpus("massless-root.urdf")) + "\n");
  const std::string after = load("robot: models/massless-root.urdf").sha256;
  EXPECT_NE(before, after);
  EXPECT_EQ(after, load("robot: models/massless-root.urdf").sha256);
}

TEST_F(ImportedScenario, FaultsAreAtTheirPlacesInTheModel) {
  write("models/bad.urdf",
        "<robot><link name='a'><inertial><mass value='1e-12'/><inertia ixx='1' iyy='1' izz='1'/>"
        "</inertial></link>\n</robot>");
  EXPECT_THAT(faults("robot: models/bad.urdf"), HasSubstr("models/bad.urdf:1:24: error: base.mass"));
  EXPECT_THAT(faults("robot: models/none.urdf"), HasSubstr("scenario.yaml:2:8: error: "));
  EXPECT_THAT(faults("robot: models/arm.urdf"),
              HasSubstr("models/arm.urdf:3:4: error: the base, link 'mount', has no mass"));
  EXPECT_THAT(faults("robot: models/arm.urdf\nimport: {base: uper}"),
              HasSubstr("scenario.yaml:3:16: error: there is no link 'uper' to be the base; did you mean 'upper'?"));
  EXPECT_THAT(faults("robot: models/arm.urdf\nimport: {bsae: upper, lock: {elbow: x}, mount: {}}"),
              AllOf(HasSubstr("unknown key 'bsae' in import; did you mean 'base'?"),
                    HasSubstr("import.lock.elbow must be a number"), HasSubstr("bus")));
  EXPECT_THAT(faults("robot: bus.yaml\nimport: {base: satellite}"),
              HasSubstr("scenario.yaml:3:1: error: 'import' is for a robot in URDF or MJCF"));
}

TEST_F(ImportedScenario, PutsAnArmOnABus) {
  const CaptureProblem problem = load(
      "robot: models/arm.urdf\nimport: {bus: bus.yaml, mount: {position: [0.5, 0, 0.2], rpy: [0, 0, "
      "1.5707963267948966]}}",
      {}, "[0.1, 0.1, 0.1]");
  const RobotSetup& robot = problem.robot;
  EXPECT_EQ(robot.base, "satellite");
  EXPECT_EQ(robot.bodies[0].mass, 500);
  ASSERT_EQ(robot.bodies.size(), 4u);  // the mount has no mass: no body
  const BodyDescription& upper = carried_by(robot, "shoulder");
  EXPECT_EQ(upper.parent, "satellite");
  EXPECT_NEAR(upper.X_PF.p[0], 0.5, 1e-15);
  EXPECT_NEAR(upper.X_PF.p[2], 0.3, 1e-15);
  EXPECT_NEAR(upper.X_PF.R(0, 0), 0, 1e-15);
  EXPECT_NEAR(upper.X_PF.R(1, 0), 1, 1e-15);
  ASSERT_EQ(robot.end_effectors.size(), 2u);
  EXPECT_EQ(robot.end_effectors[0].name, "hook");
  EXPECT_EQ(robot.end_effectors[1].name, "tool");
  ASSERT_EQ(problem.source->files.size(), 3u);
  EXPECT_EQ(problem.source->files[2].part, "bus");
}

TEST_F(ImportedScenario, PutsArmsOnABusWithPrefixes) {
  write("arm.yaml",
        "base: {mass: 2, inertia: [0.1, 0.1, 0.1]}\nlinks:\n  - {name: rod, parent: base, joint: {name: hinge, type: "
        "revolute, axis: [1, 0, 0]}, mass: 1, inertia: [0.1, 0.1, 0.1]}\nend_effectors: [{name: tip, link: rod}]\n");
  const std::string robot =
      "robot:\n"
      "  bus: bus.yaml\n"
      "  arms:\n"
      "    - {file: models/arm.urdf, prefix: left-, mount: {position: [0, 0.4, 0]}, lock: {elbow: 1}}\n"
      "    - {file: models/arm.urdf, prefix: right-, mount: {link: panel, position: [0, -0.4, 0]}}\n"
      "    - {file: arm.yaml, prefix: third-, mount: {position: [1, 0, 0]}}";
  const CaptureProblem problem = load(robot, {}, "[0.1, 0.1, 0.1, 0.1, 0.1]");
  EXPECT_EQ(carried_by(problem.robot, "left-shoulder").X_PF.p[1], 0.4);
  EXPECT_EQ(carried_by(problem.robot, "right-shoulder").parent, "panel");
  EXPECT_EQ(carried_by(problem.robot, "right-elbow").parent, "right-upper");
  EXPECT_EQ(body_of(problem.robot, "third-base").parent, "satellite");
  EXPECT_EQ(body_of(problem.robot, "third-base").joint.type, JointType::fixed);
  EXPECT_EQ(body_of(problem.robot, "third-base").X_PF.p[0], 1);
  EXPECT_EQ(body_of(problem.robot, "left-upper").mass, 10);  // with the forearm
  std::vector<std::string> tips;
  for (const EndEffectorSetup& one : problem.robot.end_effectors) tips.push_back(one.name);
  EXPECT_THAT(tips, ::testing::ElementsAre("hook", "left-tool", "right-tool", "third-tip"));
  // A choice of an arm, by --set.
  const CaptureProblem moved =
      load(robot, {{"robot.base.mass", "600"}, {"robot.arms[0].mount.position", "[0, 0.5, 0]"}},
           "[0.1, 0.1, 0.1, 0.1, 0.1]");
  EXPECT_EQ(carried_by(moved.robot, "left-shoulder").X_PF.p[1], 0.5);
  EXPECT_EQ(moved.robot.bodies[0].mass, 600);
  EXPECT_NE(moved.sha256, problem.sha256);
}

TEST_F(ImportedScenario, SaysWhatIsWrongWithArmsOnABus) {
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: models/arm.urdf}, {file: models/arm.urdf}]}"),
              HasSubstr("on the bus already; give the arm a prefix"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: models/arm.urdf, mount: {link: panle}}]}"),
              HasSubstr("the bus has no link 'panle'; did you mean 'panel'?"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml}"), HasSubstr("missing key 'arms' in robot"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: bus.yaml, prefix: b-, lock: {j: 1}}]}"),
              HasSubstr("'lock' is for models that are imported"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{flie: models/arm.urdf}]}"), HasSubstr("did you mean 'file'?"));
  EXPECT_THAT(faults("robot: {bus: models/arm.urdf, arms: [{file: models/arm.urdf}]}"), HasSubstr("error: "));
}

TEST_F(ImportedScenario, WrittenElsewhereIsTheSameProblem) {
  for (const std::string robot :
       {"robot: models/massless-root.urdf\nimport: {packages: {p: models}}",
        "robot: {bus: bus.yaml, arms: [{file: models/arm.urdf, mount: {position: [0, 0, 1]}}]}"}) {
    const std::string joints = robot.find("bus") == std::string::npos ? "[0.1, 0.1]" : "[0.1, 0.1, 0.1]";
    load(robot, {}, joints);
    fs::create_directories(folder_ / "elsewhere/deep");
    for (const bool inside : {false, true}) {
      std::vector<Change> changes;
      if (inside) {
        FaultList none;
        changes.push_back({"robot.base.mass", {}, {}, "123"});
        changes[0].value.kind = Node::Kind::scalar, changes[0].value.text = "123";
      }
      ScenarioFiles files;
      const fs::path path = folder_ / "scenario.yaml", place = folder_ / "elsewhere/deep/other.yaml";
      const CaptureProblem p = load_scenario(path, changes, files);
      const std::string text =
          changed_scenario_text(path, changed_tree(path, changes, files), p, p, place, "", "moved");
      std::ofstream(place) << text;
      const CaptureProblem q = load_scenario(place);
      ASSERT_EQ(p.robot.bodies.size(), q.robot.bodies.size());
      EXPECT_EQ(q.robot.bodies[0].mass, inside ? 123 : p.robot.bodies[0].mass);
      for (std::size_t i = 0; i < p.robot.bodies.size(); ++i) {
        EXPECT_EQ(p.robot.bodies[i].name, q.robot.bodies[i].name);
        EXPECT_EQ(p.robot.bodies[i].com[2], q.robot.bodies[i].com[2]);
      }
    }
  }
}

}  // namespace imported_scenario_test
}  // namespace grapnel
