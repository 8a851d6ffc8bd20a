#include "stop_signal.hpp"

namespace grapnel::app {
namespace {

volatile std::sig_atomic_t asked = 0;

extern "C" void note_request(int) { asked = 1; }

}  // namespace

StopSignal::StopSignal() {
  asked = 0;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &before_[i]);
    if (before_[i].sa_handler == SIG_IGN) continue;  // nohup
    struct sigaction action {};
    sigemptyset(&action.sa_mask);
    action.sa_handler = kSignals[i] == SIGXFSZ ? SIG_IGN : note_request;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigaction(kSignals[i], &action, nullptr);
  }
}

StopSignal::~StopSignal() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

bool StopSignal::poll() {
  if (asked != 0) source_.request_stop();
  return asked != 0;
}

}  // namespace grapnel::app
