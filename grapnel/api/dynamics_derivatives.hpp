#pragma once

/// @file
/// Analytical derivatives of forward and inverse dynamics, of single states and of many in SIMD lanes. Public, kept
/// stable.

#include "grapnel/api/model.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/lanes/batched_derivatives.hpp"
