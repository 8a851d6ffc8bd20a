// Reports as the program's users meet them: files, exit codes, messages. What the page shows is tested with a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "program_run.hpp"

namespace grapnel {
namespace report_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kQuick = "--set approach.duration=2 --set post_impact.duration=1 ";

class Report : public test::ProgramRun {
 protected:
  void run_case(const std::string& name, const std::string& arguments = "") const {
    const Outcome o = run("run " + scenario("thesis/open-loop-case-1.yaml ") + kQuick + arguments + " -o " + name);
    ASSERT_EQ(o.code, 0) << o.err;
  }
  // The report's data, as the page reads them.
  nlohmann::json data(const std::string& file) const {
    const std::string page = read_text(folder_ / file), tag = "id=\"grapnel-data\">";
    const std::size_t begin = page.find(tag);
    if (begin == std::string::npos) return {};
    const std::size_t from = begin + tag.size();
    return nlohmann::json::parse(page.substr(from, page.find("</script", from) - from));
  }
  fs::path angles(const std::string& name = "study.yaml") const {
    return write(name, "name: angles\nscenario: " GRAPNEL_SOURCE_DIR
                       "/scenarios/thesis/open-loop-case-1-planned.yaml\n"
                       "set: {approach.plan.starts: 2, approach.duration: 2, post_impact.duration: 1}\naxes:\n"
                       "  - {quantity: approach_angle, unit: deg, values: [0, 10]}\n"
                       "  - {path: robot.base.mass, values: [400, 500]}\n"
                       "columns: [grasps/*/impulse_magnitude, kinetic_energy_after]\n");
  }
};

#ifdef GRAPNEL_HAS_VIEWER

TEST_F(Report, WrittenLast) {
  const Outcome o = run("run " + scenario("thesis/open-loop-case-1.yaml ") + kQuick + "-o r");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, EndsWith("results in r: summary.json, timeseries.h5, scene.json\nreport: r/report.html\n"));
  const auto report = data("r/report.html");
  EXPECT_EQ(report["kind"], "run");
  EXPECT_EQ(report["version"], "0.2.0");
  EXPECT_EQ(report["title"], "open-loop case 1");
  EXPECT_EQ(report["runs"][0]["summary"], nlohmann::json::parse(read_text(folder_ / "r" / "summary.json")));
  EXPECT_EQ(report["runs"][0]["scene"], nlohmann::json::parse(read_text(folder_ / "r" / "scene.json")));
  EXPECT_EQ(report["runs"][0]["notes"], nlohmann::json::array());
  EXPECT_GT(report["runs"][0]["series"]["samples"], 10);
}

TEST_F(Report, RecreatedFromResults) {
  run_case("r", "--quiet");
  const std::string first = read_text(folder_ / "r" / "report.html");
  fs::remove(folder_ / "r" / "report.html");
  const Outcome o = run("report r/");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.out, "r/report.html\n");
  EXPECT_EQ(o.err, "");
  EXPECT_TRUE(read_text(folder_ / "r" / "report.html") == first);
  EXPECT_EQ(run("report r -o new/place/page.html").out, "new/place/page.html\n");
  EXPECT_TRUE(read_text(folder_ / "new" / "place" / "page.html") == first);
}

TEST_F(Report, EarlierReportIsRemoved) {
  run_case("r", "--quiet");
  ASSERT_TRUE(fs::exists(folder_ / "r" / "report.html"));
  run_case("r", "--quiet --no-report");
  EXPECT_FALSE(fs::exists(folder_ / "r" / "report.html"));
}

TEST_F(Report, TwoRunsAreCompared) {
  run_case("a", "--no-report");
  run_case("b", "--no-report --set targets.target-1.mass=20");
  const Outcome o = run("report a b/");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.out, "a/report-vs-b.html\n");
  const auto report = data("a/report-vs-b.html");
  EXPECT_EQ(report["kind"], "comparison");
  EXPECT_FALSE(fs::exists(folder_ / "a" / "report.html"));
}

TEST_F(Report, DamagedSeriesIsNoteDamagedSummaryIsError) {
  run_case("r", "--no-report");
  const std::string series = read_text(folder_ / "r" / "timeseries.h5");
  std::ofstream(folder_ / "r" / "timeseries.h5", std::ios::binary) << series.substr(0, series.size() / 3);
  ASSERT_EQ(run("report r").code, 0);
  const auto run_data = data("r/report.html")["runs"][0];
  EXPECT_TRUE(run_data["series"].is_null());
  ASSERT_EQ(run_data["notes"].size(), 1u);
  EXPECT_THAT(run_data["notes"][0].get<std::string>(), HasSubstr("cannot read timeseries.h5"));

  std::ofstream(folder_ / "r" / "summary.json") << "{\"schema\": \"grapnel-summary/1\",";
  const Outcome o = run("report r");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.out, "");
  EXPECT_THAT(o.err, StartsWith("grapnel: error: r/summary.json: not JSON: parse error at line 1"));
}

TEST_F(Report, FoldersWithoutResultsAreNamed) {
  fs::create_directory(folder_ / "empty");
  Outcome o = run("report empty");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("grapnel: error: empty: no results: expected summary.json (of grapnel run)"));
  o = run("report nowhere");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.err, "grapnel: error: nowhere: no such folder\n");
  EXPECT_EQ(run("report").code, 2);
}

TEST_F(Report, ReportsWriteError) {
  run_case("r", "--no-report");
  write("occupied", "a file where the folder should be");
  const Outcome o = run("report r -o occupied/page.html");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("occupied"));
}

// The results exist and are printed; the missing page is a separate error.
TEST_F(Report, WriteErrorKeepsResults) {
  fs::create_directories(folder_ / "r" / "report.html" / "in the way");
  const std::string error = "grapnel: error: no report: cannot write r/report.html: Is a directory\n";
  Outcome o = run("run " + scenario("thesis/open-loop-case-1.yaml ") + kQuick + "-o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.out, EndsWith("results in r: summary.json, timeseries.h5, scene.json\n"));
  EXPECT_THAT(o.err, HasSubstr(error));
  EXPECT_TRUE(fs::exists(folder_ / "r" / "summary.json"));

  angles();
  o = run("sweep study.yaml -o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.out, EndsWith("results in r: table.csv, table.h5, study.json\n"));
  EXPECT_THAT(o.err, HasSubstr(error));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "table.partial.csv"));
}

TEST_F(Report, EscapesHostileName) {
  const std::string name = "</script><img src=x onerror=alert(1)>";
  run_case("r", "--quiet --set 'name=\"" + name + "\"'");
  const std::string page = read_text(folder_ / "r" / "report.html");
  EXPECT_THAT(page.substr(0, page.find("<style>")), HasSubstr("&lt;/script&gt;&lt;img"));
  EXPECT_EQ(page.find("<img src=x"), std::string::npos);
  EXPECT_EQ(data("r/report.html")["title"], name);
}

TEST_F(Report, SweepNamesCommandForPoint) {
  angles();
  const Outcome o = run("sweep study.yaml -o s");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, EndsWith("report: s/report.html\n"));
  const auto report = data("s/report.html");
  EXPECT_EQ(report["kind"], "sweep");
  EXPECT_EQ(report["sweep"]["command"], "grapnel sweep ../study.yaml --only {K} -o out/study-point-{K}");
  EXPECT_EQ(report["sweep"]["axis_values"], (nlohmann::json{{0, 0, 10, 10}, {400, 500, 400, 500}}));
  const std::string first = read_text(folder_ / "s" / "report.html");
  ASSERT_EQ(run("report s").code, 0);
  EXPECT_TRUE(read_text(folder_ / "s" / "report.html") == first);
}

// A terminal would execute control characters in the table.
TEST_F(Report, DamagedTableNamedWithoutControlCharacters) {
  write("study.yaml",
        "name: two\nscenario: " GRAPNEL_SOURCE_DIR
        "/scenarios/first-plan.yaml\nsimulate: impact\naxes:\n  - {path: 'targets[0].mass', values: [10, 20]}\n");
  ASSERT_EQ(run("sweep study.yaml -o s --no-report --quiet").code, 0);
  std::string table = read_text(folder_ / "s" / "table.csv");
  const std::string column = "targets[0].mass";
  ASSERT_NE(table.find(column), std::string::npos);
  write("s/table.csv", table.replace(table.find(column), column.size(), "tar\x1b[31mgets\xc2\x9b\a"));
  const Outcome o = run("report s");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("column 2 is 'tar?[31mgets?\?'"));
  EXPECT_THAT(o.err, Not(HasSubstr("\x1b")));
}

TEST_F(Report, OptimizationReport) {
  write("search.yaml", "name: search\nscenario: " GRAPNEL_SOURCE_DIR
                       "/scenarios/thesis/open-loop-case-1-planned.yaml\nset: {approach.plan.starts: 2}\n"
                       "simulate: impact\nminimize: grasps/*/impulse_magnitude\nvariables:\n"
                       "  - {quantity: approach_angle, grasp: tip-1, from: -10, to: 10, unit: deg}\n"
                       "search: {evaluations: 6}\n");
  const Outcome o = run("optimize search.yaml -o o");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, EndsWith("report: o/report.html\n"));
  const auto report = data("o/report.html");
  EXPECT_EQ(report["kind"], "optimization");
  EXPECT_EQ(report["optimization"]["command"], "grapnel run best.yaml");
  EXPECT_EQ(report["optimization"]["columns"][1]["name"], "tip-1.approach_angle");
}

#else

TEST_F(Report, ReportsMissingViewer) {
  const Outcome o = run("run " + scenario("thesis/open-loop-case-1.yaml ") + kQuick + "-o r");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("\nno report: this grapnel was built without Node.js"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "report.html"));
  const Outcome report = run("report r");
  EXPECT_EQ(report.code, 1);
  EXPECT_THAT(report.err, HasSubstr("grapnel: error: no report: this grapnel was built without Node.js; with"));
}

#endif

TEST_F(Report, NoReportOption) {
  const Outcome o = run("run " + scenario("thesis/open-loop-case-1.yaml ") + kQuick + "--no-report -o r");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, EndsWith("results in r: summary.json, timeseries.h5, scene.json\n"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "report.html"));
}

// A point of a study, as a scenario that gives what the study's table says.
TEST_F(Report, PointOfStudyIsCompleteRun) {
  angles();
  ASSERT_EQ(run("sweep study.yaml -o s --no-report --quiet").code, 0);
  const Outcome o = run("sweep study.yaml --only 3 -o p --no-report");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, StartsWith("grapnel 0.2.0, point 3 of study study.yaml as scenario p/scenario.yaml (sha256 "));
  EXPECT_FALSE(fs::exists(folder_ / "p" / "table.csv"));
  const std::string text = read_text(folder_ / "p" / "scenario.yaml");
  EXPECT_THAT(text, HasSubstr("point 3 of 4.\n#   approach_angle: 10 deg\n#   robot.base.mass: 500\n"));
  EXPECT_THAT(text, HasSubstr("name: \"open-loop case 1, planned, approach_angle 10 deg, robot.base.mass 500\""));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "p" / "summary.json"));
  const std::string csv = read_text(folder_ / "s" / "table.csv");
  const std::string last = csv.substr(csv.rfind("\n3,") + 1);
  const double listed = std::stod(last.substr(last.find("ok,,") + 4));
  EXPECT_NEAR(summary["impact"]["grasps"][0]["impulse_magnitude"].get<double>(), listed, 1e-12 * listed);  // measured 0

  // What was written runs by itself, wherever from.
  ASSERT_EQ(run("run p/scenario.yaml --no-report --quiet -o again").code, 0);
  EXPECT_EQ(read_text(folder_ / "again" / "summary.json"), read_text(folder_ / "p" / "summary.json"));
  EXPECT_EQ(run("sweep study.yaml --only 1 --no-report --quiet").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "study-point-1" / "summary.json"));
}

TEST_F(Report, PointNeverOverwritesUserScenario) {
  angles();
  const std::string own = "name: mine\n";
  write("scenario.yaml", own);
  const Outcome o = run("sweep study.yaml --only 1 -o .");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.err,
            "./scenario.yaml: error: already exists, and grapnel did not make it; choose another folder with -o\n");
  EXPECT_EQ(read_text(folder_ / "scenario.yaml"), own);
  ASSERT_EQ(run("sweep study.yaml --only 1 --no-report --quiet -o p").code, 0);
  EXPECT_EQ(run("sweep study.yaml --only 2 --no-report --quiet -o p").code, 0);  // its own is replaced
}

TEST_F(Report, MissingPointIsBadInput) {
  angles();
  const Outcome o = run("sweep study.yaml --only 4 -o p");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.err, "study.yaml: error: there is no point 4: the study has points 0 to 3\n");
  EXPECT_FALSE(fs::exists(folder_ / "p"));
  EXPECT_EQ(run("sweep study.yaml --only -1").code, 2);
  EXPECT_EQ(run("sweep study.yaml --only one").code, 2);
}

}  // namespace report_test
}  // namespace grapnel
