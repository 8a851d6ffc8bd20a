#pragma once

/// @file
/// A loop closure as the recursive kernels see it: on links, with the ways from both sides to where they meet, or to
/// the roots of two trees. Reads what articulated_body() or `follow` left in the links' scratch. Thread safety:
/// immutable; functions write their outputs only.

#include <vector>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/articulated_body.hpp"

namespace grapnel {

/// See the file comment. Row r of a closure is the direction angular_rows[r] for the first `angular_count` rows and the
/// axis r - angular_count of C for the three linear ones that follow.
struct LoopPath {
  int link_a = 0, link_b = 0;
  Posed X_aC = Posed::identity();   // in link a's frame
  Posed X_bD = Posed::identity();   // in link b's frame
  std::vector<int> from_a, from_b;  // links from a and from b upwards, without the link where they meet or their roots
  std::vector<int> trunk;           // from where they meet to the root; empty between two trees
  int root_a = 0, root_b = 0;       // root links; one and the same in one tree
  int rows = 0, first_row = 0;
  int angular_count = 0;
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_C;
  Vector3d angular_rows[3];  // in C
  /// Rows in units in which the mobility of body b alone and free is 1: roots of mean inverse inertias [rad, m].
  double angular_scale = 1, linear_scale = 1;

  bool one_tree() const { return root_a == root_b; }
  double scale(int row) const { return row < angular_count ? angular_scale : linear_scale; }
};

/// @throws std::invalid_argument if no joint parts the bodies (one link, or two roots fixed to the world), or the
/// frames are no placements.
LoopPath make_loop_path(const Model& model, const LoopClosure& closure);

/// How a body alone and free would give way, for the rows' units; in its link's frame.
struct LoneBody {
  Symmetric3d inverse_inertia;  // about its centre of mass
  double inverse_mass;
  Vector3d com;
  explicit LoneBody(const Body& body);
  /// Sets a path's scales for a grasp at point p of the link.
  void scale_rows(const Vector3d& p, LoopPath& path) const;
};

/// Where a closure is now.
struct LoopPlace {
  Posed X_bC;  // of C in link b
};
/// From the links' angles and offsets in `links` (`place` or articulated_body()); between two trees also from the
/// roots' coordinates in q.
LoopPlace locate(const LoopPath& path, const Tree<double>& tree, std::span<const LinkScratch<double>> links,
                 std::span<const double> q);

/// Pose of D in C: the identity where the loop is closed (but for what it leaves free).
Posed pose_CD(const LoopPath& path, const LoopPlace& place);

/// A motion of C minus that of D, both at C in C's axes, for motions of links a and b in their frames.
template <SpatialKind kKind>
SpatialVector<kKind> relative_motion(const LoopPath& path, const LoopPlace& place, const SpatialVector<kKind>& of_a,
                                     const SpatialVector<kKind>& of_b) {
  return transposed_times(path.X_aC.R, shift(of_a, path.X_aC.p)) -
         transposed_times(place.X_bC.R, shift(of_b, place.X_bC.p));
}

/// The closure's rows of a relative motion.
template <SpatialKind kKind>
void take_rows(const LoopPath& path, const SpatialVector<kKind>& relative, std::span<double> rows) {
  for (int r = 0; r < path.angular_count; ++r) rows[r] = dot(path.angular_rows[r], relative.angular);
  for (int r = 0; r < 3; ++r) rows[path.angular_count + r] = relative.linear[r];
}

/// Defect of position as rows of C minus D: their rate is the rows of the relative twist as the defect vanishes.
void position_rows(const LoopPath& path, const LoopPlace& place, std::span<double> rows);

}  // namespace grapnel
