#pragma once

/// @file
/// Values given beside a file. Thread safety: a free function.

#include "grapnel/scenario/node.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {

/// "--set path=value", as faults name it.
std::string override_text(const Override& change);

/// Sets what the override's path names; keys that are absent are created, so that a wrong one is found by the check of
/// the structure, which knows what was meant.
void apply_override(Node& root, const Override& change, FaultList& faults);

}  // namespace grapnel
