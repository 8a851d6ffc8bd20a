#pragma once

/// @file
/// How long a case may take, and whether anybody still wants it.

#include <chrono>
#include <exception>
#include <stop_token>
#include <string>
#include <string_view>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {

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
