#pragma once

/// @file
/// Ctrl-C and its kin as a request to stop cleanly.

#include <array>
#include <csignal>
#include <stop_token>

namespace grapnel::app {

/// While it lives, SIGINT, SIGTERM and SIGHUP ask to stop; the second of a kind ends the program at once. A file that
/// grows beyond what is allowed (ulimit -f) is an error of writing, not the program's end. One at a time; poll() and
/// requested() by one thread.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Hands a request that came on to the token. To be called now and then.
  bool poll();
  std::stop_token token() const { return source_.get_token(); }

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGXFSZ};
  std::array<struct sigaction, kSignals.size()> before_{};
  std::stop_source source_;
};

}  // namespace grapnel::app
