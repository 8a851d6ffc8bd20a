// What is published of summary.json: its schema, its page, and the viewer's types say the same as the file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "grapnel/result/summary.hpp"
#include "result/sample_result.hpp"
#include "support/schema_check.hpp"

namespace grapnel::test {
namespace {

using nlohmann::json;
using testing::IsEmpty;
using testing::Not;

json parsed(const CaptureResult& result) { return json::parse(summary_json(result, "1.2.3")); }

const SchemaCheck& schema() {
  static const SchemaCheck check(summary_schema());
  return check;
}

TEST(SummaryContract, FilesKeepTheSchema) {
  EXPECT_THAT(schema().faults_of(parsed(sample_result())), IsEmpty());
  EXPECT_THAT(schema().faults_of(parsed(sample_result_with_laws())), IsEmpty());
  EXPECT_THAT(schema().faults_of(parsed({})), IsEmpty());
  CaptureResult fixed = sample_result();
  fixed.impact->as_published.reset();
  fixed.plan->searched = false;
  fixed.clearance.clear(), fixed.grips.clear(), fixed.grip_loads.clear();
  EXPECT_THAT(schema().faults_of(parsed(fixed)), IsEmpty());
}

TEST(SummaryContract, TheSchemaSeesFaults) {
  const json good = parsed(sample_result_with_laws());
  const auto broken = [&](const std::string& pointer, const json& value) {
    json document = good;
    document[json::json_pointer(pointer)] = value;
    return schema().faults_of(document);
  };
  EXPECT_THAT(broken("/unknown", 1), Not(IsEmpty()));
  EXPECT_THAT(broken("/schema", "grapnel-summary/1"), Not(IsEmpty()));
  EXPECT_THAT(broken("/status", "done"), Not(IsEmpty()));
  EXPECT_THAT(broken("/impact/grasps/0/impulse", {1, 2}), Not(IsEmpty()));
  EXPECT_THAT(broken("/impact/grasps/0/gap", nullptr), Not(IsEmpty()));
  EXPECT_THAT(broken("/impact/grasps/0/unknown", 1), Not(IsEmpty()));
  EXPECT_THAT(broken("/impact/measures/end_effectors/0/inverse_inertia/3/7", 1), Not(IsEmpty()));
  EXPECT_THAT(broken("/ledger/linear_momentum_drift/pass", "yes"), Not(IsEmpty()));
  EXPECT_THAT(broken("/ledger/linear_momentum_drift/pass", nullptr), IsEmpty());
  json document = good;
  document["impact"].erase("rank");
  EXPECT_THAT(schema().faults_of(document), Not(IsEmpty()));
  // A number that is none has no place where nothing says that it may be unknown.
  CaptureResult result = sample_result();
  result.impact->kinetic_energy_before = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(schema().faults_of(parsed(result)), Not(IsEmpty()));
}

TEST(SummaryContract, PageAndTypesAreAsTheProgramMakesThem) {
  const std::filesystem::path root = GRAPNEL_SOURCE_DIR;
  const std::string page = bytes_of(root / "docs/formats/summary.md");
  EXPECT_EQ(summary_page(page), page) << "run scripts/tables";
  EXPECT_EQ(summary_types(), bytes_of(root / "web/src/summary_types.ts")) << "run scripts/tables";
}

TEST(SummaryContract, APageThatLacksATableIsRefused) {
  const std::string page = bytes_of(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "docs/formats/summary.md");
  std::string other = page;
  other.replace(other.find("<!-- table LoopGap -->"), 22, "<!-- table LoopGaps -->");
  EXPECT_THROW(summary_page(other), std::runtime_error);
  EXPECT_THROW(summary_page(page.substr(page.find("<!-- table Approach -->"))), std::runtime_error);
  EXPECT_THROW(summary_page("<!-- table Summary -->"), std::runtime_error);
}

}  // namespace
}  // namespace grapnel::test
