#pragma once

/// @file
/// A reference orbit, and what bodies near it feel in a frame that falls with it without turning (docs/theory.md,
/// section 14).
///
/// The field is the linear part of the difference between the gravity at a point and that at the reference point. Its
/// relative error is some 3/2 of the distance over the orbit's radius: 2e-6 at 10 m above the Earth, 2e-3 at 10 km.
/// Thread safety: free functions; no state.

#include <string>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// A Kepler orbit, t counted from the start of the run.
struct ReferenceOrbit {
  double mu = 0;                  // gravitational parameter of the central body [m^3/s^2]
  double semi_major_axis = 0;     // [m]
  double eccentricity = 0;        // at least 0, less than 1
  double true_anomaly = 0;        // at t = 0, from the lowest point in the sense of the motion [rad]
  Vector3d radial{1, 0, 0};       // unit, in W: at t = 0 from the central body to the reference point
  Vector3d along_track{0, 1, 0};  // unit, in W: perpendicular to it in the orbit's plane, the way it goes, at t = 0
  /// The reference point in the frame of the computation, in which it moves uniformly as seen from there (a frame that
  /// moves uniformly in W, which falls too): at t = 0 [m], and its velocity [m/s]. W itself has zeros.
  Vector3d position = Vector3d::zero();
  Vector3d velocity = Vector3d::zero();
};

/// Where the reference point is on its orbit, and the axes O that turn with it.
struct OrbitPoint {
  double radius = 0;                       // R, from the central body's centre [m]
  double rate = 0;                         // at which O turns in W, about cross-track [rad/s]
  double gradient = 0;                     // mu / R^3 [1/s^2]
  Rotationd R_WO = Rotationd::identity();  // columns: radial, along-track, cross-track
  Vector3d position = Vector3d::zero();    // of the reference point, in the frame of the computation [m]

  Vector3d radial() const { return R_WO.column(0); }
};
/// @param t [s]; the eccentricity must be less than 1 (fault_of).
OrbitPoint orbit_point(const ReferenceOrbit& orbit, double t);

/// (14.2): acceleration at p_W, a point of the frame of the computation, relative to the reference point [m/s^2].
Vector3d tidal_acceleration(const OrbitPoint& at, const Vector3d& p_W);
/// (14.3): torque on a body with this attitude and inertia (in its own axes) about its centre of mass, in W [N m].
Vector3d gravity_gradient_torque(const OrbitPoint& at, const Rotationd& R_WB, const Symmetric3d& I_B);

/// Position and velocity of a point as they are seen in O: components radial, along-track, cross-track.
struct OrbitalMotion {
  Vector3d position;  // from the reference point [m]
  Vector3d velocity;  // its rate of change in O [m/s]
};
/// (14.5), of a point of the frame of the computation; `at`: the same orbit at the same time.
OrbitalMotion orbital_motion(const ReferenceOrbit& orbit, const OrbitPoint& at, const Vector3d& p_W,
                             const Vector3d& v_W);

/// Mean motion sqrt(mu / a^3) [rad/s].
double mean_motion(const ReferenceOrbit& orbit);

/// What is wrong with an orbit, as the end of a sentence that begins with it; empty: nothing.
std::string fault_of(const ReferenceOrbit& orbit);

}  // namespace grapnel
