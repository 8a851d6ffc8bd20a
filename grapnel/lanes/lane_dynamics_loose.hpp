#pragma once

/// @file
/// Free bodies that carry nothing, such as targets before they are gripped: torque-free rigid bodies need no recursion
/// and no solution of six equations.

#include "grapnel/lanes/lane_phase_array.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel::lanes {

/// One body's numbers.
template <class S>
struct LaneLooseBody {
  Vector3<S> com;
  Symmetric3<S> inertia, inverse;  // about the centre of mass
};

template <class S>
class LaneLooseBodies {
 public:
  explicit LaneLooseBodies(const PhaseTables& tables)
      : tables_(tables), is_loose_(tables.link_count), bodies_(tables.link_count) {
    for (int i = 0; i < tables.link_count; ++i) is_loose_[i] = tables.links[i].joint == LinkJoint::root_free;
    for (int i = 0; i < tables.link_count; ++i) {
      if (tables.links[i].parent >= 0) is_loose_[tables.links[i].parent] = 0;
    }
  }

  bool holds(int link) const { return is_loose_[link] != 0; }

  /// Takes a link's numbers (see lane_phase_tables.hpp) into a lane.
  void load(int lane, const double* n, int link) {
    const double m = n[kLinkMass];
    const double c[3] = {n[kLinkFirstMoment] / m, n[kLinkFirstMoment + 1] / m, n[kLinkFirstMoment + 2] / m};
    const double* J = n + kLinkRotational;  // about the origin: the parallel-axis term goes
    const double xx = J[0] - m * (c[1] * c[1] + c[2] * c[2]), yy = J[1] - m * (c[0] * c[0] + c[2] * c[2]),
                 zz = J[2] - m * (c[0] * c[0] + c[1] * c[1]), xy = J[3] + m * (c[0] * c[1]),
                 xz = J[4] + m * (c[0] * c[2]), yz = J[5] + m * (c[1] * c[2]);
    const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, d = xy * yz - xz * yy;
    const double determinant = xx * a + xy * b + xz * d;
    LaneLooseBody<S>& body = bodies_[link];
    for (int k = 0; k < 3; ++k) body.com[k].set(lane, c[k]);
    set(lane, body.inertia, xx, yy, zz, xy, xz, yz);
    set(lane, body.inverse, a / determinant, (xx * zz - xz * xz) / determinant, (xx * yy - xy * xy) / determinant,
        b / determinant, d / determinant, (xy * xz - xx * yz) / determinant);
  }

  /// Their parts of the accelerations, from the velocities: w' = J^-1 (J w x w), and no acceleration of the centre of
  /// mass, in components on the body.
  void accelerate(const S* v, S* vdot) const {
    for (int i = 0; i < tables_.link_count; ++i) {
      if (!holds(i)) continue;
      const LaneLooseBody<S>& body = bodies_[i];
      const int at = tables_.links[i].v;
      const Vector3<S> w{v[at], v[at + 1], v[at + 2]}, u{v[at + 3], v[at + 4], v[at + 5]};
      const Vector3<S> spin = body.inverse * cross(Vector3<S>(body.inertia * w), w);
      const Vector3<S> u_com = u + cross(w, body.com);
      const Vector3<S> linear = cross(u_com, w) + cross(body.com, spin);
      for (int k = 0; k < 3; ++k) vdot[at + k] = spin[k], vdot[at + 3 + k] = linear[k];
    }
  }

 private:
  static void set(int lane, Symmetric3<S>& A, double xx, double yy, double zz, double xy, double xz, double yz) {
    A.xx.set(lane, xx), A.yy.set(lane, yy), A.zz.set(lane, zz);
    A.xy.set(lane, xy), A.xz.set(lane, xz), A.yz.set(lane, yz);
  }

  const PhaseTables& tables_;
  LaneArray<S, std::uint8_t> is_loose_;
  LaneArray<S, LaneLooseBody<S>> bodies_;  // per link
};

}  // namespace grapnel::lanes
