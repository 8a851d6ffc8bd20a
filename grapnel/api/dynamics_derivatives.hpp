#pragma once

/// @file
/// Analytical derivatives of forward and inverse dynamics. Public, kept stable.

#include "grapnel/api/model.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
