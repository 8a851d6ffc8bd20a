#pragma once

/// @file
/// The poses of a body among others that do not move: which of them overlap, and when it has left. For search_cage().

#include <array>
#include <cstddef>
#include <functional>
#include <random>
#include <vector>

#include "grapnel/contact/cage_overlap.hpp"
#include "grapnel/contact/caging.hpp"

namespace grapnel {

/// A sphere.
struct Ball {
  Vector3d center;
  double radius;
};

/// The rotations that change the moving shapes about a centre: none of concentric spheres (0), those of an axis (2), or
/// all (3).
struct RotationSpace {
  int dims = 3;
  /// Directions of the rotation vector's components, in the body's frame. Of two: perpendicular to the third, the axis
  /// of the body.
  std::array<Vector3d, 3> axes{Vector3d{1, 0, 0}, Vector3d{0, 1, 0}, Vector3d{0, 0, 1}};

  Quaterniond rotation(const std::array<double, 3>& vector) const;
};

/// Bounds of motions of the body: of the translation of its centre [m] and of the rotation [rad].
struct CageMotion {
  double translation, angle;
};

/// What all motions from a pose have in common.
struct CageOverlap {
  enum class Kind { blocked, free, mixed };  // all overlap by more than the allowance; none does; neither was shown
  Kind kind;
  /// Overlap in the pose less the allowance, over the displacement of the shape's points: the largest of all shapes.
  double ratio;
  double arm;  // of that shape: a rotation displaces its points by at most the angle times this [m]
};

class CagePoses {
 public:
  /// `cage` must outlive it. The allowance is at least `allowance` [m]. @throws std::invalid_argument without moving
  /// shapes.
  CagePoses(const Cage& cage, double resolution, double allowance = 0);

  double resolution() const { return resolution_; }
  double allowance() const { return allowance_; }
  /// Around the moving shapes, in M's frame.
  const Ball& body() const { return body_; }
  /// A rotation about the centre displaces no core by more than the angle times this [m].
  double arm() const { return arm_; }
  const RotationSpace& rotations() const { return rotations_; }
  /// Directions of the edges and axes of the moving shapes, in M's frame, and of the fixed ones, in F; opposite ones
  /// are listed once.
  const std::vector<Vector3d>& moving_axes() const { return moving_axes_; }
  const std::vector<Vector3d>& fixed_axes() const { return fixed_axes_; }
  /// M's orientation at the present pose.
  const Rotationd& present() const { return cage_.X_FM.R; }
  /// Displacement of the centre at which the body has left; zero: it has [m].
  double leave() const { return leave_; }
  /// M's pose after a displacement of the body's centre, in F, and a rotation from the present pose.
  Posed pose(const Vector3d& displacement, const Rotationd& rotation) const;
  /// All such motions from a pose.
  CageOverlap overlap(const Posed& X_FM, const CageMotion& motion);
  /// The share of a motion that certainly keeps the overlaps within the allowance, at most 1; negative if the pose
  /// itself does not.
  double free_share(const Posed& X_FM, const CageMotion& motion) const;

 private:
  struct InnerBall {
    Vector3d p_M;
    double radius, arm;  // arm: distance from the body's centre [m]
  };
  struct Pair {
    OverlapPair shapes;
    double arm;
    std::size_t balls, end;  // inside of the moving shape: indices into inner_
  };
  double arm_of(const ContactShape& shape) const;
  void add_inner_balls(const ContactShape& shape);
  bool note_balls(const Pair& pair, const Posed& X_FM, const CageMotion& motion, CageOverlap& found) const;

  const Cage& cage_;
  std::vector<InnerBall> inner_;
  std::vector<Pair> pairs_;
  std::vector<std::size_t> order_;  // of evaluation
  Ball body_;
  RotationSpace rotations_;
  std::vector<Vector3d> moving_axes_, fixed_axes_;
  double resolution_, allowance_ = 0, leave_ = 0, arm_ = 0;
};

/// A pose of the moving body: displacement of its centre [m], and rotation.
struct CageWaypoint {
  Vector3d p;
  Quaterniond q;
};

/// A tree of poses that grows into random directions (S. LaValle, J. Kuffner, Int. J. Robotics Research 20 (2001)
/// 378-400), and by turns and translations that align axes of the body with those of the fixed shapes. Its edges are
/// free as a whole, because none of their steps is longer than the distances at its begin permit (24.1).
class EscapeTree {
 public:
  /// Adds the number of evaluated poses to `count`.
  EscapeTree(const CagePoses& poses, long& count);
  /// Whether the tree reaches the exit within a number of evaluations.
  bool grow(long evaluations);
  /// Whether it does by growing towards these poses, one after the other, within a number of evaluations.
  bool follow(const std::vector<CageWaypoint>& goals, long evaluations);

 private:
  double uniform(double low, double high);
  std::size_t random_index(std::size_t size);
  CageWaypoint random_goal();
  CageWaypoint turned(const CageWaypoint& at);
  CageWaypoint pushed(const CageWaypoint& at);
  bool walk_along_axes();
  double way(const CageWaypoint& from, const CageWaypoint& to) const;
  const CageWaypoint& nearest(const CageWaypoint& goal) const;
  CageWaypoint advance(CageWaypoint at, const CageWaypoint& goal);
  bool has_left(const CageWaypoint& at) const { return norm(at.p) >= poses_.leave(); }

  const CagePoses& poses_;
  long& count_;
  std::mt19937_64 random_{1};
  std::vector<CageWaypoint> nodes_;
};

/// A trial of a path that may lead out: whether it does.
using CageTrial = std::function<bool(const std::vector<CageWaypoint>&)>;

/// Looks for a proof that no path leads out, by cells (24.2). Tries some of the paths that may lead out. Writes all but
/// allowance and resolution into `answer`.
void prove_caged(CagePoses& poses, long max_cells, CageAnswer& answer, const CageTrial& trial = {});

/// Sphere around the shapes other than half-spaces; with the mean of their bounding box as its centre.
Ball ball_around(const std::vector<PlacedContactShape>& shapes);
/// The rotations that change shapes about a centre.
RotationSpace rotation_space(const std::vector<ContactShape>& shapes, const Vector3d& center);
/// Balls inside of the moving body: if one of them is caged, the whole body is. The largest first.
std::vector<ContactShape> inner_balls(const std::vector<ContactShape>& moving);

}  // namespace grapnel
