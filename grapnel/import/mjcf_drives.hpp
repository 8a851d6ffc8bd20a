#pragma once

/// @file
/// What an MJCF model says about its joints elsewhere than at them: actuators, couplings, tendons.

#include <optional>
#include <utility>

#include "grapnel/import/mjcf_tree.hpp"

namespace grapnel {

/// The range of an attribute that may be switched on and off by another ("limited", "ctrllimited"), in the file's
/// units; empty if it does not limit.
std::optional<std::pair<double, double>> mjcf_range(const MjcfAttributes& given, const char* switched,
                                                    const char* range, MjcfContext& context);

/// A joint's value where its body stands as the file puts it [rad or m].
double mjcf_joint_reference(const MjcfAttributes& joint, MjcfContext& context);

/// Efforts of joints from their actuators, couplings of joints; what of constraints and tendons acts on the motion and
/// has no counterpart is a fault.
void read_mjcf_drives(const MjcfElement& root, const MjcfTree& tree, const MjcfRobot& robot, MjcfContext& context,
                      SourceModel& model);

}  // namespace grapnel
