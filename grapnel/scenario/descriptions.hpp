#pragma once

/// @file
/// What robot and scenario files hold, described once: every key with its place in RobotSetup and CaptureProblem, its
/// unit, range, default and meaning. The published schemas, the check of a file's structure, its reading and values
/// that campaigns set in place follow from these descriptions; the tables of docs/formats are tested against them.
/// Where a value stands in files in another form than in the structure, the field names the form, which schema_of.cpp
/// lists.

#include "grapnel/describe/type.hpp"
#include "grapnel/spatial/spatial_vector.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

// What stands in files in forms of its own only.

template <>
struct Described<Rotationd> {
  static constexpr Type type = structure<Rotationd>("rotation", "", {});
};

template <>
struct Described<Symmetric3d> {
  static constexpr Type type = structure<Symmetric3d>("inertia", "", {});
};

template <>
struct Described<Wrenchd> {
  static constexpr Type type = structure<Wrenchd>("wrench", "", {});
};

template <>
struct Described<std::pair<std::string, std::string>> {
  static constexpr Type type = structure<std::pair<std::string, std::string>>("names", "", {});
};

/// Of a RobotSetup.
const Type& robot_description();
/// Of a Geometry.
const Type& geometry_description();
/// What stands at a path of a scenario: "impact.contact", "robot.end_effectors.envelope". Of lists and optional values:
/// what they hold. @throws std::logic_error if there is no such place.
const Type& description_at(std::string_view path);
/// Of a CaptureProblem, its robot included.
const Type& scenario_description();

}  // namespace grapnel
