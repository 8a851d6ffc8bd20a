#include "grapnel/study/case_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <stdexcept>
#include <thread>

namespace grapnel {
namespace case_pool_test {

CaseRow row_of(std::size_t index) {
  return {index, index % 4 == 0 ? CaseStatus::failed : CaseStatus::ok, {}, {static_cast<double>(index)}};
}

PoolOptions threads(int count) { return {.threads = count}; }

TEST(CasePool, EveryJobIsDoneOnceAndItsRowsComeInOrder) {
  for (const int count : {1, 2, 3, 8, 100}) {
    std::map<std::size_t, std::size_t> next;  // row, per job
    const std::thread::id here = std::this_thread::get_id();
    const auto work = [](std::size_t job, const RowSink& hand_in, const std::stop_token&) {
      std::this_thread::sleep_for(std::chrono::microseconds(job % 3 == 0 ? 900 : 10));  // they overtake each other
      for (std::size_t i = 0; i < 3; ++i) hand_in({row_of(3 * job + i)});
    };
    const auto take = [&](std::size_t job, std::vector<CaseRow> rows) {
      EXPECT_EQ(std::this_thread::get_id(), here);
      ASSERT_EQ(rows.size(), 1u);
      EXPECT_EQ(rows[0].index, 3 * job + next[job]++);
    };
    CaseProgress begun;
    begun.done = begun.begun_with = 5;
    begun.total = 125;
    PoolOptions options = threads(count);
    std::uint64_t seen = 0;
    options.progress = [&](const CaseProgress& at) {
      EXPECT_GE(at.done, seen);
      seen = at.done;
    };
    const CaseProgress done = run_jobs(40, options, begun, work, take);
    EXPECT_EQ(next.size(), 40u) << count;
    EXPECT_EQ(done.done, 125u);
    EXPECT_EQ(seen, 125u);
    EXPECT_EQ(done.not_ok, 30u);
    EXPECT_FALSE(done.stopped);
  }
}

TEST(CasePool, NothingToDoIsNoWork) {
  run_jobs(0, threads(2), {},
           [](std::size_t, const RowSink&, const std::stop_token&) { throw std::logic_error("called"); });
}

TEST(CasePool, ExceptionEndsTheWork) {
  std::atomic<int> begun = 0;
  const auto work = [&](std::size_t job, const RowSink& hand_in, const std::stop_token&) {
    ++begun;
    hand_in({row_of(job)});
    if (job == 7) throw std::invalid_argument("out of luck");
  };
  EXPECT_THROW(run_jobs(100000, threads(4), {}, work), std::invalid_argument);
  EXPECT_LT(begun, 100000);
  begun = 10;
  EXPECT_THROW(run_jobs(100000, threads(4), {}, work,
                        [](std::size_t job, const std::vector<CaseRow>&) {
                          if (job == 3) throw std::runtime_error("disk full");
                        }),
               std::runtime_error);
  EXPECT_LT(begun, 100000);
}

TEST(CasePool, AStopEndsTheWork) {
  std::stop_source stop;
  std::size_t rows = 0;
  PoolOptions options = threads(3);
  options.stop = stop.get_token();
  CaseProgress begun;
  begun.total = 100000;
  const CaseProgress done = run_jobs(
      100000, options, begun,
      [](std::size_t job, const RowSink& hand_in, const std::stop_token&) { hand_in({row_of(job)}); },
      [&](std::size_t, const std::vector<CaseRow>&) {
        if (++rows == 50) stop.request_stop();
      });
  EXPECT_GE(rows, 50u);
  EXPECT_LT(rows, 100000u);
  EXPECT_EQ(done.done, rows);
  EXPECT_TRUE(done.stopped);
}

}  // namespace case_pool_test
}  // namespace grapnel
