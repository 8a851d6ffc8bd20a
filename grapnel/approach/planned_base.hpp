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
/// since the control feeds forward what the joints' motion takes. `inertia`: of the servicer about its centre of mass,
/// in B [kg m^2]. `duration`: of the approach, T [s]; all of it also where the rest is planned anew, for which the base
/// is then taken for what it was.
bool keeps_attitude(const BaseControlSetup& control, const Symmetric3d& inertia, double duration);

}  // namespace grapnel
