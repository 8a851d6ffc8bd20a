#pragma once

/// @file
/// Synthetic results for the writers' tests: every field has a distinct value, so that interchanged fields are
/// detected.

#include <filesystem>
#include <string>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::test {

/// A capture with all phases, two grasps that close a loop, a brake, `as_published`, a later impact and a release.
CaptureResult sample_result();

/// The same with all optional parts of an impact: control, measures and ratings.
CaptureResult sample_result_with_laws();

/// Two phases; vectors, scalars, nested groups, names that are invalid in MATLAB, NaN and infinity, a description with
/// non-ASCII characters.
TimeSeries sample_series(int samples);

TimeSeriesMetadata sample_metadata();

/// Exactly equal; NaN equals NaN.
bool same_numbers(const std::vector<double>& a, const std::vector<double>& b);

/// A folder that is removed by the destructor.
class TemporaryFolder : public ScratchFolder {
 public:
  std::filesystem::path operator/(const std::string& name) const { return path() / name; }
  /// The number of its files, including hidden ones.
  int files() const;
};

std::string bytes_of(const std::filesystem::path& path);
void put_bytes(const std::filesystem::path& path, const std::string& bytes);

/// Runs /usr/bin/python3 on a script of this folder; `output` receives its standard output and errors. Returns its exit
/// status.
int run_python(const std::string& script, const std::string& arguments, std::string& output);

/// The message of the exception thrown by an action, or "" if there was none.
template <class Action>
std::string message_of(Action action) {
  try {
    action();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

}  // namespace grapnel::test
