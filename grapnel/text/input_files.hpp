#pragma once

/// @file
/// Enforces the rule that no output replaces an input: input files of a command are registered, and writers check their
/// paths here. Files are compared by device and inode, through symbolic and hard links.

#include <filesystem>
#include <string>

namespace grapnel {

/// During its lifetime the files that this process reads are registered as inputs; the innermost scope applies. A
/// program has one scope per command, so that a later command may replace inputs of an earlier one. Any thread may read
/// files.
class InputFiles {
 public:
  InputFiles();
  ~InputFiles();
  InputFiles(const InputFiles&) = delete;
  InputFiles& operator=(const InputFiles&) = delete;
};

/// Registers a file as an input; no effect without a scope.
void note_input(const std::filesystem::path& path);

/// The reason for which a file must not be written at `path`: it is an input of this command, or a pipe, socket or
/// device, which a rename would replace. Empty: it may be written.
std::string why_not_replace(const std::filesystem::path& path);

/// An input below a folder whose contents are replaced; empty: none.
std::filesystem::path input_below(const std::filesystem::path& folder);

}  // namespace grapnel
