// No command replaces an input by an output; results of another scenario are replaced only on request.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "program_run.hpp"

namespace grapnel {
namespace outputs_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;

const char* const kThesis = GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-at-contact.yaml";

class Outputs : public test::ProgramRun {
 protected:
  // Writes a shipped impact-only scenario to a file of this name.
  fs::path quick(const std::string& name, const std::string& called = "quick") const {
    std::string text = read_text(kThesis);
    text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
    const std::size_t at = text.find("\nname:") + 1;
    text.replace(at, text.find('\n', at) - at, "name: " + called);
    return write(name, text);
  }
  // Expects exit code 2, this message and an unchanged input file.
  void expect_refused(const std::string& arguments, const std::string& input, const std::string& message) const {
    const std::string before = read_text(folder_ / input);
    const Outcome o = run(arguments);
    EXPECT_EQ(o.code, 2) << arguments << "\n" << o.err;
    EXPECT_THAT(o.err, HasSubstr(message)) << arguments;
    EXPECT_THAT(o.err, HasSubstr("must not be replaced: ")) << arguments;
    EXPECT_EQ(read_text(folder_ / input), before) << arguments;
  }
  std::string matrices() const {
    write("m.csv",
          "2,0,0,0,0,0,0\n0,2,0,0,0,0,0\n0,0,2,0,0,0,0\n0,0,0,1,0,0,0\n0,0,0,0,1,0,0\n0,0,0,0,0,1,0\n"
          "0,0,0,0,0,0,1\n");
    return "modes --mass m.csv --stiffness m.csv --units m-kg-s";
  }
};

TEST_F(Outputs, ResultsNeverReplaceScenario) {
  for (const std::string name : {"scenario.json", "summary.json", "scene.json", "timeseries.h5", "report.html"}) {
    quick(name);
    expect_refused("run " + name + " -o .", name, "./" + name + ": error: ");
    fs::remove(folder_ / name);
  }
}

TEST_F(Outputs, LinksDoNotHideInput) {
  quick("mine.yaml");
  fs::create_directories(folder_ / "soft");
  fs::create_directories(folder_ / "hard");
  fs::create_symlink("../mine.yaml", folder_ / "soft" / "summary.json");
  fs::create_hard_link(folder_ / "mine.yaml", folder_ / "hard" / "scene.json");
  expect_refused("run mine.yaml -o soft", "mine.yaml", "it is the input 'mine.yaml' of this command");
  expect_refused("run mine.yaml -o hard", "mine.yaml", "it is the input 'mine.yaml' of this command");
}

TEST_F(Outputs, ResultsNeverReplaceReferencedFile) {
  fs::copy_file(GRAPNEL_SOURCE_DIR "/robots/planar-dual-arm.yaml", folder_ / "scene.json");
  std::string text = read_text(quick("mine.yaml"));
  const std::size_t at = text.find("robot: ");
  text.replace(at, text.find('\n', at) - at, "robot: scene.json");
  write("mine.yaml", text);
  expect_refused("run mine.yaml -o .", "scene.json", "./scene.json: error: ");
}

TEST_F(Outputs, ResultsNeverReplaceStudy) {
  quick("mine.yaml");
  const std::string axes =
      "scenario: mine.yaml\nsimulate: impact\naxes: [{path: \"targets[0].mass\", values: [10, 20]}]\n";
  const std::string drawn =
      "scenario: mine.yaml\nsimulate: impact\ncases: 4\nseed: 1\n"
      "uncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n";
  for (const std::string name : {"study.json", "table.csv", "table.partial.csv", "report.html"}) {
    write(name, "name: a\n" + axes);
    expect_refused("sweep " + name + " -o .", name, "./" + name + ": error: ");
    fs::remove(folder_ / name);
  }
  for (const std::string name : {"manifest.json", "campaign.json", "table.csv", "report.html"}) {
    write(name, "schema: grapnel-campaign/1\nname: a\n" + drawn);
    expect_refused("campaign " + name + " -o .", name, "./" + name + ": error: ");
    fs::remove(folder_ / name);
  }
  EXPECT_FALSE(fs::exists(folder_ / "shards"));
}

// A campaign recreates its folder "series".
TEST_F(Outputs, RemovalOfOldSeriesPreservesScenario) {
  fs::create_directories(folder_ / "series" / "case-1");
  std::string text = read_text(quick("mine.yaml"));
  write("series/case-1/scenario.yaml", "# Made by grapnel, once\n" + text);
  write("c.yaml",
        "schema: grapnel-campaign/1\nname: a\nscenario: series/case-1/scenario.yaml\nsimulate: impact\ncases: 4\n"
        "seed: 1\nuncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
  const Outcome o = run("campaign c.yaml -o .");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("series/case-1/scenario.yaml: error: is an input of this command"));
  EXPECT_TRUE(fs::exists(folder_ / "series" / "case-1" / "scenario.yaml"));
}

TEST_F(Outputs, BestScenarioNeverReplacesSource) {
  fs::create_directories(folder_ / "r");
  const std::string text = read_text(quick("mine.yaml"));
  write("r/best.yaml", "# Made by grapnel, once\n" + text);
  write("o.yaml",
        "name: a\nscenario: r/best.yaml\nsimulate: impact\nminimize: grasps/tip-1/impulse_magnitude\n"
        "variables: [{path: \"targets[0].mass\", from: 5, to: 10}]\nsearch: {evaluations: 4, refine: 0}\n");
  expect_refused("optimize o.yaml -o r", "r/best.yaml", "r/best.yaml: error: ");
}

TEST_F(Outputs, FileNeverReplacesInput) {
  const std::string modes = matrices();
  expect_refused(modes + " -o m.csv", "m.csv", "m.csv: error: ");
  fs::create_symlink("m.csv", folder_ / "link");
  expect_refused(modes + " -o link", "m.csv", "link: error: ");
  const std::string arm =
      "<robot name='a'><link name='l'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' "
      "ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
  write("arm.urdf", arm);
  expect_refused("import arm.urdf -o arm.urdf", "arm.urdf", "arm.urdf: error: ");
  fs::copy_file(GRAPNEL_SOURCE_DIR "/robots/planar-dual-arm.yaml", folder_ / "bus.yaml");
  expect_refused("import arm.urdf --bus bus.yaml --prefix x- -o bus.yaml", "bus.yaml", "bus.yaml: error: ");
}

TEST_F(Outputs, ReportsAndFiguresNeverReplaceResults) {
  quick("mine.yaml");
  ASSERT_EQ(run("run mine.yaml -o r --quiet").code, 0);
  expect_refused("report r -o r/summary.json", "r/summary.json", "r/summary.json: error: ");
  fs::create_hard_link(folder_ / "r" / "summary.json", folder_ / "other.html");
  expect_refused("report r -o other.html", "r/summary.json", "other.html: error: ");
  fs::create_symlink("summary.json", folder_ / "r" / "joints.dat");
  expect_refused("figure r --what impulse -o r/joints.pdf", "r/summary.json", "r/joints.dat: error: ");
}

// Pipes and links to devices at the output path remain unchanged.
TEST_F(Outputs, PipesAndDevicesAreNotReplaced) {
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  const std::string modes = matrices();
  const Outcome o = run(modes + " -o fifo");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.err,
            "fifo: error: must not be replaced: it is a pipe, which the output would replace; choose another name with "
            "-o\n");
  EXPECT_TRUE(fs::is_fifo(folder_ / "fifo"));
  fs::create_symlink("/dev/null", folder_ / "null");
  EXPECT_EQ(run(modes + " -o null").code, 2);
  EXPECT_TRUE(fs::is_symlink(folder_ / "null"));
  quick("mine.yaml");
  fs::create_directories(folder_ / "r");
  ASSERT_EQ(mkfifo((folder_ / "r" / "summary.json").c_str(), 0600), 0);
  EXPECT_EQ(run("run mine.yaml -o r").code, 2);
  EXPECT_TRUE(fs::is_fifo(folder_ / "r" / "summary.json"));
}

TEST_F(Outputs, OtherResultsReplacedOnlyOnRequest) {
  quick("a.yaml", "one");
  quick("b.yaml", "another");
  ASSERT_EQ(run("run a.yaml -o r --quiet").code, 0);
  EXPECT_EQ(run("run a.yaml -o r --quiet").code, 0);
  EXPECT_EQ(run("run a.yaml --set targets[0].mass=11 -o r --quiet").code, 0);
  const std::string before = read_text(folder_ / "r" / "summary.json");
  const Outcome o = run("run b.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err,
              HasSubstr("grapnel: error: 'r' holds the results of the scenario 'one'; replace them with --force, or "
                        "choose another folder with -o"));
  EXPECT_EQ(read_text(folder_ / "r" / "summary.json"), before);
  EXPECT_EQ(run("run b.yaml -o r --force --quiet").code, 0);
  EXPECT_THAT(read_text(folder_ / "r" / "summary.json"), HasSubstr("another"));
}

TEST_F(Outputs, RunDoesNotMixWithCampaign) {
  quick("mine.yaml");
  write("c.yaml",
        "schema: grapnel-campaign/1\nname: a\nscenario: mine.yaml\nsimulate: impact\ncases: 4\n"
        "seed: 1\nuncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
  ASSERT_EQ(run("campaign c.yaml -o r --quiet").code, 0);
  const Outcome o = run("run mine.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("'r' holds the results of a campaign"));
}

// Stored cases have identical bytes in any results folder.
TEST_F(Outputs, StoredCasesIndependentOfFolderDepth) {
  quick("mine.yaml");
  write("c.yaml",
        "schema: grapnel-campaign/1\nname: a\nscenario: mine.yaml\nsimulate: impact\ncases: 2\nseed: 1\n"
        "keep: {series: {sample: 1}}\n"
        "uncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
  ASSERT_EQ(run("campaign c.yaml -o r --quiet").code, 0);
  ASSERT_EQ(run("campaign c.yaml -o deep/er/r --quiet").code, 0);
  const std::string text = read_text(folder_ / "r" / "series" / "case-0" / "scenario.yaml");
  EXPECT_NE(text, "");
  EXPECT_EQ(read_text(folder_ / "deep" / "er" / "r" / "series" / "case-0" / "scenario.yaml"), text);
}

// ---- Options and messages ----

TEST_F(Outputs, OptionNumbersAreFinite) {
  const std::string modes = matrices();
  for (const std::string option :
       {"--damping nan", "--below nan", "--expect nan", "--origin 0 nan 0", "--expect 1e999"}) {
    const Outcome o = run(modes + " " + option);
    EXPECT_EQ(o.code, 2) << option;
    EXPECT_THAT(o.err, HasSubstr("is not a finite number")) << option;
  }
  for (const std::string option : {"--width nan", "--height NAN", "--from nan", "--to -inf", "--times 0,nan"}) {
    const Outcome o = run("figure nowhere --what joints " + option);
    EXPECT_EQ(o.code, 2) << option;
    EXPECT_THAT(o.err, HasSubstr("is not a finite number")) << option;
  }
}

TEST_F(Outputs, MessagesOfTheSystemAreSentences) {
  fs::create_symlink("loop", folder_ / "loop");
  const std::string far(300, 'x');
  for (const std::string& arguments :
       {std::string("run loop"), "run " + far, std::string("report loop"), "report " + far,
        std::string("figure loop --list"), std::string("figure loop/x --what joints"), std::string("export loop --csv"),
        std::string("info loop"), std::string("campaign loop"), std::string("merge loop -o r"),
        std::string("modes --mass loop --stiffness loop --units m-kg-s"), std::string("import loop.urdf -o x.yaml")}) {
    const Outcome o = run(arguments);
    EXPECT_EQ(o.code, 2) << arguments << o.err;
    EXPECT_EQ(o.err.find("filesystem error"), std::string::npos) << arguments << o.err;
    EXPECT_EQ(o.err.find("std::"), std::string::npos) << arguments << o.err;
  }
  quick("mine.yaml");
  for (const std::string& folder : {std::string("loop/r"), far}) {
    const Outcome o = run("run mine.yaml -o " + folder);
    EXPECT_EQ(o.code, 2) << o.err;
    EXPECT_EQ(o.err.find("filesystem error"), std::string::npos) << o.err;
  }
}

TEST_F(Outputs, RejectsEndlessMatrix) {
  fs::create_symlink("/dev/zero", folder_ / "zero.mtx");
  const Outcome o = run("modes --mass zero.mtx --stiffness zero.mtx --units m-kg-s --modes 1");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("it is larger than 64 MB"));
}

TEST_F(Outputs, LinearModelNeedsAFolder) {
  const Outcome o = run("linearize '" + scenario("wheels-keep-attitude.yaml") + "' -o none/x.mat");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("error: -o none/x.mat: the folder does not exist or is not writable"));
}

}  // namespace outputs_test
}  // namespace grapnel
