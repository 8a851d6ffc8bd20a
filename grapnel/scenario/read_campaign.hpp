#pragma once

/// @file
/// Campaigns from files. docs/formats/campaign.md describes the format.

#include <filesystem>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// Reads a campaign and its scenario, and checks everything that can be known beforehand: every uncertain value by
/// itself at its median and at the ends that `cases` draws reach, every value of the design's axes by itself. Files are
/// read once: the campaign's functions see the same bytes ever after. Into `doubts`: as of load_scenario(), of the
/// scenario as it is, with the first values of a design. @throws InputError with all faults
Campaign load_campaign(const std::filesystem::path& path, std::vector<Fault>* doubts = nullptr);

}  // namespace grapnel
