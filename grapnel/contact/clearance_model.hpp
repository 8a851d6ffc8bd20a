#pragma once

/// @file
/// Clearance of the bodies of a model: the pairs to check, and their distances.

#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/model/geometry.hpp"

namespace grapnel {

// Signed distance of two shapes.

/// Signed distance of two shapes. Points and the normal are in W.
struct ShapeDistance {
  double distance;   // [m]; negative: penetration depth
  Vector3d point_a;  // on the surface of the first shape, nearest to the second one
  Vector3d point_b;  // point_b - point_a = distance * normal
  Vector3d normal;   // unit, from the first shape to the second
};

/// Signed distance of two shapes whose bodies are at X_WA and X_WB (Geometry::X_BG places the shape on its body).
///
/// Separated shapes: the distance and a pair of nearest points (one of many if faces are parallel), exact to rounding
/// error, a few 1e-15 of the scene's size; for a cylinder with a box or a cylinder to about 1e-10 of it.
///
/// Overlapping shapes: minus the penetration depth, the minimum translation that separates the shapes, along the
/// normal. It is exact for spheres, capsules and boxes with each other and for cylinders with spheres. For cylinders
/// with other shapes it is found by searches: the result always separates the shapes and is minimal in all tests, but
/// not provably minimal.
///
/// The sign is correct unless the shapes are within 1e-8 of their size of touching. Ambiguous cases, such as coincident
/// centres, give one of the equivalent normals. A mesh is replaced by its convex hull, whose distance is at most that
/// of the mesh. Its depth is exact as for a box while the hull's faces and edges have few directions (4000 and 64),
/// otherwise an upper bound as for a cylinder. A shape `none` is infinitely far. Poses that are not finite give a
/// distance that is not finite. Does not throw. Allocates only for meshes that overlap another shape.
ShapeDistance shape_distance(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB);

/// A shape on a body; a body may have several. Meshes are replaced by their convex hulls.
struct BodyShape {
  int body;
  Geometry geometry;
};

/// Two shapes to check, by index into ClearanceModel::shapes(), and their bodies.
struct ClearancePair {
  int shape_a;
  int shape_b;
  int body_a;
  int body_b;
};

/// The minimum distance of all pairs, as ShapeDistance; infinite, with no pair, if there are no pairs.
struct Clearance {
  double distance = std::numeric_limits<double>::infinity();  // [m]
  int pair = -1;                                              // index into ClearanceModel::pairs()
  int body_a = -1;
  int body_b = -1;
  Vector3d point_a = Vector3d::zero();  // in W
  Vector3d point_b = Vector3d::zero();
  Vector3d normal{1, 0, 0};
};

/// The shapes of one model's bodies and the pairs to check. All pairs are checked except those
/// - of one body, or of bodies that fixed joints connect (also through the world);
/// - of adjacent bodies along the tree, whose shapes overlap at their common joint: parent and child. Bodies without a
/// shape (and without one on fixed joints) are skipped, so that a grandparent counts as the parent. Siblings are
/// checked, also if their common parent has no shape;
/// - of ignored pairs of bodies.
///
/// Held bodies are named as `held`, for any joint that represents the grasp. They are adjacent to no body; a body that
/// may touch them must be in an ignored pair.
///
/// Distances are computed only if lower bounds (bounding spheres, then bounding capsules) do not exclude the pair; this
/// does not change the result.
class ClearanceModel {
 public:
  ClearanceModel() = default;
  /// Shapes `none` are dropped. @throws std::invalid_argument that names the body if a size is not positive and finite
  /// (the length of a capsule may be zero), if a mesh has no hull (make_triangle_mesh), or if a body index is invalid.
  ClearanceModel(const Model& model, std::vector<BodyShape> shapes,
                 std::span<const std::pair<int, int>> ignored_pairs = {}, std::span<const int> held = {});

  const std::vector<BodyShape>& shapes() const { return shapes_; }
  const std::vector<ClearancePair>& pairs() const { return pairs_; }

  /// The minimum distance of all pairs. Reads X_WB of `kinematics`, which must belong to the model of the constructor.
  /// Allocates a few numbers per shape. `left_out`: per pair, whether it is ignored; empty: none is.
  Clearance minimum(const Kinematics& kinematics, const std::vector<bool>& left_out = {}) const;
  /// Upper bound of the distance between a point of a body, in the body's frame, and the farthest point of a shape [m].
  double farthest(int shape, const Vector3d& p_B) const {
    return norm(bounds_[static_cast<std::size_t>(shape)].center - p_B) + bounds_[static_cast<std::size_t>(shape)].reach;
  }
  /// Distance of one pair.
  ShapeDistance distance(int pair, const Kinematics& kinematics) const;
  /// Lower bounds of a pair's distance at a fraction of its cost: by spheres, and by spheres and capsules.
  double coarse_bound(int pair, const Kinematics& kinematics) const;
  double lower_bound(int pair, const Kinematics& kinematics) const;
  /// Upper bound of the rate of a pair's distance [m/s]. Reads X_WB and V_WB.
  double speed_bound(int pair, const Kinematics& kinematics) const;

 private:
  // Bounding volumes of a shape, in its body's frame.
  struct Bounds {
    Vector3d center;
    double reach;        // radius of the bounding sphere [m]
    Vector3d half_axis;  // of the bounding capsule, from the centre to the centre of an end cap [m]
    double slenderness;  // radius of the bounding capsule [m]
  };
  // The same placed in W.
  struct PlacedBounds {
    Vector3d center;
    Vector3d half_axis;
  };

  static Bounds bounds_of(const Geometry& geometry);
  PlacedBounds placed(int shape, const Kinematics& kinematics) const;
  double sphere_bound(const ClearancePair& pair, const Vector3d& center_a, const Vector3d& center_b) const;
  double capsule_bound(const ClearancePair& pair, const PlacedBounds& a, const PlacedBounds& b) const;

  std::vector<BodyShape> shapes_;
  std::vector<Bounds> bounds_;
  std::vector<ClearancePair> pairs_;
};

}  // namespace grapnel
