#pragma once

/// @file
/// What the program says on stdout and stderr, and the progress of long work there.

#include <fmt/format.h>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/study/case_pool.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel::app {

/// Whole lines to stdout; kept back until flush_stdout(), the next write_stderr() or the program's end.
void write_stdout(std::string_view lines);
/// Whole lines to stderr, at once, behind what was said on stdout before.
void write_stderr(std::string_view lines);
void flush_stdout();

/// A line of progress on stderr: rewritten by the next one and gone before anything else is written where stderr is a
/// terminal, a line of its own elsewhere.
void show_progress(std::string_view line);
void erase_progress();
bool stderr_is_terminal();

/// Faults of input files on stderr, one a line.
void say_faults(const std::vector<Fault>& faults);

/// Formatted text, whole lines.
template <class... Args>
void to_stdout(fmt::format_string<Args...> format, Args&&... args) {
  write_stdout(fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void to_stderr(fmt::format_string<Args...> format, Args&&... args) {
  write_stderr(fmt::format(format, std::forward<Args>(args)...));
}

class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  /// Part of the phase that is done: `at` of `end`.
  void report(const std::string& phase, double at, double end);
  /// Points of a study that are done, and how many of them are not ok.
  void report_points(const CaseProgress& at);
  /// Cases of a campaign that are done, and what they say so far.
  void report_campaign(const CaseProgress& at);

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
