// Scenarios whose robots come from URDF files, alone or on a bus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/scenario/problem_setter.hpp"
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
    for (const char* name : {"arm.urdf", "massless-root.urdf", "limits.urdf"})
      write("models/" + std::string(name), bytes_of(corpus(name)));
    write("bus.yaml", kBus);
  }

  void write(const std::string& name, const std::string& text) const { files_.write(name, text); }
  // A scenario with only a robot; all joints at 0.1.
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

  // A campaign of the scenario that load() wrote. `text`: 'uncertain' and further keys.
  Campaign campaign(const std::string& text) {
    write("campaign.yaml", "name: c\nscenario: scenario.yaml\ncases: 5\nseed: 3\n" + text);
    return load_campaign(folder_ / "campaign.yaml");
  }
  // The problem of a case, and the scenario written for the case, equal the scenario with the drawn values. `drawn`:
  // the paths of the inputs.
  void expect_cases(const Campaign& drawing, const std::string& robot, const std::vector<std::string>& drawn,
                    std::vector<Override> set, const std::string& joints) {
    ASSERT_EQ(drawing.inputs.size(), drawn.size());
    for (std::uint64_t k = 0; k < drawing.cases; ++k) {
      const std::vector<double> values = drawing.draw(k);
      std::vector<Override> all = set;
      for (std::size_t i = 0; i < drawn.size(); ++i) {
        char text[40];
        std::snprintf(text, sizeof text, "%.17g", values[i]);
        all.push_back({drawn[i], text});
      }
      CaptureProblem expected = load(robot, all, joints);
      CaptureProblem problem = drawing.problem(k).problem;
      EXPECT_TRUE(problem_bytes(problem) == problem_bytes(expected)) << "case " << k;
      write("case.yaml", drawing.scenario_text(k, folder_ / "case.yaml", ""));
      const CaptureProblem read = load_scenario(folder_ / "case.yaml");
      problem.name = read.name;
      EXPECT_TRUE(problem_bytes(read) == problem_bytes(problem)) << "case " << k;
    }
  }

  testing::ModelFolder files_;
  fs::path folder_ = files_.path();
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
  // The same with --set, in any order.
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
              HasSubstr("scenario.yaml:3:16: error: unknown link 'uper' for the base; did you mean 'upper'?"));
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
  ASSERT_EQ(robot.bodies.size(), 4u);  // the massless mount is not a body
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
  // Options of an arm, changed with --set.
  const CaptureProblem moved =
      load(robot, {{"robot.base.mass", "600"}, {"robot.arms[0].mount.position", "[0, 0.5, 0]"}},
           "[0.1, 0.1, 0.1, 0.1, 0.1]");
  EXPECT_EQ(carried_by(moved.robot, "left-shoulder").X_PF.p[1], 0.5);
  EXPECT_EQ(moved.robot.bodies[0].mass, 600);
  EXPECT_NE(moved.sha256, problem.sha256);
}

// Poses in the file are transformed if its base is not a body.
TEST_F(ImportedScenario, AnArmFromARobotFileMayHaveABaseWithoutMassAndUnits) {
  write("arm.yaml",
        "base: {name: mount}\nlinks:\n  - {name: rod, parent: mount, joint: {name: hinge, type: revolute, axis: [0, 0, "
        "1], origin: {position: [10 cm, 0, 0], rpy: [90 deg, 0, 0]}}, mass: 1, inertia: [0.1, 0.1, 0.1]}\n"
        "end_effectors: [{name: tip, link: mount, position: [0, 5 cm, 0]}]\n");
  const CaptureProblem problem =
      load("robot: {bus: bus.yaml, arms: [{file: arm.yaml, mount: {position: [1, 0, 0], rpy: [0, 0, 90 deg]}}]}");
  const BodyDescription& rod = body_of(problem.robot, "rod");
  EXPECT_EQ(rod.parent, "satellite");
  EXPECT_NEAR(rod.X_PF.p[0], 1, 1e-15);
  EXPECT_NEAR(rod.X_PF.p[1], 0.1, 1e-15);
  EXPECT_NEAR(rod.X_PF.R(2, 1), 1, 1e-15);  // the hinge's y axis points along the bus's z axis
  EXPECT_NEAR(problem.robot.end_effectors[1].X_BE.p[0], 0.95, 1e-15);
  write("arm.yaml", "base: {inertia: [1, 1, 1]}\n");
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: arm.yaml}]}"),
              HasSubstr("arm.yaml:1:7: error: missing key 'mass' in base"));
  write("arm.yaml", "links: []\nbase: {}\nend_effectors: [{name: tip, link: base, position: [1 kg, 0, 0]}]\n");
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: arm.yaml}]}"), HasSubstr("'1 kg', a mass"));
}

TEST_F(ImportedScenario, ReadyMadeRobotsAreBusesAndArms) {
  const std::string eight = "[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]";
  const std::string single = "robot: models/arm.urdf\nimport: {bus: ets-vii, mount: {position: [0, 0.5, 1]}}";
  const CaptureProblem problem = load(single, {}, eight);
  EXPECT_EQ(problem.robot.bodies[0].mass, 2550);
  EXPECT_EQ(carried_by(problem.robot, "shoulder").parent, "satellite");
  EXPECT_EQ(problem.source->files[2].part, "bus");
  EXPECT_NE(problem.sha256, load("robot: models/arm.urdf\nimport: {bus: bus.yaml}", {}, "[0.1, 0.1, 0.1]").sha256);
  const std::string several = "robot: {bus: ets-vii, arms: [{file: planar-test-bed, prefix: b-}]}";
  const CaptureProblem both = load(several, {}, eight);
  EXPECT_EQ(body_of(both.robot, "b-base").parent, "satellite");
  EXPECT_EQ(body_of(both.robot, "b-base").mass, 11.891);
  EXPECT_EQ(carried_by(both.robot, "b-joint-2").parent, "b-link-1");
  const std::string ten = "[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]";
  const CaptureProblem gripper =
      load("robot: {bus: ets-vii, arms: [{file: tendon-gripper, prefix: g-, mount: {link: link-6}}]}", {}, ten);
  ASSERT_EQ(gripper.robot.tendons.size(), 2u);
  EXPECT_EQ(gripper.robot.tendons[0].name, "g-left");
  EXPECT_EQ(gripper.robot.tendons[0].joints[1].joint, "g-left-2");
  EXPECT_THAT(faults("robot: {bus: ets-vi, arms: [{file: planar-test-bed}]}"),
              HasSubstr("scenario.yaml:2:14: error: no ready-made robot 'ets-vi'; did you mean 'ets-vii'?"));
  EXPECT_THAT(faults("robot: models/arm.urdf\nimport: {bus: ets-vi}"),
              HasSubstr("scenario.yaml:3:15: error: no ready-made robot 'ets-vi'"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: planar-test-bet}]}"),
              HasSubstr("no ready-made robot 'planar-test-bet'; did you mean 'planar-test-bed'?"));
}

TEST_F(ImportedScenario, LocksHaveTheUnitOfTheirJoint) {
  const auto lock = [](const char* value) {
    return "robot: models/massless-root.urdf\nimport: {lock: {elbow: " + std::string(value) + "}}";
  };
  EXPECT_EQ(problem_bytes(load(lock("12 cm"), {}, "[0.1]")), problem_bytes(load(lock("0.12"), {}, "[0.1]")));
  EXPECT_THAT(faults(lock("12 deg")),
              HasSubstr("scenario.yaml:3:17: error: joint 'elbow' slides, so it is locked at a length"));
  EXPECT_THAT(faults("robot: models/massless-root.urdf\nimport: {lock: {shoulder: 12 mm}}"),
              HasSubstr("joint 'shoulder' turns, so it is locked at an angle"));
}

TEST_F(ImportedScenario, CampaignsVaryChoicesAndImportedValues) {
  const std::string robot = "robot: models/massless-root.urdf\nimport: {lock: {elbow: 10 cm}}";
  load(robot, {}, "[0.1]");
  const std::string lock = "  - {path: import.lock.elbow, uniform: {from: 10 cm, to: 20 cm}}\n";
  const std::string mass = "  - {path: robot.base.mass, as: factor, uniform: {from: 0.9, to: 1.1}}\n";
  const std::vector<std::string> both{"import.lock.elbow", "robot.base.mass"};
  const Campaign drawn = campaign("uncertain:\n" + lock + mass);
  expect_cases(drawn, robot, both, {}, "[0.1]");
  EXPECT_NE(drawn.problem(0).problem.robot.bodies[0].mass, drawn.problem(1).problem.robot.bodies[0].mass);
  EXPECT_NE(body_of(drawn.problem(0).problem.robot, "upper").com[2],
            body_of(drawn.problem(1).problem.robot, "upper").com[2]);
  // Values set in a robot with uncertain import options, for all cases and at points of a design.
  expect_cases(campaign("set: {robot.base.mass: 71}\nuncertain:\n" + lock), robot, {"import.lock.elbow"},
               {{"robot.base.mass", "71"}}, "[0.1]");
  expect_cases(campaign("set: {robot.base.mass: 71}\nuncertain:\n" + lock + mass), robot, both, {}, "[0.1]");
  const Campaign design = campaign("design: [{path: robot.base.mass, values: [71, 72]}]\nuncertain:\n" + lock);
  EXPECT_EQ(design.problem(0).problem.robot.bodies[0].mass, 71);
  EXPECT_EQ(design.problem(5).problem.robot.bodies[0].mass, 72);
}

TEST_F(ImportedScenario, CampaignsVaryMountsAndTheBus) {
  const std::string robot = "robot: {bus: bus.yaml, arms: [{file: models/arm.urdf, mount: {position: [50 cm, 0, 0]}}]}";
  const std::string joints = "[0.1, 0.1, 0.1]";
  load(robot, {}, joints);
  const std::string mount = "  - {path: 'robot.arms[0].mount.position[0]', as: offset, normal: {deviation: 0.01}}\n";
  const std::string mass = "  - {path: robot.base.mass, as: factor, uniform: {from: 0.9, to: 1.1}}\n";
  expect_cases(campaign("uncertain:\n" + mount), robot, {"robot.arms[0].mount.position[0]"}, {}, joints);
  expect_cases(campaign("uncertain:\n" + mount + mass), robot, {"robot.arms[0].mount.position[0]", "robot.base.mass"},
               {}, joints);
}

TEST_F(ImportedScenario, ReportsErrorsOfArmsOnABus) {
  EXPECT_THAT(
      faults("robot: {bus: bus.yaml, arms: [{file: models/arm.urdf}, {file: models/arm.urdf}]}"),
      HasSubstr("end-effector 'tool' exists on the bus; give the arm a prefix (prefix: left-; --prefix left-)"));
  // A base without a name is named base; a massless base is not a body.
  write("bus-2.yaml", "base: {mass: 300, inertia: [30, 40, 50]}\n");
  write("arm.yaml", "base: {mass: 2, inertia: [0.1, 0.1, 0.1]}\n");
  EXPECT_THAT(faults("robot: {bus: bus-2.yaml, arms: [{file: arm.yaml}]}"), HasSubstr("link 'base' exists on the bus"));
  write("bus-2.yaml",
        "base: {name: mount, mass: 300, inertia: [30, 40, 50]}\nlinks: [{name: plate, parent: mount, joint: {name: "
        "mount-1, type: fixed}, mass: 1, inertia: [1, 1, 1]}]\n");
  const RobotSetup robot = load("robot: {bus: bus-2.yaml, arms: [{file: arm.yaml}, {file: models/arm.urdf}]}").robot;
  EXPECT_EQ(robot.bodies.size(), 5u);
  EXPECT_EQ(body_of(robot, "base").joint.name, "mount-1-2");
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: models/arm.urdf, mount: {link: panle}}]}"),
              HasSubstr("the bus has no link 'panle'; did you mean 'panel'?"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml}"), HasSubstr("missing key 'arms' in robot"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{file: bus.yaml, prefix: b-, lock: {j: 1}}]}"),
              HasSubstr("'lock' applies only to imported models"));
  EXPECT_THAT(faults("robot: {bus: bus.yaml, arms: [{flie: models/arm.urdf}]}"), HasSubstr("did you mean 'file'?"));
  EXPECT_THAT(
      faults("robot: {bus: models/arm.urdf, arms: [{file: models/arm.urdf}]}"),
      HasSubstr("scenario.yaml:2:14: error: a bus must be a robot file or a ready-made robot, but 'models/arm.urdf' is "
                "a model: convert it to a robot file, grapnel import models/arm.urdf -o bus.yaml"));
}

TEST_F(ImportedScenario, WrittenElsewhereIsTheSameProblem) {
  struct Written {
    std::string robot, joints;
  };
  for (const auto& [robot, joints] :
       {Written{"robot: models/massless-root.urdf\nimport: {packages: {p: models}}", "[0.1, 0.1]"},
        Written{"robot: {bus: bus.yaml, arms: [{file: models/arm.urdf, mount: {position: [0, 0, 1]}}]}",
                "[0.1, 0.1, 0.1]"},
        Written{"robot: {bus: ets-vii, arms: [{file: planar-test-bed, prefix: b-}]}",
                "[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]"}}) {
    SCOPED_TRACE(robot);
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
          changed_scenario_text({path, changed_tree(path, changes, files), p}, p, place, "", "moved");
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
