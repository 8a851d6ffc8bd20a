// Summaries of real runs keep the published schema: every shipped scenario, every impact law, runs that fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_fields.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/schema_check.hpp"

namespace grapnel::testing {
namespace summary_schema_test {

namespace fs = std::filesystem;

std::vector<std::string> faults_of(const fs::path& scenario, const std::vector<Override>& overrides = {}) {
  static const test::SchemaCheck schema(json_schema(type_of<Summary>(), "summary"));
  const CaptureResult result =
      simulate_capture(load_scenario(fs::path(GRAPNEL_SOURCE_DIR) / "scenarios" / scenario, overrides));
  return schema.faults_of(nlohmann::json::parse(summary_json(result, "test")));
}

std::vector<std::string> shipped() {
  std::vector<std::string> all;
  for (const char* folder : {"", "thesis"}) {
    for (const auto& entry : fs::directory_iterator(fs::path(GRAPNEL_SOURCE_DIR) / "scenarios" / folder)) {
      if (entry.path().extension() == ".yaml") all.push_back((fs::path(folder) / entry.path().filename()).string());
    }
  }
  return all;
}

class Shipped : public ::testing::TestWithParam<std::string> {};

TEST_P(Shipped, KeepsTheSchema) { EXPECT_THAT(faults_of(GetParam()), ::testing::IsEmpty()); }

INSTANTIATE_TEST_SUITE_P(SummarySchema, Shipped, ::testing::ValuesIn(shipped()), [](const auto& file) {
  std::string words;
  for (const char c : file.param.substr(0, file.param.size() - 5)) words += std::isalnum(c) ? c : '_';
  return words;
});

// The shipped scenarios have friction and compliant.
TEST(SummarySchema, IsKeptByEveryLaw) {
  for (const char* law : {"bilateral_restitution", "as_published"})
    EXPECT_THAT(faults_of("thesis/open-loop-case-1.yaml", {{"impact.law", law}}), ::testing::IsEmpty()) << law;
  for (const char* joints : {"braked", "driven"})
    EXPECT_THAT(faults_of("thesis/closed-loop-at-contact.yaml", {{"impact.joints", joints}}), ::testing::IsEmpty())
        << joints;
}

TEST(SummarySchema, IsKeptByRunsThatFail) {
  EXPECT_THAT(faults_of("heavy-satellite-flat-spin.yaml", {{"targets.satellite.state.position", "[-0.3, 0.4, 9.9]"}}),
              ::testing::IsEmpty());
}

}  // namespace summary_schema_test
}  // namespace grapnel::testing
