// The published schema of summaries agrees with the files; tests/app/result_contract_test.cpp: all documents.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "result/sample_result.hpp"
#include "support/format_pages.hpp"
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
  fixed.impacts[0].as_published.reset();
  fixed.plan->searched = false;
  fixed.clearance.clear(), fixed.grasps.clear(), fixed.grasp_loads.clear();
  EXPECT_THAT(schema().faults_of(parsed(fixed)), IsEmpty());
}

TEST(SummaryContract, SchemaDetectsErrors) {
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
  // NaN is rejected for fields that are not declared as possibly unknown.
  CaptureResult result = sample_result();
  result.impacts[0].kinetic_energy_before = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(schema().faults_of(parsed(result)), Not(IsEmpty()));
}

TEST(ResultContracts, MisplacedTablesAreReported) {
  std::vector<std::string> pages;
  for (const fs::path& path : format_pages("summary")) pages.push_back(bytes_of(path));
  const auto misplaced = [&] { return misplaced_tables(pages, type_of<Summary>()); };
  EXPECT_THAT(misplaced(), IsEmpty());
  const std::string place = "<!-- table LoopGap -->";
  for (std::string& page : pages) {
    const std::size_t at = page.find(place);
    if (at == std::string::npos) continue;
    page.replace(at, place.size(), "<!-- table LoopGaps -->");
    EXPECT_THROW(page_with_tables(page, type_of<Summary>()), std::runtime_error);
  }
  EXPECT_THAT(misplaced(), testing::ElementsAre("LoopGap"));
  EXPECT_THROW(page_with_tables("<!-- table Summary -->", type_of<Summary>()), std::runtime_error);
}

}  // namespace result_contract_test
}  // namespace grapnel::test
