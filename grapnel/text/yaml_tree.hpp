#pragma once

/// @file
/// The tree of a YAML document with the location of every value and key.

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

/// A value. Only the members of its kind are used.
struct Node {
  enum class Kind { null, scalar, sequence, mapping };
  static constexpr std::uint8_t kRefusedUnit = 255;  // a fault has been added
  Kind kind = Kind::null;
  Mark mark;
  std::string text;   // scalar
  bool plain = true;  // scalar: without quotes, so that it may be a number
  /// For a number that was written with a unit and converted: the index, from 1, among the units of its place. 0: none.
  /// See units.hpp.
  std::uint8_t unit = 0;
  std::vector<Node> items;         // sequence
  std::vector<NodeEntry> entries;  // mapping, in the order of the file; a duplicate key occurs twice
  std::string comment = {};        // lines to write before it; empty after reading
  std::string written = {};        // scalar with `unit`: the original text with the unit

  bool is_mapping() const { return kind == Kind::mapping; }
  bool is_sequence() const { return kind == Kind::sequence; }
  bool is_scalar() const { return kind == Kind::scalar; }

  /// The first entry with the key, or null; null also if this is not a mapping.
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

// Values named by paths such as targets[0].mass, and overrides.

/// A value that replaces a value of the file, or adds one. The path names keys, list items by index and named items by
/// name: `approach.duration`, `targets[0].mass`, `targets.target-1.mass`, `robot.base.mass` (also for a robot in a
/// separate file). The value is YAML: `10`, `[1, 0, 0]`, `{match: twist}`.
struct Override {
  std::string path;
  std::string value;
};

/// Splits the argument of --set at its first "=". @throws InputError if there is none.
Override parse_override(const std::string& argument);

/// The new value of a change. The mark is the location of the request; `text` is the value in the form of "--set
/// path=text".
struct Change {
  std::string path;
  Mark mark;
  Node value;
  std::string text;
};

/// "--set path=value", as in messages.
std::string override_text(const Override& change);

/// Sets the value at the change's path; absent keys are created, so that the structure check reports wrong keys with
/// suggestions.
void apply_change(Node& root, const Change& change, FaultList& faults);

/// The value at a path, or null.
std::optional<Node> value_at(Node root, const std::string& path);

/// One step of a path: a key of a mapping, or an item of a list.
struct PathStep {
  std::string key;        // of a mapping
  std::size_t index = 0;  // in a list, for any form of the item in the path
  bool is_index = false;
};

/// The steps along a path; keys may be absent, items of lists not. Empty after a fault.
std::vector<PathStep> path_steps(Node root, const std::string& path, const Mark& mark, FaultList& faults);

}  // namespace grapnel
