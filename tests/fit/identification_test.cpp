// Identification files: errors with their places, the result folder, and combinations of parameters of a capture that
// no log determines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "fit/slider_experiment.hpp"
#include "grapnel/compare/comparison_report.hpp"
#include "grapnel/compare/identification.hpp"
#include "grapnel/compare/identification_folder.hpp"
#include "grapnel/compare/identification_report.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace identification_test {

using testing::ElementsAre;
using testing::HasSubstr;

class IdentifySlider : public testing::Test {
 protected:
  void SetUp() override {
    scenario_ = folder_.write("slider.yaml", test::kSlider);
    folder_.write("map.yaml", test::kSliderMap);
    folder_.write("log.csv", test::slider_log(scenario_, {{"targets.block.mass", "5"}}, 1));
  }
  std::filesystem::path study(const std::string& parameters, const std::string& logs) const {
    return folder_.write("study.yaml",
                         "schema: grapnel-identification/1\nname: slider\nscenario: slider.yaml\nparameters:\n" +
                             parameters + "logs:\n" + logs);
  }
  std::vector<std::string> faults(const std::string& parameters, const std::string& logs) const {
    return test::faults_of_loading(study(parameters, logs), [](const auto& file) { load_identification(file); });
  }

  test::ExperimentFolder folder_;
  std::filesystem::path scenario_;
};

const std::string kMass = "  - {path: targets.block.mass, from: 2 kg, to: 8 kg}\n";
const std::string kFriction =
    "  - {path: robot.links.platform.joint.friction.coulomb, name: friction, from: 0.01, to: 0.2, scale: "
    "logarithmic}\n";
const std::string kLog = "  - {log: log.csv, map: map.yaml}\n";

TEST_F(IdentifySlider, FaultsComeWithPlacesAndSuggestions) {
  EXPECT_THAT(faults("  - {path: targets.block.masss, from: 2, to: 8}\n"
                     "  - {path: targets.block.mass, from: 8, to: 2}\n"
                     "  - {path: post_impact.duration, from: 0, to: 2, scale: logarithmic}\n"
                     "  - {path: targets.block.mass, name: again, from: 2, to: 8, start: 9}\n",
                     "  - {log: a.csv, map: map.yaml, name: ../a}\n"),
              ElementsAre(HasSubstr("study.yaml:5:12: error: "),
                          HasSubstr("study.yaml:6:38: error: parameters[1]: 'from' must be less than 'to'"),
                          HasSubstr("study.yaml:7:40: error: parameters[2].from is 0, must be greater than 0"),
                          HasSubstr("study.yaml:8:5: error: parameters[3] has the path of parameters[1]"),
                          HasSubstr("study.yaml:8:68: error: parameters[3].start is 9, must be between"),
                          HasSubstr("study.yaml:10:39: error: logs[0]: the name '../a' must have letters")));
  EXPECT_THAT(faults("  - {pathh: targets.block.mass, from: 2, to: 8}\n", kLog),
              testing::Contains(HasSubstr("did you mean 'path'?")));
  EXPECT_THAT(faults("  - {path: targets.block.mass, from: 2 s, to: 8}\n", kLog),
              ElementsAre(HasSubstr("study.yaml:5:38: error: ")));
  // A bound that the scenario rejects.
  EXPECT_THAT(faults("  - {path: targets.block.mass, from: -2, to: 8}\n", kLog),
              ElementsAre(HasSubstr("study.yaml:5:38: error: ")));
}

TEST_F(IdentifySlider, UnusableLogsAreErrors) {
  EXPECT_THAT(faults(kMass, "  - {log: none.csv, map: map.yaml}\n"), ElementsAre(HasSubstr("none.csv")));
  folder_.write("bad.csv", "t,x\n0,1\n1,abc\n2,3\n3,4\n");
  EXPECT_THAT(faults(kMass, "  - {log: bad.csv, map: map.yaml}\n"), ElementsAre(HasSubstr("bad.csv:3:3: error:")));
  folder_.write("other.yaml", "quantities:\n  - {run: joints/position/rial, log: x}\n");
  EXPECT_THAT(faults(kMass, "  - {log: log.csv, map: other.yaml}\n"),
              testing::Contains(HasSubstr("other.yaml:2:11: error: the run has no series 'joints/position/rial'; did "
                                          "you mean 'joints/position/rail'?")));
  folder_.write("unweighted.yaml", "time: {column: t}\nquantities:\n  - {run: joints/position/rail, log: x}\n");
  EXPECT_THAT(
      faults(kMass, "  - {log: log.csv, map: unweighted.yaml}\n"),
      ElementsAre(HasSubstr("study.yaml:7:25: error: logs[0]: no quantity of the mapping has an 'uncertainty'")));
  EXPECT_THAT(
      faults(kMass, "  - {log: log.csv, map: map.yaml, free_bias: [rali]}\n"),
      ElementsAre(HasSubstr("study.yaml:7:47: error: the mapping has no quantity 'rali'; did you mean 'rail'?")));
}

TEST_F(IdentifySlider, WritesTheFittedScenario) {
  folder_.write(
      "second.csv",
      test::slider_log(scenario_, {{"targets.block.mass", "5"}, {"targets.block.state.velocity", "[-0.3, 0, 0]"}}, 2));
  const Identification identification = load_identification(
      study(kMass + kFriction,
            kLog + "  - {log: second.csv, map: map.yaml, set: {\"targets.block.state.velocity\": [-0.3, 0, 0]}}\n"));
  Listener listener;
  const std::filesystem::path out = folder_.path() / "out";
  std::filesystem::create_directories(out);
  ASSERT_EQ(run_identification_folder(identification, out, {.threads = 2, .quiet = true, .no_report = true}, listener),
            Ending::done);
  const auto document = read_json_document(out / "identification.json", "grapnel-identification-result/1");
  EXPECT_EQ(document["agrees"], "yes");
  EXPECT_EQ(document["parameters"][0]["status"], "identified");
  const double mass = document["parameters"][0]["value"], deviation = document["parameters"][0]["uncertainty"];
  EXPECT_NEAR(mass, 5, 4 * deviation);
  EXPECT_LT(deviation, 0.1);  // measured 0.01
  const double friction = document["parameters"][1]["value"];
  EXPECT_NEAR(friction, 0.05, 0.005);
  EXPECT_EQ(document["covariance"].size(), 2u);
  for (const auto& log : document["logs"]) EXPECT_EQ(log["left_out"]["chi_square"]["agrees"], true);
  const CaptureProblem fitted = load_scenario(out / "fitted.yaml");
  EXPECT_EQ(fitted.targets[0].mass, mass);
  EXPECT_EQ(fitted.robot.bodies.size(), load_scenario(scenario_).robot.bodies.size());
  EXPECT_TRUE(std::filesystem::exists(out / "evaluations.csv"));
  for (const char* log : {"log", "second"})
    EXPECT_EQ(read_json_document(out / "logs" / log / "comparison.json", "grapnel-log-comparison/1")["agrees"], "yes");
}

// A listener that requests a stop after some evaluations.
struct Stopper : Listener {
  std::stop_source source;
  std::uint64_t after = 2;
  void points(const CaseProgress& at) override {
    if (at.done >= after) source.request_stop();
  }
};

TEST_F(IdentifySlider, AStopKeepsTheBestValues) {
  const Identification identification = load_identification(study(kMass + kFriction, kLog));
  Stopper stopper;
  const std::filesystem::path out = folder_.path() / "out";
  std::filesystem::create_directories(out);
  const FolderOptions options{.threads = 2, .no_report = true, .stop = stopper.source.get_token()};
  EXPECT_EQ(run_identification_folder(identification, out, options, stopper), Ending::interrupted);
  EXPECT_FALSE(std::filesystem::exists(out / "identification.json"));
  EXPECT_NEAR(load_scenario(out / "fitted.yaml").targets[0].mass, 5, 0.5);
  const std::string csv = file_bytes(out / "evaluations.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3) << csv;
}

TEST_F(IdentifySlider, MassFrictionAndSpeedAreNotIdentifiableTogether) {
  const Identification identification = load_identification(
      study(kMass + kFriction + "  - {path: \"targets.block.state.velocity[0]\", name: speed, from: -0.4, to: -0.1}\n",
            kLog));
  const LogFit fit = fit_logs(identification.problem, {.threads = 2});
  EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
  ASSERT_EQ(fit.combinations.size(), 3u);
  EXPECT_TRUE(fit.combinations[1].is_identifiable);
  EXPECT_FALSE(fit.combinations[2].is_identifiable);
  for (const ParameterEstimate& one : fit.parameters) EXPECT_EQ(one.status, ParameterStatus::not_identifiable);
  // m v / (M + m) and F / (M + m) are constant along it: d ln(v) = -dm M / (m (M + m)), d ln(F) = dm / (M + m).
  const double m = fit.best[0], M = 10;
  const std::vector<double>& v = fit.combinations[2].direction;
  const double dm = 6 * v[0], relative_friction = std::log(0.2 / 0.01) * v[1], dv = 0.3 * v[2];
  EXPECT_NEAR(relative_friction / dm, 1 / (M + m), 0.05 / (M + m));
  EXPECT_NEAR(dv / fit.best[2] / dm, -M / (m * (M + m)), 0.05 * M / (m * (M + m)));
  const std::string text = identification_text(identification_report(identification, fit, "1"));
  EXPECT_THAT(text, HasSubstr("not identifiable (in units of the ranges): "));
}

TEST_F(IdentifySlider, UnmodelledFrictionIsRejected) {
  const Identification identification = load_identification(
      folder_.write("study.yaml",
                    "name: slider\nscenario: slider.yaml\nset: {robot.links.platform.joint.friction.coulomb: 0}\n"
                    "parameters:\n" +
                        kMass + "logs:\n" + kLog));
  const LogFit fit = fit_logs(identification.problem, {.threads = 2});
  EXPECT_EQ(fit.agrees, Verdict::no);
  EXPECT_GT(fit.chi_square.per_number(), 5 * fit.chi_square.bound) << fit.chi_square.per_number();
  EXPECT_FALSE(fit.parameters[0].interval);
}

}  // namespace identification_test
}  // namespace grapnel
