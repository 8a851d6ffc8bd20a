#pragma once

/// @file
/// Writes scenarios changed by a study, an optimization or a campaign as complete scenario files, and planned
/// approaches as scenarios with explicit joint values.

#include <filesystem>
#include <span>
#include <string>

#include "grapnel/campaign/column.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// The scenario file's tree with changes; with the robot's tree in place of its path if a change refers to it. The file
/// has been read, and the changes have been applied to it before.
Node changed_tree(const std::filesystem::path& scenario, std::span<const Change> changes, const ScenarioFiles& files);

/// Replaces the path of the robot file in the scenario by its tree; mesh paths become relative to the scenario. The
/// scenario has been read with these files before.
void include_robot(Node& root, const std::filesystem::path& scenario, const ScenarioFiles& files);

/// States the surface normal of grasp points whose approach direction was changed by quantities: `point` is `before`
/// with quantities applied, and its inward normals are those of `before`.
void preserve_normals(const CaptureProblem& before, StudyCase& point);

/// A scenario file, its tree, possibly with changes, and the problem that was read from this tree.
struct ScenarioOnFile {
  const std::filesystem::path& file;
  Node tree;
  const CaptureProblem& problem;
};

/// Text of a scenario file for `place`: the tree of `scenario`, changed so that reading it gives `after`. Paths of
/// robot and trajectory are relative to `place`. `suffix` is appended to the scenario's name, `comment` comes first.
std::string changed_scenario_text(ScenarioOnFile scenario, const CaptureProblem& after,
                                  const std::filesystem::path& place, const std::string& suffix,
                                  const std::string& comment);

/// Changes `scenario`, from which `before` was read, so that reading it gives `after`: masses, inertias and twists of
/// targets, their grasp points (including new ones), the point of a grasp, its orientation and relative velocity,
/// approach.plan's guess and measure. Numbers read back to the same double; orientations of grasp points to rounding
/// error. Other differences are not written.
void write_back(const CaptureProblem& before, const CaptureProblem& after, Node& scenario);

/// Whether the approach requires planning.
bool has_something_to_plan(const ApproachSetup& approach);

/// Plans the approach of `problem`, if required, and writes the plan to its scenario's tree:
/// approach.final_joints and final_rates in place of approach.plan and of rates to be matched, joint values and rates
/// for waypoints given by places; for an approach with a final straight segment, or with rates beyond a joint's limit
/// (for which planning only warns), approach.pieces in place of all these. Relative velocities at grasps are included
/// in the plan and removed. The approach in the tree is the same motion as before, up to rounding error, independently
/// of other changes of the scenario.
/// @throws std::runtime_error, one line without a line end, if there is no plan.
void freeze_plan(const CaptureProblem& problem, Node& scenario);

}  // namespace grapnel
