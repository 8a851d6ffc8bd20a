#include "process.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <initializer_list>
#include <stdexcept>
#include <system_error>
#include <thread>

namespace grapnel::app {
void prepare_process() {
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest free number is this one. A stdout that cannot be written to stays one: that is no success.
    const int flags = descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY;
    [[maybe_unused]] const int opened = ::open("/dev/null", flags);
  }
}

int threads_of(int asked) {
  if (asked > 0) return asked;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

namespace {

// What the thread reads.
constexpr char kRequest = 'r', kEnd = 'e';

std::atomic<int> handler_end{-1};  // of the pipe
static_assert(std::atomic<int>::is_always_lock_free);

// Nothing but write(2), which a handler may call.
extern "C" void pass_on(int) {
  const int before = errno;
  const char request = kRequest;
  [[maybe_unused]] const ssize_t written = ::write(handler_end, &request, 1);
  errno = before;
}

}  // namespace

StopSignal::StopSignal() {
  if (::pipe2(pipe_.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  handler_end = pipe_[1];
  // The thread is to get none of these signals, so that they end no system call of its own.
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
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigaction(kSignals[i], &action, nullptr);
  }
}

StopSignal::~StopSignal() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
  [[maybe_unused]] const ssize_t written = ::write(pipe_[1], &kEnd, 1);
  waiting_.join();
  handler_end = -1;
  ::close(pipe_[0]);
  ::close(pipe_[1]);
}

}  // namespace grapnel::app
