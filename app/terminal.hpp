#pragma once

/// @file
/// What the program says on stdout and stderr, the progress of long work there, and what it settles with the system:
/// its files, its threads, and the signal that stops it.

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <csignal>
#include <exception>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
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

/// While it lives, what is said on stderr is kept here instead, for who is no terminal's program; of stdout nothing is
/// written. One at a time.
class KeptMessages {
 public:
  KeptMessages();
  ~KeptMessages();
  KeptMessages(const KeptMessages&) = delete;
  KeptMessages& operator=(const KeptMessages&) = delete;
  /// Whole lines so far.
  std::string lines() const;
};

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

/// Says once in a while that a long phase is slow and why, on stderr, also where progress is not shown: first after 20
/// s of a phase that would take as long again, then whenever the time has doubled.
class SlowWarning {
 public:
  /// `causes` of a phase: what makes it slow.
  SlowWarning(std::string file, std::function<std::string(const std::string& phase)> causes);
  void report(const std::string& phase, double at, double end);

 private:
  using Clock = std::chrono::steady_clock;
  std::string file_;
  std::function<std::string(const std::string&)> causes_;
  std::string phase_;
  double first_ = 0;
  Clock::time_point begin_;
  double next_ = 0;  // [s]
};

/// A file that grows beyond what is allowed (ulimit -f) is an error of writing, not the program's end; and where
/// stdin, stdout or stderr are closed, something that takes nothing is put in their place, so that no file that is
/// opened later gets their messages. Once, first of all.
void prepare_process();

/// How many threads work: as many as are asked for; 0: one per processor.
int threads_of(int asked);

/// While it lives, SIGINT, SIGTERM and SIGHUP ask to stop; the second of a kind ends the program at once. Whoever has
/// the token hears of it at once, however long nobody calls poll(): a thread waits for the signals. One at a time;
/// poll() by one thread. Who has handlers of its own for signals gives a token to listen to instead.
class StopSignal {
 public:
  explicit StopSignal(std::stop_token instead = {});
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether a request has come.
  bool poll() const { return token().stop_requested(); }
  std::stop_token token() const { return instead_.stop_possible() ? instead_ : source_.get_token(); }

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kSignals.size()> before_{};
  std::stop_token instead_;
  std::stop_source source_;
  std::array<int, 2> pipe_{-1, -1};  // from the handler to the thread that waits
  std::thread waiting_;
};

}  // namespace grapnel::app
