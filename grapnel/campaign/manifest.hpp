#pragma once

/// @file
/// manifest.json: what a campaign's folder holds. With it rows can be read, merged and reported without the study's
/// file. docs/formats/campaign.md is its contract. Thread safety: free functions on values.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_lock.hpp"

namespace grapnel {

/// A manifest that is not as it was written. what() names path and fault, and says how the folder is used again.
struct DamagedManifest : StoreError {
  using StoreError::StoreError;
};

struct Manifest {
  std::string version;               // of the program that made the rows
  Campaign campaign;                 // without its functions (draw, problem, scenario_text, those of columns)
  std::uint64_t total = 0;           // cases, those of extensions included
  std::uint64_t block_size = 0;      // cases per shard
  std::vector<std::uint64_t> added;  // cases, by every extension
  std::string arithmetic;            // see arithmetic_here()
  std::string file_folder = {};      // of the campaign's file, as seen from the result folder; empty: unknown
};

/// Cases per shard: so many that shards are few, and so few that all processors of a cluster have some. A function of
/// the campaign alone, so that tasks of a job array agree.
std::uint64_t block_size_for(std::uint64_t total);

/// What rows that are made here have in common, bit for bit: "fma" in lanes with fused products, whatever their width;
/// "sse2" in lanes without; "double" without lanes.
std::string arithmetic_here();

/// Of a campaign that begins, whose rows have this arithmetic.
Manifest new_manifest(const Campaign& campaign, const std::string& version,
                      const std::string& arithmetic = arithmetic_here());

/// DIR/manifest.json, with a checksum of all it says. @throws std::runtime_error naming path and reason
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);
/// Nothing if there is none. @throws DamagedManifest also where only its checksum does not match; std::runtime_error
/// naming path and reason where it cannot be read.
std::optional<Manifest> read_manifest(const std::filesystem::path& folder);

/// How a manifest's campaign and its rows' arithmetic differ from another's, a line each, as "its seed is 1, not 2";
/// empty if their cases and columns are the same.
std::vector<std::string> differences(const Manifest& manifest, const Campaign& campaign, const std::string& version,
                                     const std::string& arithmetic = arithmetic_here());

}  // namespace grapnel
