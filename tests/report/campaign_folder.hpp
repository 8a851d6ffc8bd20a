#pragma once

/// @file
/// Result folders of synthetic campaigns for the report's tests.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace grapnel::test {

/// A campaign of `rows` cases with one input and two columns, one with a name like a path. One case of 50 failed; one
/// of 10 has no success.
struct MadeCampaign {
  std::uint64_t rows = 100;
  std::string sha256 = "0123456789abcdef";
  std::string name = "made up";
  std::string schema = "grapnel-campaign-table/1";
  int status_of_row_7 = 0;
  int reason_of_row_7 = 0;
  bool short_column = false;  // a column with one row missing
};

/// campaign.json as specified in docs/formats/campaign.md, as far as reports require it.
nlohmann::ordered_json campaign_statistics(const MadeCampaign& made);
void write_campaign_table(const MadeCampaign& made, const std::filesystem::path& path);
/// Writes both into `folder`.
void write_campaign(const MadeCampaign& made, const std::filesystem::path& folder);

/// The values of case k.
double made_mass(std::uint64_t k);
double made_impulse(std::uint64_t k);

}  // namespace grapnel::test
