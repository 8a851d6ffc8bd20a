#pragma once

/// @file
/// Files that are either the old one or the new one, complete: bytes go to a temporary in the same folder, are flushed
/// to disk, and take the final name by one rename. A program killed in between leaves the previous file as it was (and
/// perhaps a `.NAME.tmp-PID-N`, which may be deleted).

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace grapnel {

/// A file could not be written: with its path and the system's reason. Where files are read and written, it tells the
/// one failure from the other.
struct CannotWrite : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One file being written. Failures throw CannotWrite; without a commit() the destructor removes the temporary.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::string_view bytes);
  /// Flushes to disk and renames. Nothing may be written afterwards.
  void commit();
  /// For libraries that write by name: they may truncate and fill this file before commit().
  const std::filesystem::path& temporary() const { return temporary_; }

 private:
  void discard() noexcept;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
};

/// Removes temporaries that killed processes left in a folder: plain files with the names that AtomicFile gives, of
/// whatever file. With age 0, where nobody else writes, all of them; else none of a process that runs on this machine,
/// and none that was written to later than `age` seconds ago, maybe by another machine.
void remove_leftovers(const std::filesystem::path& folder, double age);

/// Throws CannotWrite if the path is a symbolic link: somebody may have put it where we write, to have something else
/// written.
void refuse_link(const std::filesystem::path& path);

void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// A folder of its own among the system's temporary ones, which is gone with the object and with all that is in it.
class ScratchFolder {
 public:
  /// @throws CannotWrite
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace grapnel
