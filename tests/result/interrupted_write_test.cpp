/// @file
/// Writers that are stopped by a full disk or killed: what was there before stays, complete.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/series_export.hpp"
#include "result/sample_result.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace interrupted_write_test {

using test::bytes_of;
using test::message_of;
using test::sample_metadata;
using test::sample_series;
using test::TemporaryFolder;
using testing::HasSubstr;

/// What `action` threw in a child process where no file may grow beyond `limit` bytes: a disk that is full.
std::string message_with_full_disk(rlim_t limit, const std::filesystem::path& report,
                                   const std::function<void()>& action) {
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit soft{limit, RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &soft);
    const std::string message = message_of(action);
    const rlimit none{RLIM_INFINITY, RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &none);
    test::put_bytes(report, message);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  return bytes_of(report);
}

struct Writer {
  const char* name;
  void (*write)(const TimeSeries&, const std::filesystem::path&);
};

class FullDisk : public testing::TestWithParam<Writer> {};

TEST_P(FullDisk, LeavesThePreviousFileAndNothingElse) {
  const TemporaryFolder folder, reports;
  const std::filesystem::path path = folder / "file";
  GetParam().write(sample_series(10), path);
  const std::string before = bytes_of(path);
  const TimeSeries large = sample_series(20000);
  for (const rlim_t limit : {0, 100, 10000, 200000}) {
    const std::string message =
        message_with_full_disk(limit, reports / "message", [&] { GetParam().write(large, path); });
    EXPECT_THAT(message, HasSubstr("cannot write " + path.string())) << "limit " << limit;
    EXPECT_EQ(bytes_of(path), before) << "limit " << limit;
    EXPECT_EQ(folder.files(), 1) << "limit " << limit;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Writers, FullDisk,
    testing::Values(
        Writer{"hdf5",
               [](const TimeSeries& s, const auto& path) { write_timeseries_hdf5(s, sample_metadata(), path); }},
        Writer{"csv", [](const TimeSeries& s, const auto& path) { write_timeseries_csv(s, path); }},
        Writer{"mat", [](const TimeSeries& s, const auto& path) { write_timeseries_mat(s, sample_metadata(), path); }},
        Writer{"text", [](const TimeSeries& s,
                          const auto& path) { write_file_atomically(path, std::string(50 * s.time.size(), 'x')); }}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(KilledWriter, LeavesTheOldOrTheNewFile) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "timeseries.h5";
  const TimeSeries series[2] = {sample_series(3000), sample_series(4000)};
  for (int round = 0; round < test::repetitions(60); ++round) {
    int done[2];  // the child reports each written file
    ASSERT_EQ(::pipe(done), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      for (int i = round;; ++i) {
        write_timeseries_hdf5(series[i % 2], sample_metadata(), path);
        if (::write(done[1], "x", 1) != 1) ::_exit(1);
      }
    }
    char byte = 0;
    EXPECT_EQ(::read(done[0], &byte, 1), 1);                 // one is complete; the next is being written,
    ::usleep(static_cast<useconds_t>(977 * round % 20000));  // somewhere
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ::close(done[0]);
    ::close(done[1]);
    const std::size_t samples = read_timeseries(path).series.time.size();  // throws if it is neither
    ASSERT_TRUE(samples == 3000 || samples == 4000) << samples;
  }
}

}  // namespace interrupted_write_test
}  // namespace grapnel
