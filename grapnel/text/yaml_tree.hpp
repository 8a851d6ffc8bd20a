#pragma once

/// @file
/// The tree of a YAML document with the place of every value and key.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel {

struct NodeEntry;

/// A value. Only the members of its kind are in use.
struct Node {
  enum class Kind { null, scalar, sequence, mapping };
  static constexpr std::uint8_t kRefusedUnit = 255;  // a fault has been added
  Kind kind = Kind::null;
  Mark mark;
  std::string text;   // scalar
  bool plain = true;  // scalar: without quotes, so that it may be a number
  /// Of a number that was written with a unit, which it has no longer: which of the place's units it was, from 1. 0:
  /// none. units.hpp says more.
  std::uint8_t unit = 0;
  std::vector<Node> items;         // sequence
  std::vector<NodeEntry> entries;  // mapping, in the order of the file; a duplicate key occurs twice
  std::string comment = {};        // lines to write before it; files that are read leave it empty
  std::string written = {};        // scalar with `unit`: the text as it was, with the unit

  bool is_mapping() const { return kind == Kind::mapping; }
  bool is_sequence() const { return kind == Kind::sequence; }
  bool is_scalar() const { return kind == Kind::scalar; }

  /// The first entry with the key, or null; null also where this is no mapping.
  const NodeEntry* entry(std::string_view key) const;
  NodeEntry* entry(std::string_view key);
  const Node* find(std::string_view key) const;
  Node* find(std::string_view key);
};

struct NodeEntry {
  std::string key;
  Mark mark;  // of the key
  Node value;
};

inline const NodeEntry* Node::entry(std::string_view key) const {
  for (const NodeEntry& e : entries) {
    if (e.key == key) return &e;
  }
  return nullptr;
}
inline NodeEntry* Node::entry(std::string_view key) {
  for (NodeEntry& e : entries) {
    if (e.key == key) return &e;
  }
  return nullptr;
}
inline const Node* Node::find(std::string_view key) const {
  const NodeEntry* e = entry(key);
  return e ? &e->value : nullptr;
}
inline Node* Node::find(std::string_view key) {
  NodeEntry* e = entry(key);
  return e ? &e->value : nullptr;
}

// Values named by paths such as targets[0].mass, and values given beside a file.

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
