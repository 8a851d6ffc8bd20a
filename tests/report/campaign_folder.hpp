#pragma once

/// @file
/// Result folders of campaigns made up for the report's tests.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace grapnel::test {

/// A campaign of `rows` cases with one input and two columns, one with a name like a path. Of every 50 cases one
/// failed, of every 10 one is no success.
struct MadeCampaign {
  std::uint64_t rows = 100;
  std::string sha256 = "0123456789abcdef";
  std::string name = "made up";
  std::string schema = "grapnel-campaign-table/1";
  int status_of_row_7 = 0;
  int reason_of_row_7 = 0;
  bool short_column = false;  // a column with a row too few
};

/// campaign.json as docs/formats/campaign.md says, as far as reports need it.
nlohmann::ordered_json campaign_statistics(const MadeCampaign& made);
void write_campaign_table(const MadeCampaign& made, const std::filesystem::path& path);
/// Both, into `folder`.
void write_campaign(const MadeCampaign& made, const std::filesystem::path& folder);

/// The numbers of case k.
double made_mass(std::uint64_t k);
double made_impulse(std::uint64_t k);

}  // namespace grapnel::test
