#pragma once

/// @file
/// A scenario that a study or an optimization changed, as a complete scenario file again.

#include <filesystem>
#include <span>
#include <string>

#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/study/column.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// The scenario file's tree with changes; the robot's in place of its path where one reaches into it. The file has been
/// read, and the changes have been applied to it before.
Node changed_tree(const std::filesystem::path& scenario, std::span<const Change> changes, const ScenarioFiles& files);

/// Puts the tree of the robot's file in place of its path, where the scenario names one; meshes are then named as seen
/// from the scenario. The scenario has been read with these files before.
void include_robot(Node& root, const std::filesystem::path& scenario, const ScenarioFiles& files);

/// A grasp point that quantities turned away from the surface's normal says where that is: `point` is `before` with
/// quantities applied, and its inward normals are those of before.
void keep_normals(const CaptureProblem& before, StudyCase& point);

/// Text of the scenario file `scenario` for `place`: `tree`, from which `before` was read, so that `after` is read from
/// it. Robot and trajectory are named as seen from there. `suffix` is added to the scenario's name, `comment` comes
/// first.
std::string changed_scenario_text(const std::filesystem::path& scenario, Node tree, const CaptureProblem& before,
                                  const CaptureProblem& after, const std::filesystem::path& place,
                                  const std::string& suffix, const std::string& comment);

}  // namespace grapnel
