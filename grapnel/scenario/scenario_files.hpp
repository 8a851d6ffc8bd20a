#pragma once

/// @file
/// Scenarios from files that are read once: a study uses the same bytes for all its points, independently of later
/// changes on disk.

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "grapnel/import/source_model.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

struct ImportedFile;  // imported_robot.hpp

/// Files by path, with their trees. Only readable and valid files are stored. Thread safety: any number of threads.
class ScenarioFiles {
 public:
  struct File {
    std::string bytes;
    std::string text;  // checked_text() of a file that is not YAML
    Node tree;
    std::shared_ptr<const TriangleMesh> mesh = {};  // of a mesh file, whose `bytes` are only a digest
    std::shared_ptr<const SourceModel> model = {};  // of a model to be imported
  };
  /// Null if it is not stored.
  std::shared_ptr<const File> find(const std::filesystem::path& path) const;
  void keep(const std::filesystem::path& path, File file);
  /// All stored files, in order.
  std::vector<std::filesystem::path> paths() const;

  /// Robots assembled from files, by their sources (imported_robot.hpp): only the latest ones, because campaigns may
  /// vary the options. Null if it is not stored.
  std::shared_ptr<const ImportedFile> find_imported(const std::string& key) const;
  void keep_imported(const std::string& key, std::shared_ptr<const ImportedFile> imported);

 private:
  static constexpr std::size_t kMostImported = 64;

  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::map<std::string, std::shared_ptr<const File>> files_;
  std::map<std::string, std::shared_ptr<const ImportedFile>> imported_;
  std::deque<std::string> imported_order_;
};

/// load_scenario() with changes as trees. @throws InputError with all faults.
CaptureProblem load_scenario(const std::filesystem::path& path, std::span<const Change> changes, ScenarioFiles& files,
                             std::vector<Fault>* warnings = nullptr);

/// The tree of the robot that a file names, by the path of a robot file or by the name of a ready-made one, which has
/// neither dot nor slash; its bytes are added to `hashed`. ScenarioFiles has it at robot_path(beside, named.text).
/// Empty after faults.
std::optional<Node> read_robot_tree(const std::filesystem::path& beside, const Node& named, std::string& hashed,
                                    ScenarioFiles& files, FaultList& faults);

/// The path of a file named in another file, in readable form: relative to that file's folder, with ".." resolved if
/// the result is the same file (with symbolic links it may not be).
std::filesystem::path path_beside(const std::filesystem::path& file, const std::string& named);

/// The key of a scenario's robot in ScenarioFiles: a path relative to the scenario, or the name in messages for a
/// ready-made robot.
std::filesystem::path robot_path(const std::filesystem::path& scenario, const std::string& named);

/// Adds the absent keys of every `ready_made` target; their names are added to `used`.
void include_targets(Node& scenario, std::set<std::string, std::less<>>& used, FaultList& faults);

/// Applies changes in their order, but first those that select ready-made targets; to ready-made targets
/// after they were included. `before` is called with the tree before each.
template <class Before>
void apply_changes(Node& scenario, std::span<const Change> changes, std::set<std::string, std::less<>>& used,
                   FaultList& faults, Before before) {
  for (const bool which : {true, false}) {
    for (const Change& change : changes) {
      if (change.path.ends_with(".ready_made") != which || !before(change)) continue;
      if (!which && change.path.starts_with("targets")) include_targets(scenario, used, faults);
      apply_change(scenario, change, faults);
    }
  }
}

}  // namespace grapnel
