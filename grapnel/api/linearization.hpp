#pragma once

/// @file
/// Linear models of the equations of motion about a state (linearize()). Public, kept stable.

#include "grapnel/api/model.hpp"
#include "grapnel/dynamics/linearization.hpp"
