#include "grapnel/result/child_reader.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace grapnel {
namespace {

// Blocks of the stream: a length, then that number of bytes. These two lengths mark the end.
constexpr std::uint32_t kWell = 0xffffffff, kFault = 0xfffffffe;
constexpr std::size_t kPipeBlock = 1 << 16;
constexpr std::uint64_t kLongestText = 1 << 24;

// Writes everything or ends the child: without a parent there is no further work.
void write_all(int descriptor, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(descriptor, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(1);
    bytes += written, size -= static_cast<std::size_t>(written);
  }
}

// Writes to a child that may have crashed. SIGPIPE must not end this process: the answer reports the crash.
void send_question(int descriptor, const std::string& bytes) {
  sigset_t pipe, before;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, &before);
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t written = ::write(descriptor, bytes.data() + sent, bytes.size() - sent);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    sent += static_cast<std::size_t>(written);
  }
  const timespec at_once{};
  while (::sigtimedwait(&pipe, nullptr, &at_once) == SIGPIPE) {
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

int reap(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

// Limits the processor time from now on.
void allow_time(double seconds) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  const auto most = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec + 1) +
                    static_cast<rlim_t>(std::max(1.0, seconds));
  rlimit time{};
  ::getrlimit(RLIMIT_CPU, &time);
  time.rlim_cur = std::min(most, time.rlim_max);
  ::setrlimit(RLIMIT_CPU, &time);
}

// No core files, no messages of libraries and sanitizers, no handlers of the parent.
void settle_in_child(double seconds) {
  // Whether to stop is the parent's decision: a terminal sends its signals to both.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL, SIGPIPE, SIGXCPU}) std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  allow_time(seconds);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
}

}  // namespace

void ToParent::flush() {
  if (buffer_.empty()) return;
  const auto size = static_cast<std::uint32_t>(buffer_.size());
  write_all(descriptor_, reinterpret_cast<const char*>(&size), sizeof size);
  write_all(descriptor_, buffer_.data(), buffer_.size());
  buffer_.clear();
}

void ToParent::put(const void* bytes, std::size_t size) {
  const char* from = static_cast<const char*>(bytes);
  while (size > 0) {
    const std::size_t now = std::min(size, kPipeBlock - buffer_.size());
    buffer_.append(from, now);
    from += now, size -= now;
    if (buffer_.size() == kPipeBlock) flush();
  }
}

void ToParent::text(const std::string& value) {
  count(value.size());
  put(value.data(), value.size());
}

void ToParent::texts(const std::vector<std::string>& values) {
  count(values.size());
  for (const std::string& value : values) text(value);
}

void ToParent::end(const std::string* fault) {
  // Output before an error is discarded.
  if (fault) buffer_.clear();
  flush();
  const std::uint32_t mark = fault ? kFault : kWell;
  write_all(descriptor_, reinterpret_cast<const char*>(&mark), sizeof mark);
  if (!fault) return;
  const std::string text = fault->substr(0, kPipeBlock);
  const auto size = static_cast<std::uint32_t>(text.size());
  write_all(descriptor_, reinterpret_cast<const char*>(&size), sizeof size);
  write_all(descriptor_, text.data(), text.size());
}

void FromChild::died() {
  const int status = reap(std::exchange(child_, 0));
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
    throw std::runtime_error("damaged: reading exceeds its time limit");
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGINT || WTERMSIG(status) == SIGTERM || WTERMSIG(status) == SIGHUP))
    throw std::runtime_error("reading was interrupted");
  if (WIFSIGNALED(status))
    throw std::runtime_error(std::string("damaged: the reader crashed (") + ::strsignal(WTERMSIG(status)) + ")");
  throw std::runtime_error("damaged: the reader ended too early");
}

void FromChild::read(void* bytes, std::size_t size) {
  char* to = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = ::read(descriptor_, to, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) died();
    to += got, size -= static_cast<std::size_t>(got);
  }
}

// The next block's length. False at the end.
bool FromChild::fill() {
  std::uint32_t size = 0;
  read(&size, sizeof size);
  if (size == kWell) return false;
  if (size != kFault) {
    if (size == 0 || size > kPipeBlock) throw std::runtime_error("damaged: the reader returned invalid data");
    left_ = size;
    return true;
  }
  std::uint32_t length = 0;
  read(&length, sizeof length);
  std::string fault(std::min<std::size_t>(length, kPipeBlock), '\0');
  read(fault.data(), fault.size());
  throw std::runtime_error(fault);
}

void FromChild::get(void* bytes, std::size_t size) {
  char* to = static_cast<char*>(bytes);
  while (size > 0) {
    if (left_ == 0 && !fill()) throw std::runtime_error("damaged: the reader ended too early");
    const std::size_t now = std::min(size, left_);
    read(to, now);
    to += now, size -= now, left_ -= now;
  }
}

std::uint64_t FromChild::count() {
  std::uint64_t value = 0;
  get(&value, sizeof value);
  return value;
}

std::string FromChild::text() {
  const std::uint64_t size = count();
  if (size > kLongestText) throw std::runtime_error("damaged: implausible size of a text");
  std::string value(static_cast<std::size_t>(size), '\0');
  get(value.data(), value.size());
  return value;
}

std::vector<std::string> FromChild::texts() {
  std::vector<std::string> values;
  for (std::uint64_t left = count(); left > 0; --left) values.push_back(text());
  return values;
}

void FromChild::expect_end() {
  if (left_ > 0 || fill()) throw std::runtime_error("damaged: data after the end");
}

namespace {

// A child's end in this process.
struct Ended {
  pid_t& child;
  int& descriptor;
  ~Ended() {
    if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
    if (child <= 0) return;
    ::kill(child, SIGKILL);  // the rest is discarded
    reap(std::exchange(child, 0));
  }
};

// Runs `work`; exceptions are sent to the parent.
void answer(int descriptor, const std::function<void(ToParent&)>& work) {
  ToParent parent(descriptor);
  std::string fault;
  bool good = false;
  try {
    work(parent);
    good = true;
  } catch (const std::exception& error) {
    fault = error.what();
  } catch (...) {
    fault = "damaged";
  }
  parent.end(good ? nullptr : &fault);
}

}  // namespace

void read_in_child(double seconds, const std::function<void(ToParent&)>& work,
                   const std::function<void(FromChild&)>& take) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw NoProcess(std::generic_category().message(errno));
  const pid_t parent = ::getpid();
  pid_t child = ::fork();
  if (child < 0) {
    const int error = errno;
    ::close(ends[0]), ::close(ends[1]);
    throw NoProcess("cannot start a process for reading: " + std::generic_category().message(error));
  }
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);  // killed before the request
    settle_in_child(seconds);
    answer(ends[1], work);
    ::_exit(0);  // the parent's buffers and objects are not flushed or destroyed a second time
  }
  ::close(ends[1]);
  const Ended ended{child, ends[0]};
  FromChild source(ends[0], child);
  take(source);
  source.expect_end();
}

namespace {

constexpr std::uint32_t kLongestQuestion = 1 << 26;

// The next question; false when the parent has closed its end.
bool next_question(int descriptor, std::string& question) {
  const auto all = [&](void* bytes, std::size_t size) {
    char* to = static_cast<char*>(bytes);
    while (size > 0) {
      const ssize_t got = ::read(descriptor, to, size);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      to += got, size -= static_cast<std::size_t>(got);
    }
    return true;
  };
  std::uint32_t size = 0;
  if (!all(&size, sizeof size) || size > kLongestQuestion) return false;
  question.resize(size);
  return all(question.data(), question.size());
}

[[noreturn]] void serve(double seconds, int questions, int answers, const std::function<QueriedChild::Answer()>& open) {
  settle_in_child(seconds);
  QueriedChild::Answer reply;
  try {
    reply = open();
  } catch (const std::exception& error) {
    reply = [fault = std::string(error.what())](const std::string&, ToParent&) { throw std::runtime_error(fault); };
  }
  std::string question;
  while (next_question(questions, question)) {
    allow_time(seconds);
    answer(answers, [&](ToParent& parent) { reply(question, parent); });
  }
  ::_exit(0);
}

}  // namespace

QueriedChild::QueriedChild(double seconds, const std::function<Answer()>& open) {
  int to_child[2], to_parent[2];
  if (::pipe2(to_child, O_CLOEXEC) != 0) throw NoProcess(std::generic_category().message(errno));
  if (::pipe2(to_parent, O_CLOEXEC) != 0) {
    const int error = errno;
    ::close(to_child[0]), ::close(to_child[1]);
    throw NoProcess(std::generic_category().message(error));
  }
  child_ = ::fork();
  if (child_ == 0) {
    // It ends with the parent's end of the pipe: PR_SET_PDEATHSIG would end it with the thread that made it.
    ::close(to_child[1]), ::close(to_parent[0]);
    serve(seconds, to_child[0], to_parent[1], open);
  }
  const int error = errno;
  ::close(to_child[0]), ::close(to_parent[1]);
  questions_ = to_child[1], answers_ = to_parent[0];
  if (child_ > 0) return;
  end();
  throw NoProcess("cannot start a process for reading: " + std::generic_category().message(error));
}

QueriedChild::~QueriedChild() { end(); }

void QueriedChild::end() {
  if (questions_ >= 0) ::close(std::exchange(questions_, -1));
  const Ended ended{child_, answers_};
}

void QueriedChild::ask(const std::string& question, const std::function<void(FromChild&)>& take) {
  const std::lock_guard lock(mutex_);
  if (!failure_.empty()) throw std::runtime_error(failure_);
  try {
    const auto size = static_cast<std::uint32_t>(question.size());
    std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
    bytes += question;
    send_question(questions_, bytes);
    FromChild source(answers_, child_);
    take(source);
    source.expect_end();
  } catch (const std::exception& error) {
    failure_ = error.what();
    end();
    throw;
  }
}

}  // namespace grapnel
