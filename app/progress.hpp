#pragma once

/// @file
/// Progress of long work on stderr: a line that rewrites itself on a terminal, a plain line now and then elsewhere.

#include <chrono>
#include <string>

namespace grapnel::app {

class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  /// Part of the phase that is done: `at` of `end`.
  void report(const std::string& phase, double at, double end);

 private:
  using Clock = std::chrono::steady_clock;
  void erase();

  bool quiet_;
  bool terminal_;
  bool shown_ = false;
  std::string phase_;
  double first_ = 0;  // where the phase began
  Clock::time_point phase_start_;
  Clock::time_point last_;
};

}  // namespace grapnel::app
