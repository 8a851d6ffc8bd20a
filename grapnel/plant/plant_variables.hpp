#pragma once

/// @file
/// The variables of a plant: inputs, outputs and parameters. One list serves the model description and the access to
/// values.

#include <cstddef>
#include <string>
#include <vector>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

struct CaptureProblem;

struct PlantVariable {
  enum class Type { real, whole, boolean };
  enum class Causality { parameter, input, output };
  std::string name;
  std::string unit;   // in the notation of FMI, "N.m"; "1" or empty: none
  std::string words;  // description
  Type type = Type::real;
  Causality causality = Causality::output;
  double start = 0;  // initial value; not for outputs
};

/// A parameter: a number of the scenario that may be changed before the run begins.
struct PlantParameter {
  std::string path;  // in the notation of --set
  double start = 0;  // in SI units
  std::string unit;  // stated in the file; empty: none
};

/// A variable's reference is its position + 1; 0 is time, which FMI 3.0 requires as a variable.
constexpr unsigned kTimeReference = 0;

struct PlantVariables {
  std::vector<PlantVariable> all;  // parameters, then inputs, then outputs
  std::size_t parameters = 0, inputs = 0, outputs = 0;
  // Inputs begin with the efforts of the joints, in the robot's order. The base's torque (3) follows, or the torques of
  // the wheels, the gyros' gimbals and the valves of the thrusters.
  std::size_t joints = 0, wheels = 0, gyros = 0, thrusters = 0;
  bool base_torque = false;

  std::size_t first_input() const { return parameters; }
  std::size_t first_output() const { return parameters + inputs; }
};

/// `plant`: result of plant_of().
PlantVariables plant_variables(const CaptureProblem& plant, const std::vector<PlantParameter>& parameters);

/// Outputs in the order of plant_variables().
struct PlantOutputs {
  static constexpr int kApproach = 0, kAfterImpact = 1, kEnded = 2;
  int phase = kApproach;
  int piece = 0;  // increases when grasps close or open
  struct Joint {
    double position = 0, rate = 0;  // [rad, rad/s; m, m/s]
    double desired_position = 0, desired_rate = 0, desired_acceleration = 0;
  };
  std::vector<Joint> joints;
  struct Motion {
    Vector3d position = Vector3d::zero();          // in W [m]
    Quaterniond quaternion_wxyz{1, 0, 0, 0};       // of R_WB
    Vector3d velocity = Vector3d::zero();          // of the origin, in W [m/s]
    Vector3d angular_velocity = Vector3d::zero();  // in the body's axes [rad/s]
  };
  Motion base;
  std::vector<double> wheel_rates;  // [rad/s]
  struct Gimbal {
    double angle = 0, rate = 0;  // [rad], [rad/s]
  };
  std::vector<Gimbal> gimbals;  // of control moment gyros
  std::vector<Motion> targets;
  std::vector<char> held;  // per target
  /// Results available at the end; zero before.
  struct End {
    bool ended = false, completed = false, conserved = false, feasible = false;
    double capture_time = 0;                                       // [s]
    double linear_momentum_drift = 0, angular_momentum_drift = 0;  // relative, as in the ledger
    double work_energy_residual = 0, energy_drift = 0;
    double impact_energy_lost = 0;  // [J]
    std::vector<char> captured;     // per grasp
  };
  End end;

  std::vector<double> numbers() const;
};

}  // namespace grapnel
