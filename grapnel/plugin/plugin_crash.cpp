#include "grapnel/plugin/plugin_crash.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>

namespace grapnel {
namespace {

thread_local const PluginCall* t_call = nullptr;

// An alternate signal stack for threads whose stack overflowed; lives as long as the thread.
class HandlerStack {
 public:
  std::uintptr_t low = 0;  // the thread's own stack begins here; 0: unknown

  void prepare() {
    if (is_ready_) return;
    is_ready_ = true;
    find_low();
    stack_t now{};
    // An existing one, for example of a sanitizer, is kept.
    if (::sigaltstack(nullptr, &now) != 0 || !(now.ss_flags & SS_DISABLE)) return;
    memory_ = std::make_unique<char[]>(kSize);
    stack_t mine{};
    mine.ss_sp = memory_.get(), mine.ss_size = kSize;
    if (::sigaltstack(&mine, nullptr) != 0) memory_.reset();
  }
  ~HandlerStack() {
    if (!memory_) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    ::sigaltstack(&none, nullptr);
  }

 private:
  static constexpr std::size_t kSize = 64 << 10;  // [bytes]: AVX-512 state alone takes 3 KiB of a handler's frame

  void find_low() {
    pthread_attr_t attributes;
    if (::pthread_getattr_np(::pthread_self(), &attributes) != 0) return;
    void* begin = nullptr;
    std::size_t size = 0;
    if (::pthread_attr_getstack(&attributes, &begin, &size) == 0) low = reinterpret_cast<std::uintptr_t>(begin);
    ::pthread_attr_destroy(&attributes);
  }

  std::unique_ptr<char[]> memory_;
  bool is_ready_ = false;
};
thread_local HandlerStack t_stack;

struct Watched {
  int number;
  const char* name;
};
constexpr std::array<Watched, 5> kWatched = {{{SIGSEGV, " (segmentation fault)"},
                                              {SIGBUS, " (bus error)"},
                                              {SIGFPE, " (arithmetic exception)"},
                                              {SIGILL, " (illegal instruction)"},
                                              {SIGABRT, " (abort)"}}};
std::array<struct sigaction, kWatched.size()> previous;

// A line of text without allocation or locks, for signal handlers.
class Line {
 public:
  void add(const char* text) {
    const std::size_t more = std::min(std::strlen(text), text_.size() - size_);
    std::memcpy(text_.data() + size_, text, more);
    size_ += more;
  }
  // With six decimal places.
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

PluginBlame own_blame{};
std::atomic<PluginBlame*> shared_blame{&own_blame};
void (*before_first_call)() = nullptr;

// Prints "grapnel: the plugin 'mine.so' crashed (abort) in update() at t = 0.5 s. ..." and ends the process.
[[noreturn]] void end_process(const char* what, const char* detail, const char* end) {
  Line line;
  for (const char* text : {"grapnel: ", t_call->plugin, what, detail, " in ", t_call->function, "() at t = "})
    line.add(text);
  line.add(t_call->time);
  line.add(end);
  line.write_out();
  shared_blame.load()->said = true;
  ::_exit(1);
}

// Whether the fault address is just below this thread's stack.
bool is_stack_overflow(int number, const siginfo_t& info) {
  if (number != SIGSEGV && number != SIGBUS) return false;
  const auto address = reinterpret_cast<std::uintptr_t>(info.si_addr);
  constexpr std::uintptr_t kNear = 1 << 20;  // [bytes]: frames may jump over the guard page
  return t_stack.low != 0 && address < t_stack.low + kNear && address + kNear > t_stack.low;
}

void on_crash(int number, siginfo_t* info, void*) {
  std::size_t which = 0;
  while (which + 1 < kWatched.size() && kWatched[which].number != number) ++which;
  // not in a plugin: the previous handler receives the signal when the instruction is repeated
  if (t_call == nullptr) {
    ::sigaction(number, &previous[which], nullptr);
    if (number == SIGABRT) ::raise(number);
    return;
  }
  end_process(" crashed", is_stack_overflow(number, *info) ? " (stack overflow)" : kWatched[which].name,
              " s. This ends the program, since its memory may be corrupted; files written so "
              "far are kept.\n");
}

// Handler for exit() and quick_exit(), on the thread that calls them.
void on_exit() {
  if (t_call != nullptr)
    end_process(" called exit()", "", " s, which ends the program; files written so far are kept.\n");
}

void watch_for_crashes() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (before_first_call != nullptr) before_first_call();
    for (std::size_t i = 0; i < kWatched.size(); ++i) {
      struct sigaction action = {};
      action.sa_sigaction = on_crash;
      action.sa_flags = SA_SIGINFO | SA_ONSTACK;
      sigemptyset(&action.sa_mask);
      ::sigaction(kWatched[i].number, &action, &previous[i]);
    }
    std::atexit(on_exit);
    std::at_quick_exit(on_exit);
  });
}

void remember(const PluginCall& call) {
  PluginBlame& blame = *shared_blame.load();
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (std::strncmp(blame.plugin, call.plugin, sizeof blame.plugin - 1) != 0)
    std::strncpy(blame.plugin, call.plugin, sizeof blame.plugin - 1);
  blame.function = call.function, blame.time = call.time;
}

void count(int more) { std::atomic_ref(shared_blame.load()->calls) += more; }

}  // namespace

PluginCall::PluginCall(const char* the_plugin, const char* the_function, double the_time)
    : plugin(the_plugin), function(the_function), time(the_time), outer_(t_call) {
  watch_for_crashes();
  t_stack.prepare();
  remember(*this);
  count(1);
  t_call = this;
}

PluginCall::~PluginCall() {
  t_call = outer_;
  count(-1);
}

void share_plugin_blame(PluginBlame* blame, void (*first)()) {
  *blame = own_blame;
  shared_blame = blame;
  before_first_call = first;
}

std::string blame_text(const PluginBlame& blame, const std::string& what) {
  std::string text = std::string(blame.plugin) + " " + what;
  if (blame.calls > 0) text += fmt::format(" in {}() at t = {:.6f} s", blame.function, blame.time);
  return text;
}

}  // namespace grapnel
