#pragma once

/// @file
/// Mechanics of a model at a state: poses, twists and Jacobians; momentum and energy; mass matrix and bias;
/// generalized Jacobian and the other quantities of a free-floating base; forward and inverse dynamics.
/// Public, kept stable.

#include "grapnel/api/model.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
