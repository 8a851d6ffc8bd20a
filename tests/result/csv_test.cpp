#include "grapnel/result/series_export.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/text_table.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace csv_test {

using Rows = std::vector<std::vector<std::string>>;

/// RFC 4180, with line feeds.
Rows parse(const std::string& text) {
  Rows rows{{""}};
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
      rows.back().back() += text[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == ',') {
      rows.back().emplace_back();
    } else if (!quoted && c == '\n') {
      rows.push_back({""});
    } else {
      rows.back().back() += c;
    }
  }
  EXPECT_EQ(rows.back(), std::vector<std::string>{""});  // the last line ends with a line feed, too
  rows.pop_back();
  return rows;
}

TEST(Csv, HasOneColumnPerComponentAndReadsBackExactly) {
  const test::TemporaryFolder folder;
  const TimeSeries series = test::sample_series(7000);  // several blocks
  write_timeseries_csv(series, folder / "a.csv");
  const Rows rows = parse(test::bytes_of(folder / "a.csv"));
  ASSERT_EQ(rows.size(), 7001u);
  const std::vector<std::string> header{"time [s]",
                                        "phase",
                                        "base/position/x [m]",
                                        "base/position/y [m]",
                                        "base/position/z [m]",
                                        "base/quaternion_wxyz/w [1]",
                                        "base/quaternion_wxyz/x [1]",
                                        "base/quaternion_wxyz/y [1]",
                                        "base/quaternion_wxyz/z [1]",
                                        "kinetic_energy [J]",
                                        "joints/position/left-1 [rad]",
                                        "joints/position/right, \"1\" [rad]",
                                        "end_effectors/left-hand/velocity/x [m/s]"};
  ASSERT_GE(rows[0].size(), header.size());
  EXPECT_TRUE(std::equal(header.begin(), header.end(), rows[0].begin()));
  std::vector<double> time, position, energy;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), rows[0].size());
    EXPECT_EQ(rows[i][1], i <= 3500 ? "approach" : "post_impact");
    time.push_back(std::strtod(rows[i][0].c_str(), nullptr));
    for (std::size_t j = 2; j < 5; ++j) position.push_back(std::strtod(rows[i][j].c_str(), nullptr));
    energy.push_back(std::strtod(rows[i][9].c_str(), nullptr));
  }
  EXPECT_TRUE(test::same_numbers(time, series.time));
  EXPECT_TRUE(test::same_numbers(position, series.series[0].data));
  EXPECT_TRUE(test::same_numbers(energy, series.series[2].data));
  EXPECT_EQ(rows[1][2], "NaN");
  EXPECT_EQ(rows[1][3], "Inf");
  EXPECT_EQ(rows[1][4], "-Inf");
}

TEST(Csv, TextsAreNoFormulas) {
  // Text that a spreadsheet would evaluate or send to a server remains text.
  EXPECT_EQ(csv_quoted("=HYPERLINK(\"http://a\")"), "\"'=HYPERLINK(\"\"http://a\"\")\"");
  for (const std::string text : {"=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\rx", "'=1", "''@x"}) {
    std::string field = csv_quoted(text);
    if (field.front() == '"') field = field.substr(1, field.size() - 2);
    EXPECT_EQ(field, "'" + text);
    EXPECT_EQ(csv_text_of(field), text);
  }
  for (const std::string text : {"", "approach", "'quoted'", "a=b", "1-2", "'"}) {
    EXPECT_EQ(csv_quoted(text), text);
    EXPECT_EQ(csv_text_of(text), text);
  }
}

TEST(Csv, NamesAScalarOnceAndOneJointInFull) {
  const test::TemporaryFolder folder;
  TimeSeries series;
  series.series = {{"system/kinetic_energy", "J", "", {"kinetic_energy"}, {}},
                   {"joints/position", "rad", "", {"q"}, {}}};
  write_timeseries_csv(series, folder / "a.csv");
  EXPECT_EQ(test::bytes_of(folder / "a.csv"), "time [s],phase,system/kinetic_energy [J],joints/position/q [rad]\n");
}

TEST(Csv, IsExportedFromAResultFolder) {
  const test::TemporaryFolder folder;
  write_timeseries_hdf5(test::sample_series(20), test::sample_metadata(), folder / "timeseries.h5");
  EXPECT_EQ(export_csv(folder.path()), folder / "timeseries.csv");
  write_timeseries_csv(test::sample_series(0), folder / "empty.csv");
  EXPECT_EQ(parse(test::bytes_of(folder / "timeseries.csv")).size(), 21u);
  EXPECT_EQ(parse(test::bytes_of(folder / "empty.csv")).size(), 1u);
  const std::string message = test::message_of([&] { export_csv(folder / "nowhere"); });
  EXPECT_NE(message.find("nowhere/timeseries.h5"), std::string::npos) << message;
}

}  // namespace csv_test
}  // namespace grapnel
