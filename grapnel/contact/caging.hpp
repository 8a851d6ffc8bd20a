#pragma once

/// @file
/// Whether a body can leave others that do not move: a search of its poses (theory, section 24).

#include <vector>

#include "grapnel/contact/contact_shape.hpp"

namespace grapnel {

/// A shape with the pose of its body in a common frame F.
struct PlacedContactShape {
  Posed X_FB;
  ContactShape shape;
};

/// A body that moves among others, which do not.
struct Cage {
  std::vector<PlacedContactShape> fixed;  // half-spaces bound poses, but no body has to leave them
  std::vector<ContactShape> moving;       // on the body M; no half-spaces
  Posed X_FM;                             // present pose of M
};

struct CageSearch {
  /// Cells are not divided once no point of the body moves by more than this within a cell [m]; 0: a hundredth of the
  /// radius of the sphere around the moving shapes, or a tenth of the smallest half thickness of all shapes if that is
  /// less.
  double resolution = 0;
  long max_cells = 50'000;  // bound on the number of evaluated poses
};

struct CageAnswer {
  /// caged: no path leads out. can_leave: a path was found. undecided: neither was shown at this resolution within this
  /// number of poses.
  enum class Verdict { caged, can_leave, undecided };
  Verdict verdict = Verdict::undecided;
  /// All statements count as free the poses in which no two shapes overlap by more than this: the present overlap and
  /// twice the resolution [m].
  double allowance = 0;
  double resolution = 0;  // [m]
  long cells = 0;         // evaluated poses
  bool out_of_cells = false;
};

/// Searches all poses that M can reach from X_FM, by cells of position and rotation vector (24.2). The body has left
/// when the sphere around its shapes is apart from that around the fixed shapes other than half-spaces. Both answers
/// hold for all poses, not only for the evaluated ones, because no distance of two shapes changes by more than their
/// points move (24.1). Proofs that a body is caged are quick for cages that hold a ball inside of the body; bodies that
/// can turn far before they touch often remain undecided. Rotations that do not change the moving shapes, as of coaxial
/// cylinders, are not searched. Without fixed shapes the body can leave. @throws std::invalid_argument without moving
/// shapes.
CageAnswer search_cage(const Cage& cage, const CageSearch& search = {});

}  // namespace grapnel
