#pragma once

/// @file
/// Finite elements of an arm of planar beams that strikes a free ball, as a reference independent of the library.
///
/// The beams are those of Euler and Bernoulli: plane sections, no shear, no extension. Their angle t(s) is continuous
/// and quadratic in each element, and the position follows without any assumption of small angles,
///   p(s) = p(0) + int_0^s [cos t, sin t] ds                                          (1)
///   T = 1/2 int (m |p'|^2 + j t'^2) ds,    V = 1/2 int E I (dt/ds)^2 ds              (2)
/// with mass m and rotary inertia j per length. Small deflections w = int t ds are then piecewise cubic with a
/// continuous slope: these are Hermite's cubic elements with consistent mass, whose frequencies converge with the
/// fourth power of the length of an element (Przemieniecki, Theory of Matrix Structural Analysis, 1968). The library
/// instead bends rigid pieces at discrete springs.

#include <Eigen/Core>
#include <vector>

namespace grapnel::oracle {

/// A uniform beam on the end of the previous one, or on the base.
struct StrikingLink {
  double length, mass, bending_stiffness;  // [m], [kg], [N m^2]
  double rotary_inertia = 0;               // per length, about the normal of the plane [kg m]
  double damping_ratio = 0;                // of the first mode of the beam alone, clamped, without rotary inertia
  double joint_angle = 0;                  // between the ends of both beams [rad]
  double joint_rate = 0;                   // [rad/s]; of a free joint
  bool joint_free = false;                 // otherwise the joint is held
};

/// Force of a contact over the depth d and the approach speed v: k d^n (1 + a v) + c w(d/d_c) v, never negative, with
/// w(x) = 3 x^2 - 2 x^3 up to x = 1. Friction by Dupont's elastoplastic model with a falling coefficient.
struct StrikingContact {
  double stiffness, exponent = 1;
  double dissipation = 0, damping = 0, damping_depth = 1e-4;
  double static_friction = 0, kinetic_friction = 0, stiction_speed = 1e-2, stiction_displacement = 1e-4;
};

/// The plane is x-y of the base, whose frame is W at t = 0; everything but the ball and free joints is at rest then.
struct StrikeSetup {
  bool base_held = false;
  double base_mass = 0, base_inertia = 0;                     // centre of mass at the base's origin
  Eigen::Vector2d mount{0, 0};                                // beginning of the first link in the base
  std::vector<StrikingLink> links;                            // undeformed at t = 0
  double tip_mass = 0, tip_inertia = 0, tip_radius = 0;       // a ball at the end of the last link
  double ball_mass = 1, ball_inertia = 1, ball_radius = 0.1;  // the free ball
  Eigen::Vector2d ball_position{0, 0}, ball_velocity{0, 0};
  double ball_rate = 0;
  StrikingContact contact{1};
  double duration = 0.15;
  int elements = 8;           // per link
  bool small_angles = false;  // linear in the angles of deflection: the classical Hermite elements; held base only
  double tolerance = 1e-10;
};

/// From the time at which the balls touch until they are apart.
struct Touch {
  double begin = 0, end = 0;
  double normal_impulse = 0;      // integral of the normal force's magnitude [N s]
  Eigen::Vector2d impulse{0, 0};  // on the ball, with friction [N s]
  double peak_force = 0;          // largest normal force [N]
};

/// All touches, and the motion at the end of the duration, in W.
struct StrikeResult {
  std::vector<Touch> touches;
  Eigen::Vector2d ball_velocity, tip_position, tip_velocity, base_velocity;
  double ball_rate = 0, base_rate = 0;
  double normal_impulse = 0, peak_force = 0;  // of all touches
  double energy_defect = 0;                   // change of energy with all losses, relative to the energy at first
  Eigen::Vector2d momentum_defect{0, 0};      // [N s]; of a free base
  int steps = 0;
};

/// Integrates the motion with error control by Dormand and Prince's method of order 5, which restarts where a touch
/// begins or ends. @throws std::runtime_error after 2,000,000 steps
StrikeResult strike(const StrikeSetup& setup);

}  // namespace grapnel::oracle
