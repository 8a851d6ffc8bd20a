// What is published of summaries says the same as the files; tests/app/result_contract_test.cpp: of all documents.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "result/sample_result.hpp"
#include "support/schema_check.hpp"

namespace grapnel::test {
namespace result_contract_test {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::IsEmpty;
using testing::Not;

json parsed(const CaptureResult& result) { return json::parse(summary_json(result, "1.2.3")); }

const SchemaCheck& schema() {
  static const SchemaCheck check(json_schema(type_of<Summary>(), "summary"));
  return check;
}

TEST(SummaryContract, FilesFollowTheSchema) {
  EXPECT_THAT(schema().faults_of(parsed(sample_result())), IsEmpty());
  EXPECT_THAT(schema().faults_of(parsed(sample_result_with_laws())), IsEmpty());
  EXPECT_THAT(schema().faults_of(parsed({})), IsEmpty());
  CaptureResult fixed = sample_result();
  fixed.impact->as_published.reset();
  fixed.plan->searched = false;
  fixed.clearance.clear(), fixed.grasps.clear(), fixed.grasp_loads.clear();
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

const fs::path kRoot = GRAPNEL_SOURCE_DIR;

TEST(ResultContracts, APageThatLacksATableIsRefused) {
  const std::string page = bytes_of(kRoot / "docs/formats/summary.md");
  const auto remade = [](const std::string& text) { return page_with_tables(text, type_of<Summary>()); };
  std::string other = page;
  other.replace(other.find("<!-- table LoopGap -->"), 22, "<!-- table LoopGaps -->");
  EXPECT_THROW(remade(other), std::runtime_error);
  EXPECT_THROW(remade(page.substr(page.find("<!-- table Approach -->"))), std::runtime_error);
  EXPECT_THROW(remade("<!-- table Summary -->"), std::runtime_error);
}

}  // namespace result_contract_test
}  // namespace grapnel::test
