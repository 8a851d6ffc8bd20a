// Optimization files: errors are reported immediately, with their locations.
#include "grapnel/campaign/study_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "campaign/study_case.hpp"
#include "support/fault_texts.hpp"

namespace grapnel {
namespace read_optimization_test {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

std::vector<std::string> faults_of(const std::string& text) {
  const test::Folder folder;
  return test::faults_of_loading(folder.write("o.yaml", text), [](const auto& file) { load_optimization(file); });
}

const std::string kHead =
    "name: x\nscenario: " GRAPNEL_SOURCE_DIR "/scenarios/thesis/closed-loop.yaml\nsimulate: impact\n";

TEST(ReadOptimization, FaultsComeTogetherWithPlacesAndSuggestions) {
  EXPECT_THAT(
      faults_of(kHead + "minimize: grasps/tip-1/impulse_magnitud\n"
                        "limits:\n"
                        "  - {column: kinetic_energy_befor, at_most: 1}\n"
                        "  - {column: rank}\n"
                        "variables:\n"
                        "  - {quantity: approach_angle, grasp: tip-3, from: 0, to: 1}\n"
                        "  - {path: approach.durations, from: 1, to: 2}\n"
                        "  - {path: approach.duration, from: 2, to: 1}\n"
                        "  - {patch: sphere.rigth, u: [0, 1, 0], v: [0, 1, 0], radius: 0.1}\n"
                        "  - {quantity: relative_speed, from: 0, to: 1, unit: deg}\n"),
      ElementsAre(HasSubstr("o.yaml:4:11: error: no column 'grasps/tip-1/impulse_magnitud' in minimize; did you mean "
                            "'grasps/tip-1/impulse_magnitude'?"),
                  HasSubstr("o.yaml:6:14: error: no column 'kinetic_energy_befor' in limits[0]; did you mean"),
                  HasSubstr("o.yaml:7:5: error: missing key in limits[1]: give 'at_most' or 'at_least'"),
                  HasSubstr("o.yaml:9:39: error: unknown grasp 'tip-3' in variables[0]; did you mean 'tip-1'?"),
                  HasSubstr("o.yaml:11:37: error: variables[2]: 'from' must be less than 'to'"),
                  HasSubstr("o.yaml:12:13: error: unknown grasp point 'sphere.rigth' in variables[3]; did you mean "
                            "'sphere.right'?"),
                  HasSubstr("o.yaml:12:44: error: variables[3].v must be perpendicular to u"),
                  HasSubstr("o.yaml:13:48: error: 'unit' in variables[4] has no meaning")));
}

TEST(ReadOptimization, InvalidValuesAreReportedAtTheEndsOfAVariable) {
  EXPECT_THAT(faults_of(kHead + "minimize: rank\nvariables:\n"
                                "  - {path: approach.durations, from: 1, to: 2}\n"
                                "  - {path: approach.duration, from: -1, to: 2}\n"
                                "  - {posture: null_space, from: -1, to: 1}\n"),
              ElementsAre(HasSubstr("o.yaml:6:12: error: unknown key 'durations' in approach"),
                          HasSubstr("o.yaml:7:37: error: approach.duration is -1, must be greater than 0")));
  EXPECT_THAT(faults_of(kHead + "minimize: rank\nvariables: [{posture: null_space, from: -1, to: 1}]\n"),
              ElementsAre(HasSubstr("variables[0]: the grasps determine all joint values")));
  EXPECT_THAT(faults_of("name: x\nscenario: " GRAPNEL_SOURCE_DIR
                        "/scenarios/seven-joint-dual-capture.yaml\nminimize: rank\nvariables:\n"
                        "  - {posture: null_space, from: -1, to: 1}\n"),
              ElementsAre(HasSubstr("o.yaml:5:5: error: variables[0]: a posture needs approach.plan")));
}

TEST(ReadOptimization, OneObjective) {
  const std::string variables = "variables: [{path: approach.duration, from: 10, to: 20}]\n";
  EXPECT_THAT(faults_of(kHead + variables), ElementsAre(HasSubstr("give 'minimize' or 'maximize'")));
  EXPECT_THAT(faults_of(kHead + variables + "minimize: rank\nmaximize: rank\n").size(), 1u);
  EXPECT_THAT(faults_of("schema: grapnel-study/1\nname: x\n"),
              ElementsAre(EndsWith("this is a study file where an optimization is expected")));
}

TEST(ReadOptimization, LoadsAreStoredOnlyIfLimited) {
  const test::Folder folder;
  const std::string head = "name: x\nscenario: " GRAPNEL_SOURCE_DIR
                           "/scenarios/thesis/closed-loop.yaml\n"
                           "variables: [{path: approach.duration, from: 10, to: 20}]\n";
  const Optimization with = load_optimization(folder.write(
      "with.yaml", head + "minimize: loads/tip-1/force\n"
                          "limits: [{column: loads/*/driving, at_most: 5}, {column: rank, at_least: 1}]\n"));
  EXPECT_EQ(detail_of(with.columns), CaptureDetail::columns_and_loads);
  ASSERT_EQ(with.objective.size(), 1u);
  std::size_t loads = 0;
  ASSERT_EQ(with.objective[0].measured.columns.size(), 1u);
  EXPECT_EQ(with.columns.at(with.objective[0].measured.columns[0]).name, "loads/tip-1/force");
  for (const std::size_t c : with.limits.at(0).measured.columns) {
    const std::string& name = with.columns.at(c).name;
    EXPECT_TRUE(name.starts_with("loads/") && name.find("/driving") != std::string::npos) << name;
    ++loads;
  }
  EXPECT_GE(loads, 6u);
  EXPECT_EQ(with.columns.at(with.limits.at(1).measured.columns.at(0)).name, "rank");
  EXPECT_EQ(with.columns.back().name, feasibility_column().name);
  const Optimization without = load_optimization(folder.write("without.yaml", head + "minimize: rank\n"));
  EXPECT_EQ(detail_of(without.columns), CaptureDetail::columns);
}

TEST(ReadOptimization, LimitsMayHaveUnits) {
  const test::Folder folder;
  const std::string variables = "variables: [{path: approach.duration, from: 10, to: 20}]\n";
  const Optimization o = load_optimization(
      folder.write("o.yaml", kHead + variables +
                                 "minimize: grasps/*/impulse_magnitude\n"
                                 "limits: [{column: base/angular_velocity_change, at_most: 0.5 deg/s},\n"
                                 "         {column: grasps/*/impulse_magnitude, at_least: 2 mN s}]\n"));
  EXPECT_EQ(o.limits.at(0).bound, 0.0087266462599716477);
  EXPECT_EQ(o.limits.at(1).bound, 0.002);
  EXPECT_THAT(faults_of(kHead + variables +
                        "minimize: grasps/*/impulse_magnitude\n"
                        "limits: [{column: rank, at_most: 3 m},\n"
                        "         {column: grasps/*/mean_force, at_most: 2 N s},\n"
                        "         {column: grasps/*/mean_force, at_most: 2 kgs}]\n"),
              ElementsAre(HasSubstr("error: limits[0].at_most must be a number without unit, not '3 m'"),
                          HasSubstr("error: limits[1].at_most is '2 N s', an impulse; expected a force [N"),
                          HasSubstr("error: limits[2].at_most")));
}

TEST(ReadOptimization, SeveralColumnsAreTakenByTheWorstOrAsAVector) {
  const test::Folder folder;
  const Optimization o = load_optimization(folder.write(
      "o.yaml", kHead + "maximize:\n  - {column: grasps/*/relative_speed}\n"
                        "  - {column: base/angular_velocity_change, weight: -2}\n"
                        "  - {column: grasps/*/mean_force, weight: -1}\n"
                        "limits: [{column: joints/*/driving_impulse, combine: largest_magnitude, at_most: 3}]\n"
                        "variables: [{path: approach.duration, from: 10, to: 20}]\n"));
  ASSERT_EQ(o.objective.size(), 3u);
  EXPECT_EQ(o.objective[0].measured.combine, Combine::least);
  EXPECT_EQ(o.objective[1].measured.combine, Combine::norm);
  EXPECT_EQ(o.objective[1].weight, -2);
  EXPECT_EQ(o.objective[2].measured.combine, Combine::largest);
  EXPECT_EQ(o.limits[0].text(), "largest_magnitude of joints/*/driving_impulse at most 3");
  EXPECT_EQ(o.limits[0].measured.columns.size(), 6u);
  EXPECT_EQ(o.search.evaluations, 200u);
  EXPECT_TRUE(o.feasible);
}

}  // namespace read_optimization_test
}  // namespace grapnel
