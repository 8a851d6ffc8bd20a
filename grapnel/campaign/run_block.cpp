#include "grapnel/campaign/run_block.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include "grapnel/campaign/case_clock.hpp"
#include "grapnel/campaign/lane_block.hpp"

namespace grapnel {
Block block_at(std::uint64_t number, std::uint64_t size, std::uint64_t total) {
  return {number, number * size, std::min(total, (number + 1) * size)};
}

std::uint64_t block_count(std::uint64_t size, std::uint64_t total) { return (total + size - 1) / size; }

bool is_success(const Campaign& campaign, const CampaignRow& row) {
  if (row.status != CaseStatus::ok) return false;
  std::vector<double> numbers = row.values;
  numbers.insert(numbers.end(), row.inputs.begin(), row.inputs.end());
  return std::all_of(campaign.success.begin(), campaign.success.end(),
                     [&](const Criterion& criterion) { return criterion.holds(numbers); });
}

std::optional<CampaignRow> run_campaign_case(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop) {
  CampaignRow row;
  row.index = k;
  row.inputs.assign(campaign.inputs.size(), NAN);
  const CaseClock clock(campaign, stop);
  CaseRow outcome;
  try {
    row.inputs = campaign.draw(k);
    outcome = run_case(campaign.problem(k), campaign.mode, campaign.columns, clock.watch());
  } catch (const CaseStopped&) {
    return std::nullopt;
  } catch (const std::exception& error) {
    outcome = failed_case(error.what(), campaign.columns.size());
  }
  row.status = outcome.status;
  row.reason = std::move(outcome.reason);
  row.values = std::move(outcome.values);
  row.success = is_success(campaign, row);
  return row;
}

BlockWork block_work(const Campaign& campaign) {
  if (const std::optional<lanes::InstructionSet> set = lanes::best_instruction_set()) {
    return [&campaign, set = *set](const Block& block, const std::stop_token& stop) {
      return run_block_in_lanes(campaign, block, set, stop);
    };
  }
  return [&campaign](const Block& block, const std::stop_token& stop) {
    std::vector<CampaignRow> rows;
    for (std::uint64_t k = block.begin; k < block.end && !stop.stop_requested(); ++k) {
      std::optional<CampaignRow> row = run_campaign_case(campaign, k, stop);
      if (!row) break;
      rows.push_back(std::move(*row));
    }
    return rows;
  };
}

}  // namespace grapnel
