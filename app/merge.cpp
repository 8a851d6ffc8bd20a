#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "campaign_folder.hpp"
#include "commands.hpp"
#include "grapnel/campaign/shard_store.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/faults.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Folders that cannot be merged.
struct Disagreement : ForeignFolder {
  using ForeignFolder::ForeignFolder;
};

struct Source {
  fs::path folder;
  Manifest manifest;
};

// The folders' manifests, all of one campaign. Empty if they differ or cannot be read; the errors are on stderr.
std::optional<std::vector<Source>> sources_of(const MergeOptions& options) {
  std::vector<Source> sources;
  bool sound = true;
  for (const fs::path& folder : options.folders) {
    std::optional<Manifest> manifest;
    try {
      manifest = read_manifest(folder);
      if (!manifest) throw std::runtime_error(folder.string() + ": contains no campaign (manifest.json is missing)");
    } catch (const std::exception& error) {
      to_stderr("grapnel: error: {}\n", error_text(error));
      sound = false;
      continue;
    }
    if (!sources.empty()) {
      const Source& first = sources.front();
      std::vector<std::string> lines =
          differences(*manifest, first.manifest.campaign, first.manifest.version, first.manifest.arithmetic);
      if (manifest->block_size != first.manifest.block_size)
        lines.push_back(
            fmt::format("its shards have {} cases, not {}", manifest->block_size, first.manifest.block_size));
      if (!lines.empty()) {
        sound = false;
        to_stderr("grapnel: error: {} and {} hold different campaigns. Differences of the former:\n", folder.string(),
                  first.folder.string());
        for (const std::string& line : lines) to_stderr("  {}\n", line);
      }
    }
    sources.push_back({folder, std::move(*manifest)});
  }
  if (!sound) return std::nullopt;
  return sources;
}

// The campaign of the file, which can run cases. If the file is missing or has changed, the manifest's description of
// the campaign.
Campaign campaign_of(const Source& source) {
  try {
    Campaign campaign =
        load_campaign(file_seen_from_here(source.folder, source.manifest.file_folder, source.manifest.campaign.file));
    if (differences(source.manifest, campaign, source.manifest.version, source.manifest.arithmetic).empty())
      return campaign;
  } catch (const InputError&) {
  }
  return source.manifest.campaign;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

bool same(const CaseRow& a, const CaseRow& b) {
  return a.index == b.index && a.status == b.status && a.success == b.success && a.reason == b.reason &&
         same_bits(a.inputs, b.inputs) && same_bits(a.values, b.values);
}

// Rows of a block, and their folder.
struct Found {
  std::vector<CaseRow> rows;
  fs::path folder;
};

// Adds the rows of another folder; the longer list is kept. @throws Disagreement if rows of one case differ
void take_rows(Found& found, std::vector<CaseRow> rows, const fs::path& folder) {
  for (std::size_t i = 0; i < std::min(rows.size(), found.rows.size()); ++i) {
    if (same(rows[i], found.rows[i])) continue;
    throw Disagreement(
        fmt::format("case {} differs between {} and {}: the folders come from different programs or from machines with "
                    "different arithmetic; "
                    "leave one of them out",
                    rows[i].index, found.folder.string(), folder.string()));
  }
  if (rows.size() > found.rows.size()) found = {std::move(rows), folder};
}

// The rows of one block of the merged campaign that folder `source` holds.
std::vector<CaseRow> rows_in(const Source& source, const Campaign& campaign, std::uint64_t number) {
  const std::uint64_t size = source.manifest.block_size;
  if (number >= block_count(size, source.manifest.total)) return {};
  const Block block = block_at(number, size, source.manifest.total);
  auto rows = read_shard(source.folder, campaign, block, source.manifest.arithmetic);
  std::error_code none;
  if (!rows && fs::exists(shard_path(source.folder, number), none))
    to_stderr("grapnel: warning: {} is left out: it is damaged, or its arithmetic differs from its manifest\n",
              shard_path(source.folder, number).string());
  return rows ? std::move(*rows) : std::vector<CaseRow>{};
}

// Collects all blocks of all sources in the store.
void gather(const std::vector<Source>& sources, const Campaign& campaign, ShardStore& store, StopSignal& stop) {
  const std::uint64_t blocks = block_count(store.block_size(), store.total());
  for (std::uint64_t number = 0; number < blocks && !stop.poll(); ++number) {
    const Block block = block_at(number, store.block_size(), store.total());
    Found found{store.rows(block), store.folder()};
    const std::size_t there = found.rows.size();
    for (const Source& source : sources) {
      std::error_code none;
      if (!fs::equivalent(source.folder, store.folder(), none))
        take_rows(found, rows_in(source, campaign, number), source.folder);
    }
    if (found.rows.size() > there) store.write(block, found.rows);
  }
}

int merge_into(const std::vector<Source>& sources, Campaign campaign, const MergeOptions& options,
               const std::string& command) {
  std::uint64_t total = 0;
  for (const Source& source : sources) total = std::max(total, source.manifest.total);
  ShardStore store(options.output, campaign,
                   {.version = sources.front().manifest.version,
                    .writer = {},
                    .extend = 0,
                    .total = total,
                    .arithmetic = sources.front().manifest.arithmetic});
  for (const Source& source : sources) {
    if (source.manifest.block_size == store.block_size()) continue;
    throw ForeignFolder(fmt::format("'{}' has blocks of {} cases, '{}' of {}", source.folder.string(),
                                    source.manifest.block_size, store.folder().string(), store.block_size()));
  }
  StopSignal stop;
  gather(sources, campaign, store, stop);
  take_total(campaign, store);
  StoreCounts all;
  store.missing(0, 1, &all);
  if (stop.poll()) {
    print_stopped(store.folder(), all.rows, store.total(), command);
    return kInterrupted;
  }
  if (all.complete < all.blocks) {
    to_stderr(
        "grapnel: error: {} of {} blocks ({} of {} cases) are in {}, so no results can be written yet; grapnel "
        "campaign {} -o {} computes the missing cases{}\n",
        all.complete, all.blocks, all.rows, store.total(), store.folder().string(), campaign.file,
        store.folder().string(),
        store.arithmetic() == arithmetic_here()
            ? ""
            : fmt::format(", on a machine whose arithmetic is '{}'", store.arithmetic()));
    return kSimulationFailed;
  }
  return write_campaign_results(campaign, store.folder(),
                                {options.quiet, options.no_report, options.no_csv, threads_of(0)}, stop);
}

}  // namespace

int merge(const MergeOptions& options) {
  const auto sources = sources_of(options);
  if (!sources) return kBadInput;
  const Campaign campaign = campaign_of(sources->front());
  if (!results_folder(options.output, "", Outputs::campaign)) return kBadInput;
  std::string command = "grapnel merge";
  for (const fs::path& folder : options.folders) command += " " + folder.string();
  command += " -o " + options.output.string();
  return with_store_errors(options.output, command, [&] { return merge_into(*sources, campaign, options, command); });
}

}  // namespace grapnel::app
