#pragma once

/// @file
/// The tree of a YAML document with the place of every value and key.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel {

struct NodeEntry;

/// A value. Only the members of its kind are in use.
struct Node {
  enum class Kind { null, scalar, sequence, mapping };
  Kind kind = Kind::null;
  Mark mark;
  std::string text;                // scalar
  bool plain = true;               // scalar: without quotes, so that it may be a number
  std::vector<Node> items;         // sequence
  std::vector<NodeEntry> entries;  // mapping, in the order of the file; a duplicate key occurs twice

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

}  // namespace grapnel
