#pragma once

/// @file
/// Where a controller of the user's own comes from, if it is no library by the C interface: an FMU, or a program that
/// uses Grapnel.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// The robot that a controller of the user's own drives, by names in the model.
struct ControlledRobot {
  std::string base;                        // body
  std::vector<std::string> joints;         // in the controller's order
  std::vector<std::string> end_effectors;  // frames
  std::vector<std::string> wheels;         // joints
  Vector3d gravity = Vector3d::zero();     // [m/s^2]
  // The frame in which the run computes, see MovingFrame: at t = 0, in W [m]; [m/s].
  Vector3d origin = Vector3d::zero();
  Vector3d velocity = Vector3d::zero();
  bool commands_base = false;
};

/// Makes controllers, one per run. Thread safety: any number of threads.
class ControllerSource {
 public:
  ControllerSource() = default;
  ControllerSource(const ControllerSource&) = delete;
  ControllerSource& operator=(const ControllerSource&) = delete;
  virtual ~ControllerSource() = default;

  /// `parameters`: JSON, an object. `model` has the robot's bodies; the run's later ones may have more.
  /// @throws ControllerError.
  virtual std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters,
                                           ControlledRobot robot, const Model& model) const = 0;
  /// Whether a controller has to be gone before the same thread makes another one.
  virtual bool one_at_a_time() const { return false; }
};

}  // namespace grapnel
