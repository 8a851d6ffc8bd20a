#pragma once

/// @file
/// Robots that a scenario names in another format, or puts together: `robot: arm.urdf` with `import:`, and
/// `robot: {bus: FILE, arms: [...]}`. What is read becomes the tree of a robot file (docs/formats/import.md).

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/import/assemble.hpp"
#include "grapnel/scenario/scenario_files.hpp"

namespace grapnel {

/// A robot put together, and all that it was read from.
struct ImportedFile {
  Node tree;                                               // meshes are named relative to the scenario's folder
  std::string bytes;                                       // of all files, for the hash
  std::vector<std::pair<std::string, std::string>> texts;  // "robot" or "bus", and the text
  std::vector<ImportDecision> decisions;
  std::string comment;  // decisions that concern the whole, a line each
};

/// Whether a path's ending says that it is a model to be imported: .urdf, .xacro (which is refused with advice), .xml.
bool is_model_file(std::string_view path);
/// Whether the value of `robot` requires an import: the path of such a file, or a mapping with a bus or arms.
bool needs_import(const Node& robot);
/// Whether it is such a mapping.
bool is_put_together(const Node& robot);
/// Checks the structure of such a mapping, and makes its numbers with units plain ones.
void check_put_together(Node& robot, FaultList& faults);
/// Makes numbers with units of a scenario, which has been checked, plain ones; a robot that it holds, or what one is
/// put together from, is part of it.
void take_units(Node& scenario);
/// Whether a path leads to something that the import reads: import, or robot.bus and robot.arms of such a mapping.
bool is_import_choice(const Node& scenario, std::string_view path);
/// Changes with those of choices first: others may lead into the robot that the import makes.
std::vector<Change> import_first(const Node& scenario, std::span<const Change> changes);

/// Reads the robot of a scenario that needs_import(). It is kept for a while: asked again with the same files, robot
/// and choices it is the same, for models are read once. Null after faults.
std::shared_ptr<const ImportedFile> import_robot(const Node& scenario, const std::filesystem::path& path,
                                                 ScenarioFiles& files, FaultList& faults);
/// The one that was read before, if it is still kept; else null.
std::shared_ptr<const ImportedFile> imported_robot(const Node& scenario, const std::filesystem::path& path,
                                                   const ScenarioFiles& files);

/// A model by itself, as `grapnel import` asks for it: `settings` are those of `import`, or nothing; their paths are
/// relative to the folder of `beside`. Meshes are named relative to that of `place`.
std::shared_ptr<const ImportedFile> import_model(const std::filesystem::path& model, const Node& settings,
                                                 const std::filesystem::path& beside,
                                                 const std::filesystem::path& place, ScenarioFiles& files,
                                                 FaultList& faults);

/// The robot that an import made, whose meshes are named relative to the folder of `place`; `warnings` as for
/// load_robot(). @throws InputError with all faults, at their places in the files that were imported.
RobotSetup read_imported(const ImportedFile& imported, const std::filesystem::path& place, ScenarioFiles& files,
                         std::vector<Fault>* warnings = nullptr);

}  // namespace grapnel
