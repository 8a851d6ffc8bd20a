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

namespace grapnel {
namespace {

// Blocks of the stream: a length, then so many bytes. These two lengths say that it ends.
constexpr std::uint32_t kWell = 0xffffffff, kFault = 0xfffffffe;
constexpr std::size_t kPipeBlock = 1 << 16;
constexpr std::uint64_t kLongestText = 1 << 24;

// All of it, or the end of the child: without a parent there is nothing left to do.
void write_all(int descriptor, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(descriptor, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(1);
    bytes += written, size -= static_cast<std::size_t>(written);
  }
}

int reap(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

// No core files, no messages of libraries and sanitizers, no handlers of the parent, and no life without it.
void settle_in_child(double seconds) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL, SIGPIPE})
    std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const auto most = static_cast<rlim_t>(std::max(1.0, seconds));
  const rlimit time{most, most + 1};
  ::setrlimit(RLIMIT_CPU, &time);
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

void ToParent::end(const std::string* fault) {
  // What was said before a fault is of no use.
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

FromChild::~FromChild() {
  ::close(descriptor_);
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);  // nobody wants the rest
  reap(child_);
}

void FromChild::died() {
  const int status = reap(child_);
  child_ = 0;
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
    throw std::runtime_error("damaged: reading it does not come to an end");
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGINT || WTERMSIG(status) == SIGTERM || WTERMSIG(status) == SIGHUP))
    throw std::runtime_error("reading it was stopped");
  if (WIFSIGNALED(status))
    throw std::runtime_error(std::string("damaged: reading it ends in a crash (") + ::strsignal(WTERMSIG(status)) +
                             ")");
  throw std::runtime_error("damaged: reading it ends too early");
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
    if (size == 0 || size > kPipeBlock) throw std::runtime_error("damaged: reading it goes wrong");
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
    if (left_ == 0 && !fill()) throw std::runtime_error("damaged: reading it ends too early");
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
  if (size > kLongestText) throw std::runtime_error("damaged: a text has an impossible size");
  std::string value(static_cast<std::size_t>(size), '\0');
  get(value.data(), value.size());
  return value;
}

void FromChild::expect_end() {
  if (left_ > 0 || fill()) throw std::runtime_error("damaged: it goes on behind its end");
}

void read_in_child(double seconds, const std::function<void(ToParent&)>& work,
                   const std::function<void(FromChild&)>& take) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::generic_category().message(errno));
  const pid_t child = ::fork();
  if (child < 0) {
    const int error = errno;
    ::close(ends[0]), ::close(ends[1]);
    throw std::runtime_error("no process to read it in: " + std::generic_category().message(error));
  }
  if (child == 0) {
    settle_in_child(seconds);
    ToParent parent(ends[1]);
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
    ::_exit(0);  // nothing of the parent's is flushed or destroyed a second time
  }
  ::close(ends[1]);
  FromChild source(ends[0], child);
  take(source);
  source.expect_end();
}

}  // namespace grapnel
