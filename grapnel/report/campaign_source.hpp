#pragma once

/// @file
/// Some rows of a campaign's table.h5, for its report. Inside this module only.

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/result/campaign_table.hpp"

namespace grapnel {

/// One number per row that was read; NaN if it does not exist.
struct CampaignColumn : CampaignTable::Head {
  std::vector<float> values = {};
};

/// Requested rows and columns. Names are those of campaign.json.
struct CampaignQuery {
  std::string sha256;                                // of the campaign; empty: any
  std::vector<std::string> design, inputs, columns;  // names
  std::vector<std::uint64_t> cases;                  // included if they are in the table
  std::size_t most = 5000;                           // rows of the even sample
  std::size_t most_without_success = 500;            // added to it, if there are more
};

struct CampaignRows {
  std::uint64_t table_rows = 0;               // in the file
  std::vector<std::uint64_t> index;           // k, increasing
  std::vector<std::uint8_t> drawn;            // 1: of the even sample; 0: added
  std::vector<std::uint8_t> status, success;  // per row; status counts into `statuses`
  std::vector<std::string> statuses;
  std::vector<std::pair<std::size_t, std::string>> reasons;  // rows that have one
  std::vector<CampaignColumn> design, inputs, columns;
};

/// Reads table.h5 one dataset at a time: memory grows by 20 bytes per row of the file. From a table with more than
/// `query.most` rows the rows with the smallest hash of k are selected: an even sample, independent of patterns in the
/// order of the cases (every n-th point of a Sobol sequence is not an even sample), and identical for the same table.
/// The rows of `query.cases` and some without success are added.
/// @throws std::runtime_error naming path and error: missing, damaged, of another campaign.
CampaignRows read_campaign_rows(const std::filesystem::path& path, const CampaignQuery& query);

/// The rows that make up the sample: positions in `index`, increasing, and for each whether it is of the even sample.
std::vector<std::pair<std::size_t, bool>> sampled_rows(const std::vector<std::uint64_t>& index,
                                                       const std::vector<std::uint8_t>& success,
                                                       const CampaignQuery& query);

}  // namespace grapnel
