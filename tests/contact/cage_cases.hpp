#pragma once

/// @file
/// Cages with known answers, for tests and the survey of bench/.

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/contact/caging.hpp"

namespace grapnel::testing {

/// A cage, its answer, and the reason.
struct CageCase {
  std::string name;
  Cage cage;
  CageAnswer::Verdict verdict;
  double resolution = 0;  // [m]; 0: the default
};

namespace cage_cases {

using Shape = Geometry::Shape;

inline Geometry shape_in(Shape shape, Vector3d size, Posed X_BG) { return {shape, size, X_BG, nullptr}; }
inline Geometry shape_at(Shape shape, Vector3d size, Vector3d p = Vector3d::zero()) {
  return shape_in(shape, size, {Rotationd::identity(), p});
}
inline Geometry box(Vector3d size, Vector3d p = Vector3d::zero()) { return shape_at(Shape::box, size, p); }

inline Rotationd about_x(double angle) { return rotation_about({1, 0, 0}, angle); }
inline Rotationd about_y(double angle) { return rotation_about({0, 1, 0}, angle); }
inline Rotationd about_z(double angle) { return rotation_about({0, 0, 1}, angle); }

inline PlacedContactShape fixed(const Geometry& geometry) { return {Posed::identity(), ContactShape(geometry)}; }

// A capsule or cylinder from one point to another; its length is that of the axis.
inline Geometry between(Shape shape, double radius, const Vector3d& from, const Vector3d& to) {
  const Vector3d d = to - from;
  const double length = norm(d), flat = std::hypot(d[0], d[1]);
  const Vector3d axis = flat > 0 ? (1 / flat) * Vector3d{-d[1], d[0], 0} : Vector3d{1, 0, 0};
  return shape_in(shape, {radius, length, 0}, {rotation_about(axis, std::atan2(flat, d[2])), 0.5 * (from + to)});
}

/// A room with these inner edges [m] and walls of 0.1 m; the lid (z > 0) has a rectangular window.
inline std::vector<PlacedContactShape> room(const Vector3d& inner, double window_x, double window_y) {
  constexpr double kWall = 0.1;
  const double x = 0.5 * (inner[0] + kWall), y = 0.5 * (inner[1] + kWall), z = 0.5 * (inner[2] + kWall);
  const Vector3d outer = inner + Vector3d{2 * kWall, 2 * kWall, 2 * kWall};
  std::vector<PlacedContactShape> walls{fixed(box({outer[0], outer[1], kWall}, {0, 0, -z}))};
  for (const double side : {-1.0, 1.0}) {
    walls.push_back(fixed(box({kWall, outer[1], outer[2]}, {side * x, 0, 0})));
    walls.push_back(fixed(box({outer[0], kWall, outer[2]}, {0, side * y, 0})));
    const double width = 0.5 * (outer[0] - window_x), depth = 0.5 * (outer[1] - window_y);
    walls.push_back(fixed(box({width, outer[1], kWall}, {side * 0.5 * (window_x + width), 0, z})));
    walls.push_back(fixed(box({outer[0], depth, kWall}, {0, side * 0.5 * (window_y + depth), z})));
  }
  return walls;
}

/// Bars along the edges of a cube, and `extra` more across each side in both directions [m].
inline std::vector<PlacedContactShape> wire_cage(double edge, double radius, int extra) {
  std::vector<PlacedContactShape> bars;
  const double h = 0.5 * edge;
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = Vector3d::unit(k), u = Vector3d::unit((k + 1) % 3), v = Vector3d::unit((k + 2) % 3);
    for (int i = 0; i <= extra + 1; ++i) {
      for (int j = 0; j <= extra + 1; ++j) {
        if (i % (extra + 1) != 0 && j % (extra + 1) != 0) continue;  // inside
        const Vector3d p = (2.0 * i / (extra + 1) - 1) * h * u + (2.0 * j / (extra + 1) - 1) * h * v;
        bars.push_back(fixed(between(Shape::capsule, radius, p - h * axis, p + h * axis)));
      }
    }
  }
  return bars;
}

/// A square hole with this edge in a plate of 0.8 m and 0.06 m thickness, normal to z.
inline std::vector<PlacedContactShape> plate_with_hole(double hole) {
  std::vector<PlacedContactShape> plates;
  const double width = 0.5 * (0.8 - hole), at = 0.5 * (hole + width);
  for (const double side : {-1.0, 1.0}) {
    plates.push_back(fixed(box({width, 0.8, 0.06}, {side * at, 0, 0})));
    plates.push_back(fixed(box({0.8, width, 0.06}, {0, side * at, 0})));
  }
  return plates;
}

/// Fingers from a palm at z = 0, spread around the z axis; their tips point inward over the body [m].
inline std::vector<PlacedContactShape> fingers(int count, double distance, double height, double tip) {
  std::vector<PlacedContactShape> all{fixed(box({0.5, 0.5, 0.05}, {0, 0, -0.025}))};
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const Vector3d out{std::cos(angle), std::sin(angle), 0}, top{0, 0, height};
    all.push_back(fixed(between(Shape::capsule, 0.012, distance * out, distance * out + top)));
    all.push_back(fixed(between(Shape::capsule, 0.012, distance * out + top, (distance - tip) * out + top)));
  }
  return all;
}

/// The jaws and the stage of scenarios/ring-clamp.yaml, closed by this much; `gap` between ring and centre plane [m].
inline Cage ring_clamp(double closed, bool with_tank) {
  Cage cage{{}, {}, Posed{about_x(std::numbers::pi), {0, 0, 4.15}}};
  for (int i = 0; i < 3; ++i) {
    const Posed X_FB =
        Posed{about_z(2 * std::numbers::pi * i / 3), {0, 0, 0.45}} * Posed{Rotationd::identity(), {0.4 - closed, 0, 0}};
    const double tilt = std::numbers::pi / 6;
    cage.fixed.push_back({X_FB, ContactShape(box({0.02, 0.06, 0.36}, {0.02, 0, 0.18}))});
    for (const double side : {1.0, -1.0}) {
      const Posed X_BG{about_y(side * tilt), {-0.026, 0, 0.35 + 0.015 * side}};
      cage.fixed.push_back({X_FB, ContactShape(shape_in(Shape::box, {0.06, 0.06, 0.01}, X_BG))});
    }
  }
  if (with_tank) {
    cage.moving.push_back(ContactShape(shape_at(Shape::cylinder, {1.2, 6.5, 0})));
    cage.moving.push_back(ContactShape(shape_at(Shape::cylinder, {0.25, 0.1, 0}, {0, 0, 3.3})));
  }
  for (int i = 0; i < 12; ++i) {
    const double angle = (15 + 30 * i) * std::numbers::pi / 180, at = 0.3 * std::cos(std::numbers::pi / 12);
    const Posed X_BG{about_z(angle) * about_x(0.5 * std::numbers::pi),
                     {at * std::cos(angle), at * std::sin(angle), 3.35}};
    cage.moving.push_back(ContactShape(shape_in(Shape::capsule, {0.012, 0.1553, 0}, X_BG)));
  }
  return cage;
}

inline Posed at(double x, double y, double z, const Rotationd& R = Rotationd::identity()) { return {R, {x, y, z}}; }

inline std::vector<ContactShape> shapes(const std::vector<Geometry>& geometries) {
  return {geometries.begin(), geometries.end()};
}

}  // namespace cage_cases

/// The reasons of the answers are beside the cases.
inline std::vector<CageCase> cage_cases_with_answers() {
  using namespace cage_cases;
  using enum CageAnswer::Verdict;
  const double right = 0.5 * std::numbers::pi;
  std::vector<CageCase> all;
  const auto add = [&](const char* name, const Cage& cage, CageAnswer::Verdict verdict, double resolution = 0) {
    all.push_back({name, cage, verdict, resolution});
  };
  // A cube of 0.4 m; openings of 0.3 m.
  const auto cube = shapes({box({0.4, 0.4, 0.4})});
  add("cube in a loose wire cage", {wire_cage(1, 0.02, 2), cube, at(0, 0, 0)}, caged);
  add("cube in a wire cage with wide openings", {wire_cage(1, 0.02, 0), cube, at(0, 0, 0)}, can_leave);
  // The plate is wider (0.5 m) than the diagonal of the window (0.42 m); its inner ball passes it.
  const auto plate = shapes({box({0.5, 0.5, 0.06})});
  add("plate behind a small window", {room({0.7, 0.7, 0.7}, 0.3, 0.3), plate, at(0, 0, 0)}, caged);
  add("plate behind a slit", {room({0.7, 0.7, 0.7}, 0.6, 0.12), plate, at(0, 0, 0)}, can_leave);
  // Openings of 0.3 m, with a diagonal of 0.42 m.
  add("plate in a loose wire cage", {wire_cage(0.9, 0.02, 2), plate, at(0, 0, 0)}, caged);
  // A rod as long as the room is wide cannot rise to the window of a low room, but in a high one.
  const auto rod = shapes({shape_at(Shape::capsule, {0.05, 0.7, 0})});
  add("rod in a low room", {room({1, 1, 0.4}, 0.16, 0.16), rod, at(0, 0, 0, about_y(right))}, caged);
  add("rod in a high room", {room({1, 1, 1}, 0.16, 0.16), rod, at(0, 0, 0, about_y(right))}, can_leave);
  // Two balls of radius 0.1 m, joined by a rod through a hole of 0.15 m: neither ball passes. One ball: the rod does.
  const auto handle = between(Shape::capsule, 0.03, {0, 0, -0.3}, {0, 0, 0.3});
  const auto ball = [](double z) { return shape_at(Shape::sphere, {0.1, 0, 0}, {0, 0, z}); };
  add("dumbbell in a hole", {plate_with_hole(0.15), shapes({handle, ball(-0.3), ball(0.3)}), at(0, 0, 0)}, caged);
  add("ball with a handle in a hole", {plate_with_hole(0.15), shapes({handle, ball(-0.3)}), at(0, 0, 0)}, can_leave);
  // The same with blocks instead of balls: their inner balls do not pass either.
  const auto block = [](double z) { return box({0.2, 0.2, 0.2}, {0, 0, z}); };
  add("blocks on a rod in a hole", {plate_with_hole(0.15), shapes({handle, block(-0.3), block(0.3)}), at(0, 0, 0)},
      caged);
  // A CubeSat of three units under inward fingertips.
  const auto cubesat = shapes({box({0.1, 0.1, 0.34})});
  add("CubeSat between four fingers with tips", {fingers(4, 0.08, 0.4, 0.06), cubesat, at(0, 0, 0.19)}, caged);
  add("CubeSat between four fingers without tips", {fingers(4, 0.08, 0.4, 0.001), cubesat, at(0, 0, 0.19)}, can_leave);
  add("CubeSat between two fingers", {fingers(2, 0.08, 0.4, 0.06), cubesat, at(0, 0, 0.19)}, can_leave);
  const auto sphere = shapes({shape_at(Shape::sphere, {0.1, 0, 0})});
  add("ball in a tripod", {fingers(3, 0.125, 0.25, 0.08), sphere, at(0, 0, 0.12)}, caged);
  const auto can = shapes({shape_at(Shape::cylinder, {0.1, 0.2, 0})});
  add("cylinder in a tripod", {fingers(3, 0.125, 0.25, 0.08), can, at(0, 0, 0.12)}, caged);
  add("cylinder in four loose fingers", {fingers(4, 0.15, 0.3, 0.1), can, at(0, 0, 0.15)}, caged);
  // The jaws reach 20 mm over the ring, from three sides.
  add("ring in a clamp", ring_clamp(0.07, false), caged);
  add("stage in a ring clamp", ring_clamp(0.07, true), caged);
  add("stage in an open ring clamp", ring_clamp(0, true), can_leave);
  return all;
}

}  // namespace grapnel::testing
