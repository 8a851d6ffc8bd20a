#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace hdf5_test {

using test::bytes_of;
using test::message_of;
using test::sample_metadata;
using test::sample_series;
using test::TemporaryFolder;
using testing::HasSubstr;

class Hdf5RoundTrip : public testing::TestWithParam<int> {};

TEST_P(Hdf5RoundTrip, GivesEverythingBack) {
  const TemporaryFolder folder;
  const TimeSeries written = sample_series(GetParam());
  write_timeseries_hdf5(written, sample_metadata(), folder / "timeseries.h5");
  const TimeSeries read = read_timeseries(folder / "timeseries.h5").series;
  EXPECT_EQ(read.time, written.time);
  EXPECT_EQ(read.phase, written.phase);
  EXPECT_EQ(read.phases, written.phases);
  ASSERT_EQ(read.series.size(), written.series.size());
  for (std::size_t i = 0; i < read.series.size(); ++i) {
    EXPECT_EQ(read.series[i].path, written.series[i].path);  // in their order, too
    EXPECT_EQ(read.series[i].unit, written.series[i].unit);
    EXPECT_EQ(read.series[i].description, written.series[i].description);
    EXPECT_EQ(read.series[i].components, written.series[i].components);
    EXPECT_TRUE(test::same_numbers(read.series[i].data, written.series[i].data)) << read.series[i].path;
  }
  const TimeSeriesMetadata metadata = read_timeseries(folder / "timeseries.h5").head.metadata;
  EXPECT_EQ(metadata.version, "0.1.0");
  EXPECT_EQ(metadata.scenario_name, "sample");
  EXPECT_EQ(metadata.scenario_sha256, "0123456789abcdef");
  EXPECT_EQ(folder.files(), 1);
}

// Nothing, one sample, stored as is, several compressed chunks.
INSTANTIATE_TEST_SUITE_P(Samples, Hdf5RoundTrip, testing::Values(0, 1, 5, 701, 30000));

TEST(Hdf5, TheSameSeriesGivesTheSameBytes) {
  const TemporaryFolder folder;
  const TimeSeries series = sample_series(5000);
  write_timeseries_hdf5(series, sample_metadata(), folder / "a.h5");
  write_timeseries_hdf5(series, sample_metadata(), folder / "b.h5");
  EXPECT_EQ(bytes_of(folder / "a.h5"), bytes_of(folder / "b.h5"));
}

TEST(Hdf5, CompressesLargeDatasets) {
  const TemporaryFolder folder;
  TimeSeries series;
  series.phases = {"approach"};
  series.phase.assign(100000, 0);
  series.time.assign(100000, 0.5);
  series.series = {{"a", "1", "", {""}, std::vector<double>(100000, 0.25)}};
  write_timeseries_hdf5(series, sample_metadata(), folder / "a.h5");
  EXPECT_LT(std::filesystem::file_size(folder / "a.h5"), 100000u);  // measured 24 kB; 2 MB uncompressed
}

// The samples `begin` to `end` of a series.
TimeSeries part_of(const TimeSeries& series, std::size_t begin, std::size_t end) {
  TimeSeries part = series;
  drop_samples(part);
  const auto copy = [&](const auto& from, std::size_t width, auto& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(begin * width),
              from.begin() + static_cast<std::ptrdiff_t>(end * width));
  };
  copy(series.time, 1, part.time);
  copy(series.phase, 1, part.phase);
  for (std::size_t i = 0; i < series.series.size(); ++i)
    copy(series.series[i].data, series.series[i].components.size(), part.series[i].data);
  return part;
}

void expect_same(const TimeSeries& a, const TimeSeries& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.phase, b.phase);
  EXPECT_EQ(a.phases, b.phases);
  ASSERT_EQ(a.series.size(), b.series.size());
  for (std::size_t i = 0; i < a.series.size(); ++i) {
    EXPECT_EQ(a.series[i].path, b.series[i].path);
    EXPECT_EQ(a.series[i].unit, b.series[i].unit);
    EXPECT_EQ(a.series[i].components, b.series[i].components);
    EXPECT_TRUE(test::same_numbers(a.series[i].data, b.series[i].data)) << a.series[i].path;
  }
}

TEST(Hdf5, BlockwiseFileEqualsFileWrittenAtOnce) {
  const test::TemporaryFolder folder;
  const TimeSeries series = test::sample_series(70'001);
  TimeSeriesFile file(folder / "blocks.h5", test::sample_metadata());
  const std::size_t ends[] = {1, 30'000, 30'001, 69'000, 70'001};
  TimeSeries block;
  for (std::size_t i = 0; i < 5; ++i) {
    block = part_of(series, i == 0 ? 0 : ends[i - 1], ends[i]);
    if (i == 4) break;
    block.phases.resize(static_cast<std::size_t>(block.phase.back()) + 1);  // later phases have no name yet
    file.take(block);
    EXPECT_TRUE(block.time.empty());
    EXPECT_TRUE(block.series[0].data.empty());
    EXPECT_FALSE(std::filesystem::exists(folder / "blocks.h5"));  // not before it is complete
  }
  file.finish(block);
  EXPECT_EQ(file.samples(), 70'001u);
  expect_same(read_timeseries(folder / "blocks.h5").series, series);
  EXPECT_EQ(read_timeseries(folder / "blocks.h5").head.metadata.scenario_name, test::sample_metadata().scenario_name);
  EXPECT_EQ(folder.files(), 1);
}

TEST(Hdf5, FileOfOneBlockHasTheSameBytes) {
  const test::TemporaryFolder folder;
  TimeSeries series = test::sample_series(701);
  write_timeseries_hdf5(series, test::sample_metadata(), folder / "once.h5");
  TimeSeriesFile(folder / "block.h5", test::sample_metadata()).finish(series);
  EXPECT_EQ(test::bytes_of(folder / "once.h5"), test::bytes_of(folder / "block.h5"));
  TimeSeries none = test::sample_series(0);
  TimeSeriesFile(folder / "none.h5", test::sample_metadata()).finish(none);
  EXPECT_FALSE(std::filesystem::exists(folder / "none.h5"));
}

TEST(Hdf5, RunContinuesIfItsFileCannotBeWritten) {
  TimeSeries block = test::sample_series(701);
  TimeSeriesFile file("/nowhere/at/all.h5", test::sample_metadata());
  file.take(block);  // throws nothing
  EXPECT_TRUE(block.time.empty());
  try {
    file.finish(block);
    FAIL();
  } catch (const CannotWrite& error) {
    EXPECT_EQ(std::string(error.what()), "cannot write /nowhere/at/all.h5: No such file or directory");
  }
}

TEST(Hdf5, ThinnedSeriesKeepTheEndsOfPhases) {
  const test::TemporaryFolder folder;
  const TimeSeries series = test::sample_series(30'000);
  write_timeseries_hdf5(series, test::sample_metadata(), folder / "a.h5");
  const ReadTimeSeries all = read_timeseries(folder / "a.h5");
  EXPECT_EQ(all.head.every, 1u);
  expect_same(all.series, series);
  const ReadTimeSeries some = read_timeseries(folder / "a.h5", 100'000);
  EXPECT_EQ(some.head.samples, 30'000u);
  EXPECT_GT(some.head.every, 10u);
  EXPECT_LT(some.series.time.size(), 30'000 / some.head.every + 6);
  EXPECT_EQ(some.series.time.front(), series.time.front());
  EXPECT_EQ(some.series.time.back(), series.time.back());
  for (std::size_t i = 1; i < series.phase.size(); ++i) {
    if (series.phase[i] == series.phase[i - 1]) continue;
    for (const double t : {series.time[i - 1], series.time[i]})
      EXPECT_NE(std::find(some.series.time.begin(), some.series.time.end(), t), some.series.time.end()) << t;
  }
}

TEST(Hdf5, LeavesOutSeriesWithoutComponents) {
  const TemporaryFolder folder;
  TimeSeries series = sample_series(5);
  series.series.insert(series.series.begin(), {"joints/velocity", "rad/s", "no joints", {}, {}});
  write_timeseries_hdf5(series, sample_metadata(), folder / "a.h5");
  EXPECT_EQ(read_timeseries(folder / "a.h5").series.series.size(), series.series.size() - 1);
}

TEST(Hdf5, HoldsHundredsOfJoints) {
  const TemporaryFolder folder;
  TimeSeries series = sample_series(50);
  Series joints{"many/position", "rad", "", {}, {}};
  for (int i = 0; i < 1000; ++i) joints.components.push_back("joint_number_" + std::to_string(i));
  joints.data.assign(50000, 1.5);
  series.series.push_back(joints);
  write_timeseries_hdf5(series, sample_metadata(), folder / "a.h5");
  EXPECT_EQ(read_timeseries(folder / "a.h5").series.series.back().components, joints.components);
}

TEST(Hdf5, RefusesSeriesThatDoNotFit) {
  const TemporaryFolder folder;
  const auto message = [&](auto change) {
    TimeSeries series = sample_series(5);
    change(series);
    return message_of([&] { write_timeseries_hdf5(series, sample_metadata(), folder / "a.h5"); });
  };
  EXPECT_THAT(message([](TimeSeries& s) { s.series[0].data.pop_back(); }), HasSubstr("'base/position' has 14 numbers"));
  EXPECT_THAT(message([](TimeSeries& s) { s.phase[1] = 2; }), HasSubstr("phase 2 is not one of 2"));
  EXPECT_THAT(message([](TimeSeries& s) { s.phase.pop_back(); }), HasSubstr("4 phase numbers for 5 times"));
  EXPECT_THAT(message([](TimeSeries& s) { s.series[1].path = "base/position"; }), HasSubstr("appears twice"));
  EXPECT_THAT(message([](TimeSeries& s) { s.series[1].path = "time"; }), HasSubstr("'time' appears twice"));
  EXPECT_THAT(message([](TimeSeries& s) { s.series[1].path = "base"; }), HasSubstr("both a series and a group"));
  EXPECT_THAT(message([](TimeSeries& s) { s.series[1].path = "a//b"; }), HasSubstr("not a path"));
  EXPECT_THAT(message([](TimeSeries& s) { s.series[1].path = "../b"; }), HasSubstr("not a path"));
  EXPECT_EQ(folder.files(), 0);
}

TEST(Hdf5, IsReadByPythonWithUnits) {
  const TemporaryFolder folder;
  write_timeseries_hdf5(sample_series(3000), sample_metadata(), folder / "timeseries.h5");
  std::string output;
  const int status = test::run_python("read_timeseries.py", (folder / "timeseries.h5").string(), output);
  if (status == 77) GTEST_SKIP() << output;
  EXPECT_EQ(status, 0) << output;
}

}  // namespace hdf5_test
}  // namespace grapnel
