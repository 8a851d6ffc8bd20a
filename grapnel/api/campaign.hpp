#pragma once

/// @file
/// Campaigns: many captures with drawn values, into memory or into a folder. docs/formats/campaign.md describes the
/// files. Public, kept stable.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/api/error.hpp"

namespace grapnel {

/// How to run a campaign. No row depends on it.
struct CampaignRun {
  int threads = 0;  // 0: one per processor
  std::stop_token stop = {};
  /// Called from the calling thread, several times a second: completed cases, and all cases.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress = {};
};

struct CampaignSummary {
  std::uint64_t cases = 0;      // completed
  std::uint64_t successes = 0;  // cases that meet all criteria of the campaign
  std::uint64_t not_ok = 0;     // cases that failed, or whose target is unreachable
  double probability = 0;       // successes / cases; NaN without cases
  double lower = 0, upper = 1;  // its interval (Wilson) at the campaign's confidence
  bool stopped = false;         // on request, before all cases were completed
};

/// A quantity with one number per case.
struct CampaignQuantity {
  std::string name, unit, description;
};

struct CampaignCase {
  std::uint64_t index = 0;
  bool ok = false;             // it was simulated, and conservation checks passed
  bool success = false;        // ok, and all criteria hold
  std::string reason;          // of a case that is not ok, one line
  std::vector<double> inputs;  // as drawn, per CampaignOutcome::inputs
  std::vector<double> values;  // per CampaignOutcome::columns; NaN if the value does not exist
};

struct CampaignOutcome {
  CampaignSummary summary;
  std::vector<CampaignQuantity> inputs, columns;
  std::vector<CampaignCase> cases;  // in the order of their indices
};

/// Runs a campaign file and returns all cases. @throws InputError with all errors of the file.
CampaignOutcome simulate_campaign(const std::filesystem::path& file, const CampaignRun& run = {});

/// Runs a campaign file, or continues it, in a folder: completed cases are kept there when the run is stopped. Once
/// complete, writes table.h5, table.csv, campaign.json, success_map.csv if the campaign has a design, and report.html
/// if has_reports(). Same results as `grapnel campaign`, without the time series of single cases.
/// @throws InputError with all errors of the file; std::runtime_error if the folder belongs to another campaign, is in
/// use, or cannot be written.
CampaignSummary simulate_campaign(const std::filesystem::path& file, const std::filesystem::path& folder,
                                  const CampaignRun& run = {});

}  // namespace grapnel
