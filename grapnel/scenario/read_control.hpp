#pragma once

/// @file
/// Gains of joints and base, from a scenario's tree.

#include "grapnel/scenario/reading.hpp"

namespace grapnel {

/// "kp" and "kd" of a mapping, in joint order.
void read_gains(const Node& node, const std::string& path, Reading& reading, std::vector<double>& kp,
                std::vector<double>& kd);

/// "base_control" of a phase, if there. `is_free` says whether the base floats in this phase; else it is a fault.
std::optional<BaseControlSetup> base_control_at(const Node& phase, const std::string& path, bool is_free,
                                                Reading& reading);

}  // namespace grapnel
