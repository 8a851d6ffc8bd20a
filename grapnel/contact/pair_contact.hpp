#pragma once

/// @file
/// The contact of two shapes: geometry, forces, energy and dissipation (theory section 23). Forces are continuous
/// functions of poses and velocities; without damping and friction they are the exact gradient of the elastic energy.

#include <vector>

#include "grapnel/contact/contact_element.hpp"
#include "grapnel/contact/touch_points.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// The motion of a body B in W.
struct MovingBody {
  Posed X_WB;
  Twistd V_WB;  // at B's origin, in W [rad/s, m/s]
};

/// Elastic tangential deformation of a contact, as a fraction of that at which it slips (23.7a). Part of the state of a
/// system: its rate is ContactForce::stick_rate. Zero when contact begins.
struct StickState {
  Vector3d slip = Vector3d::zero();  // in W
  double spin = 0;                   // about the normal
};

struct ContactForce {
  bool touches = false;
  /// The shapes overlap so deeply that normals may jump (23.14): a sign of too little stiffness.
  bool beyond_model = false;
  Vector3d p_WC = Vector3d::zero();  // centre of the elastic forces, in W [m]
  Wrenchd on_a = Wrenchd::zero();    // wrench on the first shape's body about p_WC, in W [N m, N]: exactly -on_b
  Wrenchd on_b = Wrenchd::zero();
  double normal_force = 0;    // sum over all points [N]
  double area = 0;            // of surfaces in contact; zero for points and lines [m^2]
  double depth = 0;           // maximum [m]
  double slip_speed = 0;      // at p_WC [m/s]
  double friction_use = 0;    // friction and couple about the normal, over those at which it slips: at most 1
  double damping_power = 0;   // dissipated, >= 0 [W]
  double friction_power = 0;  // given up to friction, rolling and torsional friction; < 0 while sticking relaxes [W]
  StickState stick_rate;      // [1/s]
};

/// Two shapes by the points of their surfaces nearest to each other, in W.
struct ShapeSeparation {
  double distance;  // [m]; negative: depth of penetration
  Vector3d normal;  // unit, from the first shape to the second
  Vector3d point_a, point_b;
};

/// Thread safety: one thread at a time (it owns scratch memory). No result depends on an earlier call.
class PairContact {
 public:
  /// `law` is that of combine() for the materials of a and b in this order. @throws std::invalid_argument for two
  /// half-spaces.
  PairContact(ContactShape a, ContactShape b, ContactLaw law);

  /// Forces in this state; valid until the next call. Does not allocate.
  const ContactForce& evaluate(const MovingBody& a, const MovingBody& b, const StickState& stick = {});
  /// Where evaluate() gives no force: no force; of a sphere the slip speed and the rate of the deformation in the
  /// limit of a small overlap, so that both are continuous. For other pairs they begin at zero with the depth.
  const ContactForce& graze(const MovingBody& a, const MovingBody& b, const StickState& stick = {});
  /// The result of the last evaluate() or graze(); no contact before the first.
  const ContactForce& last() const { return force_; }
  /// The elastic energy [J]. For polyhedra it takes a few times as long as the forces. Its relative accuracy is that of
  /// the pose: about 1e-16 times the ratio of size to depth.
  double elastic_energy(const Posed& X_WA, const Posed& X_WB);
  /// Distance and nearest points, or depth. Depths may take long for meshes, and may allocate (convex_distance.hpp).
  ShapeSeparation separation(const Posed& X_WA, const Posed& X_WB) const;
  /// The distance of the shapes to which the forces belong: cylinders are prisms where the forces take them as such, or
  /// larger; negative if they overlap [m]. There is no force while it is positive.
  double gap(const Posed& X_WA, const Posed& X_WB) const;
  /// The points at which the shapes of gap() touch, in W. Where gap() is far from zero they have no meaning. Allocates.
  TouchPoints touch(const Posed& X_WA, const Posed& X_WB) const;
  /// A lower bound of gap() from spheres around the shapes, or boxes along the line of the centres or the normal of a
  /// half-space, at a small part of its cost.
  double gap_bound(const Posed& X_WA, const Posed& X_WB) const;
  /// ContactForce::depth in these poses; zero without contact.
  double depth(const Posed& X_WA, const Posed& X_WB);
  /// Positive where the shapes overlap: the depth, or a bound of it if that is faster; otherwise a negative bound of
  /// the gap or less than zero [m]. Continuous at zero.
  double overlap(const Posed& X_WA, const Posed& X_WB);
  /// Between the centres of both shapes, or the centre of one and a point of a half-space, in W.
  Vector3d between_centers(const Posed& X_WA, const Posed& X_WB) const;
  /// Radius of a sphere about the origin of body a, or of b, that contains its shape [m].
  double reach_of(bool of_b) const {
    const ContactShape& shape = of_b == exchanged_ ? shapes_.a : shapes_.b;
    return norm(shape.X_BC().p) + shape.reach();
  }
  /// A bound of the speed at which the gap changes [m/s].
  double speed_bound(const MovingBody& a, const MovingBody& b) const;
  /// A bound of the speed at which overlap() changes while it is positive [m/s]: the largest one of points in contact.
  double overlap_speed(const MovingBody& a, const MovingBody& b);
  /// Whether one shape is a sphere: then gap() is a smooth function of time while its nearest feature is the same, and
  /// -overlap() while it is negative.
  bool has_sphere() const { return shapes_.a.kind() == ContactShape::Kind::sphere; }
  /// Of a pair with a sphere: the gap, and its rate.
  struct SphereGap {
    double gap, rate;  // [m], [m/s]
  };
  SphereGap sphere_gap(const MovingBody& a, const MovingBody& b) const;
  const ContactLaw& law() const { return shapes_.law; }

 private:
  struct CorePoses {
    Posed X_WA, X_WB;
  };
  CorePoses core_poses(const Posed& X_WA, const Posed& X_WB) const;
  Posed relative_pose(const Posed& X_WA, const Posed& X_WB) const;
  double gap_bound_from(const CorePoses& cores) const;
  CorePair cores(const Posed& X_AB) const;
  void gather(const Posed& X_AB);
  void clear_force();
  Vector3d find_center();
  Vector3d find_point();
  void add_normal_forces(const Vector3d& n, const Twistd& V_AB, Wrenchd& on_b);
  void add_friction(const Vector3d& n, const Twistd& V_AB, const StickState& stick, Wrenchd& on_b);
  void add_rolling(const Vector3d& normal, const Vector3d& w, Wrenchd& on_b);
  void finish(const Posed& X_WA, const Vector3d& mean_rate, const StickState& stick, const Wrenchd& on_b);

  bool exchanged_;  // shapes_.a is the second shape
  ContactShapes shapes_;
  PressureContact pressure_;
  ContactElements elements_;
  Posed gathered_ = Posed::identity();  // relative pose of elements_
  bool is_gathered_ = false;
  double lever_ = 0;  // mean distance of the elastic forces from their centre [m]
  double onset_ = 0;  // factor of the rates at small depths
  ContactForce force_;
};

}  // namespace grapnel
