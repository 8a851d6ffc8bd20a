#pragma once

/// @file
/// Free, unheld bodies without children, such as targets before they are grasped, in packs. They need neither recursion
/// nor a 6 x 6 solution.

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/spatial/pack.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel::lanes {

/// Centre of mass and central inertia of a link, from its numbers in a record (lane_phase_tables.hpp). The tag
/// separates the symbol names of different instruction sets.
template <class S>
struct CentralInertia {
  double com[3];
  Symmetric3d J;  // about the centre of mass

  explicit CentralInertia(const double* n) {
    const double m = n[kLinkMass];
    // A massless link has its centre of mass at its origin.
    for (int k = 0; k < 3; ++k) com[k] = m == 0 ? 0 : n[kLinkFirstMoment + k] / m;
    const double* c = com;
    const double* O = n + kLinkRotational;  // about the origin; the parallel-axis term is subtracted
    J.xx = O[0] - m * (c[1] * c[1] + c[2] * c[2]), J.yy = O[1] - m * (c[0] * c[0] + c[2] * c[2]);
    J.zz = O[2] - m * (c[0] * c[0] + c[1] * c[1]), J.xy = O[3] + m * (c[0] * c[1]);
    J.xz = O[4] + m * (c[0] * c[2]), J.yz = O[5] + m * (c[1] * c[2]);
  }
};

template <class S>
void set_lane(int lane, Symmetric3<S>& A, const Symmetric3d& of_lane) {
  A.xx.set(lane, of_lane.xx), A.yy.set(lane, of_lane.yy), A.zz.set(lane, of_lane.zz);
  A.xy.set(lane, of_lane.xy), A.xz.set(lane, of_lane.xz), A.yz.set(lane, of_lane.yz);
}

/// The parameters of a free body without children.
template <class S>
struct LaneFreeBody {
  Vector3<S> com;
  Symmetric3<S> inertia, inverse;  // about the centre of mass
  S inverse_mass;
};

/// All free bodies of a run.
template <class S>
class LaneFreeBodies {
 public:
  explicit LaneFreeBodies(const PhaseTables& tables)
      : tables_(tables), is_free_(tables.link_count), bodies_(tables.link_count) {
    for (int i = 0; i < tables.link_count; ++i)
      is_free_[i] = tables.links[i].joint == JointType::free && !tables.links[i].is_grounded;
    for (int i = 0; i < tables.link_count; ++i) {
      if (tables.links[i].parent >= 0) is_free_[tables.links[i].parent] = 0;
    }
  }

  bool holds(int link) const { return is_free_[link] != 0; }

  /// Loads a link's numbers (see lane_phase_tables.hpp) into a lane.
  void load(int lane, const double* n, int link) {
    const CentralInertia<S> I(n);
    const auto& [xx, yy, zz, xy, xz, yz] = I.J;
    const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, d = xy * yz - xz * yy;
    const double determinant = xx * a + xy * b + xz * d;
    LaneFreeBody<S>& body = bodies_[link];
    for (int k = 0; k < 3; ++k) body.com[k].set(lane, I.com[k]);
    set_lane(lane, body.inertia, I.J);
    set_lane(lane, body.inverse,
             {a / determinant, (xx * zz - xz * xz) / determinant, (xx * yy - xy * xy) / determinant, b / determinant,
              d / determinant, (xy * xz - xx * yz) / determinant});
    body.inverse_mass.set(lane, 1 / n[kLinkMass]);
  }

  /// Their accelerations from the velocities: w' = J^-1 (J w x w) and zero acceleration of the centre of mass, in body
  /// axes.
  void accelerate(const S* v, S* vdot) const {
    for (int i = 0; i < tables_.link_count; ++i) {
      if (!holds(i)) continue;
      const LaneFreeBody<S>& body = bodies_[i];
      const int at = tables_.links[i].v;
      const Vector3<S> w{v[at], v[at + 1], v[at + 2]}, u{v[at + 3], v[at + 4], v[at + 5]};
      const Vector3<S> spin = body.inverse * cross(Vector3<S>(body.inertia * w), w);
      const Vector3<S> u_com = u + cross(w, body.com);
      const Vector3<S> linear = cross(u_com, w) + cross(body.com, spin);
      for (int k = 0; k < 3; ++k) vdot[at + k] = spin[k], vdot[at + 3 + k] = linear[k];
    }
  }
  /// Adds the accelerations due to a wrench on a body, about its frame's origin, and due to gravity; both in its axes.
  void push(int link, const Wrench<S>& F, const Vector3<S>& gravity, S* vdot) const {
    const LaneFreeBody<S>& body = bodies_[link];
    const int at = tables_.links[link].v;
    const Vector3<S> spin = body.inverse * Vector3<S>(F.angular - cross(body.com, F.linear));
    const Vector3<S> linear = body.inverse_mass * F.linear + gravity + cross(body.com, spin);
    for (int k = 0; k < 3; ++k) vdot[at + k] += spin[k], vdot[at + 3 + k] += linear[k];
  }

 private:
  const PhaseTables& tables_;
  LaneArray<S, std::uint8_t> is_free_;
  LaneArray<S, LaneFreeBody<S>> bodies_;  // per link
};

}  // namespace grapnel::lanes
