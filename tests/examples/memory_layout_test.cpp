// Results do not depend on the addresses of stack and heap, which the system randomizes for every run of a program.
#include <alloca.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>

#include "capture/recorded.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {
namespace memory_layout_test {

// The stack begins at any multiple of 16 bytes; vector registers hold up to 64.
constexpr std::size_t kUnit = 16;

// `padding` bytes further down the stack.
__attribute__((noinline)) CaptureResult run_further_down(const CaptureProblem& problem, std::size_t padding) {
  volatile char* pad = static_cast<char*>(alloca(padding + kUnit));
  pad[0] = 0;
  return simulate_capture(problem);
}

class MemoryLayout : public ::testing::TestWithParam<const char*> {};

TEST_P(MemoryLayout, ResultsAreBitIdentical) {
  const CaptureProblem problem =
      load_scenario(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios" / (std::string(GetParam()) + ".yaml"));
  const CaptureResult first = simulate_capture(problem);
  ASSERT_EQ(first.status, CaptureStatus::completed) << first.failure;
  const std::string summary = summary_json(first, "test");
  std::vector<std::unique_ptr<char[]>> between;  // shifts what is allocated later
  for (const std::size_t k : {1, 2}) {
    for (int i = 0; i < 64; ++i) between.push_back(std::make_unique<char[]>(kUnit * k + 24));
    const CaptureResult again = run_further_down(problem, kUnit * k);
    EXPECT_TRUE(summary_json(again, "test") == summary) << k;
    ASSERT_EQ(again.series.series.size(), first.series.series.size());
    for (std::size_t s = 0; s < first.series.series.size(); ++s) {
      const std::vector<double>&a = first.series.series[s].data, &b = again.series.series[s].data;
      ASSERT_EQ(a.size(), b.size());
      EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(double)), 0) << first.series.series[s].path;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenarios, MemoryLayout,
                         ::testing::Values("heavy-satellite-detumble", "compliant-grip", "thesis/closed-loop"),
                         [](const auto& file) {
                           std::string name;
                           for (const char* c = file.param; *c != 0; ++c) name += std::isalnum(*c) ? *c : '_';
                           return name;
                         });

}  // namespace memory_layout_test
}  // namespace grapnel::testing
