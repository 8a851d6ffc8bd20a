#pragma once

/// @file
/// Files that are either the old one or the new one, complete: bytes go to a temporary in the same folder, are flushed
/// to disk, and take the final name by one rename. A program killed in between leaves the previous file as it was (and
/// perhaps a `.NAME.tmp-PID-N`, which may be deleted).

#include <filesystem>
#include <string_view>

namespace grapnel {

/// One file being written. Failures throw std::runtime_error with the path and the system's reason; without a commit()
/// the destructor removes the temporary. Thread safety: one thread per object; any number of objects at once.
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

void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace grapnel
