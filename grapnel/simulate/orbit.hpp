#pragma once

/// @file
/// A reference orbit, and the forces on bodies near it in a frame that falls with it without rotation (docs/theory,
/// section 14).
///
/// The field is the linear part of the difference between the gravity at a point and that at the reference point. Its
/// relative error is some 3/2 of the distance over the orbit's radius: 2e-6 at 10 m above the Earth, 2e-3 at 10 km.
/// Templates on the scalar serve a single capture and many in SIMD lanes (grapnel/lanes/). Thread safety: free
/// functions; no state.

#include <string>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// A Kepler orbit; t is relative to the start of the run.
struct ReferenceOrbit {
  double mu = 0;               // gravitational parameter of the central body [m^3/s^2]
  double semi_major_axis = 0;  // [m]
  double eccentricity = 0;     // at least 0, less than 1
  double true_anomaly = 0;     // at t = 0, from the lowest point in the direction of motion [rad]
  Vector3d radial{1, 0, 0};    // unit, in W: at t = 0 from the central body to the reference point
  // unit, in W: perpendicular to it in the orbit's plane, in the direction of motion, at t = 0
  Vector3d along_track{0, 1, 0};
  /// The reference point in the frame of the computation, in which it moves uniformly (that frame moves uniformly in W
  /// and falls, too): at t = 0 [m], and its velocity [m/s]. Zero in W itself.
  Vector3d position = Vector3d::zero();
  Vector3d velocity = Vector3d::zero();
};

/// The reference point on its orbit, and the axes O that rotate with it; S: double, or packs of SIMD lanes.
template <class S>
struct BasicOrbitPoint {
  S radius = S(0.0);                           // R, from the central body's centre [m]
  S rate = S(0.0);                             // rotation rate of O in W, about cross-track [rad/s]
  S gradient = S(0.0);                         // mu / R^3 [1/s^2]
  Rotation<S> R_WO = Rotation<S>::identity();  // columns: radial, along-track, cross-track
  Vector3<S> position = Vector3<S>::zero();    // of the reference point, in the frame of the computation [m]

  GRAPNEL_INLINE Vector3<S> radial() const { return R_WO.column(0); }
};
using OrbitPoint = BasicOrbitPoint<double>;

/// The constants of an orbit: its parameters, and quantities derived from them.
template <class S>
struct OrbitConstants {
  S mu, semi_major_axis, eccentricity;
  S root;          // sqrt(1 - e^2)
  S mean_motion;   // [rad/s]
  S mean_anomaly;  // at t = 0 [rad]
  S cosine, sine;  // of the true anomaly at t = 0
  Vector3<S> radial, along_track, position, velocity;
};
OrbitConstants<double> orbit_constants(const ReferenceOrbit& orbit);

/// @param t [s]; the eccentricity must be less than 1 (fault_of).
OrbitPoint orbit_point(const ReferenceOrbit& orbit, double t);
/// The same from the eccentric anomaly E at the time t, which solves M + n t = E - e sin E (14.1).
template <class S>
GRAPNEL_INLINE BasicOrbitPoint<S> orbit_point(const OrbitConstants<S>& orbit, const S& t, const SineCosine<S>& E) {
  // True anomaly, and its difference from the one at t = 0.
  const S shrink = S(1.0) - orbit.eccentricity * E.cosine;
  const S cos_now = S(E.cosine - orbit.eccentricity) / shrink, sin_now = S(orbit.root * E.sine) / shrink;
  const S c = cos_now * orbit.cosine + sin_now * orbit.sine, s = sin_now * orbit.cosine - cos_now * orbit.sine;
  BasicOrbitPoint<S> at;
  at.radius = orbit.semi_major_axis * shrink;
  at.gradient = orbit.mu / S(S(at.radius * at.radius) * at.radius);
  at.rate = S(orbit.mean_motion * orbit.root) / S(shrink * shrink);
  const Vector3<S> radial = c * orbit.radial + s * orbit.along_track;
  const Vector3<S> along_track = c * orbit.along_track - s * orbit.radial;
  const Vector3<S> cross_track = cross(orbit.radial, orbit.along_track);
  for (int i = 0; i < 3; ++i) at.R_WO(i, 0) = radial[i], at.R_WO(i, 1) = along_track[i], at.R_WO(i, 2) = cross_track[i];
  at.position = orbit.position + t * orbit.velocity;
  return at;
}

/// (14.2): acceleration at p_W, a point of the frame of the computation, relative to the reference point [m/s^2].
template <class S>
GRAPNEL_INLINE Vector3<S> tidal_acceleration(const BasicOrbitPoint<S>& at, const Vector3<S>& p_W) {
  const Vector3<S> r = p_W - at.position, up = at.radial();
  return at.gradient * (S(S(3.0) * dot(up, r)) * up - r);
}
/// (14.3): torque on a body with this attitude and inertia (in its own axes) about its centre of mass, in W [N m].
template <class S>
GRAPNEL_INLINE Vector3<S> gravity_gradient_torque(const BasicOrbitPoint<S>& at, const Rotation<S>& R_WB,
                                                  const Symmetric3<S>& I_B) {
  const Vector3<S> up = transposed_times(R_WB, at.radial());
  return R_WB * (S(S(3.0) * at.gradient) * cross(up, I_B * up));
}

/// Position and velocity of a point relative to O: components radial, along-track, cross-track.
struct OrbitalMotion {
  Vector3d position;  // from the reference point [m]
  Vector3d velocity;  // its rate of change in O [m/s]
};
/// (14.5), of a point of the frame of the computation; `at`: the same orbit at the same time.
OrbitalMotion orbital_motion(const ReferenceOrbit& orbit, const OrbitPoint& at, const Vector3d& p_W,
                             const Vector3d& v_W);

/// Mean motion sqrt(mu / a^3) [rad/s].
double mean_motion(const ReferenceOrbit& orbit);

/// The error in an orbit, as the end of a sentence that begins with it; empty: none.
std::string fault_of(const ReferenceOrbit& orbit);

}  // namespace grapnel
