#pragma once

/// @file
/// Scenarios that a study, an optimization or a campaign changed as plain data, as complete scenario files again; and
/// planned approaches as scenarios that say the joint values themselves.

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

/// Changes `scenario`, from which `before` was read, so that `after` is read from it: masses, inertias and twists of
/// targets, their grasp points (also further ones), which point a grasp takes, its orientation and relative velocity,
/// approach.plan's guess and measure. Numbers read back to the same double; orientations of grasp points to rounding.
/// Other differences are not looked for.
void write_back(const CaptureProblem& before, const CaptureProblem& after, Node& scenario);

/// Whether the program has to find something before the approach can be flown.
bool has_something_to_plan(const ApproachSetup& approach);

/// Plans the approach of `problem`, if there is anything to plan, and makes its scenario's tree say what was found:
/// approach.final_joints and final_rates in place of approach.plan and of rates to be matched, joint values and rates
/// for waypoints given by places; of an approach that goes straight in, or
/// whose rates are beyond a joint's limit (of which planning only warns), approach.pieces in place of all these.
/// Relative velocities at grasps have then done their work and are dropped. The tree's approach is the same motion as
/// before, up to rounding, and stays it whatever else in the scenario changes.
/// @throws std::runtime_error, a line without its end, if there is no plan.
void freeze_plan(const CaptureProblem& problem, Node& scenario);

}  // namespace grapnel
