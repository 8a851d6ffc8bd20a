#pragma once

/// @file
/// Contacts between the shapes of bodies, as plain data: materials of surfaces, obstacles fixed in W, and the pairs of
/// bodies that may touch.
/// Public, kept stable.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/contact/contact_material.hpp"
#include "grapnel/model/geometry.hpp"
#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// A body of a problem: of the robot, by its name, of a target, or an obstacle.
struct BodyName {
  BodyName() = default;
  BodyName(std::string body) : name(std::move(body)) {}
  BodyName(const char* body) : name(body) {}
  static BodyName of_target(std::size_t index, std::string panel = {}) {
    BodyName body(std::move(panel));
    body.target = index;
    return body;
  }
  static BodyName of_obstacle(std::size_t index) {
    BodyName body;
    body.obstacle = index;
    return body;
  }

  std::string name;                          // of a target: its panel's; empty: the target without its panels
  std::optional<std::size_t> target;         // in CaptureProblem::targets
  std::optional<std::size_t> obstacle = {};  // in CaptureProblem::obstacles; only in contacts

  bool operator==(const BodyName&) const = default;
};

/// A named surface material.
struct MaterialSetup {
  std::string name;
  ContactMaterial surface;
  /// Coefficient of restitution of an impact at restitution_speed [m/s], from which surface.dissipation follows (23.6);
  /// absent: surface.dissipation as stated. Of a hard surface on another one: of every impact; surface.restitution is
  /// then not read, and the dissipation follows at surface.rest_speed.
  std::optional<double> restitution = {};
  double restitution_speed = 0.1;
};

/// A body fixed in W that others may touch.
struct ObstacleSetup {
  std::string name;
  Posed X_WO = Posed::identity();
  std::vector<Geometry> geometry;  // empty: the half-space z <= 0 of its frame
};

/// Pairs of bodies that may touch, and the material of both surfaces. Either `pairs`, two groups, or `all`.
struct ContactPairsSetup {
  std::vector<std::pair<BodyName, BodyName>> pairs;
  std::vector<BodyName> first_group, second_group;  // every body of one with every body of the other
  /// Every pair that clearance monitors, and every body with every obstacle.
  bool all = false;
  std::vector<std::pair<BodyName, BodyName>> exclude;  // pairs left out
  /// In CaptureProblem::materials, by name: of both surfaces. With one name, a linear stiffness and damping are those
  /// of the contact; with two, of the first and of the second body of each pair, in series.
  std::vector<std::string> materials;
};

}  // namespace grapnel
