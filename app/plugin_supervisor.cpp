#include "plugin_supervisor.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <new>

#include "commands.hpp"
#include "grapnel/plugin/plugin_crash.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

// Memory shared between the program and the process that watches it.
struct Shared {
  PluginBlame blame{};
  std::atomic<bool> has_ended = false;
  std::atomic<int> code = 0;
};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

Shared* shared = nullptr;

// Signals that request the end of the program; they are forwarded to the child.
constexpr std::array kPassedOn{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2};

bool is_single_thread() {
  std::error_code error;
  const std::filesystem::directory_iterator tasks("/proc/self/task", error);
  return !error && std::distance(begin(tasks), end(tasks)) == 1;
}

bool is_ignored(int signal) {
  struct sigaction action {};
  return ::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

// Those of `signals` that this process does not ignore (nohup ignores SIGHUP).
sigset_t watched_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : kPassedOn)
    if (!is_ignored(signal)) sigaddset(&set, signal);
  for (const int signal : {SIGCHLD, SIGTSTP, SIGCONT}) sigaddset(&set, signal);
  return set;
}

// Waits for the end of the child. Returns its status, as from waitpid(); sets `asked` to a forwarded signal.
int wait_for(pid_t child, const sigset_t& signals, int& asked) {
  for (;;) {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0) continue;
    if (signal == SIGTSTP) {
      ::kill(child, SIGSTOP);
      ::raise(SIGSTOP);
      ::kill(child, SIGCONT);
    } else if (signal == SIGCONT) {
      ::kill(child, SIGCONT);
    } else if (signal != SIGCHLD) {
      asked = signal;
      ::kill(child, signal);
    }
    int status = 0;
    if (::waitpid(child, &status, WNOHANG) == child) return status;
  }
}

std::string end_text(int status) {
  if (WIFEXITED(status)) return fmt::format("ended the program (exit code {})", WEXITSTATUS(status));
  return fmt::format("ended the program ({})", ::strsignal(WTERMSIG(status)));
}

// Ends this process by the same signal as the child.
[[noreturn]] void die_of(int signal) {
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);  // the child's core file exists
  std::signal(signal, SIG_DFL);
  sigset_t all;
  sigfillset(&all);
  sigprocmask(SIG_UNBLOCK, &all, nullptr);
  ::raise(signal);
  ::_exit(128 + signal);
}

[[noreturn]] void end_like(int status, int asked) {
  const PluginBlame& blame = shared->blame;
  const auto accuse = [&](const std::string& what) {
    to_stderr("grapnel: error: {}; files written so far are kept\n", blame_text(blame, what));
    ::_exit(kSimulationFailed);
  };
  if (shared->has_ended) {
    if (WIFEXITED(status) || blame.said) ::_exit(blame.said ? kSimulationFailed : shared->code.load());
    if (blame.plugin[0] != 0) accuse(fmt::format("crashed ({}) as the program ended", ::strsignal(WTERMSIG(status))));
    die_of(WTERMSIG(status));
  }
  if (blame.said) ::_exit(kSimulationFailed);
  if (WIFSIGNALED(status) && (WTERMSIG(status) == asked || blame.calls == 0)) die_of(WTERMSIG(status));
  accuse(end_text(status));
  ::_exit(kSimulationFailed);
}

void continue_in_child() {
  if (!is_single_thread()) return;
  flush_stdout();
  std::fflush(stderr);
  const sigset_t signals = watched_signals();
  sigset_t before;
  sigprocmask(SIG_BLOCK, &signals, &before);
  const pid_t watcher = ::getpid();
  const pid_t child = ::fork();
  if (child > 0) {
    int asked = 0;
    const int status = wait_for(child, signals, asked);
    end_like(status, asked);
  }
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != watcher) ::_exit(kSimulationFailed);
    // A separate process group: signals from a terminal arrive once, through the watcher.
    ::setpgid(0, 0);
    for (const int signal : {SIGTTOU, SIGTTIN}) std::signal(signal, SIG_IGN);
  }
  sigprocmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace

void supervise_plugins() {
  void* const memory = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return;
  shared = new (memory) Shared;
  share_plugin_blame(&shared->blame, continue_in_child);
}

void note_end(int code) {
  if (shared == nullptr) return;
  shared->code = code;
  shared->has_ended = true;
}

int end_of_program(int code) {
  note_end(code);
  return code;
}

}  // namespace grapnel::app
