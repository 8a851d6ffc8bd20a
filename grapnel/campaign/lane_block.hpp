#pragma once

/// @file
/// A block's cases side by side: their pieces of motion are integrated in SIMD lanes, everything else case by case.

#include <stop_token>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_row.hpp"
#include "grapnel/campaign/run_block.hpp"
#include "grapnel/lanes/dispatch.hpp"

namespace grapnel {

/// Rows of a block's cases in the order of their indices. A piece of motion that lanes do not know (loops, loads from
/// outside, columns that need the loads of all phases) is integrated alone, as run_campaign_case() does it. Which
/// pieces those are, and every number of a row, follow from the case alone. After a stop request fewer rows, or none.
std::vector<CampaignRow> run_block_in_lanes(const Campaign& campaign, const Block& block, lanes::InstructionSet set,
                                            const std::stop_token& stop);

}  // namespace grapnel
