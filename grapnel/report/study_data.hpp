#pragma once

/// @file
/// Result folders of sweeps, campaigns and optimizations as a report holds them. Inside this module only. All throw
/// std::runtime_error naming path and fault; TooLarge where a page could not show so much.

#include <filesystem>
#include <nlohmann/json.hpp>

namespace grapnel {

/// SweepData of web/src/data.ts from study.json and table.csv.
nlohmann::ordered_json sweep_data(const std::filesystem::path& folder);

/// CampaignData of web/src/data.ts from campaign.json, which must be sound, and table.h5, which a note says to be
/// missing or damaged.
nlohmann::ordered_json campaign_data(const std::filesystem::path& folder);

/// OptimizationData of web/src/data.ts from comparison.json and evaluations.csv.
nlohmann::ordered_json optimization_data(const std::filesystem::path& folder);

}  // namespace grapnel
