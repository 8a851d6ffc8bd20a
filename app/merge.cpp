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

// What cannot be merged.
struct Disagreement : ForeignFolder {
  using ForeignFolder::ForeignFolder;
};

struct Source {
  fs::path folder;
  Manifest manifest;
};

// The folders' manifests, all of one campaign. Empty if not, which was said on stderr.
std::optional<std::vector<Source>> sources_of(const MergeOptions& options) {
  std::vector<Source> sources;
  bool sound = true;
  for (const fs::path& folder : options.folders) {
    std::optional<Manifest> manifest;
    try {
      manifest = read_manifest(folder);
      if (!manifest) throw std::runtime_error(folder.string() + ": no campaign is there (manifest.json is missing)");
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
        to_stderr("grapnel: error: {} and {} hold different campaigns; of the former:\n", folder.string(),
                  first.folder.string());
        for (const std::string& line : lines) to_stderr("  {}\n", line);
      }
    }
    sources.push_back({folder, std::move(*manifest)});
  }
  if (!sound) return std::nullopt;
  return sources;
}

// The file's campaign, which can run cases; if the file is gone or has changed, what the manifest says of it.
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

// Rows of a block that were found, and where.
struct Found {
  std::vector<CaseRow> rows;
  fs::path folder;
};

// Takes the rows of another folder too: the longer list counts. @throws Disagreement if rows of one case differ
void take_rows(Found& found, std::vector<CaseRow> rows, const fs::path& folder) {
  for (std::size_t i = 0; i < std::min(rows.size(), found.rows.size()); ++i) {
    if (same(rows[i], found.rows[i])) continue;
    throw Disagreement(
        fmt::format("case {} is not the same in {} and in {}: they were not made by the same program on machines that "
                    "compute alike; "
                    "one of them has to be left out",
                    rows[i].index, found.folder.string(), folder.string()));
  }
  if (rows.size() > found.rows.size()) found = {std::move(rows), folder};
}

// What folder `source` has of a block of the whole.
std::vector<CaseRow> rows_in(const Source& source, const Campaign& campaign, std::uint64_t number) {
  const std::uint64_t size = source.manifest.block_size;
  if (number >= block_count(size, source.manifest.total)) return {};
  const Block block = block_at(number, size, source.manifest.total);
  auto rows = read_shard(source.folder, campaign, block, source.manifest.arithmetic);
  std::error_code none;
  if (!rows && fs::exists(shard_path(source.folder, number), none))
    to_stderr("grapnel: warning: {} is damaged, or of another arithmetic than its manifest says, and left out\n",
              shard_path(source.folder, number).string());
  return rows ? std::move(*rows) : std::vector<CaseRow>{};
}

// All blocks of all sources into the store.
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
    say_stopped(store.folder(), all.rows, store.total(), command);
    return kInterrupted;
  }
  if (all.complete < all.blocks) {
    to_stderr(
        "grapnel: error: {} of {} blocks ({} of {} cases) are in {}, and no results can be written yet; grapnel "
        "campaign {} -o {} computes the others{}\n",
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
