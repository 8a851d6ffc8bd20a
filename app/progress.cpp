#include "progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace grapnel::app {
namespace {
// Nothing is shown before this, so that quick runs stay quiet.
constexpr double kTerminalInterval = 0.2, kPlainInterval = 10;
}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1), last_(Clock::now()) {}

Progress::~Progress() { erase(); }

void Progress::erase() {
  if (shown_ && terminal_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void Progress::report(const std::string& phase, double at, double end) {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  if (phase != phase_) {
    phase_ = phase;
    first_ = at;
    phase_start_ = now;
  }
  const double since = std::chrono::duration<double>(now - last_).count();
  if (since < (terminal_ ? kTerminalInterval : kPlainInterval)) return;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - phase_start_).count();
  const double rate = elapsed > 0 ? (at - first_) / elapsed : 0;
  const std::string text = fmt::format("{}: t = {:.3g} of {:.3g} s, {:.3g} simulated s per s, {:.0f} s left", phase, at,
                                       end, rate, rate > 0 ? (end - at) / rate : 0.0);
  std::fputs((terminal_ ? "\r\033[K" + text : text + "\n").c_str(), stderr);
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace grapnel::app
