#pragma once

/// @file
/// Ctrl-C and its kin as a request to stop cleanly.

#include <array>
#include <csignal>
#include <stop_token>
#include <thread>

namespace grapnel::app {

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
