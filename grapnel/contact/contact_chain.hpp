#pragma once

/// @file
/// A shape of a flexible link, which consists of rigid pieces: one surface for a sphere that touches it (theory section
/// 23, Shapes of flexible links).

#include <array>
#include <cstddef>
#include <vector>

#include "grapnel/contact/pair_contact.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// A link L that was straight before its pieces moved. Between two pieces is a cut, normal to the axis.
struct ContactChain {
  struct Piece {
    int body;
    Vector3d p_LB;  // the body's origin in L; its axes are parallel to those of L
  };
  struct Cut {
    double at;    // coordinate along the axis [m]
    double half;  // half the length over which contact changes from one piece to the next [m]
  };
  Vector3d point, axis;  // of the axis, in L: the origin of coordinates along it, and its direction
  std::vector<Piece> pieces;
  std::vector<Cut> cuts;  // one less
};

/// The motion of L as it acts on a sphere with the centre C: a blend of its positions relative to two pieces.
class ChainMotion {
 public:
  /// `p_WC`, `v_WC`: of the centre.
  ChainMotion(const ContactChain& chain, const Kinematics& kinematics, const Vector3d& p_WC, const Vector3d& v_WC);

  /// L, whose twist is the derivative of its pose relative to C.
  MovingBody link() const;
  /// The body of the piece with the larger share.
  int body() const { return share_ < 0.5 ? sides_[0].body : sides_[1].body; }
  /// A force on a piece of L.
  struct Part {
    int body;
    Wrenchd on_sphere;  // about C, in W; that on the piece is opposite
  };
  /// The wrench of L on the sphere about C => its parts, whose power is that of L. A body of -1: no part.
  std::array<Part, 2> parts(const Wrenchd& on_sphere) const;

 private:
  // The centre relative to a piece, in L.
  struct Side {
    int body = -1;
    Rotationd R_WB = Rotationd::identity();
    Vector3d w = Vector3d::zero();     // angular velocity of the piece, in W
    Vector3d p = Vector3d::zero();     // of C in L
    Vector3d rate = Vector3d::zero();  // of p
  };
  static Side side_of(const ContactChain::Piece& piece, const Kinematics& kinematics, const Vector3d& p_WC,
                      const Vector3d& v_WC);

  Vector3d p_WC_, v_WC_, axis_;
  std::array<Side, 2> sides_;
  double share_ = 0;  // of the second side
  double slope_ = 0;  // derivative with respect to the coordinate along the axis [1/m]
  Rotationd R_WL_ = Rotationd::identity();
};

}  // namespace grapnel
