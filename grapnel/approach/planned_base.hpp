#pragma once

/// @file
/// Base model of the planner under attitude control.
///
/// About one of its axes, a base with moment of inertia J rotates by phi under the control torque (6.13), and by phi_0
/// if it floats freely,
///   J phi'' + k_d phi' + k_p phi = -u',   J phi_0'' = -u',   u the arms' angular momentum about that axis         (1)
/// so that at the circular frequency w
///   J w^2 |phi_0 - phi| = |k_p + i k_d w| |phi|                                                                   (2)
/// The joint motion lasts T, and w = 2 pi/T. If J w^2 is at most |k_p + i k_d w|, an attitude-controlled base (phi = 0)
/// is the better approximation than a floating base (phi = phi_0).

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Whether planning treats a base under this control as attitude-controlled: by (2) about all three axes, or because
/// the control has gains about all axes and feeds forward the joints' reaction. Depends on the gains alone; torque
/// limits, actuators and the initial base motion are not considered. `inertia`: of the servicer about its centre of
/// mass, in B [kg m^2]. `duration`: T of the shortest joint motion [s].
bool keeps_attitude(const BaseControlSetup& control, const Symmetric3d& inertia, double duration);

}  // namespace grapnel
