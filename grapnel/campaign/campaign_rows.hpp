#pragma once

/// @file
/// A campaign's rows as the parts of its analysis read them. For campaign_*.cpp.

#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/campaign/campaign_report.hpp"

namespace grapnel {

/// What every part of the analysis reads.
struct Rows {
  const Campaign& campaign;
  const CampaignTable& table;
  std::vector<std::uint64_t> index;
  std::vector<std::uint8_t> status, success;

  std::size_t count() const { return index.size(); }
  bool ok(std::size_t row) const { return status[row] == static_cast<std::uint8_t>(CaseStatus::ok); }
  /// A number by its index among columns and inputs.
  std::vector<double> numbers(std::size_t i) const {
    const std::size_t columns = campaign.columns.size();
    return i < columns ? table.column(i) : table.input(i - columns);
  }
  void read(std::size_t i, std::size_t first, std::span<double> out) const {
    const std::size_t columns = campaign.columns.size();
    if (i < columns)
      table.read_column(i, first, out);
    else
      table.read_input(i - columns, first, out);
  }
};

/// Writes `criteria`, `failures` of rows that are ok, `assumed`, and what decides in the envelope.
void count_criteria(const Rows& rows, CampaignReport& report);
/// Writes `reasons`, and adds them to `failures`.
void count_reasons(const Rows& rows, CampaignReport& report);
/// Writes `grasps`.
void count_grasps(const Rows& rows, CampaignReport& report);
/// Writes `warnings`, from all counts.
void say_what_is_not_said(const Campaign& campaign, CampaignReport& report);
/// Writes `groups`, `measures` and `rounding`. `inputs`: their rankings; reads `columns`.
void measure_influences(const Rows& rows, const std::vector<Ranking>& inputs, CampaignReport& report);

/// An input as its influence is measured: without what the design makes of it.
std::vector<double> apart_from_design(const Rows& rows, std::vector<double> numbers);

/// A column's index; the number of columns if there is none of the name.
std::size_t column_named(const Campaign& campaign, const std::string& name);

}  // namespace grapnel
