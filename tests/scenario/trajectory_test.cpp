// Approaches from CSV files: what they become, and every kind of fault in one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "grapnel/result/file_seal.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace trajectory_test {

using testing::ElementsAre;

// Starts where kSmallScenario does.
const char* const kMotion = R"(# measured on the test bed
time, elbow, shoulder

0, 1, 0.5
2.5, 0.75, 0.25
  # a pause
20, 0.5, 0.125
)";
const char* const kMotionWithRates =
    "time,shoulder,shoulder.rate,elbow,elbow.rate\n0,0.5,0.1,1,0.2\n20,0.25,0.3,0.5,0.4\n";

const Edit kPath = way("trajectory: motion.csv");
const Edit kNoDuration{"  duration: 20\n", ""};
const Edit kNoJoints{"  joints: {shoulder: 0.5, elbow: 1}", "  base: {}"};

class Trajectory : public testing::Test {
 protected:
  CaptureProblem load(const std::string& csv, const std::vector<Edit>& edits) const {
    folder_.write("motion.csv", csv);
    return load_scenario(folder_.write("scenario.yaml", edited(kSmallScenario, edits)));
  }
  std::vector<std::string> faults(const std::string& csv, const std::vector<Edit>& edits = {kPath}) const {
    folder_.write("motion.csv", csv);
    return faults_of_file(folder_.write("scenario.yaml", edited(kSmallScenario, edits)));
  }
  TemporaryFolder folder_;
};

TEST_F(Trajectory, PositionsInJointOrder) {
  const CaptureProblem p = load(kMotion, {kPath});
  const ApproachSetup& a = *p.approach;
  ASSERT_TRUE(a.sampled);
  EXPECT_THAT(a.sampled->times, ElementsAre(0, 2.5, 20));
  EXPECT_THAT(a.sampled->positions, ElementsAre(ElementsAre(0.5, 0.25, 0.125), ElementsAre(1, 0.75, 0.5)));
  EXPECT_TRUE(a.sampled->rates.empty());
  EXPECT_EQ(a.duration, 20);
  EXPECT_TRUE(a.final_position.empty());
  EXPECT_FALSE(a.plan);
  EXPECT_FALSE(a.match);
  EXPECT_FALSE(a.final_rates);
  EXPECT_THAT(p.joint_position, ElementsAre(0.5, 1));
  EXPECT_TRUE(p.joint_rate.empty());
}

TEST_F(Trajectory, WithRates) {
  const CaptureProblem p = load(kMotionWithRates, {kPath});
  EXPECT_THAT(p.approach->sampled->positions, ElementsAre(ElementsAre(0.5, 0.25), ElementsAre(1, 0.5)));
  EXPECT_THAT(p.approach->sampled->rates, ElementsAre(ElementsAre(0.1, 0.3), ElementsAre(0.2, 0.4)));
  EXPECT_THAT(p.joint_rate, ElementsAre(0.1, 0.2));
}

TEST_F(Trajectory, SaysDurationAndInitialValues) {
  const CaptureProblem p = load("time,shoulder,elbow\n0,0.25,-1\n7,0,0\n", {kPath, kNoDuration, kNoJoints});
  EXPECT_EQ(p.approach->duration, 7);
  EXPECT_THAT(p.joint_position, ElementsAre(0.25, -1));
  EXPECT_THAT(faults("time,shoulder,elbow\n0,0.25,-1\n7,0,0\n"),
              ElementsAre("scenario.yaml:20:22: error: initial.joints.shoulder is 0.5, but the trajectory starts at "
                          "0.25; they must agree within 1e-06 or leave out initial.joints",
                          "scenario.yaml:20:34: error: initial.joints.elbow is 1, but the trajectory starts at -1; "
                          "they must agree within 1e-06 or leave out initial.joints",
                          "scenario.yaml:31:13: error: approach.duration is 20 [s], but the trajectory ends at 7; make "
                          "them agree or leave out the duration"));
  // Too many samples are reported for a duration that comes from the file.
  EXPECT_THAT(
      faults("time,shoulder,elbow\n0,0.5,1\n1e7,0,0\n", {kPath, kNoDuration, with_top("output: {interval: 0.5}")}),
      ElementsAre("scenario.yaml:32:20: error: output.interval is 0.5 [s], which gives 2e+07 samples over 1e+07 "
                  "s; at most 10000000 are allowed"));
}

TEST_F(Trajectory, AgreementHasTolerances) {
  const std::string near = "time,shoulder,elbow\n0,0.5000009,1\n20.00000001,0,0\n";
  const CaptureProblem ideal = load(near, {kPath});
  EXPECT_EQ(ideal.approach->duration, 20.00000001);
  EXPECT_THAT(ideal.joint_position, ElementsAre(0.5000009, 1));  // ideal tracking begins on the trajectory
  const CaptureProblem pd = load(near, {way("trajectory: motion.csv\n  tracking: {mode: pd, kp: 1, kd: 1}")});
  EXPECT_THAT(pd.joint_position, ElementsAre(0.5, 1));
  EXPECT_THAT(faults("time,shoulder,elbow\n0,0.5000011,1\n20,0,0\n"),
              ElementsAre(testing::StartsWith("scenario.yaml:20:22: error: initial.joints.shoulder is 0.5, but ")));
  EXPECT_THAT(faults("time,shoulder,elbow\n0,0.5,1\n20.0000001,0,0\n"),
              ElementsAre(testing::StartsWith("scenario.yaml:31:13: error: approach.duration is 20 [s], but ")));
}

TEST_F(Trajectory, InitialRates) {
  const Edit rates{"  joints: {", "  joint_rates: {elbow: 0.5}\n  joints: {"};
  EXPECT_THAT(faults(kMotion, {kPath, rates}),
              ElementsAre("scenario.yaml:20:3: error: initial.joint_rates: with ideal tracking the joints start with "
                          "the trajectory's rates; leave out joint_rates"));
  EXPECT_THAT(faults(kMotionWithRates, {kPath, rates}),
              ElementsAre("scenario.yaml:20:24: error: initial.joint_rates.elbow is 0.5, but the trajectory starts "
                          "with 0.2; they must agree within 1e-06 or leave out initial.joint_rates"));
  const Edit agreeing{"  joints: {", "  joint_rates: [0.1, 0.2]\n  joints: {"};
  EXPECT_THAT(load(kMotionWithRates, {kPath, agreeing}).joint_rate, ElementsAre(0.1, 0.2));
  const Edit nearly{"  joints: {", "  joint_rates: {shoulder: 0.1000009, elbow: 0.2}\n  joints: {"};
  EXPECT_THAT(load(kMotionWithRates, {kPath, nearly}).joint_rate, ElementsAre(0.1, 0.2));
  const Edit pd = way("trajectory: motion.csv\n  tracking: {mode: pd, kp: 1, kd: 1}");
  EXPECT_THAT(load(kMotionWithRates, {pd, rates}).joint_rate, ElementsAre(0, 0.5));
  EXPECT_THAT(load(kMotionWithRates, {pd}).joint_rate, ElementsAre(0.1, 0.2));
}

TEST_F(Trajectory, WindowsTextAndBlanks) {
  const std::string csv = "\xef\xbb\xbftime ,\tshoulder, elbow \r\n\r\n 0, 0.5 ,1\r\n20 ,0, +0.5e0";
  const CaptureProblem p = load(csv, {kPath});
  EXPECT_THAT(p.approach->sampled->positions, ElementsAre(ElementsAre(0.5, 0), ElementsAre(1, 0.5)));
}

TEST_F(Trajectory, DocumentedExample) {
  const std::string page = bytes_of(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "docs/formats/scenario.md");
  const std::string fence = "```\n";
  const std::size_t begin = page.find(fence, page.find("### Trajectory files")) + fence.size();
  const std::string example = page.substr(begin, page.find(fence, begin) - begin);
  EXPECT_EQ(load(example, {kPath, kNoDuration}).approach->duration, 0.1);
}

TEST_F(Trajectory, BytesEnterTheHash) {
  const std::string scenario = edited(kSmallScenario, {kPath});
  EXPECT_EQ(load(kMotion, {kPath}).sha256, sha256(scenario + kMotion));
  const std::string beside = "name: test\nrobot: robot.yaml\n" + scenario.substr(scenario.find("initial:"));
  folder_.write("robot.yaml", small_robot());
  const std::vector<Override> overrides{{"name", "other"}};
  EXPECT_EQ(load_scenario(folder_.write("beside.yaml", beside), overrides).sha256,
            sha256(beside + small_robot() + kMotion + "--set name=other\n"));
}

TEST_F(Trajectory, JointMayBeNamedLikeARate) {
  // The name of a joint goes before the name of a rate.
  const CaptureProblem p = load("time,shoulder,shoulder.rate\n0,0.5,1\n20,0,0\n",
                                {kPath, {"name: elbow", "name: shoulder.rate"}, {"elbow: 1", "shoulder.rate: 1"}});
  EXPECT_THAT(p.approach->sampled->positions, ElementsAre(ElementsAre(0.5, 0), ElementsAre(1, 0)));
  EXPECT_TRUE(p.approach->sampled->rates.empty());
}

TEST_F(Trajectory, Header) {
  const auto header = [&](const std::string& line) { return faults(line + "\n0,0.5,1\n20,0,0\n"); };
  EXPECT_THAT(header("t,shoulder,elbow"),
              ElementsAre("motion.csv:1:1: error: the first column is 't', must be 'time'"));
  EXPECT_THAT(header("time,sholder,elbow"),
              ElementsAre("motion.csv:1:1: error: the header lacks joints: shoulder",
                          "motion.csv:1:6: error: unknown column 'sholder'; did you mean 'shoulder'?"));
  EXPECT_THAT(header("time,shoulder,shoulder"), ElementsAre("motion.csv:1:1: error: the header lacks joints: elbow",
                                                            "motion.csv:1:15: error: duplicate column 'shoulder'"));
  EXPECT_THAT(header("time,shoulder,"), ElementsAre("motion.csv:1:1: error: the header lacks joints: elbow",
                                                    "motion.csv:1:15: error: unknown column ''; joints are shoulder, "
                                                    "elbow"));
  EXPECT_THAT(header("time,\"shoulder\",elbow"),
              ElementsAre("motion.csv:1:1: error: the header lacks joints: shoulder",
                          "motion.csv:1:6: error: unknown column '\"shoulder\"'; did you mean 'shoulder'?"));
  EXPECT_THAT(faults("# é\n\ntime, sch\xc3\xb6, ärm, shoulder, elbow\n0,0,0,0.5,1\n20,0,0,0,0\n"),
              ElementsAre("motion.csv:3:7: error: unknown column 'schö'; joints are shoulder, elbow",
                          "motion.csv:3:13: error: unknown column 'ärm'; joints are shoulder, elbow"));
  EXPECT_THAT(faults("time,shoulder,elbow,elbow.rate\n0,0.5,1,0\n20,0,0,0\n"),
              ElementsAre("motion.csv:1:1: error: the header has rates of some joints but lacks: shoulder.rate"));
  EXPECT_THAT(faults("time,shoulder,elbow,elbw.rate\n0,0.5,1,0\n20,0,0,0\n"),
              ElementsAre("motion.csv:1:21: error: unknown column 'elbw.rate'; did you mean 'elbow.rate'?"));
  EXPECT_THAT(faults(kMotion, {kPath,
                               {"type: revolute, axis: [0, 0, 1], origin", "type: fixed, origin"},
                               {"shoulder: 0.5, elbow: 1", "shoulder: 0.5"}}),
              ElementsAre("motion.csv:2:7: error: joint 'elbow' is fixed and has no column"));
}

// As numpy.savetxt writes it.
TEST_F(Trajectory, HeaderBehindASign) {
  const CaptureProblem p = load("# made by hand\n# time,shoulder,elbow\n0.0e+00,5e-1,1\n20,0,0\n", {kPath});
  EXPECT_THAT(p.approach->sampled->positions, ElementsAre(ElementsAre(0.5, 0), ElementsAre(1, 0)));
  EXPECT_THAT(faults("#time,sholder,elbow\n0,0.5,1\n20,0,0\n"),
              ElementsAre("motion.csv:1:2: error: the header lacks joints: shoulder",
                          "motion.csv:1:7: error: unknown column 'sholder'; did you mean 'shoulder'?"));
  // A real header has priority over a comment that looks like one.
  EXPECT_NO_THROW(load("# time,and other things\ntime,shoulder,elbow\n0,0.5,1\n20,0,0\n", {kPath}));
}

TEST_F(Trajectory, LinesAreComplete) {
  EXPECT_THAT(faults("time,shoulder,elbow\n0,0.5,1\n10,0\n20,0,0,0\n"),
              ElementsAre("motion.csv:3:1: error: the line has 2 fields, must have 3",
                          "motion.csv:4:1: error: the line has 4 fields, must have 3"));
}

TEST_F(Trajectory, Numbers) {
  const auto field = [&](const std::string& text) {
    return faults("time,shoulder,elbow\n0,0.5,1\n20,0, " + text + "\n");
  };
  EXPECT_THAT(field("half"),
              ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m], not the text 'half'"));
  EXPECT_THAT(field(""), ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m], not empty"));
  EXPECT_THAT(field("010"),
              ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m]; '010' looks octal, write 10"));
  EXPECT_THAT(field("0x1"), ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m]; '0x1' is not "
                                        "accepted, write the decimal number 1"));
  EXPECT_THAT(field(".nan"), ElementsAre("motion.csv:3:7: error: elbow is .nan, must be a finite number [rad or m]"));
  EXPECT_THAT(field("nan"),
              ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m], not the text 'nan'"));
  EXPECT_THAT(
      field("1e999"),
      ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m]; '1e999' is above the range of a double"));
  EXPECT_THAT(field("1 2"),
              ElementsAre("motion.csv:3:7: error: elbow must be a number [rad or m], not the text '1 2'"));
  EXPECT_THAT(faults("time,shoulder,elbow,shoulder.rate,elbow.rate\n0,0.5,1,0,0\n2O,0,0,,0\n"),
              ElementsAre("motion.csv:3:1: error: time must be a number [s], not the text '2O'; did you mean 20?",
                          "motion.csv:3:8: error: shoulder.rate must be a number [rad/s or m/s], not empty"));
}

TEST_F(Trajectory, Times) {
  const auto times = [&](const std::string& lines) {
    return faults("time,shoulder,elbow\n" + lines, {kPath, kNoDuration});
  };
  EXPECT_THAT(times("0.5,0.5,1\n20,0,0\n"), ElementsAre("motion.csv:2:1: error: the first time is 0.5 [s], must be 0"));
  EXPECT_THAT(times("0,0.5,1\n2,0,0\n2,0,0\n1.5,0,0\n"),
              ElementsAre("motion.csv:4:1: error: time is 2 [s], must be greater than 2 of the previous sample",
                          "motion.csv:5:1: error: time is 1.5 [s], must be greater than 2 of the previous sample"));
  EXPECT_THAT(times("0,0.5,1\n"), ElementsAre("motion.csv:1:1: error: the file has 1 sample, must have at least 2"));
  EXPECT_THAT(times(""), ElementsAre("motion.csv:1:1: error: the file has 0 samples, must have at least 2"));
}

TEST_F(Trajectory, Limits) {
  EXPECT_THAT(
      faults("time,shoulder,elbow,elbow.rate,shoulder.rate\n0,0.5,1,9,1\n1,2.5,9,9,-1.5\n2,-3,9,9,0\n20,0,0,0,0\n"),
      ElementsAre(
          "motion.csv:3:3: error: shoulder is 2.5, beyond the joint's limits -2 to 2 (the first of 2 such values)",
          "motion.csv:3:11: error: shoulder.rate is -1.5, beyond the joint's rate limit 1"));
}

TEST_F(Trajectory, Files) {
  for (const char* text : {"", "\n\n", "# only a comment\n", "\xef\xbb\xbf"}) {
    EXPECT_THAT(faults(text), ElementsAre("motion.csv:1:1: error: the file has no header line time,<joint>,..."))
        << text;
  }
  EXPECT_THAT(faults("time,sh\xff"), ElementsAre("motion.csv:1:8: error: the file is not UTF-8 (byte 0xff)"));
  EXPECT_THAT(faults(kMotion, {way("trajectory: motoin.csv")}),
              ElementsAre("scenario.yaml:32:15: error: cannot read the file 'motoin.csv': no such file; did you mean "
                          "'motion.csv'?"));
  EXPECT_THAT(faults(kMotion, {way("trajectory: .")}), ElementsAre(testing::EndsWith("it is a directory")));
  // No complaint about initial joints that an unreadable file may say.
  EXPECT_THAT(faults(kMotion, {way("trajectory: no.csv"), kNoJoints}),
              ElementsAre("scenario.yaml:32:15: error: cannot read the file 'no.csv': no such file"));
  const auto huge = folder_.write("huge.csv", "time\n");
  std::filesystem::resize_file(huge, (64u << 20) + 1);  // sparse
  EXPECT_THAT(faults(kMotion, {way("trajectory: huge.csv")}),
              ElementsAre("scenario.yaml:32:15: error: cannot read the file 'huge.csv': it is larger than 64 MB"));
}

TEST_F(Trajectory, FaultsOfTheRobotLeaveItsColumnsAlone) {
  EXPECT_THAT(faults("time,shoulder,elbow,wrist\n0,0.5,1,0\n20,0,0,0\n", {kPath, {"name: elbow", "label: elbow"}}),
              testing::Each(testing::StartsWith("scenario.yaml:")));
}

TEST_F(Trajectory, ThereIsAnEndToTheFaults) {
  std::string csv = "time,shoulder,elbow\n";
  for (int i = 0; i < 5000; ++i) csv += "x,y,z\n";
  const auto found = faults(csv);
  ASSERT_EQ(found.size(), 1001u);
  EXPECT_THAT(found.back(), testing::EndsWith("error: too many errors; further errors are not listed"));
}

// Whatever happens to a file: it is accepted, or refused with a InputError.
TEST_F(Trajectory, OnlySuccessOrInputError) {
  SKIP_UNDER_SANITIZERS();  // and the fuzzer damages them there
  std::mt19937_64 random(20240607);
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
  const std::vector<std::string> pieces{",", "\n", "#", "time", ".rate", "-", "1e308", ".nan", " ", "\t", "0", "\r"};
  int accepted = 0, refused = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string csv = i % 2 == 0 ? kMotion : kMotionWithRates;
    for (std::size_t k = below(2) + 1; k-- > 0;) {
      const std::size_t at = below(csv.size());
      if (below(3) == 0)
        csv[at] = static_cast<char>(random() & 0xff);
      else if (below(2) == 0)
        csv.insert(at, pieces[below(pieces.size())]);
      else
        csv.erase(at, 1 + below(10));
    }
    ++(faults(csv, {kPath, kNoDuration, kNoJoints}).empty() ? accepted : refused);  // other exceptions fail the test
  }
  EXPECT_GT(accepted, 50);  // measured 132
  EXPECT_GT(refused, 500);  // measured 868
}

}  // namespace trajectory_test
}  // namespace grapnel::test
