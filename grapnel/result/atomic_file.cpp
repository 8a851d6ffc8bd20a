#include "grapnel/result/atomic_file.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "grapnel/text/input_files.hpp"

namespace grapnel {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw CannotWrite("cannot write " + path.string() + ": " + std::generic_category().message(error));
}

/// A name that no other writer of this or another process uses at the same time.
std::filesystem::path temporary_for(const std::filesystem::path& path) {
  static std::atomic<unsigned> count{0};
  return path.parent_path() / ("." + path.filename().string() + ".tmp-" + std::to_string(::getpid()) + "-" +
                               std::to_string(count.fetch_add(1)));
}

/// The process id in the name of a temporary made by temporary_for(); 0: not such a name.
long process_in(const std::string& name) {
  const std::size_t mark = name.rfind(".tmp-");
  if (!name.starts_with('.') || mark == std::string::npos || mark < 2) return 0;
  long process = 0, number = 0;
  const char* const end = name.data() + name.size();
  const auto first = std::from_chars(name.data() + mark + 5, end, process);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '-') return 0;
  const auto second = std::from_chars(first.ptr + 1, end, number);
  return second.ec == std::errc() && second.ptr == end && process > 0 ? process : 0;
}

}  // namespace

void remove_leftovers(const std::filesystem::path& folder, double age) {
  std::error_code none;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder, none)) {
    const long process = process_in(entry.path().filename().string());
    struct stat status;
    if (process == 0 || ::lstat(entry.path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    const bool runs = process == ::getpid() || ::kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH;
    if (age > 0 && runs) continue;
    if (std::difftime(std::time(nullptr), status.st_mtime) < age) continue;
    ::unlink(entry.path().c_str());
  }
}

void refuse_link(const std::filesystem::path& path) {
  std::error_code none;
  if (std::filesystem::is_symlink(std::filesystem::symlink_status(path, none)))
    throw CannotWrite("cannot write " + path.string() + ": it is a symbolic link, which is not followed; remove it");
}

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
  if (!path_.has_filename()) throw CannotWrite("cannot write '" + path_.string() + "': not the name of a file");
  if (const std::string why = why_not_replace(path_); !why.empty())
    throw CannotWrite("cannot write " + path_.string() + ": " + why);
  // O_EXCL: never open an existing file. A name in use was left by a killed process with the same id; take the next.
  do {
    temporary_ = temporary_for(path_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && (errno == EEXIST || errno == EINTR));
  if (descriptor_ < 0) fail(path_, errno);
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::discard() noexcept {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  descriptor_ = -1;
  ::unlink(temporary_.c_str());
}

void AtomicFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path_, errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void AtomicFile::commit() {
  if (::fsync(descriptor_) != 0) fail(path_, errno);
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail(path_, errno);
  const int descriptor = std::exchange(descriptor_, -1);
  if (::close(descriptor) != 0) fail(path_, errno);
}

void write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

ScratchFolder::ScratchFolder() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  if (error) {
    const char* const named = std::getenv("TMPDIR");
    throw CannotWrite(std::string("cannot create a temporary folder: TMPDIR is '") + (named ? named : "") +
                      "', which is not a folder");
  }
  std::string name = (parent / "grapnel-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) fail(parent, errno);
  path_ = name;
}
ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  // A caller may have removed the write permission.
  std::filesystem::permissions(path_, std::filesystem::perms::owner_all, ignored);
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace grapnel
