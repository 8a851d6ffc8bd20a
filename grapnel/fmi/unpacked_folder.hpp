#pragma once

/// @file
/// The folder into which an FMU is unpacked. Internal to this module.

#include <sys/types.h>

#include <filesystem>

#include "grapnel/result/atomic_file.hpp"

namespace grapnel::fmi {

/// A temporary folder that is removed with the object, or when the process ends without destroying it, as in a crash of
/// the FMU: a shell process waits for the end of this process and removes the folder.
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
