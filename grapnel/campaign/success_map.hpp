#pragma once

/// @file
/// The success map: the probability of success at every point of a campaign's design.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/statistics.hpp"

namespace grapnel {

struct SuccessMapPoint {
  std::uint64_t ok = 0;
  Proportion success;                // of all rows of the point
  std::vector<std::uint64_t> unmet;  // per criterion: rows that are ok and fail it, as counted for only_this

  /// What decides: the criterion that most rows fail, of equal ones the first; the number of criteria if more
  /// rows are not ok. Nothing where all are a success.
  std::optional<std::size_t> deciding() const;
};

/// How many points have a success of at least `level` by the lower end of the interval.
std::size_t points_above(std::span<const SuccessMapPoint> points, double level);

/// The criterion's name; "not ok", or empty.
std::string deciding_text(const Campaign& campaign, const SuccessMapPoint& point);

/// Per point of the design, the first axis varying slowest; nothing without a design. `indices`, `status`, `success`:
/// per row, as CampaignTable has them; a row belongs to point k / cases. @throws std::runtime_error for a k beyond.
std::vector<SuccessMapPoint> success_map_of(const Campaign& campaign, std::span<const std::uint64_t> indices,
                                            std::span<const std::uint8_t> status,
                                            std::span<const std::uint8_t> success);

/// success_map.csv: one line per point.
std::string success_map_csv(const Campaign& campaign, std::span<const SuccessMapPoint> points);

/// For a terminal: with two axes a table of percentages, the first axis downwards; else a line per point.
std::string success_map_summary(const Campaign& campaign, std::span<const SuccessMapPoint> points);

/// "99.98 %", with as many digits as the interval is wide.
std::string percentage(double probability, const Proportion& of);

}  // namespace grapnel
