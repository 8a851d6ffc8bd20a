// From result folders to the page's data.

#include "grapnel/report/report_data.hpp"
#include "grapnel/report/run_data.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "grapnel/report/base64.hpp"
#include "grapnel/report/series_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "report/report_folder.hpp"
#include "result/sample_result.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace report_data_test {

namespace fs = std::filesystem;
using nlohmann::json;
using test::bytes_of;
using test::message_of;
using test::put_bytes;
using test::write_run;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct ReportDataOf : testing::Test {
  test::TemporaryFolder folder;

  json data() const { return json::parse(report_data(folder.path(), "1.2.3").json); }
  json run() const { return data()["runs"][0]; }
  std::vector<std::string> notes() const { return run()["notes"].get<std::vector<std::string>>(); }
  std::string fault() const {
    return message_of([&] { report_data(folder.path(), "1.2.3"); });
  }
};

TEST(Base64, MatchesTheStandard) {
  const auto text = [](std::string_view s) {
    const std::vector<std::uint8_t> bytes(s.begin(), s.end());
    return base64_of(std::span(bytes));
  };
  // RFC 4648, section 10.
  EXPECT_EQ(text(""), "");
  EXPECT_EQ(text("f"), "Zg==");
  EXPECT_EQ(text("fo"), "Zm8=");
  EXPECT_EQ(text("foo"), "Zm9v");
  EXPECT_EQ(text("foobar"), "Zm9vYmFy");
  EXPECT_EQ(text("\xff\xfe\xfd"), "//79");
  const std::vector<double> numbers{1, -0.0, 1e300, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_TRUE(test::same_numbers(test::numbers_from_base64<double>(base64_of(std::span(numbers))), numbers));
}

TEST_F(ReportDataOf, ARunHasAllItsFiles) {
  write_run(folder.path());
  const json all = data(), run = all["runs"][0];
  EXPECT_EQ(all["schema"], "grapnel-report/1");
  EXPECT_EQ(all["version"], "1.2.3");
  EXPECT_EQ(all["kind"], "run");
  EXPECT_EQ(all["title"], "sample");
  EXPECT_EQ(all["runs"].size(), 1u);
  EXPECT_EQ(run["label"], "");
  EXPECT_FALSE(run.contains("folder"));
  EXPECT_EQ(run["summary"], json::parse(bytes_of(folder / "summary.json")));
  EXPECT_EQ(run["scene"], json::parse(bytes_of(folder / "scene.json")));
  EXPECT_THAT(notes(), IsEmpty());
}

TEST_F(ReportDataOf, TheScenariosTextsAreThere) {
  write_run(folder.path());
  EXPECT_TRUE(run()["source"].is_null());  // results of earlier versions have none
  EXPECT_THAT(notes(), IsEmpty());
  SourceTexts texts;
  texts.description = "A <b>hand</b>";
  texts.add("scenario", "name: sample\n");
  texts.add("robot", std::string(SourceTexts::kLargestText + 1, 'x'));
  texts.settings = {"approach.duration=10"};
  put_bytes(folder / "scenario.json", source_texts_json(texts, "sample", "0123456789abcdef", "0.1.0"));
  const json source = run()["source"];
  EXPECT_EQ(source["description"], "A <b>hand</b>");
  EXPECT_EQ(source["settings"], json({"approach.duration=10"}));
  EXPECT_EQ(source["files"][0], (json{{"part", "scenario"}, {"bytes", 13}, {"text", "name: sample\n"}}));
  EXPECT_EQ(source["files"][1]["text"], "");
  EXPECT_EQ(source["files"][1]["bytes"], SourceTexts::kLargestText + 1);
  EXPECT_THAT(notes(), IsEmpty());
}

TEST_F(ReportDataOf, TextsOfAnotherScenarioAreNotShown) {
  write_run(folder.path());
  put_bytes(folder / "scenario.json", source_texts_json({}, "sample", "fedcba9876543210", "0.1.0"));
  EXPECT_TRUE(run()["source"].is_null());
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("scenario.json is of scenario 'sample' (sha256 fedcba987654)")));
  put_bytes(folder / "scenario.json", "{");
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("the scenario's text is not shown: ")));
}

TEST_F(ReportDataOf, SeriesComeBackFromTheirPacking) {
  const TimeSeries s = test::sliding_series(200);
  write_run(folder.path(), "sample", "0123456789abcdef", s);
  const json packed = run()["series"];
  const double bound = packed["bound"].get<double>();
  EXPECT_EQ(bound, kFinestBound);
  const auto kept = *kept_samples(s, bound);
  EXPECT_EQ(packed["of"], s.time.size());
  ASSERT_EQ(packed["samples"], kept.size());
  EXPECT_LT(kept.size(), s.time.size() / 2);
  EXPECT_EQ(packed["phases"], json(s.phases));
  const auto time = test::numbers_from_base64<double>(packed["time"].get<std::string>());
  const auto phase = test::numbers_from_base64<std::uint8_t>(packed["phase"].get<std::string>());
  ASSERT_EQ(time.size(), kept.size());
  ASSERT_EQ(phase.size(), kept.size());
  ASSERT_EQ(packed["series"].size(), s.series.size());
  for (std::size_t n = 0; n < s.series.size(); ++n) {
    const json one = packed["series"][n];
    EXPECT_EQ(one["path"], s.series[n].path);
    EXPECT_EQ(one["unit"], s.series[n].unit);
    EXPECT_EQ(one["description"], s.series[n].description);
    EXPECT_EQ(one["components"], json(s.series[n].components));
    const auto values = test::numbers_from_base64<float>(one["data"].get<std::string>());
    const std::size_t width = s.series[n].components.size();
    ASSERT_EQ(values.size(), kept.size() * width);
    for (std::size_t k = 0; k < kept.size(); ++k) {
      EXPECT_EQ(time[k], s.time[kept[k]]);
      EXPECT_EQ(phase[k], s.phase[kept[k]]);
      for (std::size_t c = 0; c < width; ++c)
        EXPECT_EQ(values[k * width + c], static_cast<float>(s.series[n].data[kept[k] * width + c]));
    }
  }
}

TEST_F(ReportDataOf, NoNumbersSurviveThePacking) {
  TimeSeries s = test::sliding_series(5);
  s.series[4].data[3] = std::numeric_limits<double>::quiet_NaN();
  s.series[4].data[7] = -std::numeric_limits<double>::infinity();
  write_run(folder.path(), "sample", "0123456789abcdef", s);
  const auto values = test::numbers_from_base64<float>(run()["series"]["series"][4]["data"].get<std::string>());
  EXPECT_EQ(std::count_if(values.begin(), values.end(), [](float x) { return std::isnan(x); }), 1);
  EXPECT_EQ(std::count(values.begin(), values.end(), -std::numeric_limits<float>::infinity()), 1);
}

// Equal times all stay: 10 samples of 9 + 4 * 15 bytes.
TEST_F(ReportDataOf, SeriesThatStayTooLargeForAPageAreRefused) {
  TimeSeries s = test::sliding_series(5);
  std::fill(s.time.begin(), s.time.end(), 1.0);
  EXPECT_EQ(packed_series(s, 690)["samples"], 10);
  EXPECT_EQ(test::message_of([&] { packed_series(s, 689); }),
            "10 samples of 15 numbers exceed the limit of a page, and the tolerance admits no further reduction");
}

TEST_F(ReportDataOf, TheSameResultsGiveTheSameBytes) {
  write_run(folder / "a");
  fs::create_directory(folder / "b");
  fs::copy(folder / "a", folder / "b" / "a");
  const std::string first = report_data(folder / "a", "1").json;
  EXPECT_TRUE(first == report_data(folder / "b" / "a", "1").json);
  EXPECT_TRUE(first == report_data(folder / "b" / ".." / "a" / "", "1").json);
}

TEST_F(ReportDataOf, MissingFilesAreNotes) {
  write_run(folder.path());
  fs::remove(folder / "scene.json");
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("scene.json is missing")));
  EXPECT_TRUE(run()["scene"].is_null());
  EXPECT_FALSE(run()["series"].is_null());
  fs::remove(folder / "timeseries.h5");
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("scene.json is missing"), HasSubstr("timeseries.h5 is missing")));
  EXPECT_TRUE(run()["series"].is_null());
}

TEST_F(ReportDataOf, DamagedFilesAreNotesWithTheirFault) {
  write_run(folder.path());
  const std::string series = bytes_of(folder / "timeseries.h5"), scene = bytes_of(folder / "scene.json");
  put_bytes(folder / "timeseries.h5", series.substr(0, series.size() / 2));
  put_bytes(folder / "scene.json", scene.substr(0, scene.size() / 2));
  ASSERT_EQ(notes().size(), 2u);
  EXPECT_THAT(notes()[0], HasSubstr("scene.json: not JSON: parse error at line"));
  EXPECT_THAT(notes()[1], HasSubstr("timeseries.h5: "));
  EXPECT_TRUE(run()["scene"].is_null());
  EXPECT_TRUE(run()["series"].is_null());
  put_bytes(folder / "timeseries.h5", "");
  put_bytes(folder / "scene.json", R"({"schema": "grapnel-scene/1"})");
  EXPECT_THAT(notes()[0], HasSubstr("schema is 'grapnel-scene/1', not grapnel-scene/2"));
  EXPECT_THAT(notes()[1], HasSubstr("not an HDF5 file"));
}

// Cut or altered anywhere: a note, or the file is used; the page opens.
TEST_F(ReportDataOf, NoDamageBesidesTheSummaryIsFatal) {
  write_run(folder.path());
  int noted = 0;
  for (const char* file : {"scene.json", "timeseries.h5"}) {
    const std::string sound = bytes_of(folder / file);
    for (std::size_t k = 0; k < 40; k += test::kSanitized ? 8 : 1) {
      const std::size_t at = k * sound.size() / 40;
      std::string altered = sound;
      altered[at] = static_cast<char>(altered[at] ^ 0x14);
      for (const std::string& bytes : {sound.substr(0, at), altered}) {
        put_bytes(folder / file, bytes);
        noted += notes().empty() ? 0 : 1;
      }
    }
    put_bytes(folder / file, sound);
  }
  EXPECT_GT(noted, test::repetitions(120));  // of 160
}

TEST_F(ReportDataOf, FilesOfAnotherRunAreNoted) {
  write_run(folder.path());
  write_run(folder / "other", "another", "fedcba9876543210");
  fs::copy_file(folder / "other" / "scene.json", folder / "scene.json", fs::copy_options::overwrite_existing);
  EXPECT_THAT(notes(), ElementsAre("scene.json is of scenario 'another' (sha256 fedcba987654), summary.json of "
                                   "scenario 'sample' (sha256 0123456789ab)"));
  fs::copy_file(folder / "other" / "timeseries.h5", folder / "timeseries.h5", fs::copy_options::overwrite_existing);
  EXPECT_THAT(notes(), ElementsAre(HasSubstr("scene.json"), HasSubstr("timeseries.h5 is of scenario 'another'")));
}

TEST_F(ReportDataOf, BodiesWithoutMotionAreNoted) {
  TimeSeries s = test::sliding_series(5);
  s.series[2].path = "targets/other/position";
  write_run(folder.path(), "sample", "0123456789abcdef", s);
  EXPECT_THAT(notes(), ElementsAre("timeseries.h5 has no motion of body 'debris'"));
}

TEST_F(ReportDataOf, WithoutASoundSummaryThereIsNoReport) {
  write_run(folder.path());
  const fs::path path = folder / "summary.json";
  const std::string sound = bytes_of(path);
  put_bytes(path, sound.substr(0, sound.size() / 2));
  EXPECT_THAT(fault(), HasSubstr(path.string() + ": not JSON: parse error at line"));
  put_bytes(path, "");
  EXPECT_THAT(fault(), HasSubstr(path.string() + ": not JSON"));
  put_bytes(path, "[1, 2]");
  EXPECT_EQ(fault(), path.string() + ": not a JSON object");
  put_bytes(path, "{}");
  EXPECT_EQ(fault(), path.string() + ": key 'schema' is missing; it should be grapnel-summary/2");
  put_bytes(path, R"({"schema": "grapnel-summary/3"})");
  EXPECT_EQ(fault(), path.string() + ": schema is 'grapnel-summary/3', not grapnel-summary/2");
  put_bytes(path, R"({"schema": "grapnel-summary/1", "scenario": {"name": 5}})");
  EXPECT_EQ(fault(), path.string() + ": key 'scenario/name' is not a text");
  put_bytes(path, R"({"schema": "grapnel-summary/1", "scenario": "none"})");
  EXPECT_EQ(fault(), path.string() + ": key 'scenario/name' is missing");
  put_bytes(path,
            R"({"schema": "grapnel-summary/1", "x": )" + std::string(100000, '[') + std::string(100000, ']') + "}");
  EXPECT_EQ(fault(), path.string() + ": damaged: nested deeper than 64 levels");
  fs::remove(path);
  fs::create_directory(path);
  EXPECT_EQ(fault(), path.string() + ": not a file");
}

TEST_F(ReportDataOf, AFolderWithoutResultsSaysWhatWasLookedFor) {
  EXPECT_EQ(fault(), folder.path().string() +
                         ": no results: expected summary.json (of grapnel run), study.json (of grapnel sweep), "
                         "comparison.json (of grapnel optimize), campaign.json (of grapnel campaign)");
  const auto of = [&](const fs::path& path) { return message_of([&] { report_data(path, "1"); }); };
  EXPECT_EQ(of(folder / "nowhere"), (folder / "nowhere").string() + ": no such folder");
  put_bytes(folder / "file", "");
  EXPECT_EQ(of(folder / "file"), (folder / "file").string() + ": not a folder");
  put_bytes(folder / "summary.json", "{}");
  put_bytes(folder / "study.json", "{}");
  EXPECT_THAT(fault(), HasSubstr("results of several kinds, summary.json (of grapnel run) and study.json"));
}

TEST_F(ReportDataOf, TwoRunsAreCompared) {
  write_run(folder / "first");
  write_run(folder / "second", "other", "fedcba9876543210");
  const ReportData report = comparison_data(folder / "first", folder / "second", "1.2.3");
  EXPECT_EQ(report.title, "sample and other");
  const json all = json::parse(report.json);
  EXPECT_EQ(all["kind"], "comparison");
  EXPECT_EQ(all["title"], report.title);
  EXPECT_EQ(all["runs"][0]["label"], "A");
  EXPECT_EQ(all["runs"][1]["label"], "B");
  EXPECT_EQ(all["runs"][0]["folder"], "first");
  EXPECT_EQ(all["runs"][1]["summary"]["scenario"]["name"], "other");
  put_bytes(folder / "second" / "study.json", "{}");
  fs::remove(folder / "second" / "summary.json");
  EXPECT_EQ(message_of([&] { comparison_data(folder / "first", folder / "second", "1"); }),
            (folder / "second").string() + ": not a run; only runs can be compared");
}

TEST_F(ReportDataOf, ALongRunStaysSmall) {
  SKIP_UNDER_SANITIZERS();
  const TimeSeries s = test::sliding_series(100'000);
  write_run(folder.path(), "sample", "0123456789abcdef", s);
  EXPECT_EQ(run()["series"]["of"], 200'000);
  EXPECT_LT(report_data(folder.path(), "1").json.size(), 200'000u);  // measured below 100 kB
}

}  // namespace report_data_test
}  // namespace grapnel
