#pragma once

/// @file
/// A scenario of the Python package: the content of its files, the changes since, and the resulting problem.

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

/// Thread safety: several threads may read an object simultaneously; a thread that changes it needs exclusive use.
class Scenario {
 public:
  using Changes = std::vector<std::pair<std::string, py::object>>;

  /// From a file. @throws InputError with all errors.
  Scenario(const std::filesystem::path& file, const Changes& changes);
  /// From a dictionary with the keys of a scenario file; file names are relative to `folder`.
  Scenario(const py::dict& values, const std::filesystem::path& folder, const Changes& changes);

  /// Sets values by their paths, all or none; equivalent to `grapnel run --set` with all settings so far. @throws
  /// InputError
  void set(const Changes& changes);
  /// The value at a path, with all changes, the content of the robot file, and defaults. @throws py::key_error
  py::object get(const std::string& path) const;

  const CaptureProblem& problem() const { return *problem_; }
  std::shared_ptr<const CaptureProblem> shared_problem() const { return problem_; }
  const std::vector<Fault>& warnings() const { return warnings_; }
  const std::filesystem::path& file() const { return file_; }
  /// The text of a scenario file for `place`, with all changes; names of other files are relative to its folder.
  std::string text(const std::filesystem::path& place) const;
  /// Every change, path and value, in their order.
  std::vector<std::pair<std::string, py::object>> changes() const;
  /// The dictionary of the scenario; None for a scenario from a file.
  py::object values() const;
  /// "path=value" of every change, in order, in the form of `--set`.
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
  mutable std::shared_ptr<const Node> tree_;  // computed on first use
};

}  // namespace grapnel::python
