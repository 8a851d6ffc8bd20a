#include "grapnel/campaign/campaign_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <ctime>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <stop_token>
#include <system_error>
#include <thread>

#include "grapnel/result/atomic_file.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, int error) {
  throw std::runtime_error("cannot write " + path.string() + ": " + std::generic_category().message(error));
}

// --- Identity of a process ---

struct Holder {
  std::string host, boot, space;  // machine; boot id; name space of process ids
  long pid = 0;
  std::string start;  // start time of the process in kernel ticks: distinguishes reused process ids
  std::string since;  // for messages
};

std::string first_line(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::string link_text(const char* path) {
  std::error_code none;
  return fs::read_symlink(path, none).string();
}

// Field 22 of /proc/PID/stat (proc(5)); the name before it, in parentheses, may hold anything. Empty: no such process.
std::string start_of(long pid) {
  const std::string line = first_line(fmt::format("/proc/{}/stat", pid));
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream fields(line.substr(name_end + 1));
  std::string field;
  for (int i = 3; i <= 22; ++i) fields >> field;
  return field;
}

std::string time_text() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
  return text.data();
}

Holder myself() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  const long pid = ::getpid();
  return {
      host.data(), first_line("/proc/sys/kernel/random/boot_id"), link_text("/proc/self/ns/pid"), pid, start_of(pid),
      time_text()};
}

std::string text_of(const Holder& h) {
  return fmt::format("host {}\npid {}\nsince {}\nboot {}\nspace {}\nstart {}\n", h.host, h.pid, h.since, h.boot,
                     h.space, h.start);
}

// Empty if the text has another format, or is empty.
std::optional<Holder> holder_from(const std::string& text) {
  std::map<std::string, std::string> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t space = line.find(' ');
    if (space != std::string::npos) values[line.substr(0, space)] = line.substr(space + 1);
  }
  if (values.count("host") == 0 || values.count("pid") == 0) return std::nullopt;
  return Holder{values["host"],  values["boot"], values["space"], std::strtol(values["pid"].c_str(), nullptr, 10),
                values["start"], values["since"]};
}

// Whether the process is known to have ended, or to exist.
enum class Fate { gone, there, unknown };
Fate fate_of(const Holder& holder) {
  const Holder me = myself();
  if (holder.host == me.host && holder.boot != me.boot) return Fate::gone;  // the machine was rebooted
  if (holder.host != me.host || holder.boot != me.boot || holder.space != me.space) return Fate::unknown;
  if (::kill(static_cast<pid_t>(holder.pid), 0) != 0 && errno == ESRCH) return Fate::gone;
  const std::string start = start_of(holder.pid);
  return start.empty() || start == holder.start ? Fate::there : Fate::gone;
}

// --- A file with the system's lock ---

// Byte ranges of the file "lock" for locks; they need not exist.
constexpr off_t kFolderByte = 1 << 20, kTurnByte = kFolderByte + 1;

struct flock range(short type, off_t byte) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = byte;
  lock.l_len = 1;
  return lock;
}

enum class Taken { yes, no, cannot };

// Locks of open file descriptions: two objects of one process exclude each other too.
Taken take(int descriptor, short type, off_t byte, bool wait) {
  struct flock lock = range(type, byte);
  while (::fcntl(descriptor, wait ? F_OFD_SETLKW : F_OFD_SETLK, &lock) != 0) {
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == EACCES) return Taken::no;
    return Taken::cannot;  // ENOLCK, ENOSYS, EOPNOTSUPP: a file system without locks
  }
  return Taken::yes;
}

// The file of a lock: open, and identical to the file at the path (a holder removes it when it ends).
class LockFile {
 public:
  explicit LockFile(fs::path path) : path_(std::move(path)) { open(); }
  ~LockFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

  Taken take(short type, off_t byte) {
    for (;;) {
      const Taken taken = grapnel::take(descriptor_, type, byte, false);
      if (taken != Taken::yes || is_current()) return taken;
      ::close(descriptor_);
      open();
    }
  }
  std::string text() const {
    std::array<char, 4096> bytes{};
    const ssize_t size = ::pread(descriptor_, bytes.data(), bytes.size(), 0);
    return {bytes.data(), size > 0 ? static_cast<std::size_t>(size) : 0};
  }
  void write(const std::string& text) {
    if (::ftruncate(descriptor_, 0) != 0) fail(path_, errno);
    const ssize_t written = ::pwrite(descriptor_, text.data(), text.size(), 0);
    if (written != static_cast<ssize_t>(text.size())) fail(path_, written < 0 ? errno : ENOSPC);
  }
  /// Seconds since the file was marked, by the clock of the file system: those of machines may differ.
  double age() const {
    struct stat before {
    }, after{};
    if (::fstat(descriptor_, &before) != 0) return 0;
    const fs::path probe = path_.string() + fmt::format(".probe-{}", ::getpid());
    const int now = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (now < 0) return 0;
    const bool known = ::fstat(now, &after) == 0;
    ::close(now);
    ::unlink(probe.c_str());
    return known ? static_cast<double>(after.st_mtim.tv_sec - before.st_mtim.tv_sec) : 0;
  }
  void mark() const { ::futimens(descriptor_, nullptr); }
  void remove() const { ::unlink(path_.c_str()); }
  int descriptor() const { return descriptor_; }
  const fs::path& path() const { return path_; }

 private:
  void open() {
    refuse_link(path_);
    descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor_ < 0) fail(path_, errno);
  }
  bool is_current() const {
    struct stat mine {
    }, named{};
    return ::fstat(descriptor_, &mine) == 0 && ::lstat(path_.c_str(), &named) == 0 && mine.st_ino == named.st_ino &&
           mine.st_dev == named.st_dev;
  }

  fs::path path_;
  int descriptor_ = -1;
};

[[noreturn]] void in_use(const fs::path& folder, const std::optional<Holder>& holder, const std::string& more) {
  const std::string who =
      holder ? fmt::format("process {} on {} writes to it since {}", holder->pid, holder->host, holder->since)
             : std::string("another process writes to it");
  throw FolderInUse(fmt::format("'{}' is in use: {}{}", folder.string(), who, more));
}

// After the system granted the lock, or without locks: whether the holder in the text still exists.
void expect_gone(const fs::path& folder, const LockFile& file, bool system_gave) {
  const std::optional<Holder> holder = holder_from(file.text());
  if (!holder) return;
  const Fate fate = fate_of(*holder);
  if (fate == Fate::gone) return;
  // The same kernel manages all its locks.
  if (system_gave && holder->boot == myself().boot) return;
  if (fate == Fate::there) in_use(folder, holder, "");
  const double age = file.age(), gone = static_cast<double>(CampaignLock::kGone.count());
  if (age >= gone) return;
  in_use(folder, holder,
         fmt::format(" (its last heartbeat is {:.0f} s old; if it has ended, retry in {:.0f} s, or after removing {})",
                     age, gone - age, file.path().string()));
}

// "lock.task-3-of-8", "lock.rank-2": not a user's lock.yaml.
bool is_writers(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.starts_with("lock.task-") || name.starts_with("lock.rank-");
}

// Another live named writer, for a message.
std::optional<Holder> some_writer(const fs::path& folder) {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    if (!is_writers(entry.path())) continue;
    std::ifstream file(entry.path());
    std::ostringstream text;
    text << file.rdbuf();
    const std::optional<Holder> holder = holder_from(text.str());
    if (holder && fate_of(*holder) != Fate::gone) return holder;
  }
  return std::nullopt;
}

// Files of named writers that have ended.
void remove_writers(const fs::path& folder) {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
    if (is_writers(entry.path())) fs::remove(entry.path(), none);
}

// Whether no living process is named as the holder of a lock that the system does not give.
constexpr int kOrphanTries = 100;
constexpr std::chrono::milliseconds kOrphanWait{20};
bool is_orphaned(const fs::path& folder, const LockFile& file) {
  const std::optional<Holder> alone = holder_from(file.text());
  return !(alone && fate_of(*alone) != Fate::gone) && !some_writer(folder);
}

}  // namespace

struct CampaignLock::Held {
  LockFile folder;
  std::unique_ptr<LockFile> writer;  // null: alone
  std::mutex mutex;
  std::condition_variable_any wake;
  std::jthread beat;  // last: it uses the others

  explicit Held(const fs::path& path) : folder(path) {}
  LockFile& mine() { return writer ? *writer : folder; }
};

CampaignLock::CampaignLock(const fs::path& folder, const std::string& writer)
    : held_(std::make_unique<Held>(folder / "lock")) {
  const short type = writer.empty() ? F_WRLCK : F_RDLCK;
  Taken whole = held_->folder.take(type, kFolderByte);
  // A child process in which a killed holder read a table shares its lock, and ends soon after it.
  for (int tries = 0; whole == Taken::no && tries < kOrphanTries && is_orphaned(folder, held_->folder); ++tries) {
    std::this_thread::sleep_for(kOrphanWait);
    whole = held_->folder.take(type, kFolderByte);
  }
  if (whole == Taken::no) {
    const std::optional<Holder> alone = holder_from(held_->folder.text());
    in_use(folder, alone && fate_of(*alone) != Fate::gone ? alone : some_writer(folder), "");
  }
  expect_gone(folder, held_->folder, whole == Taken::yes);
  if (!writer.empty()) {
    held_->writer = std::make_unique<LockFile>(folder / ("lock." + writer));
    const Taken own = held_->writer->take(F_WRLCK, kFolderByte);
    if (own == Taken::no) in_use(folder, holder_from(held_->writer->text()), fmt::format(" as {}", writer));
    expect_gone(folder, *held_->writer, own == Taken::yes);
    held_->folder.write("");  // of a holder that has ended
  } else if (whole == Taken::cannot) {
    if (const auto other = some_writer(folder)) in_use(folder, other, "");
  }
  if (writer.empty()) remove_writers(folder);
  held_->mine().write(text_of(myself()));
  held_->beat = std::jthread([held = held_.get()](const std::stop_token& stop) {
    std::unique_lock guard(held->mutex);
    while (!held->wake.wait_for(guard, stop, kBeat, [&] { return stop.stop_requested(); })) held->mine().mark();
  });
}

CampaignLock::~CampaignLock() {
  held_->beat.request_stop();
  held_->beat.join();
  if (held_->writer) held_->writer->remove();
  // The last holder removes the folder's file.
  if (!held_->writer || take(held_->folder.descriptor(), F_WRLCK, kFolderByte, false) == Taken::yes)
    held_->folder.remove();
}

CampaignLock::Turn::Turn(const CampaignLock& lock) : lock_(lock) {
  take(lock_.held_->folder.descriptor(), F_WRLCK, kTurnByte, true);
}
CampaignLock::Turn::~Turn() { take(lock_.held_->folder.descriptor(), F_UNLCK, kTurnByte, false); }

}  // namespace grapnel
