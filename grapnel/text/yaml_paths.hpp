#pragma once

/// @file
/// Values named by paths such as targets[0].mass, and values given beside a file.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// A value that replaces, or adds to, what the file says. The path names keys, list items by index and named items by
/// name: `approach.duration`, `targets[0].mass`, `targets.target-1.mass`, `robot.base.mass` (also where the robot has a
/// file of its own). The value is YAML: `10`, `[1, 0, 0]`, `{match: twist}`.
struct Override {
  std::string path;
  std::string value;
};

/// Splits the argument of --set at its first "=". @throws InputError if there is none.
Override parse_override(const std::string& argument);

/// What a change of a value puts in its place. The mark is where it was asked for; `text` is the value as "--set
/// path=text" would say it.
struct Change {
  std::string path;
  Mark mark;
  Node value;
  std::string text;
};

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
