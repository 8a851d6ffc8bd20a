#pragma once

/// @file
/// Scenario and robot files: YAML text to plain data that simulate_capture() takes. The formats are described in
/// docs/formats/scenario.md and docs/formats/robot.md. Public, kept stable.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/faults.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Reads a scenario and the robot and trajectory files it names, applies the overrides in order, and checks everything.
/// CaptureProblem::sha256 is that of the scenario file's bytes, then the robot file's, those of ready-made targets in
/// the order of their names, then the trajectory file's, then
/// "--set path=value\n" of every override. `warnings`, unless null, receives warnings about valid but implausible
/// input, such as an angle in degrees, in the order of their places. @throws InputError with all errors.
CaptureProblem load_scenario(const std::filesystem::path& path, std::span<const Override> overrides = {},
                             std::vector<Fault>* warnings = nullptr);

/// Reads a robot file, or a ready-made robot by its name if there is no such file; `warnings` as for load_scenario().
/// @throws InputError with all errors.
RobotSetup load_robot(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// A ready-made target, at rest at the origin; `warnings` as above. @throws InputError if no target has this name.
TargetSetup load_ready_made_target(std::string_view name, std::vector<Fault>* warnings = nullptr);

/// The published JSON Schemas (draft 7).
std::string scenario_schema();
std::string robot_schema();
std::string target_schema();

}  // namespace grapnel
