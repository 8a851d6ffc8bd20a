#include "terminal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <initializer_list>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "commands.hpp"
#include "grapnel/campaign/statistics.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/message_text.hpp"
#include "plugin_supervisor.hpp"

namespace grapnel::app {
namespace {

std::mutex mutex;
bool progress_shown = false;      // the terminal shows a line without an end; guarded by mutex
std::optional<std::string> kept;  // BufferedMessages; guarded by mutex

// Longer lines of stderr are truncated: a list in a message may have any length.
constexpr std::size_t kLongestLine = 16384;  // [bytes]

std::string with_short_lines(std::string text) {
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end - begin > kLongestLine) {
      std::size_t last = begin + kLongestLine;
      while (last > begin && (static_cast<unsigned char>(text[last]) & 0xc0) == 0x80) --last;
      text.replace(last, end - last, "…");
      end = text.find('\n', last) == std::string::npos ? text.size() : text.find('\n', last);
    }
    begin = end + 1;
  }
  return text;
}

// Call with `mutex` held. Errors of stdout remain in ferror(stdout); errors of stderr are ignored.
void put(std::FILE* stream, const std::string& text) { (void)!std::fwrite(text.data(), 1, text.size(), stream); }

void erase_line() {
  if (progress_shown) put(stderr, "\r\033[K");
  progress_shown = false;
}

}  // namespace

bool stderr_is_terminal() { return isatty(STDERR_FILENO) == 1; }

void write_stdout(std::string_view lines) {
  const std::lock_guard lock(mutex);
  if (kept) return;
  erase_line();
  put(stdout, printable_lines(lines));
}

void write_stderr(std::string_view lines) {
  const std::lock_guard lock(mutex);
  if (kept) {
    *kept += with_short_lines(printable_lines(lines));
    return;
  }
  erase_line();
  // Writes the buffer of stdout first, so that a line of stderr cannot interrupt a line of it.
  std::fflush(stdout);
  put(stderr, with_short_lines(printable_lines(lines)));
  std::fflush(stderr);
}

void flush_stdout() {
  const std::lock_guard lock(mutex);
  std::fflush(stdout);
}

void show_progress(std::string_view line) {
  const std::lock_guard lock(mutex);
  const bool terminal = stderr_is_terminal();
  std::fflush(stdout);
  put(stderr, terminal ? "\r\033[K" + printable_line(line) : printable_line(line) + "\n");
  std::fflush(stderr);
  progress_shown = terminal;
}

void erase_progress() {
  const std::lock_guard lock(mutex);
  erase_line();
  std::fflush(stderr);
}

BufferedMessages::BufferedMessages() {
  const std::lock_guard lock(mutex);
  kept.emplace();
}

BufferedMessages::~BufferedMessages() {
  const std::lock_guard lock(mutex);
  kept.reset();
}

std::string BufferedMessages::lines() const {
  const std::lock_guard lock(mutex);
  return *kept;
}

void print_errors(const std::vector<Fault>& faults) {
  std::string lines;
  for (const Fault& fault : faults) lines += fault.text() + "\n";
  write_stderr(lines);
}

namespace {
// Intervals between lines of progress [s]. Quick runs show none.
constexpr double kTerminalInterval = 0.2, kPlainInterval = 10;
}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(stderr_is_terminal()), last_(Clock::now()), begin_(last_) {}

Progress::~Progress() { erase_progress(); }

void Progress::report(const std::string& phase, double at, double end) {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  if (phase != phase_) {
    phase_ = phase;
    first_ = at;
    phase_start_ = now;
  }
  if (!is_due(now)) return;
  const double elapsed = std::chrono::duration<double>(now - phase_start_).count();
  const double rate = elapsed > 0 ? (at - first_) / elapsed : 0;
  const std::string text = phase == kPlanning
                               ? fmt::format("planning: {:.3g} of at most {:.3g} evaluations", at, end)
                               : fmt::format("{}: t = {:.3g} of {:.3g} s, {:.3g} simulated s per s, {:.0f} s left",
                                             phase, at, end, rate, rate > 0 ? (end - at) / rate : 0.0);
  show(text, now);
}

void Progress::report_points(const CaseProgress& at) {
  const Clock::time_point now = Clock::now();
  if (quiet_ || !is_due(now) || at.done == 0) return;
  const double rate = static_cast<double>(at.done) / std::chrono::duration<double>(now - begin_).count();
  const std::string failures = at.not_ok > 0 ? fmt::format(", {} not ok", at.not_ok) : "";
  show(fmt::format("{} of {} points{}, {:.3g} points per s, {:.0f} s left", at.done, at.total, failures, rate,
                   static_cast<double>(at.total - at.done) / rate),
       now);
}

void Progress::report_campaign(const CaseProgress& at) {
  const Clock::time_point now = Clock::now();
  if (quiet_ || !is_due(now) || at.done == at.begun_with) return;
  const double rate =
      static_cast<double>(at.done - at.begun_with) / std::chrono::duration<double>(now - begin_).count();
  const Proportion success = wilson(at.successes, at.done);
  const std::string failures = at.not_ok > 0 ? fmt::format(", {} not ok", at.not_ok) : "";
  show(fmt::format("{} of {} cases, {:.3g} cases per s, {:.0f} s left, success {:.4f} ({:.4f} to {:.4f}){}", at.done,
                   at.total, rate, static_cast<double>(at.total - at.done) / rate, success.estimate, success.lower,
                   success.upper, failures),
       now);
}

namespace {
constexpr double kSlow = 20;  // [s]
}  // namespace

SlowWarning::SlowWarning(std::string file, std::function<std::string(const std::string& phase)> causes)
    : file_(std::move(file)), causes_(std::move(causes)), begin_(Clock::now()), next_(kSlow) {}

void SlowWarning::report(const std::string& phase, double at, double end) {
  const Clock::time_point now = Clock::now();
  if (phase != phase_) {
    phase_ = phase;
    first_ = at;
    begin_ = now;
    next_ = kSlow;
  }
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  if (elapsed < next_) return;
  next_ = 2 * elapsed;
  const double rate = (at - first_) / elapsed, left = rate > 0 ? (end - at) / rate : HUGE_VAL;
  if (left < elapsed) return;
  if (phase == kPlanning && !(end > 0)) {
    to_stderr("{}: warning: slow: the targets' motion before the capture has taken {:.0f} s so far; {}\n", file_,
              elapsed, causes_(phase));
    return;
  }
  if (phase == kPlanning) {
    to_stderr(
        "{}: warning: slow: planning has made {:.3g} evaluations in {:.0f} s and ends at most at {:.3g}, about {:.0f} "
        "s "
        "from now; to shorten it, reduce the starts, knots and constraints of approach.plan\n",
        file_, at, elapsed, end, left);
    return;
  }
  const std::string time = left < 1e6 ? fmt::format("about {:.0f} s left", left) : "no estimate of the end";
  to_stderr(
      "{}: warning: slow: {} is at t = {:.4g} of {:.4g} s after {:.0f} s, {:.2g} simulated s per s, {}; to "
      "speed it up, most effective first: {}\n",
      file_, phase, at, end, elapsed, rate, time, causes_(phase));
}

bool Progress::is_due(Clock::time_point now) const {
  return std::chrono::duration<double>(now - last_).count() >= (terminal_ ? kTerminalInterval : kPlainInterval);
}

void Progress::show(const std::string& text, Clock::time_point now) {
  last_ = now;
  show_progress(text);
}

namespace {

// For commands that have no results to keep.
extern "C" void end_at_once(int) {
  note_end(kInterrupted);
  ::_exit(kInterrupted);
}

}  // namespace

void prepare_process() {
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler == SIG_IGN) continue;  // nohup
    sigemptyset(&action.sa_mask);
    action.sa_handler = end_at_once;
    action.sa_flags = 0;
    sigaction(signal, &action, nullptr);
  }
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // open() returns the lowest free number. A stdout that is not writable remains so and is an error.
    const int flags = descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY;
    [[maybe_unused]] const int opened = ::open("/dev/null", flags);
  }
}

int threads_of(int asked) {
  if (asked > 0) return asked;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

namespace {

// Bytes that the thread reads from the pipe.
constexpr char kRequest = 'r', kEnd = 'e';

std::atomic<int> handler_end{-1};  // of the pipe
// Time of the first signal of each kind since the StopSignal was made [ns of the monotonic clock]; 0: none.
std::array<std::atomic<std::int64_t>, 32> came;
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

std::int64_t monotonic_time() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}
static_assert(std::atomic<int>::is_always_lock_free);

// Calls only async-signal-safe functions. The second signal of a kind ends the program, unless it arrives at the same
// moment: timeout(1) sends its signal both to the process and to its group.
extern "C" void pass_on(int signal) {
  constexpr std::int64_t kSameMoment = 300'000'000;  // [ns]
  const std::int64_t now = monotonic_time();
  std::int64_t first = 0;
  if (!came[static_cast<std::size_t>(signal)].compare_exchange_strong(first, now)) {
    if (now - first > kSameMoment) end_at_once(signal);
    return;
  }
  const int before = errno;
  const char request = kRequest;
  [[maybe_unused]] const ssize_t written = ::write(handler_end, &request, 1);
  errno = before;
}

}  // namespace

StopSignal::StopSignal(std::stop_token instead) : instead_(std::move(instead)) {
  if (instead_.stop_possible()) return;
  if (::pipe2(pipe_.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  handler_end = pipe_[1];
  for (std::atomic<std::int64_t>& one : came) one = 0;
  // Blocks all signals in the thread, so that they do not interrupt its system calls.
  sigset_t mine, all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &mine);
  waiting_ = std::thread([this] {
    for (char c = 0; c != kEnd;) {
      const ssize_t got = ::read(pipe_[0], &c, 1);
      if (got == 0 || (got < 0 && errno != EINTR)) return;
      if (got == 1 && c == kRequest) source_.request_stop();
    }
  });
  pthread_sigmask(SIG_SETMASK, &mine, nullptr);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &before_[i]);
    if (before_[i].sa_handler == SIG_IGN) continue;  // nohup
    struct sigaction action {};
    sigemptyset(&action.sa_mask);
    action.sa_handler = pass_on;
    action.sa_flags = SA_RESTART;
    sigaction(kSignals[i], &action, nullptr);
  }
}

StopSignal::~StopSignal() {
  if (instead_.stop_possible()) return;
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
  [[maybe_unused]] const ssize_t written = ::write(pipe_[1], &kEnd, 1);
  waiting_.join();
  handler_end = -1;
  ::close(pipe_[0]);
  ::close(pipe_[1]);
}

}  // namespace grapnel::app
