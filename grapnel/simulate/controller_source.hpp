#pragma once

/// @file
/// Source of user-defined controllers that are not libraries with the C interface: an FMU, or a program that uses
/// Grapnel.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// The robot of a user-defined controller, by names in the model.
struct ControlledRobot {
  std::string base;                        // body
  std::vector<std::string> joints;         // in the controller's order
  std::vector<std::string> end_effectors;  // frames
  std::vector<std::string> wheels;         // joints
  Vector3d gravity = Vector3d::zero();     // [m/s^2]
  // The frame of the computation, see MovingFrame: at t = 0, in W [m]; [m/s].
  Vector3d origin = Vector3d::zero();
  Vector3d velocity = Vector3d::zero();
  bool commands_base = false;
};

/// Creates controllers, one per run. Thread safety: any number of threads.
class ControllerSource {
 public:
  ControllerSource() = default;
  ControllerSource(const ControllerSource&) = delete;
  ControllerSource& operator=(const ControllerSource&) = delete;
  virtual ~ControllerSource() = default;

  /// `parameters`: a JSON object. `model` contains the robot's bodies; later models of the run may have more. @throws
  /// ControllerError.
  virtual std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters,
                                           ControlledRobot robot, const Model& model) const = 0;
  /// Whether a controller must be destroyed before the same thread creates another one.
  virtual bool one_at_a_time() const { return false; }
};

}  // namespace grapnel
