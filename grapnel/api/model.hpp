#pragma once

/// @file
/// Mechanical systems: bodies on joints, named frames (ModelBuilder, Model), and their states (State).
/// Public, kept stable.

#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
