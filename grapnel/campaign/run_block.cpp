#include "grapnel/campaign/run_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include "grapnel/study/run_case.hpp"

namespace grapnel {

CaseTooLong::CaseTooLong(double limit) : text(fmt::format("{} {:g} s", kTookTooLong, limit)) {}

void CaseClock::check() const {
  if (stop_.stop_requested()) throw CaseStopped{};
  if (limit_ <= 0) return;
  const std::chrono::duration<double> spent = spent_ + (Clock::now() - since_);
  if (spent.count() > limit_) throw CaseTooLong(limit_);
}

Block block_at(std::uint64_t number, std::uint64_t size, std::uint64_t total) {
  return {number, number * size, std::min(total, (number + 1) * size)};
}

std::uint64_t block_count(std::uint64_t size, std::uint64_t total) { return (total + size - 1) / size; }

bool is_success(const Campaign& campaign, const CaseRow& row) {
  if (row.status != CaseStatus::ok) return false;
  std::vector<double> numbers = row.values;
  numbers.insert(numbers.end(), row.inputs.begin(), row.inputs.end());
  return std::all_of(campaign.success.begin(), campaign.success.end(),
                     [&](const Criterion& criterion) { return criterion.holds(numbers); });
}

std::optional<CaseRow> run_campaign_case(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop) {
  std::vector<double> inputs(campaign.inputs.size(), NAN);
  const CaseClock clock(campaign, stop);
  CaseRow row;
  try {
    if (campaign.draw) inputs = campaign.draw(k);
    row = run_case(campaign.problem(k), campaign.mode, campaign.columns, clock.watch());
  } catch (const CaseStopped&) {
    return std::nullopt;
  } catch (const std::exception& error) {
    row = failed_case(error.what(), campaign.columns.size());
  }
  row.index = k;
  row.inputs = std::move(inputs);
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
    std::vector<CaseRow> rows;
    for (std::uint64_t k = block.begin; k < block.end && !stop.stop_requested(); ++k) {
      std::optional<CaseRow> row = run_campaign_case(campaign, k, stop);
      if (!row) break;
      rows.push_back(std::move(*row));
    }
    return rows;
  };
}

}  // namespace grapnel
