#pragma once

/// @file
/// What planning takes the base for while attitude control acts on it.
///
/// About one of its axes a base with the moment of inertia J turns under the control torque (6.13) by phi, and by phi_0
/// if it floats freely,
///   J phi'' + k_d phi' + k_p phi = -u',   J phi_0'' = -u',   u the arms' angular momentum about that axis         (1)
/// so that at the circular frequency w
///   J w^2 |phi_0 - phi| = |k_p + i k_d w| |phi|                                                                   (2)
/// The joints' motion lasts T, and w = 2 pi/T. Where J w^2 is at most |k_p + i k_d w| the base is nearer to one that
/// keeps its attitude (phi = 0) than to one that floats (phi = phi_0).

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Whether a base under this control is planned with as one that keeps its attitude: by (2) about all three axes, or
/// since the control has gains about all of them and feeds forward what the joints' motion takes. By gains alone: how
/// much torque the control's limit and the actuators leave, and what the base does as the approach begins, is not
/// looked at. `inertia`: of the servicer about its centre of mass, in B [kg m^2]. `duration`: T, of the joints'
/// shortest motion [s].
bool keeps_attitude(const BaseControlSetup& control, const Symmetric3d& inertia, double duration);

}  // namespace grapnel
