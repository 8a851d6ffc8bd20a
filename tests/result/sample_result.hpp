#pragma once

/// @file
/// Results made up for the writers' tests: every field has its own value, so that a mix-up shows.

#include <filesystem>
#include <string>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::test {

/// A capture with all phases, two grasps that close a loop, a brake, `as_published`, a later impact and a release.
CaptureResult sample_result();

/// The same with all parts that laws, measures and ratings can add to an impact.
CaptureResult sample_result_with_laws();

/// Two phases; vectors, scalars, nested groups, names that MATLAB refuses, NaN and infinity, a description that is not
/// ASCII.
TimeSeries sample_series(int samples);

TimeSeriesMetadata sample_metadata();

/// Exactly equal; NaN equals NaN.
bool same_numbers(const std::vector<double>& a, const std::vector<double>& b);

/// A folder that disappears with the object.
class TemporaryFolder : public ScratchFolder {
 public:
  std::filesystem::path operator/(const std::string& name) const { return path() / name; }
  /// How many files it holds, hidden ones too.
  int files() const;
};

std::string bytes_of(const std::filesystem::path& path);
void put_bytes(const std::filesystem::path& path, const std::string& bytes);

/// Runs /usr/bin/python3 on a script of this folder; its standard output and errors go to `output`. Returns its exit
/// status.
int run_python(const std::string& script, const std::string& arguments, std::string& output);

/// What an action threw, or "" if it did not.
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
