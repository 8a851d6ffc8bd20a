#pragma once

/// @file
/// Settings of control and actuators, as plain data: parts of CaptureProblem.

#include <cstdint>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// Timing of an on-board computer.
struct ControlTiming {
  double period = 0.01;  // T [s]
  double delay = 0;      // from a sample to its command [s]
  bool operator==(const ControlTiming&) const = default;
};

/// Logged efforts, and commands of the base's actuators; each row is held until the time of the next.
struct EffortLog {
  std::vector<double> times;                 // [s], of the scenario; the first is 0, increasing
  std::vector<std::vector<double>> efforts;  // per joint of the robot, per time [N m or N]
  std::vector<Vector3d> base_torque;         // per time, on the base in its axes [N m]; empty: none
  /// Per actuator of the base, in the robot's order, per time, as in ActuatorCommands; empty: no commands of this kind.
  std::vector<std::vector<double>> wheel_torque = {}, gimbal_rate = {}, thruster = {};
  bool commands_actuators() const { return !wheel_torque.empty() || !gimbal_rate.empty() || !thruster.empty(); }
};

/// The sensor of a joint reads theta + n(t), and its rate theta_dot + n'(t). n is a sum of cosines (NoiseSignal) of
/// equal amplitude with random frequencies in (0, bandwidth] and random phases: nearly Gaussian, stationary, with
/// standard deviation `position`. It is smooth, so that an integrator keeps its order, and reproducible to the bit.
struct TrackingNoise {
  double position = 0;     // standard deviation [rad or m]; 0: no noise
  double bandwidth = 5;    // [Hz]
  std::uint64_t seed = 0;  // determines n(t), together with the joint's number
};

/// A thruster on a body. It pushes the body along its direction.
struct Thruster {
  Vector3d position = Vector3d::zero();      // point of its force, in the body's frame [m]
  Vector3d direction{1, 0, 0};               // unit, of its force, in the body's frame, as known to the controller
  Vector3d misalignment = Vector3d::zero();  // rotation vector from it to the true direction [rad]
  double force = 0;                          // [N]
  double specific_impulse = 0;               // of its propellant [s]
  double min_on_time = 0;                    // [s]
  double rise = 0, fall = 0;                 // of its force, from zero to full and back, linear [s]
};

/// How thrusters realize a commanded torque.
struct ThrusterModulation {
  /// pulse_width: in each period of the control clock, each fires for the time that gives the commanded mean. schmitt:
  /// each is on or off, with hysteresis.
  enum class Kind { pulse_width, schmitt };
  Kind kind = Kind::pulse_width;
  /// Fractions of the minimum on-time (pulse_width) or of the force (schmitt): a thruster switches on if its command is
  /// at least level_on, off if it is at most level_off, and keeps its state between them.
  double level_on = 0.75, level_off = 0.25;
};

/// Settings of the thrusters that dump the wheels' momentum.
struct MomentumDumping {
  double above = 0;   // magnitude of the wheels' momentum at which dumping begins [N m s],
  double below = 0;   // and ends
  double torque = 0;  // mean over a period [N m]
};

/// Parameters of the gimbal rates for a torque, near singular configurations. The measure of singularity is m =
/// sqrt(det(A A^T)), with the momenta's derivatives by the gimbal angles as columns of A, divided by the largest
/// momentum.
struct GyroSteering {
  double near = 0.2;      // m below which the array counts as near a singularity
  double damping = 0.01;  // lambda_0
  double dither = 0.01;   // epsilon_0; less than 1/2
};

/// Parameters of impedance control of end-effectors (ImpedanceLaw).
struct ImpedanceGains {
  /// The controlled directions: all six, the position, or x, y and the rotation about z of W.
  enum class Motion { pose, position, plane };
  Motion motion = Motion::pose;
  /// operational_space: exact for the model (21.2). transpose: J*^T (K e - D v), without mass and model (21.6).
  enum class Law { operational_space, transpose };
  Law law = Law::operational_space;
  // Along and about the axes of the reference:
  Vector3d mass{1, 1, 1};                                                             // apparent [kg]
  Vector3d damping = Vector3d::zero(), stiffness = Vector3d::zero();                  // [N s/m], [N/m]
  Vector3d inertia{1, 1, 1};                                                          // apparent [kg m^2]
  Vector3d angular_damping = Vector3d::zero(), angular_stiffness = Vector3d::zero();  // [N m s/rad], [N m/rad]
  /// Whether the law receives contact forces; otherwise it assumes zero.
  enum class Force { sensed, not_sensed };
  Force force = Force::sensed;
  double null_rate = 1;  // damping rate of the joints' null-space motion [1/s]
};

}  // namespace grapnel
