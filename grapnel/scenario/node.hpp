#pragma once

/// @file
/// The tree of a YAML document with the place of every value and key. Thread safety: plain values.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/scenario/fault.hpp"

namespace grapnel {

/// A place in a source: a file, or an override (line 0).
struct Mark {
  std::shared_ptr<const std::string> source;
  int line = 0;
  int column = 0;
};

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

/// Collects faults; messages are built where they are found. Stops at kMost: nobody reads more, and input made to be
/// slow stays harmless. What is allowed but hardly meant is a warning: it is kept apart and refuses nothing.
class FaultList {
 public:
  static constexpr std::size_t kMost = 1000;
  /// Longer messages are cut off: lists in them may have thousands of names.
  static constexpr std::size_t kLongestMessage = 2000;  // [bytes]

  void add(const Mark& mark, std::string message) {
    add(Fault{mark.source ? *mark.source : std::string(), mark.line, mark.column, std::move(message)});
  }
  void add(Fault fault) {
    if (faults_.size() > kMost) return;
    if (faults_.size() == kMost) fault.message = "too many faults; the search for more ends here";
    faults_.push_back(cut(std::move(fault)));
  }
  void warn(const Mark& mark, std::string message) {
    warn(Fault{mark.source ? *mark.source : std::string(), mark.line, mark.column, std::move(message)});
  }
  void warn(Fault warning) {
    warning.is_warning = true;
    if (warnings_.size() < kMost) warnings_.push_back(cut(std::move(warning)));
  }
  bool full() const { return faults_.size() > kMost; }
  bool empty() const { return faults_.empty(); }
  std::size_t size() const { return faults_.size(); }
  const std::vector<Fault>& all() const { return faults_; }
  const std::vector<Fault>& warnings() const { return warnings_; }
  /// @throws ScenarioError if there are any.
  void throw_if_any() {
    if (!faults_.empty()) throw ScenarioError(std::move(faults_));
  }

 private:
  static Fault cut(Fault fault) {
    if (fault.message.size() <= kLongestMessage) return fault;
    std::size_t end = kLongestMessage;
    while (end > 0 && (static_cast<unsigned char>(fault.message[end]) & 0xc0) == 0x80) --end;
    fault.message = fault.message.substr(0, end) + "…";
    return fault;
  }

  std::vector<Fault> faults_, warnings_;
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
