#pragma once

/// @file
/// The poses of a body among others that do not move: which of them overlap, and when it has left. For search_cage().

#include <array>
#include <cstddef>
#include <vector>

#include "grapnel/contact/caging.hpp"
#include "grapnel/contact/pair_contact.hpp"

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
  /// Directions of the rotation vector's components, in the body's frame.
  std::array<Vector3d, 3> axes{Vector3d{1, 0, 0}, Vector3d{0, 1, 0}, Vector3d{0, 0, 1}};
};

/// Bounds of motions of the body: of the translation of its centre [m] and of the rotation [rad].
struct CageMotion {
  double translation, angle;
};

class CagePoses {
 public:
  /// `cage` must outlive it. The allowance is at least `allowance` [m]. @throws std::invalid_argument without moving
  /// shapes.
  CagePoses(const Cage& cage, double resolution, double allowance = 0);

  double resolution() const { return resolution_; }
  double allowance() const { return allowance_; }
  /// The largest of some balls inside of the moving shapes, in M's frame.
  Ball inner_ball() const;
  /// Around the moving shapes, in M's frame.
  const Ball& body() const { return body_; }
  const RotationSpace& rotations() const { return rotations_; }
  /// Displacement of the centre at which the body has left; zero: it has [m].
  double leave() const { return leave_; }
  /// M's pose after a displacement of the body's centre, in F, and a rotation from the present pose.
  Posed pose(const Vector3d& displacement, const Rotationd& rotation) const;
  /// The smallest distance of moving and fixed shapes and the allowance; exact if it is between -enough and `enough`
  /// [m].
  double distance(const Posed& X_FM, double enough);
  /// Whether a ball inside of a moving shape overlaps a fixed shape by more than the allowance after all such motions
  /// from a pose. A ball near the centre moves little, so that this often holds for larger rotations than by
  /// distance().
  bool stays_overlapping(const Posed& X_FM, const CageMotion& motion);

 private:
  struct Pair {
    Posed X_FB;
    PairContact contact;
    ContactShape fixed, moving;
    double bound(const Posed& X_FM) const;
  };

  struct InnerBall {
    Vector3d p_M;
    double radius, arm;  // arm: distance from the body's centre [m]
  };
  void add_inner_balls(const ContactShape& shape);
  bool overlaps_inner(const PlacedContactShape& fixed, const Posed& X_FM, const CageMotion& motion) const;

  const Cage& cage_;
  std::vector<InnerBall> inner_;
  std::size_t last_overlap_ = 0;  // index of a fixed shape
  std::vector<Pair> pairs_;
  std::vector<std::size_t> order_;  // of evaluation
  Ball body_;
  RotationSpace rotations_;
  double resolution_, allowance_ = 0, leave_ = 0;
};

/// Looks for a path that leads out, at most `evaluations` distances. Returns whether there is one; adds the number of
/// evaluations to `count`.
bool find_escape(CagePoses& poses, long evaluations, long& count);
/// Looks for a proof that no path leads out, by cells (24.2). Writes all but allowance and resolution into `answer`.
void prove_caged(CagePoses& poses, long max_cells, CageAnswer& answer);

}  // namespace grapnel
