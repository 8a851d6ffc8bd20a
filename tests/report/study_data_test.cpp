// Studies in reports.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/optimization_report.hpp"
#include "grapnel/report/report_data.hpp"
#include "result/sample_result.hpp"
#include "support/sanitizers.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace study_data_test {

namespace fs = std::filesystem;
using nlohmann::json;
using test::bytes_of;
using test::message_of;
using test::put_bytes;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Two speeds by three labels with characters that CSV must quote; the last point failed.
struct Table {
  Campaign study;
  std::vector<CaseRow> rows;
};
Table table() {
  Table t;
  t.study.kind = CampaignKind::sweep;
  t.study.cases = 1;
  t.study.name = "speeds, \"quick\"";
  t.study.text = "name: speeds\n";
  t.study.file = "studies/my speeds.yaml";
  t.study.sha256 = "abc";
  t.study.design = {{"relative_speed", "m/s", "speed", true, {{0.1, ""}, {0.2, ""}}},
                    {"spin", "", "which", false, {{NAN, "at rest"}, {NAN, "both, \"turn\"\nfast"}, {NAN, "one"}}}};
  t.study.columns = {{"grasps/tip/impulse_magnitude", "N s", "how hard", {}}, {"captured", "1", "1: yes", {}}};
  for (std::size_t i = 0; i < 6; ++i) {
    const bool ok = i < 5;
    t.rows.push_back({i,
                      ok ? CaseStatus::ok : CaseStatus::unreachable,
                      ok ? "" : "too far, \"2 m\"\nbeyond",
                      {ok ? 1.0 / 3.0 + static_cast<double>(i) : NAN, ok ? 1.0 : NAN}});
  }
  return t;
}

struct StudyReport : testing::Test {
  test::TemporaryFolder folder;

  void write(const Table& t) const {
    std::string csv = csv_head(t.study);
    for (const CaseRow& row : t.rows) csv += csv_line(t.study, row);
    put_bytes(folder / "table.csv", csv);
    put_bytes(folder / "study.json", sweep_json(t.study, t.rows, "0.1.0"));
    EXPECT_THAT(test::contract_faults<SweepReport>(json::parse(bytes_of(folder / "study.json"))), IsEmpty());
  }
  json data() const { return json::parse(report_data(folder.path(), "1.2.3").json); }
  std::string fault() const {
    return message_of([&] { report_data(folder.path(), "1.2.3"); });
  }
};

TEST_F(StudyReport, ASweepHasItsTable) {
  write(table());
  const json all = data(), sweep = all["sweep"];
  EXPECT_EQ(all["kind"], "sweep");
  EXPECT_EQ(all["title"], "speeds, \"quick\"");
  EXPECT_EQ(all["runs"], json::array());
  EXPECT_EQ(sweep["settings"], json::parse(bytes_of(folder / "study.json")));
  EXPECT_EQ(sweep["command"], "grapnel sweep 'my speeds.yaml' --only {K} -o 'out/my speeds-point-'{K}");
  EXPECT_EQ(sweep["axes"][0], (json{{"name", "relative_speed"}, {"unit", "m/s"}, {"description", "speed"}}));
  EXPECT_EQ(sweep["axes"][1]["labels"], (json{"at rest", "both, \"turn\"\nfast", "one"}));
  EXPECT_EQ(sweep["axis_values"], (json{{0.1, 0.1, 0.1, 0.2, 0.2, 0.2}, {0, 1, 2, 0, 1, 2}}));
  EXPECT_EQ(sweep["status"][4], "ok");
  EXPECT_EQ(sweep["status"][5], "unreachable");
  EXPECT_EQ(sweep["reason"][5], "too far, \"2 m\"\nbeyond");
  EXPECT_EQ(sweep["columns"][0]["name"], "grasps/tip/impulse_magnitude");
  EXPECT_EQ(sweep["columns"][0]["unit"], "N s");
  EXPECT_EQ(sweep["values"].size(), 2u);
  EXPECT_EQ(sweep["values"][0][2], 2.33333333);  // nine digits
  EXPECT_TRUE(sweep["values"][0][5].is_null());
}

TEST_F(StudyReport, WhereTheStudysFileIsNotKnownThereIsNoCommand) {
  write(table());
  json settings = json::parse(bytes_of(folder / "study.json"));
  settings["study"].erase("file");
  put_bytes(folder / "study.json", settings.dump());
  EXPECT_EQ(data()["sweep"]["command"], "");
}

TEST_F(StudyReport, TablesThatDoNotFitAreErrors) {
  write(table());
  const std::string csv = bytes_of(folder / "table.csv"), path = (folder / "table.csv").string();
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = csv;
    text.replace(text.find(from), from.size(), to);
    put_bytes(folder / "table.csv", text);
    return fault();
  };
  EXPECT_EQ(changed("relative_speed [m/s]", "speed [m/s]"),
            path +
                ": line 1: column 2 is 'speed [m/s]' where study.json has 'relative_speed [m/s]': they are of "
                "different studies");
  EXPECT_EQ(changed("\n2,", "\n7,"), path + ": line 5: point '7' where 2 was expected");
  EXPECT_EQ(changed(",ok,,2.3333333333333335,", ",ok,,zwei,"),
            path + ": line 5: 'zwei' is no number, in column 'grasps/tip/impulse_magnitude [N s]'");
  EXPECT_EQ(changed(",ok,,2.3333333333333335,", ",ok,,2.3333333333333335,1,"),
            path + ": line 5: 8 fields where the first line has 7");
  put_bytes(folder / "table.csv", csv.substr(0, csv.rfind("5,")));
  EXPECT_THAT(fault(), HasSubstr("5 points where study.json has 6"));
  put_bytes(folder / "table.csv", csv.substr(0, csv.size() - 20));
  EXPECT_THAT(fault(), HasSubstr("a quote is not closed"));
  put_bytes(folder / "table.csv", csv + csv.substr(csv.rfind("5,")));
  EXPECT_THAT(fault(), HasSubstr("point '5' where 6 was expected"));
  put_bytes(folder / "table.csv", "");
  EXPECT_EQ(fault(), path + ": empty");
  fs::remove(folder / "table.csv");
  EXPECT_EQ(fault(), path + ": No such file or directory");
}

TEST_F(StudyReport, DamagedSettingsAreErrors) {
  write(table());
  const json sound = json::parse(bytes_of(folder / "study.json"));
  const std::string path = (folder / "study.json").string();
  const auto with = [&](const std::string& pointer, const json& value) {
    json settings = sound;
    settings[json::json_pointer(pointer)] = value;
    put_bytes(folder / "study.json", settings.dump());
    return fault();
  };
  EXPECT_EQ(with("/schema", "grapnel-study-table/9"),
            path + ": schema is 'grapnel-study-table/9', not grapnel-study-table/1");
  EXPECT_EQ(with("/points", 7), path + ": 7 points where the axes make 6");
  EXPECT_EQ(with("/points", "six"), path + ": number 'points' is missing");
  EXPECT_EQ(with("/axes", 3), path + ": list 'axes' is missing");
  EXPECT_EQ(with("/axes/0/values", json::array()), path + ": axis 'relative_speed' has no values");
  EXPECT_EQ(with("/columns/0", 3), path + ": an entry of 'columns' lacks the text 'name'");
  EXPECT_EQ(with("/columns/0/unit", 3), path + ": an entry of 'columns' lacks the text 'unit'");
}

// Truncated or altered anywhere: a message that names the file, or a report; never a crash.
TEST_F(StudyReport, NoDamageIsFatal) {
  write(table());
  int faults = 0;
  for (const char* file : {"table.csv", "study.json"}) {
    const std::string sound = bytes_of(folder / file);
    for (std::size_t at = 0; at < sound.size(); at += test::kSanitized ? 56 : 7) {
      std::string altered = sound;
      altered[at] = static_cast<char>(altered[at] ^ 0x14);
      for (const std::string& bytes : {sound.substr(0, at), altered}) {
        put_bytes(folder / file, bytes);
        const std::string message = fault();
        if (message.empty()) continue;
        EXPECT_THAT(message, HasSubstr(folder.path().string())) << file << " at " << at;
        ++faults;
      }
    }
    put_bytes(folder / file, sound);
  }
  EXPECT_GT(faults, test::repetitions(200));  // measured 299
  EXPECT_EQ(fault(), "");
}

TEST_F(StudyReport, TooLargeTableIsReported) {
  SKIP_UNDER_SANITIZERS();
  Table t = table();
  t.study.design[0].values.assign(1'000'000, {0.5, ""});
  t.rows.clear();
  put_bytes(folder / "table.csv", "");
  json settings = json::parse(sweep_json(t.study, t.rows, "0.1.0"));
  settings["points"] = 3'000'000;
  put_bytes(folder / "study.json", settings.dump());
  EXPECT_THROW(report_data(folder.path(), "1"), TooLarge);
  EXPECT_THAT(fault(), HasSubstr("3000000 lines of 5 columns are too much for a report"));
}

// An optimization of one variable with one limit, and three points.
struct ReportOfOptimization : StudyReport {
  void SetUp() override {
    Optimization o;
    o.name = "gentlest";
    o.text = "name: gentlest\n";
    o.sha256 = "abc";
    o.variables = {{"approach_angle", "deg", -60, 60, 0}};
    const auto none = [](const StudyCase&, const CaptureResult&) { return 0.0; };
    o.columns = {{"impulse", "N s", "", none}, {"ledger/excess", "1", "", none}};
    o.objective = {{{"impulse", "N s", {0}, Combine::largest}, 1}};
    o.limits = {{{"impulse", "N s", {0}, Combine::largest}, true, 2}};
    OptimizationOutcome outcome;
    const auto evaluation = [](std::size_t i, double angle, double impulse) {
      return Evaluation{{angle}, i / 2, {i, CaseStatus::ok, "", {impulse, 0}}, {true, impulse, {impulse}, 0, 0}};
    };
    outcome.before = evaluation(0, 0, 1.5);
    outcome.evaluations = {evaluation(0, 0, 1.5), evaluation(1, 10, 1.25), evaluation(2, 20, 1)};
    outcome.evaluations[1].row = {1, CaseStatus::unreachable, "too far, \"2 m\"", {NAN, NAN}};
    outcome.evaluations[1].score = {false, NAN, {NAN}, 0, 0};
    outcome.best = 2;
    put_bytes(folder / "evaluations.csv", evaluations_csv(o, outcome));
    put_bytes(folder / "comparison.json", comparison_json(o, outcome, &outcome.evaluations[2], "0.1.0"));
    EXPECT_THAT(test::contract_faults<OptimizationReport>(json::parse(bytes_of(folder / "comparison.json"))),
                IsEmpty());
  }
};

TEST_F(ReportOfOptimization, HasItsEvaluations) {
  put_bytes(folder / "best.yaml", "");
  const json all = data(), found = all["optimization"];
  EXPECT_EQ(all["kind"], "optimization");
  EXPECT_EQ(all["title"], "gentlest");
  EXPECT_EQ(found["comparison"], json::parse(bytes_of(folder / "comparison.json")));
  EXPECT_EQ(found["command"], "grapnel run best.yaml");
  std::vector<std::string> names, units;
  for (const json& column : found["columns"]) {
    names.push_back(column["name"]);
    units.push_back(column["unit"]);
  }
  EXPECT_THAT(names, ElementsAre("point", "approach_angle", "acceptable", "objective", "violation", "impulse at most 2",
                                 "impulse", "ledger/excess"));
  EXPECT_THAT(units, ElementsAre("1", "deg", "1", "N s", "1", "N s", "N s", "1"));
  EXPECT_EQ(found["values"][1], (json{0, 10, 20}));
  EXPECT_EQ(found["values"][3], (json{1.5, nullptr, 1}));
  EXPECT_EQ(found["search"], (json{"sample", "sample", "local 1"}));
  EXPECT_EQ(found["status"], (json{"ok", "unreachable", "ok"}));
  EXPECT_EQ(found["reason"][1], "too far, \"2 m\"");
}

TEST_F(ReportOfOptimization, WithoutABestThereIsNoCommand) { EXPECT_EQ(data()["optimization"]["command"], ""); }

TEST_F(ReportOfOptimization, TableOfAnotherSearchIsError) {
  std::string csv = bytes_of(folder / "evaluations.csv");
  csv.replace(csv.find("approach_angle"), 14, "approach_speed");
  put_bytes(folder / "evaluations.csv", csv);
  EXPECT_THAT(fault(), HasSubstr("evaluations.csv: line 1: column 3 is 'approach_speed [deg]' where comparison.json "
                                 "has 'approach_angle [deg]'"));
}

}  // namespace study_data_test
}  // namespace grapnel
