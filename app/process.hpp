#pragma once

/// @file
/// What a program settles with the system: its files, its threads, and the signal that stops it.

#include <array>
#include <csignal>
#include <stop_token>
#include <thread>

namespace grapnel::app {

/// A file that grows beyond what is allowed (ulimit -f) is an error of writing, not the program's end; and where
/// stdin, stdout or stderr are closed, something that takes nothing is put in their place, so that no file that is
/// opened later gets their messages. Once, first of all.
void prepare_process();

/// How many threads work: as many as are asked for; 0: one per processor.
int threads_of(int asked);

/// While it lives, SIGINT, SIGTERM and SIGHUP ask to stop; the second of a kind ends the program at once. Whoever has
/// the token hears of it at once, however long nobody calls poll(): a thread waits for the signals. One at a time;
/// poll() by one thread.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether a request has come.
  bool poll() const { return source_.stop_requested(); }
  std::stop_token token() const { return source_.get_token(); }

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kSignals.size()> before_{};
  std::stop_source source_;
  std::array<int, 2> pipe_{-1, -1};  // from the handler to the thread that waits
  std::thread waiting_;
};

}  // namespace grapnel::app
