#include "grapnel/study/case_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>

namespace grapnel {
namespace {

CaseRow row_of(std::size_t index) { return {index, CaseStatus::ok, {}, {static_cast<double>(index)}}; }

TEST(CasePool, RowsComeInOrderWithoutGapsForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8, 100}) {
    std::vector<std::size_t> order;
    std::multiset<std::size_t> finished;
    run_cases(
        5, 45, threads,
        [](std::size_t i) {
          std::this_thread::sleep_for(std::chrono::microseconds(i % 3 == 0 ? 900 : 10));  // they overtake each other
          return row_of(i);
        },
        [&](CaseRow&& row) { order.push_back(row.index); }, [&](const CaseRow& row) { finished.insert(row.index); });
    ASSERT_EQ(order.size(), 40u) << threads;
    for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i + 5);
    EXPECT_EQ(finished.size(), 40u);
  }
}

TEST(CasePool, NothingToDoIsNoWork) {
  run_cases(
      3, 3, 2, [](std::size_t) -> CaseRow { throw std::logic_error("called"); }, [](CaseRow&&) {});
}

TEST(CasePool, WhatTheSinkThrowsEndsTheWork) {
  std::atomic<int> begun = 0;
  const auto sink = [](CaseRow&& row) {
    if (row.index == 3) throw std::runtime_error("disk full");
  };
  EXPECT_THROW(run_cases(
                   0, 100000, 4,
                   [&](std::size_t i) {
                     ++begun;
                     return row_of(i);
                   },
                   sink),
               std::runtime_error);
  EXPECT_LT(begun, 100000);
}

TEST(CasePool, AStopKeepsTheRowsBeforeIt) {
  std::stop_source stop;
  std::size_t rows = 0;
  run_cases(
      0, 100000, 3, [](std::size_t i) { return row_of(i); },
      [&](CaseRow&& row) {
        EXPECT_EQ(row.index, rows++);
        if (rows == 50) stop.request_stop();
      },
      {}, stop.get_token());
  EXPECT_GE(rows, 50u);
  EXPECT_LT(rows, 100000u);
}

}  // namespace
}  // namespace grapnel
