// Numbers with units in scenarios, robots, overrides, studies, campaigns and optimizations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "grapnel/campaign/study_files.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "scenario/scenario_files.hpp"
#include "support/schema_check.hpp"

namespace grapnel::test {
namespace scenario_units_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// kSmallScenario with a prismatic joint and with gains.
std::string sliding(const std::vector<Edit>& edits = {}) {
  std::string text = edited(kSmallScenario, {{"name: elbow, type: revolute", "name: elbow, type: prismatic"}});
  return edited(text, edits);
}

CaptureProblem problem_of(const std::string& text, const std::vector<Override>& overrides = {}) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text), overrides);
}

TEST(ScenarioUnits, AreTheSameProblemToTheLastBit) {
  const std::vector<Edit> with_units{
      {"mass: 100", "mass: 0.1 t"},
      {"[10, 10, 10]", "[10 kg m^2, 1e5 kg cm^2, \"10 kg m²\"]"},
      {"lower: -2, upper: 2, rate: 1}", "lower: -2 rad, upper: 2, rate: 1000 mrad/s}"},
      {"com: [0.5, 0, 0]", "com: [500 mm, 0, 0 m]"},
      {"{shoulder: 0.5, elbow: 1}", "{shoulder: 30 deg, elbow: 100 cm}"},
      {"position: [2, 0, 0]", "position: [200 cm, 0, 0]"},
      {"[0, 0, 0.2]", "[0, 0, 2 deg/s]"},
      {"duration: 20", "duration: 0.5min"},
      {"[0.2, -0.4]", "[10°, -400 mm]"},
      {"duration: 1e-3", "duration: 1 ms"},
  };
  const std::vector<Edit> plain{
      {"{shoulder: 0.5, elbow: 1}", "{shoulder: 0.5235987755982989, elbow: 1}"},
      {"[0, 0, 0.2]", "[0, 0, 0.03490658503988659]"},
      {"duration: 20", "duration: 30"},
      {"[0.2, -0.4]", "[0.17453292519943295, -0.4]"},
  };
  EXPECT_TRUE(problem_bytes(problem_of(sliding(with_units))) == problem_bytes(problem_of(sliding(plain))));
  EXPECT_FALSE(problem_bytes(problem_of(sliding(with_units))) == problem_bytes(problem_of(sliding())));
}

TEST(ScenarioUnits, InOverrides) {
  const CaptureProblem problem = problem_of(kSmallScenario, {{"targets.ball.state.rpy", "[90 deg, 0, 0]"},
                                                             {"approach.duration", "1 min"},
                                                             {"robot.links[0].mass", "500 g"},
                                                             {"initial.joints.shoulder", "30 deg"}});
  EXPECT_EQ(problem.approach->duration, 60);
  EXPECT_EQ(problem.robot.bodies[1].mass, 0.5);
  EXPECT_EQ(problem.joint_position[0], 0.5235987755982989);
  EXPECT_NEAR(problem.targets[0].X_WT.R.column(1)[2], 1, 1e-15);
  EXPECT_THAT(
      faults_of(kSmallScenario, {{"approach.duration", "3 m"}}),
      ElementsAre("--set approach.duration=3 m: error: approach.duration is '3 m', a length; expected a time [s, "
                  "ms, min, h]"));
}

TEST(ScenarioUnits, OfWrongDimensionHaveTheirPlace) {
  const std::pair<Edit, std::string> cases[] = {
      {{"mass: 10\n", "mass: 10 m\n"}, "23:11: error: targets[0].mass is '10 m', a length; expected a mass [kg, g, t]"},
      {{"mass: 10\n", "mass: 10 kgs\n"},
       "23:11: error: targets[0].mass: unknown unit 'kgs' in '10 kgs'; did you mean 'kg'?"},
      {{"[0, 0, 0.2]", "[0, 0, 2 deg]"},
       "25:59: error: targets[0].state.angular_velocity[2] is '2 deg', an angle; expected an angular rate [rad/s, "
       "deg/s, rpm]"},
      {{"duration: 20", "duration: -20 s"},
       "31:13: error: approach.duration is -20 s (-20), must be greater than 0 [s]"},
      {{"shoulder: 0.5", "shoulder: 30 mm"},
       "20:22: error: initial.joints.shoulder is in m, but joint 'shoulder' turns: expected an angle [rad, deg, mrad]"},
      {{"[0.2, -0.4]", "[0.2, 5 cm]"},
       "32:23: error: approach.final_joints[1] (joint 'elbow') is in m, but joint 'elbow' turns: expected an angle "
       "[rad, deg, mrad]"},
      {{"shoulder: 0.5", "shoulder: 300 deg"}, "20:22: error: initial.joints.shoulder is 5.23598775598"},
      {{"lower: -2", "lower: -2 m"},
       "8:80: error: robot.links[0].joint.limits.lower is in m, but joint 'shoulder' turns: expected an angle [rad, "
       "deg, mrad]"},
      {{"\nimpact:", "\nintegration: {relative_tolerance: 1e-9 m}\nimpact:"},
       "integration.relative_tolerance must be a number without unit, not '1e-9 m'"},
      {{"  final_rates", "  tracking: {mode: pd, kp: 5 N/m, kd: 1}\n  final_rates"},
       "approach.tracking.kp is in N/m, but joint 'shoulder' turns: expected a torsional stiffness [N m/rad, N m/deg]"},
      {{"  final_rates", "  tracking: {mode: computed_torque, kp: 5 N m/rad, kd: 1 1/s}\n  final_rates"},
       "approach.tracking.kp is in N m/rad; with computed_torque gains are in 1/s^2"},
      {with_wrench("{body: base, time: {shape: table, values: [[0 s, 0, 0, 0, 0, 0, 0], [1 s, 2 N m, 0, 0, 0, 0, "
                   "0]]}}"),
       "external_wrenches[0].time.values: number 2 of a row is in N m; expected a force [N, mN, kN]"},
      {{"impact: {duration: 1e-3}",
        "impact: {law: compliant, contact: {model: hertz, stiffness: 1e5 N/m}, grasp: "
        "{linear_stiffness: 1 kN/m, angular_stiffness: 2 N m/deg}}"},
       "impact.contact.stiffness is in N/m; of model hertz it is in N/m^1.5"},
  };
  for (const auto& [edit, fault] : cases)
    EXPECT_THAT(faults_of(edited(kSmallScenario, {edit})), ElementsAre(HasSubstr(fault))) << edit.second;
  EXPECT_THAT(
      faults_of(edited(kSmallScenario, {{"duration: 20", "duration: 1e9 h"}})),
      testing::Contains(HasSubstr("31:13: error: approach.duration is 1e9 h (3600000000000), must be at most 1e+09 "
                                  "in magnitude [s]")));
}

TEST(ScenarioUnits, OfJointsThatSlide) {
  EXPECT_THAT(
      faults_of(sliding({{"elbow: 1}", "elbow: 30 deg}"}})),
      ElementsAre(HasSubstr("initial.joints.elbow is in rad, but joint 'elbow' slides: expected a length [m, mm, "
                            "cm, km]")));
  EXPECT_THAT(faults_of(sliding({{"  final_rates",
                                  "  tracking: {mode: pd, kp: {shoulder: 5 N m/rad, elbow: 3 kN/m}, "
                                  "kd: {shoulder: 5 N m s/rad, elbow: 3 N s/mm}}\n  final_rates"}})),
              IsEmpty());
  // One number for revolute and prismatic joints cannot have a unit.
  EXPECT_THAT(faults_of(sliding({{"  final_rates", "  tracking: {mode: pd, kp: 5 N m/rad, kd: 3}\n  final_rates"}})),
              ElementsAre(HasSubstr("approach.tracking.kp is in N m/rad, but joint 'elbow' slides")));
}

TEST(ScenarioUnits, RaiseNoDoubts) {
  EXPECT_THAT(warnings_of(edited(kSmallScenario, {{"[0, 0, 0.2]", "[0, 0, 90]"}})), testing::Not(IsEmpty()));
  EXPECT_THAT(warnings_of(edited(kSmallScenario, {{"[0, 0, 0.2]", "[0, 0, 90 rad/s]"}})), IsEmpty());
}

TEST(ScenarioUnits, AreInTheSchema) {
  const SchemaCheck schema(scenario_schema());
  const auto accepts = [&](const std::string& duration, const nlohmann::json& mass) {
    nlohmann::json document = {{"name", "x"},
                               {"robot", "robot.yaml"},
                               {"approach", {{"duration", duration}, {"plan", nlohmann::json::object()}}},
                               {"targets",
                                {{{"name", "t"},
                                  {"mass", mass},
                                  {"inertia", {"1 kg m^2", 1, 1}},
                                  {"state", {{"position", {0, 0, "5 cm"}}}}}}}};
    return schema.faults_of(document).empty();
  };
  EXPECT_TRUE(accepts("20 s", "3 t"));
  EXPECT_TRUE(accepts("0.5 min", 3));
  EXPECT_FALSE(accepts("20", 3));
  EXPECT_FALSE(accepts("20 apples", 3));
  EXPECT_FALSE(accepts("long", 3));
}

// ---- Studies, campaigns, optimizations ----

class StudyUnits : public testing::Test {
 protected:
  StudyUnits() {
    folder_.write("scenario.yaml", sliding({{"{shoulder: 0.5, elbow: 1}", "{shoulder: 30 deg, elbow: 1}"}}));
  }

  template <class Load>
  static std::vector<std::string> faults_of_load(Load load) {
    std::vector<std::string> texts;
    try {
      load();
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) texts.push_back(fault.message);
    }
    return texts;
  }
  Campaign study(const std::string& axes) {
    return load_study(
        folder_.write("study.yaml", "name: s\nscenario: scenario.yaml\nsimulate: impact\naxes:\n" + axes));
  }
  Campaign campaign(const std::string& uncertain) {
    return load_campaign(folder_.write("campaign.yaml",
                                       "name: c\nscenario: scenario.yaml\nsimulate: impact\ncases: "
                                       "10\nuncertain:\n" +
                                           uncertain));
  }
  TemporaryFolder folder_;
};

TEST_F(StudyUnits, OfAxes) {
  const Campaign one = study(
      "  - {path: targets.ball.mass, values: [500 g, 1, 0.01 t]}\n"
      "  - {path: initial.joints.elbow, from: 90 cm, to: 1.1, count: 3}\n"
      "  - {quantity: target_spin, unit: deg, values: [3 deg/s, 4, 0.5 rpm]}\n"
      "  - {quantity: relative_speed, values: [5 cm/s]}\n");
  ASSERT_EQ(one.design.size(), 4u);
  EXPECT_TRUE(one.design[0].is_numeric);
  EXPECT_EQ(one.design[0].values[0].number, 0.5);
  EXPECT_EQ(one.design[0].values[2].number, 10);
  EXPECT_EQ(one.design[1].values[0].number, 0.9);
  EXPECT_EQ(one.design[2].values[0].number, 3);  // the table is in degrees
  EXPECT_EQ(one.design[2].values[2].number, 3);
  EXPECT_EQ(one.design[3].values[0].number, 0.05);
  EXPECT_EQ(one.problem(0).problem.targets[0].mass, 0.5);
  EXPECT_EQ(one.problem(0).problem.joint_position[0], 0.5235987755982989);
}

TEST_F(StudyUnits, OfAxesThatDoNotFit) {
  EXPECT_THAT(faults_of_load([&] { study("  - {path: targets.ball.mass, values: [500 m]}\n"); }),
              ElementsAre("axes[0].values[0] is '500 m', a length; expected a mass [kg, g, t]"));
  EXPECT_THAT(faults_of_load([&] { study("  - {path: initial.joints.elbow, from: 1 deg, to: 2 deg, count: 3}\n"); }),
              testing::Contains(HasSubstr("is in rad, but joint 'elbow' slides")));
  EXPECT_THAT(faults_of_load([&] { study("  - {quantity: mass_ratio, values: [0.5 kg]}\n"); }),
              testing::Contains(HasSubstr("must be a number without unit, not '0.5 kg'")));
}

TEST_F(StudyUnits, OfCampaigns) {
  const Campaign one = campaign(
      "  - {path: initial.joints.shoulder, as: offset, uniform: {from: -2 deg, to: 2 deg}}\n"
      "  - {path: targets.ball.mass, normal: {mean: 8000 g, deviation: 100 g}}\n"
      "  - {path: targets.ball.state.position, as: offset, normal: {deviation: [1 mm, 0, 2 mm]}}\n"
      "  - {path: initial.joints.elbow, discrete: {values: [90 cm, 1]}}\n"
      "  - {path: targets.ball.state.angular_velocity, tilt: {deviation: 5 deg}}\n");
  const double degree = std::numbers::pi / 180;
  for (std::uint64_t k = 0; k < 10; ++k) {
    const CaptureProblem problem = one.problem(k).problem;
    EXPECT_NEAR(problem.joint_position[0], 30 * degree, 2 * degree);
    EXPECT_NEAR(problem.targets[0].mass, 8, 0.5);
    EXPECT_NEAR(problem.targets[0].X_WT.p[0], 2, 0.005);
    EXPECT_TRUE(problem.joint_position[1] == 0.9 || problem.joint_position[1] == 1);
    const TemporaryFolder folder;
    const auto place = folder.path() / "case.yaml";
    CaptureProblem read = load_scenario(folder.write("case.yaml", one.scenario_text(k, place, "")));
    read.name = problem.name;
    EXPECT_TRUE(problem_bytes(problem) == problem_bytes(read));
  }
}

TEST_F(StudyUnits, OfCampaignsThatDoNotFit) {
  EXPECT_THAT(
      faults_of_load([&] { campaign("  - {path: targets.ball.mass, as: factor, normal: {deviation: 1 kg}}\n"); }),
      ElementsAre("uncertain[0].normal.deviation must be a number without unit, not '1 kg'"));
  EXPECT_THAT(faults_of_load([&] { campaign("  - {path: targets.ball.mass, normal: {mean: 8, deviation: 1 s}}\n"); }),
              ElementsAre("uncertain[0].normal.deviation is '1 s', a time; expected a mass [kg, g, t]"));
  EXPECT_THAT(
      faults_of_load([&] { campaign("  - {path: initial.joints.elbow, as: offset, normal: {deviation: 1 deg}}\n"); }),
      ElementsAre("uncertain[0]: normal.deviation is in rad; expected a length [m, mm, cm, km]"));
}

TEST_F(StudyUnits, OfOptimizations) {
  const auto load = [&](const std::string& variable) {
    return load_optimization(
        folder_.write("optimization.yaml",
                      "name: o\nscenario: scenario.yaml\nsimulate: impact\nminimize: grasps/*/impulse_magnitude\n"
                      "variables:\n  - " +
                          variable + "\n"));
  };
  const Optimization one = load("{path: initial.joints.shoulder, from: 20 deg, to: 0.1 rev}");
  EXPECT_EQ(one.variables[0].from, 0.3490658503988659);
  EXPECT_EQ(one.variables[0].to, 0.6283185307179586);
  EXPECT_THAT(faults_of_load([&] { load("{path: initial.joints.shoulder, from: 20 mm, to: 30 mm}"); }),
              testing::Contains(HasSubstr("is in m, but joint 'shoulder' turns")));
}

}  // namespace scenario_units_test
}  // namespace grapnel::test
