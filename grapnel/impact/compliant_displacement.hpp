#pragma once

/// @file
/// How far bodies have moved since an instant, without cancellation: a deformation of micrometres is the difference of
/// two displacements, not of two positions of several metres.

#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// The motion x -> x + (turn - 1)(x - o) + move of all points of a body in W, o a reference point common to all bodies.
struct Displacement {
  Quaterniond turn = Quaterniond::identity();  // in W, unit; its vector part keeps its digits near zero
  Vector3d move = Vector3d::zero();            // of the point at o
};

/// (turn - 1) x without cancellation for small turns.
inline Vector3d turned_by(const Quaterniond& turn, const Vector3d& x) {
  const Vector3d v{turn.x, turn.y, turn.z};
  const Vector3d t = 2.0 * cross(v, x);
  return turn.w * t + cross(v, t);
}

/// What displacements need of the beginning.
class StartPose {
 public:
  /// `origin_W`: the reference point o. `by_com` says per free root (index: body) whether its translation is given by
  /// the centre of mass of its tree.
  StartPose(const Model& model, const State& state, const Vector3d& origin_W, std::vector<std::uint8_t> by_com);

  /// `change`: per coordinate, in the layout of State::q, how it differs from the start: for joints the difference; for
  /// quaternions those of conj(start) o now from (1, 0, 0, 0); for a free root the displacement in W of its tree's
  /// centre of mass, or of its origin where it is not by_com. (12.2)
  void displacements(std::span<const double> change, std::span<Displacement> of_bodies) const;

  const Vector3d& origin() const { return origin_W_; }

 private:
  struct Start {
    JointType type;
    int parent, root, q;
    Vector3d axis;  // of the joint, in W
    Vector3d arm;   // from o to the body's origin, in W
    Vector3d com;   // from o to the centre of mass, in W
    Rotationd R_WB;
    double share;  // mass over that of its tree
  };
  Displacement own_motion(const Start& start, std::span<const double> change) const;

  std::vector<Start> bodies_;
  std::vector<std::uint8_t> by_com_;
  Vector3d origin_W_;
};

}  // namespace grapnel
