#pragma once

/// @file
/// A scenario in Python's hands: its files as they were read once, the changes made since, and the problem that they
/// make.

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "binding.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/scenario_files.hpp"

namespace grapnel::python {

/// Thread safety: an object may be read by several threads at once, and used by one that changes it.
class Scenario {
 public:
  using Changes = std::vector<std::pair<std::string, py::object>>;

  /// Of a file. @throws InputError with all faults.
  Scenario(const std::filesystem::path& file, const Changes& changes);
  /// Of a dictionary with the keys of a scenario file; files that it names are looked for from `folder`.
  Scenario(const py::dict& values, const std::filesystem::path& folder, const Changes& changes);

  /// Sets values by their paths, all or none: what `grapnel run --set` with all settings so far would read. @throws
  /// InputError
  void set(const Changes& changes);
  /// The value at a path as the reader sees it: changes applied, the robot's file included, defaults filled in. @throws
  /// py::key_error
  py::object get(const std::string& path) const;

  const CaptureProblem& problem() const { return *problem_; }
  std::shared_ptr<const CaptureProblem> shared_problem() const { return problem_; }
  const std::vector<Fault>& warnings() const { return warnings_; }
  const std::filesystem::path& file() const { return file_; }
  /// A scenario file for `place` that is this problem: changes are in it, other files are named as seen from there.
  std::string text(const std::filesystem::path& place) const;
  /// Every change, path and value, in their order.
  std::vector<std::pair<std::string, py::object>> changes() const;
  /// The dictionary it was made from; None if that was a file.
  py::object values() const;
  /// "path=value" of every change, in their order, as `--set` takes them.
  std::vector<std::string> settings() const;

 private:
  void load(std::vector<Change> changes);
  const Node& tree() const;

  std::filesystem::path file_;
  bool is_file_ = true;
  std::shared_ptr<ScenarioFiles> files_ = std::make_shared<ScenarioFiles>();
  std::vector<Change> changes_;
  std::shared_ptr<const CaptureProblem> problem_;
  std::vector<Fault> warnings_;
  mutable std::shared_ptr<const Node> tree_;  // made when it is first asked for
};

}  // namespace grapnel::python
