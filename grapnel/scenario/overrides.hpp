#pragma once

/// @file
/// Values given beside a file. Thread safety: a free function.

#include <optional>
#include <string>

#include "grapnel/scenario/node.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/scenario_files.hpp"

namespace grapnel {

/// "--set path=value", as faults name it.
std::string override_text(const Override& change);

/// Sets what the change's path names; keys that are absent are created, so that a wrong one is found by the check of
/// the structure, which knows what was meant.
void apply_change(Node& root, const Change& change, FaultList& faults);

/// What a path names, if it is there.
std::optional<Node> value_at(Node root, const std::string& path);

}  // namespace grapnel
