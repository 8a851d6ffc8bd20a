#include "grapnel/campaign/study_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "campaign/study_case.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/fault_texts.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace read_study_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

// The messages of all errors, without the folder.
std::vector<std::string> faults_of(const std::string& text) {
  const test::Folder folder;
  return test::faults_of_loading(folder.write("study.yaml", text), [](const auto& file) { load_study(file); });
}

std::string scenario() { return test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml"); }

TEST(ReadStudy, EveryFaultOfTheStructureAtOnce) {
  const auto faults = faults_of(
      "name: bad\n"
      "scenaro: " +
      scenario() +
      "\n"
      "simulate: impakt\n"
      "axes:\n"
      "  - {quantity: relative_sped, values: [1]}\n"
      "  - {path: targets.target-1.mass, from: 1, count: 1}\n"
      "  - {path: targets.target-1.mass, quantity: mass_ratio, values: [1]}\n"
      "  - {quantity: mass_ratio, unit: deg, values: [1, two]}\n"
      "  - {name: case, values: [{lable: a, set: {}}]}\n");
  const auto has = [&](const std::string& text) { EXPECT_THAT(faults, Contains(HasSubstr(text))); };
  has("study.yaml:2:1: error: unknown key 'scenaro' in the study; did you mean 'scenario'?");
  has("study.yaml:3:11: error: unknown value 'impakt' for simulate; did you mean 'impact'?");
  has("study.yaml:5:16: error: unknown value 'relative_sped' for axes[0].quantity; did you mean 'relative_speed'?");
  has("study.yaml:6:35: error: 'from' needs 'to' in axes[1]");
  has("study.yaml:6:51: error: axes[1].count is 1, must be between 2 and 1000000");
  has("study.yaml:7:35: error: axes[2] has both 'path' and 'quantity', only one is allowed");
  has("study.yaml:8:28: error: 'unit' in axes[3] has no meaning");
  has("study.yaml:8:51: error: axes[3].values[1] must be a number, not the text 'two'");
  has("study.yaml:9:28: error: unknown key 'lable' in axes[4].values[0]; did you mean 'label'?");
}

TEST(ReadStudy, EveryFaultOfTheValuesAtOnce) {
  const auto faults = faults_of(
      "name: bad\n"
      "scenario: " +
      scenario() +
      "\n"
      "set: {approach.durtion: 3}\n"
      "axes:\n"
      "  - {path: targets.target-9.mass, values: [1]}\n"
      "  - {path: targets.target-1.mass, values: [10, -3, 0]}\n"
      "  - {quantity: relative_speed, grasp: tip-3, values: [1]}\n"
      "  - {quantity: approach_angle, axis: [1, 1, 0], values: [1]}\n"
      "  - {name: case, values: [{label: a, scenario: nowhere.yaml}, {label: a}]}\n");
  const auto has = [&](const std::string& text) { EXPECT_THAT(faults, Contains(HasSubstr(text))); };
  has("study.yaml:8:38: error: axes[3].axis has length");
  has("study.yaml:9:48: error: ");  // nowhere.yaml
  has("duplicate label 'a' in axes[4]");
}

TEST(ReadStudy, ScenarioErrorsAreReportedAtTheirCauseInTheStudy) {
  const auto faults = faults_of(
      "name: bad\n"
      "scenario: " +
      scenario() +
      "\n"
      "set: {approach.durtion: 3}\n"
      "axes:\n"
      "  - {path: targets.target-9.mass, values: [1]}\n"
      "  - {path: targets.target-1.mass, values: [10, -3, 0]}\n");
  const auto has = [&](const std::string& text) { EXPECT_THAT(faults, Contains(HasSubstr(text))); };
  has("study.yaml:3:7: error: unknown key 'durtion' in approach; did you mean 'duration'?");
  has("study.yaml:5:12: error: no item 'target-9' in targets; did you mean 'target-1'?");
  has("study.yaml:6:48: error: targets[0].mass is -3, must be greater than 0 [kg]");
  has("study.yaml:6:52: error: targets[0].mass is 0, must be greater than 0 [kg]");
  EXPECT_EQ(faults.size(), 4u) << testing::PrintToString(faults);  // each once
}

TEST(ReadStudy, NamesOfQuantitiesAndColumnsAreChecked) {
  const auto faults = faults_of(
      "name: bad\n"
      "scenario: " +
      scenario() +
      "\n"
      "axes:\n"
      "  - {quantity: relative_speed, grasp: tip-3, values: [1]}\n"
      "  - {quantity: mass_ratio, target: target-1, values: [1, 0]}\n"
      "  - {quantity: mass_ratio, target: target-1, values: [2]}\n"
      "columns: [captured, grasps/tip-1/impulse_magnitud]\n");
  EXPECT_THAT(
      faults,
      ElementsAre(AllOf(HasSubstr("study.yaml:4:39: error: unknown grasp 'tip-3' in axes[0]; did you mean 'tip-1'?")),
                  HasSubstr("study.yaml:5:58: error: axes[1]: mass_ratio: must be greater than 0"),
                  HasSubstr("study.yaml:6:5: error: axes[2] varies 'target-1.mass_ratio', as axes[1] does"),
                  HasSubstr("study.yaml:7:21: error: no column 'grasps/tip-1/impulse_magnitud'; did you mean "
                            "'grasps/tip-1/impulse_magnitude'?")));
}

TEST(ReadStudy, AStudyNeedsAScenarioForEveryPoint) {
  EXPECT_THAT(faults_of("name: bad\naxes:\n  - {quantity: relative_speed, values: [1]}\n"),
              ElementsAre(HasSubstr("missing key 'scenario'")));
  EXPECT_THAT(faults_of("name: bad\nscenario: nowhere.yaml\naxes:\n  - {quantity: relative_speed, values: [1]}\n"),
              ElementsAre(HasSubstr("study.yaml:2:11: error: ")));
  EXPECT_THAT(faults_of("schema: grapnel-scenario/1\nname: bad\n"),
              ElementsAre(HasSubstr("where a study is expected")));
  EXPECT_THAT(faults_of(""), ElementsAre(HasSubstr("the file is empty")));
}

TEST(ReadStudy, TooManyPointsAreRefused) {
  EXPECT_THAT(faults_of("name: bad\nscenario: " + scenario() +
                        "\naxes:\n  - {path: approach.duration, from: 10, to: 20, count: 10000}\n"
                        "  - {quantity: relative_speed, from: 0, to: 1, count: 10000}\n"),
              ElementsAre(HasSubstr("the axes give 1e+08 points, the limit is 10000000")));
}

// Changes of files while a study runs have no effect on its points.
TEST(ReadStudy, FilesAreReadOnce) {
  const test::Folder folder;
  std::string text = test::read_bytes(scenario());
  text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
  folder.write("scenario.yaml", text);
  const Campaign study = load_study(folder.write(
      "study.yaml",
      "name: s\nscenario: scenario.yaml\naxes:\n  - {path: targets.target-1.mass, from: 1, to: 9, count: 9}\n"));
  folder.write("scenario.yaml", "nothing");
  EXPECT_EQ(study.problem(4).problem.targets[0].mass, 5);
}

TEST(ReadStudy, ShippedStudiesHaveNoFaults) {
  SKIP_UNDER_SANITIZERS();
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::shipped("studies"))) {
    SCOPED_TRACE(entry.path().string());
    if (entry.path().filename().string().starts_with("optimize-")) continue;  // grapnel-optimization files
    if (test::read_bytes(entry.path()).find("\nschema: grapnel-campaign/") != std::string::npos) continue;
    EXPECT_GT(load_study(entry.path()).total(), 1u);
    ++count;
  }
  EXPECT_GE(count, 5);
}

}  // namespace read_study_test
}  // namespace grapnel
