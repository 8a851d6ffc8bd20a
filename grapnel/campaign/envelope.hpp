#pragma once

/// @file
/// The capture envelope: the probability of success at every point of a campaign's design. Thread safety: pure
/// functions.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/statistics.hpp"

namespace grapnel {

struct EnvelopePoint {
  std::uint64_t ok = 0;
  Proportion success;  // of all rows of the point
};

/// Per point of the design, the first axis varying slowest; nothing without a design. `indices`, `status`, `success`:
/// per row, as CampaignTable has them; a row belongs to point k / cases. @throws std::runtime_error for a k beyond.
std::vector<EnvelopePoint> envelope_of(const Campaign& campaign, std::span<const std::uint64_t> indices,
                                       std::span<const std::uint8_t> status, std::span<const std::uint8_t> success);

/// envelope.csv: one line per point.
std::string envelope_csv(const Campaign& campaign, std::span<const EnvelopePoint> points);

/// For a terminal: with two axes a table of percentages, the first axis downwards; else a line per point.
std::string envelope_summary(const Campaign& campaign, std::span<const EnvelopePoint> points);

/// "99.98 %", with as many digits as the interval is wide.
std::string percentage(double probability, const Proportion& of);

}  // namespace grapnel
