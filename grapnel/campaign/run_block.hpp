#pragma once

/// @file
/// Cases of a campaign, alone and in blocks. Blocks only divide the work; no row depends on them.

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/lanes/dispatch.hpp"

namespace grapnel {

/// Cases begin to end (not included).
struct Block {
  std::uint64_t number = 0;
  std::uint64_t begin = 0, end = 0;
};

/// Number `number` of the blocks of `size` cases that make up `total` cases.
Block block_at(std::uint64_t number, std::uint64_t size, std::uint64_t total);
std::uint64_t block_count(std::uint64_t size, std::uint64_t total);

/// Rows of a block, in the order of their indices. Faults of cases are their rows' reasons. Called from several threads
/// at once, also with a part of a block (a long one is done in parts). A stop request may end it early: it then returns
/// the first rows, as many as are complete without a gap.
using BlockWork = std::function<std::vector<CaseRow>(const Block&, const std::stop_token&)>;

/// The way from cases to rows that suits the campaign: lanes where they can (docs/modules.md), else one by
/// one. The campaign must outlive it.
BlockWork block_work(const Campaign& campaign);

/// The rows of a block's cases side by side: their pieces of motion are integrated in SIMD lanes, everything else case
/// by case. A piece of motion that lanes do not know (loops, loads from outside, columns that need the loads of all
/// phases) is integrated alone, as run_campaign_case() does it. Which pieces those are, and every number of a row,
/// follow from the case alone. After a stop request fewer rows, or none.
std::vector<CaseRow> run_block_in_lanes(const Campaign& campaign, const Block& block, lanes::InstructionSet set,
                                        const std::stop_token& stop);

/// One case, one by one: as `block_work` without lanes does it. Nothing if it was stopped. A case that takes longer
/// than the campaign's time limit is a failed row without values; the limit is looked at when the capture reports
/// progress.
std::optional<CaseRow> run_campaign_case(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop = {});

/// Whether an ok row meets all criteria. Their numbers are a row's columns, then its inputs.
bool is_success(const Campaign& campaign, const CaseRow& row);

// --- How long a case may take, and whether anybody still wants it ---

/// Thrown through a simulation that is given up. Not a std::exception: it is no fault of the case.
struct CaseStopped {};
/// How the reason of a case that took too long begins.
inline constexpr std::string_view kTookTooLong = "took longer than the time limit of";
/// Thrown through a simulation that takes too long. Not a std::runtime_error, which a capture takes for a numerical
/// failure of its own.
struct CaseTooLong : std::exception {
  explicit CaseTooLong(double limit);
  const char* what() const noexcept override { return text.c_str(); }
  std::string text;
};

/// Counts a case's own time, from resume() to pause().
class CaseClock {
 public:
  CaseClock(const Campaign& campaign, std::stop_token stop) : limit_(campaign.time_limit), stop_(std::move(stop)) {}
  void resume() { since_ = Clock::now(); }
  void pause() { spent_ += Clock::now() - since_; }
  /// @throws CaseStopped, CaseTooLong. Between resume() and pause().
  void check() const;
  /// For simulate_capture() and CaptureSteps; the clock must outlive it.
  CaptureProgress watch() const {
    return [this](const std::string&, double, double) { check(); };
  }

 private:
  using Clock = std::chrono::steady_clock;
  double limit_;  // [s]; 0: none
  std::stop_token stop_;
  Clock::time_point since_ = Clock::now();
  Clock::duration spent_{};
};

}  // namespace grapnel
