#include "stop_signal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace grapnel::app {
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
