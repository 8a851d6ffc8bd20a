#pragma once

/// @file
/// manifest.json: description of the contents of a campaign's folder. It allows rows to be read, merged and reported
/// without the campaign file. docs/formats/campaign.md is its contract. Thread safety: free functions on values.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_lock.hpp"

namespace grapnel {

/// A manifest that was changed or damaged. what() names path and error, and states how to use the folder again.
struct DamagedManifest : StoreError {
  using StoreError::StoreError;
};

struct Manifest {
  std::string version;               // of the program that computed the rows
  Campaign campaign;                 // without its functions (draw, problem, scenario_text, those of columns)
  std::uint64_t total = 0;           // cases, those of extensions included
  std::uint64_t block_size = 0;      // cases per shard
  std::vector<std::uint64_t> added;  // cases, by every extension
  std::string arithmetic;            // see arithmetic_here()
  std::string file_folder = {};      // of the campaign's file, relative to the result folder; empty: unknown
};

/// Cases per shard: large enough for a small number of shards, and small enough to use all processors of a cluster. A
/// function of the campaign alone, so that tasks of a job array agree.
std::uint64_t block_size_for(std::uint64_t total);

/// Arithmetic of rows computed on this machine; equal arithmetic gives identical bits: "fma" in lanes with fused
/// products of any width; "sse2" in lanes without; "double" without lanes.
std::string arithmetic_here();

/// The manifest of a new campaign whose rows have this arithmetic.
Manifest new_manifest(const Campaign& campaign, const std::string& version,
                      const std::string& arithmetic = arithmetic_here());

/// Writes DIR/manifest.json with a checksum of its contents. @throws std::runtime_error naming path and reason
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);
/// Empty if there is none. @throws DamagedManifest also if only its checksum does not match; std::runtime_error naming
/// path and reason if it cannot be read.
std::optional<Manifest> read_manifest(const std::filesystem::path& folder);

/// Differences of a manifest's campaign and arithmetic from another's, one line each, such as "its seed is 1, not 2";
/// empty if their cases and columns are the same.
std::vector<std::string> differences(const Manifest& manifest, const Campaign& campaign, const std::string& version,
                                     const std::string& arithmetic = arithmetic_here());

}  // namespace grapnel
