#pragma once

/// @file
/// What a campaign's folder gets once all cases are there.

#include <filesystem>

#include "grapnel/campaign/campaign.hpp"
#include "stop_signal.hpp"

namespace grapnel::app {

struct CampaignResults {
  bool quiet = false;
  bool no_report = false;
  bool no_csv = false;
};

/// Writes table.h5, table.csv, campaign.json, the complete runs of the cases that are to be kept so (series/case-K) and
/// report.html, and prints what came out. Returns the exit code. @throws std::exception (disk)
int write_campaign_results(const Campaign& campaign, const std::filesystem::path& folder, const CampaignResults& what,
                           StopSignal& stop);

}  // namespace grapnel::app
