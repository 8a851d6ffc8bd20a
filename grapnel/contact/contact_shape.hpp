#pragma once

/// @file
/// Shapes for contact: those of bodies (Geometry) and half-spaces, with the faces, support points and distances that
/// contact needs. Thread safety: immutable after construction.

#include <memory>
#include <vector>

#include "grapnel/contact/convex_distance.hpp"

namespace grapnel {

/// A face's plane: the shape lies where dot(normal, x) <= offset.
struct FacePlane {
  Vector3d normal;  // unit, outward
  double offset;    // [m]
};

/// A point's position relative to the surface of a core.
struct CoreDistance {
  double distance;  // [m], negative inside
  Vector3d normal;  // unit, outward at the nearest point of the surface; the gradient of `distance`
};

/// A convex shape: a core C with a rounding radius, placed on its body B.
class ContactShape {
 public:
  /// In the order in which a pair takes its shapes.
  enum class Kind { sphere, capsule, cylinder, polyhedron, half_space };
  /// Faces around the axis of the prism that represents a cylinder against everything except spheres, capsules and
  /// half-spaces. The prism has the cylinder's volume.
  static constexpr int kPrismFaces = 32;

  /// @throws std::invalid_argument if the geometry has no shape or a size is not positive and finite (negative scale
  /// factors of meshes are allowed), or a mesh without volume.
  explicit ContactShape(const Geometry& geometry);
  /// The points with z <= 0 in the frame X_BG of the body.
  static ContactShape half_space(const Posed& X_BG);

  Kind kind() const { return kind_; }
  const ConvexCore& core() const { return core_; }
  /// A core that contains core() and the prism of a cylinder.
  const ConvexCore& bounding_core() const { return bounding_core_; }
  /// Pose of the core's frame on the body. Cylinders and capsules: z along the axis. Half-spaces: z outward.
  const Posed& X_BC() const { return X_BC_; }
  /// Whether the axes of C are those of B.
  bool is_aligned() const { return is_aligned_; }
  /// Of polyhedra, half-spaces and the prisms of cylinders, in C.
  const std::vector<FacePlane>& faces() const { return faces_; }
  /// Half extents of a box around core and prism, along C's axes [m].
  const Vector3d& half_extents() const { return half_extents_; }
  /// Radius of a sphere about C's origin that contains the shape [m]; infinite for half-spaces.
  double reach() const { return reach_; }
  /// H: distance of an interior point from the nearest face, at which the pressure field has the value E [m]. Boxes,
  /// spheres, capsules and cylinders: of the centre. Hulls: of the mean of the vertices. Infinite for half-spaces.
  double thickness() const { return thickness_; }

  /// The farthest point of the polyhedron or prism along a direction, in C; not for half-spaces. Of prisms an upper
  /// bound.
  Vector3d support_point(const Vector3d& direction) const { return support(bounding_core_, direction); }
  /// Of a point p_C.
  CoreDistance distance(const Vector3d& p_C) const;

 private:
  ContactShape() = default;
  void add_box_faces();
  void add_prism_faces();
  void add_hull_faces();
  CoreDistance distance_to_faces(const Vector3d& p) const;

  Kind kind_ = Kind::half_space;
  ConvexCore core_;
  ConvexCore bounding_core_;
  Posed X_BC_ = Posed::identity();
  bool is_aligned_ = true;
  std::vector<FacePlane> faces_;
  Vector3d half_extents_ = Vector3d::zero();
  double reach_ = 0, thickness_ = 0;
  std::shared_ptr<const TriangleMesh> mesh_;
  std::shared_ptr<const SupportMap> map_;
};

}  // namespace grapnel
