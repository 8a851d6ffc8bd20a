#pragma once

/// @file
/// Result folders of campaigns as a report holds them. Inside this module only.

#include <filesystem>
#include <nlohmann/json.hpp>

namespace grapnel {

/// CampaignData of web/src/data.ts from campaign.json, which must be sound, and table.h5, which a note says to be
/// missing or damaged. @throws std::runtime_error naming path and fault; TooLarge where a page could not show so much.
nlohmann::ordered_json campaign_data(const std::filesystem::path& folder);

}  // namespace grapnel
