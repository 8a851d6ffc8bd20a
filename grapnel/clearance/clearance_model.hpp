#pragma once

/// @file
/// Which bodies of a model are to keep clear of each other, and how near they are.

#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/model/geometry.hpp"

namespace grapnel {

// Signed distance of two shapes.

/// How near two shapes are. Points and the normal are in W.
struct ShapeDistance {
  double distance;   // [m]; negative: they overlap, and this is the depth
  Vector3d point_a;  // on the surface of the first shape, nearest to the second one
  Vector3d point_b;  // point_b - point_a = distance * normal
  Vector3d normal;   // unit, from the first shape to the second
};

/// Signed distance of two shapes whose bodies are at X_WA and X_WB (Geometry::X_BG places the shape on its body).
///
/// Apart: the distance and a pair of nearest points (one of many where faces are parallel), exact to rounding, a few
/// 1e-15 of the scene's size; a cylinder with a box or a cylinder to about 1e-10 of it. Overlapping: minus the depth,
/// the least translation that parts the shapes, along the normal. It is exact for spheres, capsules and boxes with each
/// other and for cylinders with spheres. For cylinders with other shapes it is found by searches: always a translation
/// that parts them, and in all tests the least one, but that it is the least is not proved.
/// The sign is right where the shapes are not within 1e-8 of their size of touching. Centres that coincide and other
/// ambiguous cases give one of the equally good normals.
/// A mesh counts as its convex hull: never farther than the mesh itself. Its depth is exact as a box's while the hull's
/// faces and edges have few directions (4000 and 64), else an upper bound as a cylinder's.
/// A shape `none` is infinitely far. Poses that are not finite give a distance that is not finite. Throws nothing,
/// allocates nothing, but for meshes that overlap something.
ShapeDistance shape_distance(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB);

/// A shape on a body; a body may have several. Meshes count as their convex hulls.
struct BodyShape {
  int body;
  Geometry geometry;
};

/// Two shapes that are checked, by index into ClearanceModel::shapes(), and their bodies.
struct ClearancePair {
  int shape_a;
  int shape_b;
  int body_a;
  int body_b;
};

/// The minimum distance of all pairs, as ShapeDistance; infinite, with no pair, where nothing is checked.
struct Clearance {
  double distance = std::numeric_limits<double>::infinity();  // [m]
  int pair = -1;                                              // index into ClearanceModel::pairs()
  int body_a = -1;
  int body_b = -1;
  Vector3d point_a = Vector3d::zero();  // in W
  Vector3d point_b = Vector3d::zero();
  Vector3d normal{1, 0, 0};
};

/// The shapes of one model's bodies and the pairs of them that are checked: all, except those
/// - of one body, or of bodies that fixed joints connect (also through the world), which cannot move against each
/// other;
/// - of bodies next to each other along the tree, whose shapes overlap at the joint between them: parent and child,
///   where bodies that carry no shape (and have none on fixed joints) are passed over, so that a grandparent counts as
///   the parent. Siblings are checked, also where their common parent has no shape;
/// - of ignored pairs of bodies.
///
/// Bodies that are merely held, whatever joint stands for the grasp, are named as `held`: they are nobody's neighbours,
/// so that what may touch them must be an ignored pair.
///
/// Distances of a pair are computed only where cheap bounds (the distance of bounding spheres, then of bounding
/// capsules) do not exclude it; this does not change the result.
class ClearanceModel {
 public:
  ClearanceModel() = default;
  /// Shapes `none` are dropped. @throws std::invalid_argument naming the body if a size is not positive and finite (the
  /// length of a capsule may be zero), if a mesh has no hull (make_triangle_mesh), or if an index is not a body's.
  ClearanceModel(const Model& model, std::vector<BodyShape> shapes,
                 std::span<const std::pair<int, int>> ignored_pairs = {}, std::span<const int> held = {});

  const std::vector<BodyShape>& shapes() const { return shapes_; }
  const std::vector<ClearancePair>& pairs() const { return pairs_; }

  /// The minimum distance of all pairs. Reads X_WB of `kinematics`, which must be of the model that this was built for.
  /// Allocates a few numbers per shape. `left_out`: per pair, whether it does not count; empty: all count.
  Clearance minimum(const Kinematics& kinematics, const std::vector<bool>& left_out = {}) const;
  /// A number not below the distance of a shape's farthest point from a point of its body, in the body's frame [m].
  double farthest(int shape, const Vector3d& p_B) const {
    return norm(bounds_[static_cast<std::size_t>(shape)].center - p_B) + bounds_[static_cast<std::size_t>(shape)].reach;
  }
  /// Distance of one pair.
  ShapeDistance distance(int pair, const Kinematics& kinematics) const;
  /// Numbers not above the distance of a pair, for a fraction of its cost: by spheres, and by spheres and capsules.
  double coarse_bound(int pair, const Kinematics& kinematics) const;
  double lower_bound(int pair, const Kinematics& kinematics) const;
  /// A number not below the rate at which the distance of a pair changes [m/s]. Reads X_WB and V_WB.
  double speed_bound(int pair, const Kinematics& kinematics) const;

 private:
  // What holds a shape, in its body's frame.
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
