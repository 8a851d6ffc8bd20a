#pragma once

/// @file
/// Controllers of the calling program. They have the inputs, outputs, units and frames of plugins in C, which
/// grapnel_controller.h documents. Public, kept stable.

#include <Eigen/Core>
#include <functional>
#include <string>

#include "grapnel/api/error.hpp"
#include "grapnel/api/problem.hpp"
#include "grapnel/plugin/grapnel_controller.h"

namespace grapnel {

using ControllerInput = grapnel_controller_input;
using ControllerOutput = grapnel_controller_output;

/// The true model of the servicer and all bodies that it holds, with N velocities: see grapnel_controller_access. Valid
/// during the call. @throws std::runtime_error.
class ControllerModel {
 public:
  ControllerModel(const grapnel_controller_access& access, bool has_free_base)
      : access_(access), base_velocities_(has_free_base ? 6 : 0) {}

  int velocities() const { return access_.velocities(access_.context); }
  Eigen::MatrixXd mass_matrix() const;  // N x N
  Eigen::VectorXd bias() const;         // N
  Momentumd momentum() const;           // about the centre of mass, in W
  /// Of an end-effector, 6 x (N - 6), for a fixed base 6 x N: its twist in W at zero momentum.
  Eigen::MatrixXd generalized_jacobian(const std::string& end_effector) const;

 private:
  const grapnel_controller_access& access_;
  int base_velocities_;
};

/// Called at every sample time of a run, in order. All values of the output are zero on call. An exception ends the
/// run: the result's failure contains its message.
using ControllerUpdate = std::function<void(const ControllerInput&, const ControllerModel&, ControllerOutput&)>;

/// The controller drives the joints wherever ApproachSetup::tracking or PostImpactSetup::joints is `controller`, at the
/// sample times of ControlSetup::timing. `make` is called once per run, from the thread of the run, so each run has a
/// separate controller with its own state; runs of several threads call it concurrently. `name` appears in results.
void set_controller(CaptureProblem& problem, std::function<ControllerUpdate()> make, const std::string& name);

}  // namespace grapnel
