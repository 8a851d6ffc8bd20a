#pragma once

/// @file
/// The folder into which an FMU is unpacked. Internal to this module.

#include <sys/types.h>

#include <filesystem>

#include "grapnel/result/atomic_file.hpp"

namespace grapnel::fmi {

/// A folder among the system's temporary ones that is gone with the object, and also when the process ends without
/// destroying it, as in a crash of the FMU: a shell of its own waits for the end of the process and removes it.
class UnpackedFolder {
 public:
  /// @throws CannotWrite
  UnpackedFolder();
  ~UnpackedFolder();
  UnpackedFolder(const UnpackedFolder&) = delete;
  UnpackedFolder& operator=(const UnpackedFolder&) = delete;
  const std::filesystem::path& path() const { return folder_.path(); }

 private:
  ScratchFolder folder_;
  pid_t keeper_ = -1;
  int alive_ = -1;  // the end of a pipe that the system closes with the process
};

}  // namespace grapnel::fmi
