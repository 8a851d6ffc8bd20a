// The commands `grapnel campaign`, `merge` and `map`: exit codes, files, messages, interruption by signals.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "grapnel/campaign/shard_store.hpp"
#include "program_run.hpp"

namespace grapnel {
namespace campaign_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;
using testing::Not;

class Campaign : public test::ProgramRun {
 protected:
  // A campaign of impacts at a stated configuration with uncertain target mass; each case takes less than 1 ms.
  fs::path study(int cases, const std::string& more = "") const {
    std::string at_once = read_text(scenario("seven-joint-dual-capture.yaml"));
    const auto cut = [&](const std::string& from, const std::string& to) {
      const std::size_t a = at_once.find(from);
      at_once.erase(a, at_once.find(to) - a);
    };
    cut("initial:", "targets:");
    cut("approach:", "contact:");
    cut("post_impact:", "output:");
    at_once.replace(at_once.find("../robots"), 9, GRAPNEL_SOURCE_DIR "/robots");
    const std::string gap = "gap: weld_as_found";  // end-effectors are 0.4 m from the grasp points
    at_once.replace(at_once.find(gap), gap.size(), gap + ", largest_gap: any");
    write("at-once.yaml",
          at_once +
              "initial:\n"
              "  base: {velocity: [0.01, -0.02, 0.03], angular_velocity: [0.02, 0.01, -0.03]}\n"
              "  joints: [0.4, 0.4, 0.1, -0.6, -2.0, -2.7, -0.2, 0.5, 0.4, -0.3, 0.2, -2.1, -2.7, -0.1]\n"
              "  joint_rates: [0.01, -0.02, 0.03, 0, 0.01, 0.02, -0.01, 0.02, 0.01, 0, -0.03, 0.01, 0, 0.02]\n");
    return write("study.yaml",
                 "schema: grapnel-campaign/1\nname: masses\nscenario: at-once.yaml\nsimulate: impact\n"
                 "cases: " +
                     std::to_string(cases) +
                     "\nseed: 3\nuncertain:\n"
                     "  - {path: \"targets[0].mass\", as: factor, uniform: {from: 0.5, to: 1.5}}\n"
                     "  - {path: \"targets[1].mass\", as: factor, uniform: {from: 0.5, to: 1.5}}\n"
                     "keep: {columns: [captured, grasps]}\n" +
                     more);
  }
  // Starts the program in a separate process and returns the process id.
  pid_t start(const std::vector<std::string>& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    signal(SIGINT, SIG_DFL);  // shells ignore SIGINT in background processes
    if (chdir(folder_.c_str()) != 0) _exit(126);
    const int out = open("child.out", O_WRONLY | O_CREAT | O_TRUNC, 0666),
              err = open("child.err", O_WRONLY | O_CREAT | O_TRUNC, 0666);
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    std::vector<char*> argv{const_cast<char*>("grapnel")};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    execv(GRAPNEL_PROGRAM, argv.data());
    _exit(127);
  }
  // Waits for a process; returns its exit code, or the negative signal number.
  static int end_of(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  std::size_t shards(const std::string& folder) const {
    std::error_code none;
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(folder_ / folder / "shards", none))
      if (!entry.path().filename().string().starts_with('.')) ++count;
    return count;
  }
  // Waits until the campaign has written `count` shards.
  void await_shards(const std::string& folder, std::size_t count) const {
    for (int i = 0; i < 6000 && shards(folder) < count; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_GE(shards(folder), count);
  }
  void expect_same_results(const std::string& a, const std::string& b) const {
    for (const char* file : {"table.h5", "table.csv", "campaign.json"}) {
      EXPECT_NE(read_text(folder_ / a / file), "") << a << "/" << file;
      EXPECT_EQ(read_text(folder_ / a / file), read_text(folder_ / b / file)) << a << ", " << b << ": " << file;
    }
  }
};

TEST_F(Campaign, ConservationFailuresAreNoSuccess) {
  const fs::path file =
      write("coarse.yaml",
            "schema: grapnel-campaign/1\nname: coarse\nscenario: " + scenario("thesis/open-loop-case-1-planned.yaml") +
                "\nset: {integration.method: rk4, contact: {gap: weld_as_found}}\ncases: 6\nuncertain:\n"
                "  - {path: integration.step, discrete: {values: [0.02, 2]}}\n"
                "success: [captured]\n");
  const Outcome o = run("campaign " + file.string() + " -o out --no-report");
  EXPECT_EQ(o.code, 3) << o.err;
  const auto json = nlohmann::json::parse(read_text(folder_ / "out" / "campaign.json"));
  const int failed = json["counts"]["failed"];
  EXPECT_GT(failed, 0);
  EXPECT_EQ(json["counts"]["ok"], 6 - failed);
  EXPECT_DOUBLE_EQ(json["success"]["estimate"], (6.0 - failed) / 6);
  EXPECT_THAT(json["failures"][0]["examples"][0]["reason"].get<std::string>(),
              HasSubstr("conservation check failed: energy_drift is "));
  EXPECT_THAT(o.out, HasSubstr(std::to_string(failed) + " without a result: not counted as a success"));
}

TEST_F(Campaign, WritesItsResultsAndTheSameBytesForAnyNumberOfThreads) {
  study(600);
  const Outcome o = run("campaign study.yaml -o r1 -j 1");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.err,
            "study.yaml: warning: in all successes the grasps are assumed to close: end-effectors without an "
            "'envelope' hold without a check of position and velocity\n");
  EXPECT_THAT(o.out, HasSubstr("600 cases, all assumed to hold without an envelope\n"));
  EXPECT_THAT(o.out, HasSubstr("grapnel 0.2.0, campaign study.yaml (sha256 "));
  EXPECT_THAT(o.out, HasSubstr("600 cases\n"));
  EXPECT_THAT(o.out, HasSubstr("results in r1: table.h5, table.csv, campaign.json"));
  const auto report = nlohmann::json::parse(read_text(folder_ / "r1" / "campaign.json"));
  EXPECT_EQ(report["rows"], 600);
  ASSERT_EQ(run("campaign study.yaml -o r2 -j 2 --quiet").code, 0);
  expect_same_results("r1", "r2");
  EXPECT_FALSE(fs::exists(folder_ / "r1" / "lock"));
}

TEST_F(Campaign, RerunFindsAllResults) {
  study(300);
  ASSERT_EQ(run("campaign study.yaml -o r").code, 0);
  const std::string before = read_text(folder_ / "r" / "table.h5");
  const Outcome o = run("campaign study.yaml -o r");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("300 cases, 300 of them complete"));
  EXPECT_EQ(read_text(folder_ / "r" / "table.h5"), before);
}

TEST_F(Campaign, PartsEqualWhole) {
  study(600);
  ASSERT_EQ(run("campaign study.yaml -o whole --quiet").code, 0);
  for (int i = 1; i <= 3; ++i) {
    const Outcome o = run("campaign study.yaml -o one --shard " + std::to_string(i) + "/3");
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.out, HasSubstr(i < 3 ? "part " + std::to_string(i) + "/3 is complete; " : "results in one: "));
    EXPECT_EQ(
        run("campaign study.yaml --quiet -o part" + std::to_string(i) + " --shard " + std::to_string(i) + "/3").code,
        0);
  }
  expect_same_results("whole", "one");
  EXPECT_FALSE(fs::exists(folder_ / "part1" / "table.h5"));
  const Outcome early = run("merge part1 part3 -o merged");
  EXPECT_EQ(early.code, 1);
  EXPECT_THAT(early.err, HasSubstr(" of 75 blocks ("));
  const Outcome o = run("merge part1 part2 part3 -o merged");
  EXPECT_EQ(o.code, 0) << o.err;
  expect_same_results("whole", "merged");
  EXPECT_EQ(run("merge part2 part1 part3 -o part3 --quiet").code, 0);  // in place
  expect_same_results("whole", "part3");
}

TEST_F(Campaign, JobArraySelectsPart) {
  study(300);
  const std::string array = "SLURM_ARRAY_TASK_ID=12 SLURM_ARRAY_TASK_MIN=10 SLURM_ARRAY_TASK_MAX=13 ";
  const auto run_in = [&](const std::string& environment, const std::string& arguments) {
    write("script", environment + "'" GRAPNEL_PROGRAM "' " + arguments + "\n");
    const int status = std::system(("cd '" + folder_.string() + "' && sh script >out 2>err").c_str());
    return Outcome{WEXITSTATUS(status), read_text(folder_ / "out"), read_text(folder_ / "err")};
  };
  const Outcome o = run_in(array, "campaign study.yaml -o r");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("part 3/4 from SLURM_ARRAY_TASK_ID=12"));
  EXPECT_EQ(shards("r"), 19u);
  const Outcome gaps = run_in(array + "SLURM_ARRAY_TASK_COUNT=3 ", "campaign study.yaml -o r");
  EXPECT_EQ(gaps.code, 2);
  EXPECT_THAT(gaps.err, HasSubstr("the array has 3 tasks where 10 to 13 by 1 would be 4"));
  EXPECT_EQ(run("campaign study.yaml --shard slurm").code, 2);
  for (const char* bad : {"0/3", "4/3", "1", "x/y", "1/3x"}) {
    const Outcome b = run(std::string("campaign study.yaml --shard ") + bad);
    EXPECT_EQ(b.code, 2) << bad;
    EXPECT_THAT(b.err, HasSubstr("must be i/N with i from 1 to N")) << bad;
  }
  // An empty "$PART" from an unset variable must not select the whole campaign.
  for (const char* empty : {"--shard \"\"", "--only \"\"", "-o \"\"", "-j \"\"", "--extend \"\""})
    EXPECT_EQ(run(std::string("campaign study.yaml ") + empty).code, 2) << empty;
  EXPECT_THAT(run("campaign study.yaml --shard \"\"").err, HasSubstr("--shard: its value is empty"));
  EXPECT_FALSE(fs::is_directory(folder_ / "out"));
}

// A manifest with another arithmetic label and a valid checksum.
TEST_F(Campaign, MergeIndependentOfLocalArithmetic) {
  study(300);
  for (const std::string part : {"1", "2"})
    ASSERT_EQ(run("campaign study.yaml --quiet -o part" + part + " --shard " + part + "/2").code, 0);
  const auto relabel = [&](const std::string& part) {
    const auto manifest = read_manifest(folder_ / part);
    Manifest other = *manifest;
    other.arithmetic = "abacus";
    write_manifest(folder_ / part, other);
    for (const auto& entry : fs::directory_iterator(folder_ / part / "shards")) {
      const auto number = std::stoull(entry.path().stem().string());
      const Block block = block_at(number, manifest->block_size, manifest->total);
      const auto rows = read_shard(folder_ / part, manifest->campaign, block, manifest->arithmetic);
      std::ofstream(entry.path(), std::ios::binary) << shard_bytes(manifest->campaign, *rows, "abacus");
    }
  };
  relabel("part1");
  const Outcome mixed = run("merge part1 part2 -o both");
  EXPECT_EQ(mixed.code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("part2 and part1 hold different campaigns"));
  EXPECT_THAT(mixed.err, HasSubstr("not 'abacus': they differ in the last bits"));
  EXPECT_FALSE(fs::exists(folder_ / "both" / "manifest.json"));
  relabel("part2");
  const Outcome o = run("merge part1 part2 -o both --quiet");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(read_manifest(folder_ / "both")->arithmetic, "abacus");
}

TEST_F(Campaign, DamagedManifestRejectedWithRemedy) {
  study(300);
  ASSERT_EQ(run("campaign study.yaml -o r --quiet").code, 0);
  const std::string before = read_text(folder_ / "r" / "table.h5");
  std::string manifest = read_text(folder_ / "r" / "manifest.json");
  manifest.replace(manifest.find("\"total\": 300"), 12, "\"total\": 301");
  std::ofstream(folder_ / "r" / "manifest.json") << manifest;
  for (const char* command : {"campaign study.yaml -o r", "merge r -o r"}) {
    const Outcome o = run(command);
    EXPECT_EQ(o.code, 2) << command;
    EXPECT_THAT(o.err, HasSubstr("manifest.json: damaged: its contents were changed")) << command;
    EXPECT_THAT(o.err, HasSubstr("move this file to another folder: the command that created r then creates it again"))
        << command;
    EXPECT_THAT(o.err, Not(HasSubstr("to resume: "))) << command;
  }
  fs::remove(folder_ / "r" / "manifest.json");
  const Outcome o = run("campaign study.yaml -o r");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(read_text(folder_ / "r" / "table.h5"), before);
}

TEST_F(Campaign, ExtensionInStepsEqualsOneRun) {
  study(300);
  ASSERT_EQ(run("campaign study.yaml -o steps --quiet").code, 0);
  ASSERT_EQ(run("campaign study.yaml -o steps --quiet --extend 200").code, 0);
  ASSERT_EQ(run("campaign study.yaml -o steps --quiet --extend 100").code, 0);
  ASSERT_EQ(run("campaign study.yaml -o once --quiet --extend 300").code, 0);
  expect_same_results("steps", "once");
  const Outcome o = run("campaign study.yaml -o steps");  // the manifest records the extension
  EXPECT_THAT(o.out, HasSubstr("600 cases, 600 of them complete"));
}

TEST_F(Campaign, SingleCaseEqualsCampaignCase) {
  study(300);
  ASSERT_EQ(run("campaign study.yaml -o r --quiet").code, 0);
  const Outcome o = run("campaign study.yaml --only 123 -o alone");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("case 123 of campaign study.yaml as scenario alone/scenario.yaml"));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "alone" / "summary.json"));
  const double impulse = summary["impact"]["grasps"][0]["impulse_magnitude"];
  std::istringstream csv(read_text(folder_ / "r" / "table.csv"));
  std::string head, line;
  std::getline(csv, head);
  for (int k = 0; k <= 123; ++k) std::getline(csv, line);
  const std::size_t before = head.find("/impulse_magnitude [N s]");
  ASSERT_NE(before, std::string::npos);
  std::istringstream fields(line);
  std::string field;
  for (auto n = std::count(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(before), ','); n >= 0; --n)
    std::getline(fields, field, ',');
  EXPECT_GT(impulse, 0.01);
  EXPECT_EQ(std::stod(field), impulse);  // the same bits
}

TEST_F(Campaign, RejectsFolderOfOtherCampaign) {
  study(300);
  ASSERT_EQ(run("campaign study.yaml -o r --quiet").code, 0);
  study(301);
  const Outcome o = run("campaign study.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("'r' holds another campaign:"));
  EXPECT_THAT(o.err, HasSubstr("line 5 of its file is 'cases: 300', not 'cases: 301'"));
  ASSERT_EQ(run("campaign study.yaml -o other --quiet").code, 0);
  const Outcome merged = run("merge r other -o both");
  EXPECT_EQ(merged.code, 2);
  EXPECT_THAT(merged.err, HasSubstr("other and r hold different campaigns"));
}

TEST_F(Campaign, BadInputFoundBeforeRun) {
  EXPECT_EQ(run("campaign nowhere.yaml").code, 2);
  study(300);
  const Outcome o = run("map study.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("needs a 'design'"));
  EXPECT_FALSE(fs::exists(folder_ / "r"));
  EXPECT_EQ(run("merge nowhere -o r").code, 2);
  for (const char* arguments : {"--only -1", "--only 1000000000", "--only 5 --extend 10", "--extend 0",
                                "--extend 1000000000000", "--extend 1000000000"}) {
    const Outcome wrong = run("campaign study.yaml -o r " + std::string(arguments));
    EXPECT_EQ(wrong.code, 2) << arguments << "\n" << wrong.err;
    EXPECT_NE(wrong.err, "") << arguments;
  }
}

TEST_F(Campaign, UnwritableFolderIsNamed) {
  study(300);
  write("file", "");
  const Outcome o = run("campaign study.yaml -o file/r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("cannot write results to 'file/r': Not a directory"));
  if (geteuid() == 0) return;  // root can write everywhere
  fs::create_directory(folder_ / "locked");
  fs::permissions(folder_ / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_EQ(run("campaign study.yaml -o locked").code, 2);
}

// --- Long tests ---

class LongCampaign : public Campaign {};

TEST_F(LongCampaign, ResumesToSameBytesAfterKill) {
  study(4000);
  ASSERT_EQ(run("campaign study.yaml -o calm --quiet").code, 0);
  unsigned random = 4711;
  int kills = 0, code = -1;
  for (int round = 0; kills < 30; ++round) {
    const std::string folder = "killed" + std::to_string(round);
    double longest = 100;  // [ms]; grows until the campaign completes on slow machines
    for (code = -1; code != 0; longest *= 1.03) {
      const pid_t child = start({"campaign", "study.yaml", "-o", folder, "--quiet", "-j", "2"});
      random = random * 1664525u + 1013904223u;
      std::this_thread::sleep_for(
          std::chrono::microseconds(static_cast<int>(1000 * longest * static_cast<double>(random >> 8) * 0x1p-24)));
      kill(child, SIGKILL);
      code = end_of(child);
      if (code == -SIGKILL)
        ++kills;
      else
        ASSERT_EQ(code, 0) << read_text(folder_ / "child.err");
    }
    expect_same_results("calm", folder);
  }
  EXPECT_GE(kills, 30);
}

TEST_F(LongCampaign, CtrlCStopsAndNamesResumeCommand) {
  study(200000);
  const pid_t child = start({"campaign", "study.yaml", "-o", "r", "-j", "2"});
  await_shards("r", 3);
  const Outcome second = run("campaign study.yaml -o r");
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.err, HasSubstr("'r' is in use: process " + std::to_string(child) + " on "));
  kill(child, SIGINT);
  EXPECT_EQ(end_of(child), 130);
  const std::string err = read_text(folder_ / "child.err");
  EXPECT_THAT(err, HasSubstr("grapnel: stopped: "));
  EXPECT_THAT(err, HasSubstr(" of 200000 cases are kept in r; to resume: grapnel campaign study.yaml -o r -j 2\n"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "lock"));
}

TEST_F(LongCampaign, FullDiskReportedAndResultsPreserved) {
  study(4000);
  ASSERT_EQ(run("campaign study.yaml -o calm --quiet").code, 0);
  write("limited",
        "ulimit -f 4\nexec '" GRAPNEL_PROGRAM "' campaign study.yaml -o r\n");  // blocks of 512 or 1024 bytes
  const int status = std::system(("cd '" + folder_.string() + "' && sh limited >out 2>err").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  const std::string err = read_text(folder_ / "err");
  EXPECT_THAT(err, HasSubstr("cannot write r/"));
  EXPECT_THAT(err, HasSubstr("File too large"));
  ASSERT_EQ(run("campaign study.yaml -o r --quiet").code, 0);
  expect_same_results("calm", "r");
}

// The file size limit admits the shards but not the table.
TEST_F(LongCampaign, TableBeyondFileSizeLimitIsNamed) {
  study(4000);
  ASSERT_EQ(run("campaign study.yaml -o r --quiet --no-csv --no-report").code, 0);
  const auto size = fs::file_size(folder_ / "r" / "table.h5");
  fs::remove(folder_ / "r" / "table.h5");
  // HDF5 buffers part of the table until the file is closed, so each limit fails at a different write.
  for (const std::uintmax_t limit : {size / 8, size / 2, size - 1024}) {
    write("limited", "ulimit -f " + std::to_string(limit / 512) +
                         "\nexec '" GRAPNEL_PROGRAM "' campaign study.yaml -o r --no-csv --no-report\n");
    const int status = std::system(("cd '" + folder_.string() + "' && sh limited >out 2>err").c_str());
    ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status) << " at " << limit;
    EXPECT_EQ(WEXITSTATUS(status), 1) << limit;
    const std::string err = read_text(folder_ / "err");
    EXPECT_THAT(err, HasSubstr("table.h5")) << limit;
    EXPECT_THAT(err, HasSubstr("File too large")) << limit;
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 2) << err;
  }
}

TEST_F(LongCampaign, FullFileSystemReportedAndResultsPreserved) {
  study(4000);
  fs::create_directory(folder_ / "small");
  if (mount("none", (folder_ / "small").c_str(), "tmpfs", 0, "size=300k") != 0)
    GTEST_SKIP() << "no file system can be mounted here";
  const Outcome o = run("campaign study.yaml -o small/r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("cannot write small/r/shards/"));
  EXPECT_THAT(o.err, HasSubstr("No space left on device"));
  EXPECT_THAT(o.err, HasSubstr("the files in small/r remain valid; to resume: grapnel campaign study.yaml -o small/r"));
  EXPECT_GT(shards("small/r"), 3u);
  EXPECT_EQ(mount("none", (folder_ / "small").c_str(), "tmpfs", MS_REMOUNT, "size=30m"), 0);
  const Outcome again = run("campaign study.yaml -o small/r");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.out, Not(HasSubstr(", 0 of them complete")));
  ASSERT_EQ(run("campaign study.yaml -o calm --quiet").code, 0);
  expect_same_results("calm", "small/r");
  EXPECT_EQ(umount((folder_ / "small").c_str()), 0);
}

#ifdef GRAPNEL_MPI_PROGRAM
class MpiCampaign : public Campaign {
 protected:
  Outcome run_ranks(int ranks, const std::string& arguments) const {
    write("script", GRAPNEL_MPIEXEC " --oversubscribe -np " + std::to_string(ranks) + " '" GRAPNEL_MPI_PROGRAM "' " +
                        arguments + "\n");
    const int status = std::system(("cd '" + folder_.string() +
                                    "' && OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
                                    "OMPI_MCA_btl_vader_single_copy_mechanism=none sh script >out 2>err </dev/null")
                                       .c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(folder_ / "out"), read_text(folder_ / "err")};
  }
};

TEST_F(MpiCampaign, TheSameBytesForAnyNumberOfRanks) {
  study(2000);
  ASSERT_EQ(run("campaign study.yaml -o serial --quiet").code, 0);
  for (int ranks = 1; ranks <= 4; ++ranks) {
    const std::string folder = "ranks" + std::to_string(ranks);
    const Outcome o = run_ranks(ranks, "campaign study.yaml -o " + folder);
    ASSERT_EQ(o.code, 0) << ranks << " ranks: " << o.err;
    EXPECT_THAT(o.out, HasSubstr("2000 cases, " + std::to_string(ranks) + " ranks"));
    expect_same_results("serial", folder);
    EXPECT_FALSE(fs::exists(folder_ / folder / "lock"));
  }
}

TEST_F(MpiCampaign, ErrorEndsAllRanks) {
  study(500);
  EXPECT_EQ(run_ranks(3, "campaign nowhere.yaml").code, 2);
  EXPECT_EQ(run_ranks(3, "campaign study.yaml --nonsense").code, 2);
  ASSERT_EQ(run("campaign study.yaml -o r --quiet").code, 0);
  study(501);
  const Outcome o = run_ranks(3, "campaign study.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("holds another campaign"));
}
#endif

}  // namespace campaign_test
}  // namespace grapnel
