#pragma once

/// @file
/// Contact geometry of two shapes as elements: points with normals, elastic forces and depths, whose sum is the exact
/// gradient of the elastic energy. Private to this module.
///
/// The first shape A is the one whose kind comes first (ContactShape::Kind). All vectors are in A's core frame.

#include <cstdint>
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
  int patch;        // elements of one number form a patch
};

struct ContactElements {
  std::vector<ContactElement> list;
  int patches = 0;
  double energy = 0;          // [J]; not of pressure contacts
  bool beyond_model = false;  // a core reaches beyond the other's surface, where normals may jump

  void clear() { list.clear(), patches = 0, energy = 0, beyond_model = false; }
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

 private:
  /// p(x) = constant - dot(gradient, x), of one face.
  struct Field {
    Vector3d gradient;
    double constant;
    double at(const Vector3d& x) const { return constant - dot(gradient, x); }
  };
  /// Contains the points of the polygons of one field; without a bound if its radius is infinite.
  struct Cell {
    Vector3d center;
    double radius;
  };
  struct Region {
    Vector3d center;
    double radius;
    Vector3d axes[3];  // of the box
    Vector3d half;     // half extents along them
  };
  bool collect(const ContactShapes& shapes, const Posed& X_AB);
  bool find_direction(const ContactShapes& shapes, const Posed& X_AB);
  void offer(const Vector3d& n, double overlap);
  void descend(const ContactShapes& shapes, const Posed& X_AB);
  void narrow(const ContactShapes& shapes, const Posed& X_AB);
  void prune(std::size_t first);
  Cell cell_of_polygon(double margin) const;
  bool begin_polygon(const Vector3d& normal, double offset, double margin);
  double region_reach(const Vector3d& normal, double margin) const;
  bool cut(const Vector3d& normal, double offset, const Field& base, std::size_t i, std::size_t j);
  void reserve_corners(std::size_t corners);
  bool clip(const Field& field);
  double area_and_centroid(const Vector3d& normal, Vector3d& centroid) const;
  void add_polygon(const ContactShapes& shapes, const Field& field, const Vector3d& normal, ContactElements& elements);

  std::vector<Field> fields_;                // of A's faces near the contact, then of B's
  std::size_t count_a_ = 0;                  // of A's
  std::vector<Cell> cells_;                  // of fields_
  std::size_t lowest_a_ = 0, lowest_b_ = 0;  // the least of A's and of B's fields at the region's centre
  std::vector<std::uint8_t> is_least_;       // scratch of prune()
  bool too_many_ = false;                    // faces near the contact; some are left out
  std::size_t corners_ = 0;                  // number of the polygon's corners
  std::vector<Vector3d> polygon_;            // of the last cut(), its first elements
  std::vector<Vector3d> clipped_;            // scratch of clip()
  std::vector<double> inside_;               // scratch of clip()
  Region region_{};                          // contains the overlap
  bool boxed_ = false;                       // polygons are cut to the region's box; otherwise its sphere is used
  Vector3d direction_{};                     // A to B, with a small overlap along it
  double overlap_ = 0;                       // along direction_ [m]: a bound of the depth
  double bound_ = 0;                         // of the pressure [Pa]
};

}  // namespace grapnel
