#pragma once

/// @file
/// Values given beside a file. Thread safety: a free function.

#include <optional>
#include <string>
#include <vector>

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

/// One step of the way to a value: a key of a mapping, or an item of a list.
struct PathStep {
  std::string key;        // of a mapping
  std::size_t index = 0;  // of a list, whatever the path called the item
  bool is_index = false;
};

/// The steps along a path; keys may be absent, items of lists not. Empty after a fault.
std::vector<PathStep> path_steps(Node root, const std::string& path, const Mark& mark, FaultList& faults);

}  // namespace grapnel
