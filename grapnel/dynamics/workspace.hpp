#pragma once

/// @file
/// The scratch of the functions of forward_dynamics.hpp and mass_matrix.hpp, whose memory the kernels use.

#include <vector>

#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// See forward_dynamics.hpp.
struct Workspace {
  DynamicsWorkspace<double> kernel;
  std::vector<Wrenchd> link_wrench;  // external wrenches, gathered on the links
  std::vector<double> force;         // generalized forces written by the kernels
  std::vector<double> square;        // velocities x velocities
  Kinematics kinematics;

  explicit Workspace(const Model& model);
};

}  // namespace grapnel
