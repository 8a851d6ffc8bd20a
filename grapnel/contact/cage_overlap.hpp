#pragma once

/// @file
/// Bounds of the signed distance of two shapes, as fast as a search of many poses needs them. For search_cage().

#include <array>
#include <limits>
#include <vector>

#include "grapnel/contact/caging.hpp"
#include "grapnel/contact/pair_contact.hpp"

namespace grapnel {

/// Distance of shapes whose overlap was excluded [m].
inline constexpr double kFarApart = std::numeric_limits<double>::infinity();

inline bool is_half_space(const ContactShape& shape) { return shape.kind() == ContactShape::Kind::half_space; }

/// Bounds of a signed distance, which is negative by the depth of penetration [m].
struct DistanceRange {
  double low, high;
};

/// A convex polyhedron inside of a shape's core, symmetric about its origin: a box, segment or point itself, or a prism
/// of 16 faces in a cylinder. In the core's frame.
class InnerPolyhedron {
 public:
  explicit InnerPolyhedron(const ContactShape& shape);

  /// Largest dot product of a point and n.
  double support(const Vector3d& n) const;
  /// Directions of all face normals and edges; opposite ones are listed once.
  const std::vector<Vector3d>& normals() const { return normals_; }
  const std::vector<Vector3d>& edges() const { return edges_; }
  /// No point of the core is farther from the polyhedron [m].
  double lack() const { return lack_; }

 private:
  static constexpr int kRimPairs = 8;  // of opposite corners
  Vector3d half_;
  bool round_;
  double lack_ = 0;
  std::array<std::array<double, 2>, kRimPairs> rim_{};  // corners of the prism
  std::vector<Vector3d> normals_, edges_;
};

class OverlapPair {
 public:
  OverlapPair(const PlacedContactShape& fixed, const ContactShape& moving);

  /// Bounds of the signed distance for the pose of the moving body. They are equal for overlapping boxes and for
  /// spheres and capsules with one another; `high` is infinite where overlap was excluded, and `low` may be any bound
  /// above `enough` where there is one. Depths of cylinders in `high` are those of their inner prism; depths of hulls
  /// are from local searches, see penetration().
  DistanceRange distance(const Posed& X_FM, double enough) const;
  /// The signed distance; of cylinders and hulls a depth may be an upper bound, see penetration().
  double separation(const Posed& X_FM) const { return contact_.separation(X_FFixed_, X_FM).distance; }
  const ContactShape& moving() const { return moving_; }
  const ContactShape& fixed() const { return fixed_; }
  /// Pose of the fixed core.
  const Posed& X_FA() const { return X_FA_; }

 private:
  DistanceRange to_half_space(const Posed& X_FB) const;
  DistanceRange by_normals(const Posed& X_AB, double enough) const;

  Posed X_FA_;  // pose of the fixed core
  ContactShape fixed_, moving_;
  InnerPolyhedron a_, b_;
  bool is_exact_;  // polyhedra represent both shapes
  PairContact contact_;
  Posed X_FFixed_;
};

}  // namespace grapnel
