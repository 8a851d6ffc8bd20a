#pragma once

/// @file
/// Sweeps, campaigns and optimizations, run into a result folder: the computation and all files written from it. Thread
/// safety: one call per folder at a time.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/listener.hpp"
#include "grapnel/campaign/optimization.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/campaign/shard_store.hpp"

namespace grapnel {

/// Computes all points and writes table.csv, table.h5, study.json, source.json and report.html. Until then, and after a
/// stop, the complete points are in table.partial.csv.
Ending run_sweep_folder(const Campaign& study, const std::filesystem::path& folder, const FolderOptions& options,
                        Listener& listener);

/// Searches and writes evaluations.csv, best.yaml, comparison.json and report.html. A stopped search leaves the
/// evaluations, and the best of them.
Ending run_optimization_folder(const Optimization& optimization, const std::filesystem::path& folder,
                               const FolderOptions& options, Listener& listener);

/// Part `number`, counted from 0, of `count`.
struct CampaignPart {
  std::uint64_t number = 0, count = 1;

  bool is_part() const { return count > 1; }
  /// "3/8", counted from 1.
  std::string text() const;
};

struct CampaignFolderOptions : FolderOptions {
  std::uint64_t extend = 0;  // cases to add
  CampaignPart part = {};
  bool no_csv = false;  // no table.csv
  // What the user repeats to resume the campaign: before and after the cases have been added.
  std::string command, resume;
};

/// Whether the campaign has the design that a map (`map`) requires. Otherwise the listener gets an error.
bool can_run(const Campaign& campaign, bool map, Listener& listener);
/// Reads a campaign file. Empty if it has errors or cannot run; the listener gets the errors and warnings.
std::optional<Campaign> campaign_from_file(const std::filesystem::path& file, bool map, Listener& listener);

/// Computes the missing cases of a campaign in its folder. Once all are complete, writes their results.
Ending run_campaign_folder(Campaign campaign, const std::filesystem::path& folder, const CampaignFolderOptions& options,
                           Listener& listener);

/// Merges the parts of one campaign in `sources` into `folder`, which may be one of them, and writes the results.
Ending merge_folders(std::span<const std::filesystem::path> sources, const std::filesystem::path& folder,
                     const CampaignFolderOptions& options, Listener& listener);

// --- Parts of run_campaign_folder(), for campaigns on other machines ---

/// The number of threads: `requested`; 0: one per processor.
int threads_of(int requested);

/// Notes how many cases are complete. `part`: the part of the campaign; empty: all.
void note_start(const ShardStore& store, const std::string& part, Listener& listener);

/// Tells that the campaign was stopped, and what resumes it. Returns Ending::interrupted.
Ending tell_stopped(const std::filesystem::path& folder, std::uint64_t done, std::uint64_t total,
                    const std::string& command, Listener& listener);

/// Sets the number of cases of the campaign to that of the store.
void take_total(Campaign& campaign, const ShardStore& store);

/// Returns the ending of `work`, or that of its exception, which becomes an error of the listener: failed for a folder
/// in use and for disk errors, bad_input for the folder of another campaign or with a damaged manifest. `command`
/// resumes the campaign.
Ending with_store_errors(const std::filesystem::path& folder, const std::string& command, Listener& listener,
                         const std::function<Ending()>& work);

/// Writes table.h5, table.csv (unless `no_csv`), campaign.json and, if the campaign has a design, success_map.csv.
/// Returns the content of campaign.json. @throws std::exception (disk)
CampaignReport write_campaign_tables(const Campaign& campaign, const std::filesystem::path& folder, bool no_csv,
                                     int threads);

/// Writes the tables, the stored complete runs (series/case-K) and report.html. The listener gets a summary. @throws
/// std::exception (disk)
Ending write_campaign_results(const Campaign& campaign, const std::filesystem::path& folder,
                              const CampaignFolderOptions& options, Listener& listener);

}  // namespace grapnel
