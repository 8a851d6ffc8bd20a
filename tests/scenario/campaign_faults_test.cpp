#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/campaign/study_files.hpp"
#include "scenario/scenario_files.hpp"
#include "support/fault_texts.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace campaign_faults_test {

using testing::ElementsAre;
using testing::HasSubstr;

// Messages of all errors, without the folder.
std::vector<std::string> faults_of(const std::string& text) {
  const test::TemporaryFolder folder;
  return test::faults_of_loading(folder.write("campaign.yaml", text), [](const auto& file) { load_campaign(file); });
}

// Lines 1 to 4 of a campaign.
std::string head(const std::string& scenario = "scenarios/thesis/open-loop-case-1-planned.yaml") {
  return std::string("name: test\nscenario: ") + GRAPNEL_SOURCE_DIR "/" + scenario + "\ncases: 1000\nuncertain:\n";
}
const std::string kMass = "  - {path: targets.target-1.mass, as: factor, uniform: {from: 0.8, to: 1.2}}\n";

// Expects this error for one uncertain value, in line 5.
void expect(const std::string& entry, const std::string& fault) {
  EXPECT_THAT(faults_of(head() + "  - " + entry + "\n"), ElementsAre(HasSubstr(fault))) << entry;
}

TEST(CampaignFaults, OfTheStructureAllAtOnce) {
  const auto faults = faults_of(
      "nam: test\n"
      "scenario: nowhere.yaml\n"
      "cases: 0\n"
      "sampling: latin\n"
      "seed: -1\n"
      "uncertain:\n"
      "  - {path: targets.target-1.mass}\n"
      "  - {path: targets.target-1.mass, uniform: {from: 1}}\n"
      "  - {path: targets.target-1.mass, uniform: {from: 1, to: 2}, normal: {mean: 1, deviation: 1}}\n"
      "  - {path: targets.target-1.mass, normal: {mean: 1, deviation: -1}}\n"
      "keep: {series: {worst: {count: 3}}}\n");
  const auto has = [&](const std::string& text) { EXPECT_THAT(faults, testing::Contains(HasSubstr(text))); };
  has("campaign.yaml:1:1: error: unknown key 'nam' in the campaign; did you mean 'name'?");
  has("campaign.yaml:2:11: error: ");  // nowhere.yaml
  has("campaign.yaml:3:8: error: cases is 0, must be between 1 and 1000000000");
  has("campaign.yaml:4:11: error: unknown value 'latin' for sampling");
  has("campaign.yaml:5:7: error: seed is -1, must be between 0 and");
  has("campaign.yaml:7:5: error: missing key in uncertain[0]: give 'normal', 'log_normal', 'uniform'");
  has("missing key 'to' in uncertain[1].uniform");
  has("uncertain[2] has both 'uniform' and 'normal', only one is allowed");
  has("uncertain[3].normal.deviation is -1, must be at least 0");
  has("missing key 'by' in keep.series.worst");
}

TEST(CampaignFaults, OfOneUncertainValue) {
  expect("{path: targets.target-9.mass, uniform: {from: 1, to: 2}}",
         "campaign.yaml:5:12: error: no item 'target-9' in targets; did you mean 'target-1'?");
  expect("{path: targets.target-1.mas, uniform: {from: 1, to: 2}}",
         "unknown key 'mas' in targets[0]; did you mean 'mass'?");
  expect("{path: targets.target-1.mass, normal: {mean: 10, deviation: 9}}",
         "campaign.yaml:5:12: error: uncertain[0], at probability 0.0005: targets[0].mass is -19.6");
  expect("{path: targets.target-1.mass, normal: {deviation: 1}}", "uncertain[0]: normal needs a 'mean'");
  expect("{path: targets.target-1.mass, uniform: {from: 2, to: 1}}", "uncertain[0]: uniform.from is 2, above to, 1");
  expect("{path: targets.target-1.mass, normal: {mean: 10, deviation: 1, from: 12, to: 11}}",
         "uncertain[0]: normal.from is 12, must be less than to, 11");
  expect("{path: targets.target-1.mass, log_normal: {median: -1, deviation: 1}}",
         "uncertain[0]: log_normal.median is -1, must be greater than 0");
  expect("{path: targets.target-1.mass, uniform: {from: 10, to: 10}}", "uncertain[0]: no component is uncertain");
  expect("{path: targets.target-1.com, as: offset, normal: {deviation: [1, 1]}}",
         "uncertain[0]: normal.deviation has 2 items, must have 3, one for each number at targets.target-1.com");
  expect("{path: targets.target-1.com, as: factor, normal: {deviation: 0.1}}",
         "uncertain[0]: the value at targets.target-1.com is 0, which a factor does not change");
  expect("{path: targets.target-1.geometry, as: factor, normal: {deviation: 0.1}}",
         "uncertain[0]: the scenario has a mapping at targets.target-1.geometry, not a number");
  expect(
      "{path: approach.tracking.noise.seed, as: offset, normal: {deviation: 0.1}}",
      "uncertain[0]: factor, offset and tilt require a value at approach.tracking.noise.seed, which the scenario does "
      "not have");
  expect("{path: targets.target-1.mass, as: factor, integers: {from: 1, to: 2}}",
         "uncertain[0]: integers are values, not factors or offsets");
  expect("{path: targets.target-1.mass, integers: {from: 3, to: 2}}", "uncertain[0]: integers.from is 3, must be less");
}

TEST(CampaignFaults, OfVectorsAndOrientations) {
  expect("{path: targets.target-1.mass, sphere: {length: 1}}",
         "uncertain[0]: sphere requires a vector, a list of 3 numbers; at targets.target-1.mass there is one number");
  expect("{path: targets.target-1.state.velocity, tilt: {deviation: 0.1}}",
         "uncertain[0]: the vector at targets.target-1.state.velocity is zero");
  expect("{path: targets.target-1.state.angular_velocity, tilt: {}}", "uncertain[0]: no component is uncertain");
  expect("{path: targets.target-1.state.angular_velocity, as: factor, tilt: {deviation: 0.1}}",
         "uncertain[0]: 'as' has no meaning with tilt");
  expect("{path: targets.target-1.state.angular_velocity, sphere: {length: {uniform: {from: 2, to: 1}}}}",
         "uncertain[0]: sphere.length.uniform.from is 2, must be less than to, 1");
  const auto rotation = [](const std::string& path, const std::string& what) {
    expect("{path: " + path + ", rotation: uniform}",
           "campaign.yaml:5:12: error: uncertain[0]: rotation requires an orientation, a 'quaternion_wxyz' or 'rpy', "
           "not " +
               what + " at " + path + "; use the path of the mapping, such as targets.NAME.state");
  };
  rotation("targets.target-1.mass", "the number 10");
  rotation("targets.target-1.state.angular_velocity", "a list");
  rotation("contact", "a mapping");
  expect("{path: targets.target-1.stat, rotation: uniform}", "unknown key 'stat' in targets[0]; did you mean 'state'?");
}

TEST(CampaignFaults, OfMisspeltPaths) {
  for (const std::string what : {"as: factor, uniform: {from: 0.9, to: 1.1}", "as: offset, normal: {deviation: 0.1}",
                                 "uniform: {from: 9, to: 11}", "tilt: {deviation: 0.1}"}) {
    const auto misspelt = [&](const std::string& path, const std::string& fault) {
      expect("{path: " + path + ", " + what + "}", "campaign.yaml:5:12: error: uncertain[0]: " + fault);
    };
    misspelt("targets.target-1.masss", "unknown key 'masss' in targets[0]; did you mean 'mass'?");
    misspelt("target.target-1.mass", "unknown key 'target' in the scenario; did you mean 'targets'?");
    misspelt("approach.trackin.kp", "unknown key 'trackin' in approach; did you mean 'tracking'?");
    misspelt("robot.base.mas", "unknown key 'mas' in robot.base; did you mean 'mass'?");
  }
  // A valid path without a value in the scenario is not reported as a misspelling.
  expect("{path: initial.base.velocity, as: offset, normal: {deviation: 0.1}}",
         "factor, offset and tilt require a value at initial.base.velocity, which the scenario does not have");
  expect("{path: targets.target-1.inertia.zz, as: factor, uniform: {from: 0.9, to: 1.1}}",
         "campaign.yaml:5:12: error: no item 'zz' in targets.target-1.inertia, a list whose items have no names: they "
         "are [0] to [2]");
}

TEST(CampaignFaults, OfIntervalsWithoutProbability) {
  const auto factor = [](const std::string& distribution) {
    return "{path: targets.target-1.mass, as: factor, " + distribution + "}";
  };
  expect(factor("normal: {deviation: 0.01, from: 2, to: 3}"),
         "uncertain[0]: normal.from is 2, 100 deviations above the mean, 1; beyond about 37 the probability is zero in "
         "double precision: correct the interval or the mean, or use uniform");
  expect(factor("normal: {deviation: 0.01, to: 0.5}"), "normal.to is 0.5, 50 deviations below the mean, 1; beyond");
  expect(factor("log_normal: {deviation: 0.01, from: 2, to: 3}"),
         "log_normal.from is 2, 69.31 deviations above the median, 1; beyond");
  expect(factor("log_normal: {deviation: 1, to: 0}"), "log_normal.to is 0, must be greater than 0");
  expect(factor("normal: {deviation: 1e3, from: 1, to: 1.00000001}"),
         "normal.from is 1 and to 1.00000001, too close to each other for the deviation 1000; use uniform");
  expect(factor("normal: {mean: 1, deviation: 0, from: 2, to: 3}"),
         "normal.mean is 1 and its deviation 0, which is not between 2 and 3");
  expect("{path: targets.target-1.state.velocity, sphere: {length: {normal: {mean: 1, deviation: 0.01, from: 2}}}}",
         "sphere.length.normal.from is 2, 100 deviations above the mean, 1; beyond");
  // A remote interval with nonzero probability is accepted.
  EXPECT_THAT(faults_of(head() + "  - " + factor("normal: {deviation: 0.01, from: 1.36, to: 3}") + "\n"),
              ElementsAre());
}

TEST(CampaignFaults, OfLengthsBelowZero) {
  const auto length = [](const std::string& given) {
    return "{path: targets.target-1.state.velocity, sphere: {length: " + given + "}}";
  };
  expect(length("-1"), "campaign.yaml:5:62: error: uncertain[0]: sphere.length is -1, must be at least 0");
  expect(length("{uniform: {from: -0.1, to: 0.1}}"), "sphere.length.uniform.from is -0.1, must be at least 0");
  expect(length("{normal: {mean: 0.1, deviation: 0.1, from: -0.1}}"), "sphere.length.normal.from is -0.1, must be at");
  expect(length("{normal: {mean: -0.1, deviation: 0}}"), "sphere.length.normal.mean is -0.1, must be at least 0");
  const std::string message =
      "sphere.length.normal has mean 0.1 and deviation 0.02, which gives lengths below 0; add from: 0";
  expect(length("{normal: {mean: 0.1, deviation: 0.02}}"), message);
  expect(length("{normal: {mean: 0.1, deviation: 0.02, to: 0.2}}"), message);
  for (const std::string well :
       {"0.1", "{normal: {mean: 0.1, deviation: 0.01}}", "{uniform: {from: 0, to: 0.1}}",
        "{normal: {mean: 0.1, deviation: 0.1, from: 0}}", "{log_normal: {median: 0.1, deviation: 2, to: 0.2}}"})
    EXPECT_THAT(faults_of(head() + "  - " + length(well) + "\n"), ElementsAre()) << well;
}

TEST(CampaignFaults, OfChoicesAndCovariances) {
  expect("{path: targets.target-1.mass, discrete: {values: [10, 11, -12]}}",
         "campaign.yaml:5:63: error: uncertain[0], at probability 0.833333: targets[0].mass is -12, must be greater "
         "than 0");
  expect("{path: targets.target-1.mass, discrete: {values: [10, 11], weights: [1]}}",
         "uncertain[0]: discrete.weights has 1 item, must have 2, one for each value");
  expect("{path: targets.target-1.mass, discrete: {values: [10, 11], weights: [0, 0]}}",
         "uncertain[0]: discrete.weights must have a sum greater than 0");
  const std::string both = "{paths: [targets.target-1.mass, targets.target-2.mass], as: offset, ";
  expect(both + "uniform: {from: 1, to: 2}}", "uncertain[0]: several 'paths' are for normal with a 'covariance'");
  expect(both + "normal: {covariance: [[1, 0]]}}", "uncertain[0]: normal.covariance must be 2 by 2");
  expect(both + "normal: {covariance: [[1, 0.1], [0.2, 1]]}}",
         "uncertain[0]: normal.covariance[1][0] is 0.2, but [0][1] is 0.1; a covariance is symmetric");
  expect(both + "normal: {covariance: [[1, 1.5], [1.5, 1]]}}",
         "uncertain[0]: normal.covariance is indefinite: [1][0] is 1.5, at most 1 is possible");
}

TEST(CampaignFaults, TwiceTheSamePlace) {
  EXPECT_THAT(faults_of(head() + kMass + kMass),
              ElementsAre(HasSubstr("campaign.yaml:6:12: error: uncertain[1] and uncertain[0] both draw "
                                    "targets.target-1.mass")));
  EXPECT_THAT(faults_of(head() + "  - {path: targets.target-1.inertia, as: factor, uniform: {from: 0.9, to: 1}}\n"
                                 "  - {path: 'targets.target-1.inertia[0]', uniform: {from: 0.9, to: 1}}\n"),
              ElementsAre(HasSubstr("uncertain[1] draws targets.target-1.inertia[0], and uncertain[0] draws "
                                    "targets.target-1.inertia, which contains it")));
}

// Paths by index and by name denote the same value.
TEST(CampaignFaults, TwiceTheSamePlaceByOtherNames) {
  EXPECT_THAT(
      faults_of(head() + kMass + "  - {path: 'targets[0].mass', uniform: {from: 9, to: 11}}\n"),
      ElementsAre(HasSubstr("campaign.yaml:6:12: error: uncertain[1] and uncertain[0] both draw targets[0].mass, "
                            "also named targets.target-1.mass")));
  const std::string part = "  - {path: 'targets[0].state.angular_velocity[2]', uniform: {from: 0.1, to: 0.2}}\n",
                    whole = "  - {path: targets.target-1.state.angular_velocity, tilt: {deviation: 0.1}}\n";
  EXPECT_THAT(faults_of(head() + whole + part),
              ElementsAre(HasSubstr("uncertain[1] draws targets[0].state.angular_velocity[2], and uncertain[0] draws "
                                    "targets.target-1.state.angular_velocity, which contains it")));
  EXPECT_THAT(
      faults_of(head() + part + whole),
      ElementsAre(HasSubstr("uncertain[1] draws targets.target-1.state.angular_velocity, and uncertain[0] draws "
                            "targets[0].state.angular_velocity[2], a part of it")));
  EXPECT_THAT(faults_of(head() + "  - {path: 'targets[1].state', rotation: uniform}\n"
                                 "  - {path: targets.target-2.state.quaternion_wxyz, discrete: {values: [[1, 0, 0, "
                                 "0]]}}\n"),
              ElementsAre(HasSubstr(", also named targets[1].state.quaternion_wxyz")));
  EXPECT_THAT(faults_of(head() + "  - {paths: [targets.target-1.mass, 'targets[0].mass'], as: offset, normal: "
                                 "{covariance: [[1, 0], [0, 1]]}}\n"),
              ElementsAre(HasSubstr("uncertain[0] draws targets[0].mass twice, also named targets.target-1.mass")));
  EXPECT_THAT(faults_of(head() + kMass + "  - {path: 'targets[1].mass', uniform: {from: 9, to: 11}}\n"), ElementsAre());
}

TEST(CampaignFaults, OfConditionsAndColumns) {
  const auto faults = faults_of(head() + kMass +
                                "success:\n"
                                "  - captured and grasps/tip-1/impulse_magnitud < 1\n"
                                "  - {name: a, holds: 'captured and'}\n"
                                "keep: {columns: [bas], series: {worst: {count: 1, by: capture}}}\n"
                                "quantiles: [0.5, 0.1]\n");
  const auto has = [&](const std::string& text) { EXPECT_THAT(faults, testing::Contains(HasSubstr(text))); };
  has("campaign.yaml:7:18: error: success: ");
  has("campaign.yaml:8:");
  has("no column 'bas'");
  has("no column 'capture' for keep.series.worst.by; did you mean 'captured'?");
  has("campaign.yaml:10:18: error: quantiles[1] is 0.1, must be greater than the previous 0.5");
}

TEST(CampaignFaults, OfTheDesign) {
  const auto faults = faults_of(head() + kMass +
                                "design:\n"
                                "  - {quantity: relative_sped, values: [1]}\n");
  EXPECT_THAT(faults, ElementsAre(HasSubstr("did you mean 'relative_speed'?")));
  const auto values = faults_of(head() + kMass +
                                "design:\n"
                                "  - {path: targets.target-2.mass, values: [1, -1]}\n"
                                "  - {name: a, values: [{label: x, scenario: other.yaml}]}\n");
  EXPECT_THAT(values, testing::UnorderedElementsAre(
                          HasSubstr("design[1] names a scenario; all cases of a campaign use one"),
                          HasSubstr("campaign.yaml:7:47: error: targets[1].mass is -1, must be greater than 0")));
}

// Design axes whose values have no effect.
TEST(CampaignFaults, OfADesignWithoutEffect) {
  const auto with = [](const std::string& uncertain, const std::string& design) {
    return faults_of("plan: per_case\n" + head() + "  - " + uncertain + "\ndesign:\n" + design);
  };
  const std::string value = "{path: targets.target-1.state.angular_velocity, sphere: {length: 0.1}}",
                    part = "  - {path: 'targets[0].state.angular_velocity[2]', values: [0, 0.1]}\n",
                    labelled =
                        "  - {name: a, values: [{label: x, set: {'targets[0].state.angular_velocity': [0, 0, 1]}}, "
                        "{label: y, set: {'targets[0].state.angular_velocity[0]': 1}}]}\n",
                    message = " draws another value in its place for every case; draw it as: factor or as: offset";
  EXPECT_THAT(
      with(value, part),
      ElementsAre(HasSubstr("campaign.yaml:8:5: error: design[0] varies 'targets[0].state.angular_velocity[2]', but "
                            "uncertain[0]" +
                            message)));
  EXPECT_THAT(with(value, labelled), ElementsAre(HasSubstr("design[0] varies 'a', but uncertain[0]" + message)));
  EXPECT_THAT(with("{path: targets.target-1.mass, uniform: {from: 9, to: 11}}",
                   "  - {path: 'targets[0].mass', from: 8, to: 12, count: " +
                       std::string(test::kSanitized ? "10000" : "1000000") + "}\n"),
              ElementsAre(HasSubstr(message)));
  // Accepted: a factor of the design value, one component of a design vector, and a nominal plan for each design value.
  EXPECT_THAT(with("{path: targets.target-1.mass, as: factor, uniform: {from: 0.9, to: 1.1}}",
                   "  - {path: 'targets[0].mass', values: [9, 10]}\n"),
              ElementsAre());
  EXPECT_THAT(with("{path: 'targets[0].state.angular_velocity[2]', uniform: {from: 0, to: 1}}",
                   "  - {path: targets.target-1.state.angular_velocity, values: [[0, 0, 0], [0.1, 0, 0]]}\n"),
              ElementsAre());
  EXPECT_THAT(faults_of(head() + "  - {path: targets.target-1.mass, uniform: {from: 9, to: 11}}\n" +
                        "design:\n  - {path: 'targets[0].mass', values: [9, 10]}\n"),
              ElementsAre());
}

TEST(CampaignFaults, OfADesignTwiceTheSamePlace) {
  const auto axes = [](const std::string& first, const std::string& second) {
    return faults_of(head() + "  - {path: targets.target-2.mass, uniform: {from: 9, to: 11}}\ndesign:\n  - {path: '" +
                     first + "}\n  - {path: '" + second + "}\n");
  };
  const std::string whole = "targets.target-1.state.angular_velocity', values: [[0, 0, 0], [0, 0, 0.1]]",
                    part = "targets[0].state.angular_velocity[0]', values: [0, 0.1]";
  EXPECT_THAT(
      axes("targets[0].mass', values: [9, 10]", "targets.target-1.mass', values: [9, 10]"),
      ElementsAre(HasSubstr("campaign.yaml:8:5: error: design[1] and design[0] both vary targets.target-1.mass, "
                            "also named targets[0].mass")));
  EXPECT_THAT(axes(part, whole),
              ElementsAre(HasSubstr("design[1] varies targets.target-1.state.angular_velocity, and design[0] varies "
                                    "targets[0].state.angular_velocity[0], a part of it")));
  EXPECT_THAT(axes(whole, part), ElementsAre());
}

TEST(CampaignFaults, OfThePlan) {
  EXPECT_THAT(
      faults_of("set: {approach.plan.starts: 1, targets.target-1.state.position: [9, 0, 0]}\n" + head() + kMass),
      ElementsAre(HasSubstr("plan: nominal: planning the approach")));
}

TEST(CampaignFaults, AnotherKindOfFile) {
  EXPECT_THAT(faults_of("schema: grapnel-study/1\nname: x\n"),
              ElementsAre(HasSubstr("this is a study file where a campaign is expected")));
}

}  // namespace campaign_faults_test
}  // namespace grapnel
