/// Stepwise execution of plants without an FMU, so that sanitizers see their thread.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/plant/plant_package.hpp"
#include "grapnel/plant/plant_problem.hpp"
#include "grapnel/plant/plant_run.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "plant/short_capture.hpp"

namespace grapnel::testing {
namespace plant_run_test {

namespace fs = std::filesystem;

class Plants : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("grapnel-plants-" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + "-" +
               std::to_string(::getpid()));
    fs::create_directories(folder_);
    write("robot.yaml", kShortRobot);
    write("short.yaml", kShortCapture);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  CaptureProblem problem(const std::vector<Override>& changes = {}) const {
    return load_scenario(folder_ / "short.yaml", changes);
  }
  std::unique_ptr<PlantRun> run(const std::vector<Override>& changes = {}) const {
    CaptureProblem plant = plant_of(problem(changes), false);
    PlantVariables variables = plant_variables(plant, {});
    return std::make_unique<PlantRun>(std::move(plant), std::move(variables));
  }
  std::string refusal(const std::vector<Override>& changes, bool base_torque = false) const {
    try {
      plant_of(problem(changes), base_torque);
      return {};
    } catch (const PlantError& error) {
      return error.what();
    }
  }
  fs::path folder_;
};

std::vector<double> pd(const PlantOutputs& seen) {
  std::vector<double> tau;
  for (const std::size_t j : {0, 1}) {
    const PlantOutputs::Joint& joint = seen.joints[j];
    tau.push_back((j == 0 ? 40.0 : 30.0) * (joint.desired_position - joint.position) +
                  (j == 0 ? 60.0 : 40.0) * (joint.desired_rate - joint.rate));
  }
  return tau;
}

TEST_F(Plants, AgreeWithTheBuiltInLaw) {
  const CaptureResult reference = simulate_capture(problem());
  const auto plant = run();
  plant->begin();
  for (int k = 1; !plant->has_ended(); ++k) plant->step(k * plant->period(), pd(plant->outputs()));
  EXPECT_NEAR(plant->time(), 3.5, 1e-12);
  for (const std::size_t j : {0, 1}) {
    EXPECT_EQ(plant->outputs().joints[j].position, reference.post_impact_end->joints.position[j]);
    EXPECT_EQ(plant->outputs().joints[j].rate, reference.post_impact_end->joints.velocity[j]);
  }
  EXPECT_TRUE(plant->outputs().end.conserved);
  EXPECT_EQ(plant->outputs().numbers().size(), plant_variables(plant_of(problem(), false), {}).outputs);
}

// A satellite without driven joints, with torques on its base and actuator commands, in phases of `motion`.
TEST_F(Plants, SupportScenariosWithoutJointsAndCapture) {
  const std::string wheels = "  wheel_array: {configuration: orthogonal, inertia: 0.05}\n";
  const std::string panel =
      "  links:\n    - {name: p, parent: bus, joint: {name: h, type: revolute, axis: [0, 0, 1], spring: {stiffness: "
      "5}}, "
      "mass: 1, com: [1, 0, 0], inertia: [0.1, 0.1, 0.1]}\n";
  for (const std::string& parts : {std::string(), wheels, panel, wheels + panel}) {
    for (const std::string phases : {"motion: {duration: 2}", "motion: [{duration: 1}, {name: late, duration: 1}]",
                                     "approach: {duration: 2, final_joints: {}}"}) {
      write("bus.yaml",
            "schema: grapnel-scenario/1\nname: bus\nrobot:\n  name: bus\n  base: {name: bus, mass: 50, inertia: "
            "[2, 2, 2]}\n" +
                parts + "control: {period: 0.1}\n" + phases + "\n");
      // A base without actuators takes torques unasked: there is nothing else to command.
      for (const bool base_torque : {true, false}) {
        CaptureProblem plant = plant_of(load_scenario(folder_ / "bus.yaml"), base_torque);
        PlantVariables variables = plant_variables(plant, {});
        const std::size_t inputs = variables.inputs;
        ASSERT_GT(inputs, 0u);
        PlantRun run(std::move(plant), std::move(variables));
        run.begin();
        std::vector<double> command(inputs, 0.0);
        command.back() = 0.5;  // about z [N m], on the base or by the third wheel
        for (int k = 1; !run.has_ended(); ++k) run.step(0.1 * k, command);
        EXPECT_NEAR(run.time(), 2, 1e-12) << phases << parts;
        EXPECT_TRUE(run.outputs().end.conserved) << phases << parts;
        EXPECT_NE(run.outputs().base.angular_velocity[2], 0) << phases << parts;
        if (parts.empty()) {
          EXPECT_NEAR(run.outputs().base.angular_velocity[2], 0.5 * 2 / 2, 1e-9);
        }
      }
    }
  }
}

// The run's thread ends with the object in every state: before begin(), at a sample, at the end, after a failure.
TEST_F(Plants, MayBeDestroyedAtAnyTime) {
  run();
  {
    const auto plant = run();
    plant->begin();
  }
  {
    const auto plant = run();
    plant->begin();
    plant->step(2.2, {0.1, 0.1});
    EXPECT_EQ(plant->outputs().phase, PlantOutputs::kAfterImpact);
  }
  {
    const auto plant = run();
    plant->begin();
    plant->step(100, {0, 0});
    EXPECT_TRUE(plant->has_ended());
    EXPECT_NEAR(plant->time(), 3.5, 1e-12);
  }
  const auto plant = run(
      {{"robot.links[1].joint", "{name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [0.8, 0, 0]}}"}});
  plant->begin();
  plant->step(0.01, {0, 0});
  const PlantOutputs before = plant->outputs();
  EXPECT_THROW(plant->step(0.05, {0, 1e6}), PlantError);
  EXPECT_NEAR(plant->outputs().joints[1].position, before.joints[1].position, 1e-15);
}

TEST_F(Plants, ReportInvalidScenarios) {
  EXPECT_EQ(refusal({}), "");
  EXPECT_NE(refusal({{"robot.base.mode", "fixed"}}, true).find("so no torque rotates it"), std::string::npos);
  CaptureProblem still = problem();
  still.approach.reset(), still.post_impact.reset();
  EXPECT_THROW(plant_of(still, false), PlantError);
}

TEST_F(Plants, IncludeAllFiles) {
  std::vector<Fault> warnings;
  const GatheredPlant gathered = gather_plant(folder_ / "short.yaml", {"targets[0].mass=12", "approach.duration=2 s"},
                                              {"targets[0].mass", "approach.duration"}, false, &warnings);
  ASSERT_EQ(gathered.files.size(), 2u);
  EXPECT_EQ(gathered.files[0].to, "scenario/short.yaml");
  EXPECT_EQ(gathered.files[1].to, "scenario/robot.yaml");
  ASSERT_EQ(gathered.package.parameters.size(), 2u);
  EXPECT_EQ(gathered.package.parameters[0].start, 12);
  EXPECT_EQ(gathered.package.parameters[1].unit, "s");
  // Round trip.
  write("plant.json", plant_json(gathered.package));
  const PlantPackage back = read_plant(folder_);
  EXPECT_EQ(back.scenario, gathered.package.scenario);
  EXPECT_EQ(back.settings, gathered.package.settings);
  EXPECT_EQ(back.parameters[1].path, "approach.duration");
  fs::create_directories(folder_ / "scenario");
  for (const char* file : {"short.yaml", "robot.yaml"}) fs::copy_file(folder_ / file, folder_ / "scenario" / file);
  EXPECT_EQ(load_plant(back, folder_, {}).targets[0].mass, 12);
  EXPECT_EQ(load_plant(back, folder_, {12, 2}).sha256, load_plant(back, folder_, {}).sha256);
  EXPECT_EQ(load_plant(back, folder_, {20, 3}).approach->duration, 3);
}

}  // namespace plant_run_test
}  // namespace grapnel::testing
