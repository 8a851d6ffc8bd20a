#pragma once

/// @file
/// Runs gnuplot, without a shell.

#include <filesystem>
#include <string>

namespace grapnel {

struct GnuplotOutcome {
  bool found = true;    // whether there is a gnuplot in PATH
  int status = 0;       // 0: it drew the figure
  std::string message;  // what it said
};

/// Runs gnuplot on `script`, a file of `folder`, in that folder and without the user's start-up files. @throws
/// std::runtime_error if the process cannot be started for another reason than that there is none.
GnuplotOutcome run_gnuplot(const std::filesystem::path& folder, const std::string& script);

}  // namespace grapnel
