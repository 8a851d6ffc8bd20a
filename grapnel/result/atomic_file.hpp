#pragma once

/// @file
/// Atomic replacement of files: bytes go to a temporary in the same folder, are flushed to disk, and take the final
/// name by one rename. A program that is killed before the rename leaves the previous file unchanged, and possibly a
/// `.NAME.tmp-PID-N`, which may be deleted.

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace grapnel {

/// A file could not be written: path and the system's reason. Callers that read and write files distinguish the two
/// failures by this type.
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

/// Removes temporaries that killed processes left in a folder: regular files with names of AtomicFile. Age 0, for
/// folders without another writer, removes all of them. Otherwise temporaries of running processes on this machine, and
/// temporaries modified within the last `age` seconds (possibly by another machine), remain.
void remove_leftovers(const std::filesystem::path& folder, double age);

/// Throws CannotWrite if the path is a symbolic link, which could redirect the output to another file.
void refuse_link(const std::filesystem::path& path);

void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// A unique temporary folder, removed with all its contents by the destructor.
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
