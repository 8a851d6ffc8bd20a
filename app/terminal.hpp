#pragma once

/// @file
/// Output on stdout and stderr, progress of long work, and settings of the process: its files, its threads, and the
/// signals that stop it.

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <csignal>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "grapnel/campaign/listener.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel::app {

/// Writes whole lines to stdout. They are buffered until flush_stdout(), the next write_stderr() or the end of the
/// program.
void write_stdout(std::string_view lines);
/// Writes whole lines to stderr immediately, after the earlier output on stdout.
void write_stderr(std::string_view lines);
void flush_stdout();

/// Shows a line of progress on stderr. On a terminal the next output replaces it; elsewhere it is a separate line.
void show_progress(std::string_view line);
void erase_progress();
bool stderr_is_terminal();

/// Prints errors of input files on stderr, one per line.
void print_errors(const std::vector<Fault>& faults);

/// Writes formatted text, which consists of whole lines.
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
  Progress();
  ~Progress();
  /// Progress of a phase: `at` of `end`.
  void report(const std::string& phase, double at, double end);
  /// Completed points of a study, and how many of them are not ok.
  void report_points(const CaseProgress& at);
  /// Completed cases of a campaign, and their results so far.
  void report_campaign(const CaseProgress& at);

 private:
  using Clock = std::chrono::steady_clock;
  bool is_due(Clock::time_point now) const;
  void show(const std::string& text, Clock::time_point now);

  bool terminal_;
  std::string phase_;
  double first_ = 0;  // start of the phase
  Clock::time_point phase_start_;
  Clock::time_point last_;   // last output
  Clock::time_point begin_;  // start of all work
};

/// Shows messages, notes and progress of the library on stdout and stderr.
class Terminal : public Listener {
 public:
  void message(const Message& message) override { write_stderr(message.text + "\n"); }
  void note(const std::string& lines) override {
    write_stdout(lines);
    flush_stdout();
  }
  void phase(const std::string& phase, double at, double end) override { progress().report(phase, at, end); }
  void points(const CaseProgress& at) override { progress().report_points(at); }
  void cases(const CaseProgress& at) override { progress().report_campaign(at); }

 private:
  // Counts time from the first progress.
  Progress& progress() { return progress_ ? *progress_ : progress_.emplace(); }
  std::optional<Progress> progress_;
};

/// Prepares the process. A file that exceeds its size limit (ulimit -f) becomes a write error instead of ending the
/// program. Closed stdin, stdout or stderr are replaced, so that no file opened later receives their output. Call once,
/// before anything else.
void prepare_process();

/// While an object exists, SIGINT, SIGTERM and SIGHUP request a stop; the second signal of a kind ends the program
/// immediately. A thread waits for the signals, so that holders of the token are notified without calls of poll(). At
/// most one object at a time; one thread calls poll().
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether a stop has been requested.
  bool poll() const { return token().stop_requested(); }
  std::stop_token token() const { return source_.get_token(); }
  /// For other requests to stop than signals.
  std::stop_source source() const { return source_; }

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kSignals.size()> before_{};
  std::stop_source source_;
  std::array<int, 2> pipe_{-1, -1};  // from the signal handler to the waiting thread
  std::thread waiting_;
};

}  // namespace grapnel::app
