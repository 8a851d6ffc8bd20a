#pragma once

/// @file
/// Contact geometry of two shapes as elements: points with normals, elastic forces and depths, whose sum is the exact
/// gradient of the elastic energy. Private to this module.
///
/// The first shape A is the one whose kind comes first (ContactShape::Kind). All vectors are in A's core frame.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/contact/contact_material.hpp"
#include "grapnel/contact/contact_shape.hpp"

namespace grapnel {

struct ContactElement {
  Vector3d point;
  Vector3d normal;  // unit, from A to B
  double elastic;   // force [N]
  double depth;     // of both surfaces together [m]
  double share;     // of the whole contact's damping
  double area;      // [m^2]; zero for points and lines
};

/// Elements by component in blocks, so that sums over them use SIMD registers: kLanes elements at a time, with one
/// partial sum per lane. Therefore sums have the same bits for any width of registers. Elements behind the last one are
/// zero.
class ContactElements {
 public:
  static constexpr std::size_t kLanes = 8;
  struct Vectors {
    double x[kLanes], y[kLanes], z[kLanes];
    Vector3d operator[](std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
    void set(std::size_t lane, const Vector3d& v) { x[lane] = v[0], y[lane] = v[1], z[lane] = v[2]; }
  };
  struct Block {
    Vectors point, normal;
    double elastic[kLanes], depth[kLanes], share[kLanes], area[kLanes];
  };

  double energy = 0;          // [J]; not of pressure contacts
  bool beyond_model = false;  // a core reaches beyond the other's surface, where normals may jump

  void reserve(std::size_t elements) { blocks_.reserve((elements + kLanes - 1) / kLanes); }
  void clear() { blocks_.clear(), size_ = 0, energy = 0, beyond_model = false; }
  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::span<const Block> blocks() const { return blocks_; }
  std::span<Block> blocks() { return blocks_; }

  void add(const ContactElement& e) {
    const std::size_t lane = size_++ % kLanes;
    if (lane == 0) blocks_.emplace_back();
    Block& to = blocks_.back();
    to.point.set(lane, e.point), to.normal.set(lane, e.normal);
    to.elastic[lane] = e.elastic, to.depth[lane] = e.depth, to.share[lane] = e.share, to.area[lane] = e.area;
  }
  /// Calls change(block, lane) for the elements from number `first` on.
  template <class Change>
  void change_from(std::size_t first, Change&& change) {
    for (std::size_t i = first; i < size_; ++i) change(blocks_[i / kLanes], i % kLanes);
  }
  double largest_depth() const {
    double deepest = 0;
    for (const Block& block : blocks_)
      deepest = std::max(deepest, *std::max_element(block.depth, block.depth + kLanes));
    return deepest;
  }

 private:
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
};

/// Two shapes in contact and the constants of their law.
struct ContactShapes {
  ContactShapes(ContactShape a, ContactShape b, const ContactLaw& law);

  ContactShape a, b;
  ContactLaw law;
  double radius = 0;                      // effective, of Hertz's law [m]
  double pressure_a = 0, pressure_b = 0;  // slopes of the pressure fields [Pa/m]
  double pressure = 0;                    // both in series [Pa/m]
  double reference_area = 0;              // pressure / stiffness: the area whose contact has the law's damping [m^2]
};

// In round_contact.cpp.

/// A sphere and any shape: one element at most.
void add_sphere_contact(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements);
/// A capsule and any shape but a sphere: its two ends, and Gauss points along the part of its axis that is in contact.
void add_capsule_contact(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements);
/// A cylinder and a half-space: Gauss points over the submerged volume.
void add_cylinder_on_plane(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements);

// Polyhedra, prisms and half-spaces.

/// The surface of equal pressure of two polyhedra (23.9), integrated exactly. Owns scratch memory, and does not
/// allocate after construction unless an overlap has more than kMaxElements elements.
class PressureContact {
 public:
  static constexpr std::size_t kMaxElements = 8192;
  explicit PressureContact(const ContactShapes& shapes);
  void add(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements);
  /// The elastic energy [J] (23.12).
  double energy(const ContactShapes& shapes, const Posed& X_AB);
  /// Whether overlap() is exact: boxes, or a polyhedron and a half-space.
  static bool has_overlap(const ContactShapes& shapes);
  /// The smallest distance that separates both shapes along normals of faces and of pairs of edges [m]; otherwise a
  /// negative value, which is continuous at zero. A small part of the time of add().
  double overlap(const ContactShapes& shapes, const Posed& X_AB);

 private:
  /// p(x) = constant - dot(gradient, x), of one face; x relative to origin_.
  struct Field {
    Vector3d gradient;
    double constant;
    double at(const Vector3d& x) const { return constant - dot(gradient, x); }
    friend Field operator-(const Field& f, const Field& g) {
      return {f.gradient - g.gradient, f.constant - g.constant};
    }
  };
  /// Of fields_, by component, which is what cut() reads of many fields at a time.
  struct FieldTable {
    std::vector<double> gradient[3], constant;
    std::size_t size() const { return constant.size(); }
    Field operator[](std::size_t k) const { return {{gradient[0][k], gradient[1][k], gradient[2][k]}, constant[k]}; }
    void set(std::size_t k, const Field& field);
    void push_back(const Field& field);
    void resize(std::size_t size);
    void reserve(std::size_t size);
  };
  /// A point of a plane by two of its coordinates.
  struct Corner {
    double s, t;
  };
  /// A function that is linear on a plane.
  struct Line {
    double constant, along_s, along_t;
    double at(const Corner& x) const { return constant + along_s * x.s + along_t * x.t; }
  };
  /// A plane: the coordinate h, that with the largest component of the normal, is a function of the others s and t.
  struct Plane {
    int s = 0, t = 1, h = 2;
    Vector3d across{};  // the normal, of any length
    Line height{};      // x[h]
    /// Area over its projection along h.
    double stretch() const { return norm(across) / std::abs(across[h]); }
    Vector3d point(const Corner& x) const;
    Line restricted(const Field& field) const;
  };
  /// Contains the points of the polygons of one field; without a bound if its radius is infinite.
  struct Cell {
    Vector3d center;
    double radius;
  };
  /// Relative to origin_, which is its centre: a sphere and a box around the overlap.
  struct Region {
    double radius;
    Vector3d axes[3];  // of the box
    Vector3d half;     // half extents along them
    /// By how much a linear function with the gradient g varies along each axis, from the centre to the box's side.
    Vector3d rises(const Vector3d& g) const {
      return {half[0] * dot(g, axes[0]), half[1] * dot(g, axes[1]), half[2] * dot(g, axes[2])};
    }
  };
  bool collect(const ContactShapes& shapes, const Posed& X_AB);
  bool find_direction(const ContactShapes& shapes, const Posed& X_AB);
  void search_direction(const ContactShapes& shapes, const Posed& X_AB);
  void offer(const Vector3d& n, double overlap);
  void descend(const ContactShapes& shapes, const Posed& X_AB);
  void find_region(const ContactShapes& shapes, const Posed& X_AB);
  void narrow(const ContactShapes& shapes, const Posed& X_AB);
  void find_lowest();
  void keep_lowest(std::size_t first, std::size_t count);
  void prune(std::size_t first);
  Cell cell_of_polygon(double margin) const;
  bool may_meet(std::size_t i, std::size_t j) const;
  bool begin_polygon(const Field& across, double margin);
  double region_reach(const Vector3d& normal, double margin) const;
  bool cut(const Field& across, const Field& base, std::size_t i, std::size_t j);
  bool clip_by_others(const Field& base, std::size_t i, std::size_t j);
  void reserve_corners(std::size_t corners);
  bool clip(const Line& line);
  bool clip_scattered();
  double area_and_centroid(Corner& centroid) const;
  void add_polygon(const ContactShapes& shapes, const Field& field, ContactElements& elements);
  void drop_parallel_fields(double tolerance);
  double cut_faces(Vector3d& inside);
  void cut_walls(double tolerance);

  Vector3d origin_{};                        // in the region's middle, in A
  FieldTable fields_;                        // of A's faces near the contact, then of B's
  std::size_t count_a_ = 0;                  // of A's
  std::vector<Cell> cells_;                  // of fields_
  std::vector<Vector3d> rises_;              // of fields_, in the region's box
  std::size_t lowest_a_ = 0, lowest_b_ = 0;  // the least of A's and of B's fields at the origin
  std::vector<std::uint8_t> is_least_;       // scratch of prune()
  bool too_many_ = false;                    // faces near the contact; some are left out
  Plane plane_;                              // of the polygon
  std::size_t corners_ = 0;                  // number of the polygon's corners
  std::vector<Corner> polygon_;              // of the last cut(), its first elements, anticlockwise in (s, t)
  std::vector<Corner> clipped_;              // scratch of clip()
  std::vector<double> inside_;               // scratch of clip()
  std::vector<double> lines_[3], least_;     // scratch of clip_by_others(): constants and slopes, least values
  std::vector<Vector3d> apex_;               // of energy(): a point of each field's cell, on its face or a wall
  std::vector<std::uint8_t> has_apex_;
  std::vector<double> volume_;  // of energy(): of each field's cell
  Region region_{};             // contains the overlap
  bool boxed_ = false;          // polygons are cut to the region's box
  Vector3d direction_{};        // A to B, with a small overlap along it
  double overlap_ = 0;          // along direction_ [m]: a bound of the depth
  Posed directed_{};            // relative pose of both
  bool has_direction_ = false;
  double bound_ = 0;  // of the pressure [Pa]
};

}  // namespace grapnel
