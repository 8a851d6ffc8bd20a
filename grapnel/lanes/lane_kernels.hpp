#pragma once

/// @file
/// The recursive kernels' templates with the scalar that runs them in lanes. Included by the translation units of the
/// instruction sets only: whatever uses it is compiled for one set (grapnel/lanes/CMakeLists.txt).
///
/// A Tree<Pack> has one structure for all lanes (parents, kinds of joints, axes, which frames are rotated, which joints
/// have rotors) and numbers per lane.

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/newton_euler_kernel.hpp"
#include "grapnel/dynamics/root_velocity_kernel.hpp"
#include "grapnel/lanes/lane_sine_cosine.hpp"
