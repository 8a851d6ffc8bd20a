#pragma once

/// @file
/// Progress of long work on stderr: a line that rewrites itself on a terminal, a plain line now and then elsewhere.

#include <chrono>
#include <string>

#include "grapnel/campaign/run_campaign.hpp"

namespace grapnel::app {

class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  /// Part of the phase that is done: `at` of `end`.
  void report(const std::string& phase, double at, double end);
  /// Points of a study that are done, and how many of them are not ok.
  void report_points(std::size_t done, std::size_t total, std::size_t not_ok);
  /// Cases of a campaign that are done, and what they say so far.
  void report_campaign(const CampaignProgress& at);

 private:
  using Clock = std::chrono::steady_clock;
  bool is_due(Clock::time_point now) const;
  void show(const std::string& text, Clock::time_point now);

  bool quiet_;
  bool terminal_;
  std::string phase_;
  double first_ = 0;  // where the phase began
  Clock::time_point phase_start_;
  Clock::time_point last_;   // when something was shown
  Clock::time_point begin_;  // of everything
};

}  // namespace grapnel::app
