#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "campaign/fake_campaign.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/result/campaign_table.hpp"

namespace grapnel {
namespace table_memory_test {

// Maximum memory of this process so far [bytes].
double largest_memory() {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmHWM:")) return 1024 * std::stod(line.substr(6));
  return NAN;
}

Campaign wide_campaign(std::uint64_t cases) {
  Campaign campaign = test::fake_campaign(cases);
  campaign.columns.clear();
  campaign.inputs.clear();
  std::vector<std::string> names;
  for (int i = 0; i < 30; ++i) {
    names.push_back("group/" + std::to_string(i));
    campaign.columns.push_back({names.back(), "N", "", {}});
  }
  for (int i = 0; i < 6; ++i) campaign.inputs.push_back({"input/" + std::to_string(i), "kg", ""});
  campaign.success = {Criterion::parse("group/* < 0.99", names)};
  return campaign;
}

void write(const Campaign& campaign, const test::TemporaryFolder& folder) {
  write_campaign_tables(folder.path(), campaign, "1", true, [&](const TakeRow& take) {
    CaseRow row;
    row.status = CaseStatus::ok;
    row.inputs.resize(6);
    row.values.resize(30);
    std::uint64_t state = 1;
    const auto next = [&] {
      state = state * 6364136223846793005u + 1442695040888963407u;
      return static_cast<double>(state >> 11) * 0x1p-53;
    };
    for (row.index = 0; row.index < campaign.cases; ++row.index) {
      for (double& x : row.inputs) x = next();
      for (double& x : row.values) x = next();
      take(row);
    }
  });
}

// 300 000 rows of 36 numbers are 86 MB.
TEST(CampaignMemory, DoesNotGrowWithTheRows) {
  constexpr std::uint64_t kFew = 20000, kMany = 300000;
  const test::TemporaryFolder few, many;
  write(wide_campaign(kFew), few);
  const double before = largest_memory();
  write(wide_campaign(kMany), many);
  const double after_writing = largest_memory();
  EXPECT_LT(after_writing - before, 8e6);  // measured 1.3e6
  const CampaignTable table(many.path() / "table.h5");
  const CampaignReport report = analyze_campaign(wide_campaign(kMany), table, "1");
  EXPECT_EQ(report.rows, kMany);
  EXPECT_LT((largest_memory() - before) / kMany, 200);  // bytes a row; measured 82
}

}  // namespace table_memory_test
}  // namespace grapnel
