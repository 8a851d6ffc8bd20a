#pragma once

/// @file
/// The one rule that no output replaces an input: files that a command reads are remembered, and what writes files asks
/// here first. Files are compared by device and inode, through symbolic and hard links.

#include <filesystem>
#include <string>

namespace grapnel {

/// While one lives, the files that this process reads are remembered as inputs; the innermost scope's list counts. A
/// program has one per command, so that a later command may replace what an earlier one read. Any thread may read.
class InputFiles {
 public:
  InputFiles();
  ~InputFiles();
  InputFiles(const InputFiles&) = delete;
  InputFiles& operator=(const InputFiles&) = delete;
};

/// Remembers a file that is read as an input; nothing happens without a scope.
void note_input(const std::filesystem::path& path);

/// Why a file must not be written at `path`: it is an input of this command, or something there is no file (a pipe, a
/// socket, a device), which a rename would replace. Empty: it may be written.
std::string why_not_replace(const std::filesystem::path& path);

/// The input below a folder whose contents are made anew; empty: none.
std::filesystem::path input_below(const std::filesystem::path& folder);

}  // namespace grapnel
