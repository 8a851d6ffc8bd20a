#include "grapnel/plugin/plugin_crash.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstring>
#include <mutex>

namespace grapnel {
namespace {

thread_local const PluginCall* t_call = nullptr;

struct Watched {
  int number;
  const char* name;
};
constexpr std::array<Watched, 5> kWatched = {{{SIGSEGV, "segmentation fault"},
                                              {SIGBUS, "bus error"},
                                              {SIGFPE, "arithmetic fault"},
                                              {SIGILL, "illegal instruction"},
                                              {SIGABRT, "abort"}}};
std::array<struct sigaction, kWatched.size()> previous;

// Nothing here may allocate or lock.
class Line {
 public:
  void add(const char* text) {
    const std::size_t more = std::min(std::strlen(text), text_.size() - size_);
    std::memcpy(text_.data() + size_, text, more);
    size_ += more;
  }
  // With six digits behind the point.
  void add(double number) {
    if (!(std::abs(number) < 1e12)) return add("?");
    if (number < 0) add("-");
    auto millionths = static_cast<unsigned long long>(std::abs(number) * 1e6 + 0.5);
    std::array<char, 32> digits{};
    std::size_t at = digits.size() - 1;
    for (int k = 0; k < 7 || millionths > 0; ++k) {
      if (k == 6) digits.at(--at) = '.';
      digits.at(--at) = static_cast<char>('0' + millionths % 10);
      millionths /= 10;
    }
    add(digits.data() + at);
  }
  void write_out() const {
    std::size_t done = 0;
    while (done < size_) {
      const ssize_t written = ::write(STDERR_FILENO, text_.data() + done, size_ - done);
      if (written <= 0) return;
      done += static_cast<std::size_t>(written);
    }
  }

 private:
  std::array<char, 1024> text_{};
  std::size_t size_ = 0;
};

void on_crash(int number) {
  std::size_t which = 0;
  while (which + 1 < kWatched.size() && kWatched[which].number != number) ++which;
  if (t_call == nullptr) {  // not a plugin's: what was there before gets it, as the instruction is tried again
    ::sigaction(number, &previous[which], nullptr);
    if (number == SIGABRT) ::raise(number);
    return;
  }
  Line line;
  line.add("grapnel: ");
  line.add(t_call->plugin);
  line.add(" crashed (");
  line.add(kWatched[which].name);
  line.add(") in ");
  line.add(t_call->function);
  line.add("() at t = ");
  line.add(t_call->time);
  line.add(
      " s. This ends the program, since the memory of the process cannot be trusted any more; files written so far "
      "are kept.\n");
  line.write_out();
  ::_exit(1);
}

void watch_for_crashes() {
  static std::once_flag once;
  std::call_once(once, [] {
    for (std::size_t i = 0; i < kWatched.size(); ++i) {
      struct sigaction action = {};
      action.sa_handler = on_crash;
      sigemptyset(&action.sa_mask);
      ::sigaction(kWatched[i].number, &action, &previous[i]);
    }
  });
}

}  // namespace

PluginCall::PluginCall(const char* the_plugin, const char* the_function, double the_time)
    : plugin(the_plugin), function(the_function), time(the_time), outer_(t_call) {
  watch_for_crashes();
  t_call = this;
}

PluginCall::~PluginCall() { t_call = outer_; }

}  // namespace grapnel
