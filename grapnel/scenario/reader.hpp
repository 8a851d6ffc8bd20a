#pragma once

/// @file
/// Values from a Node tree whose structure has been checked, and the checks that a schema cannot express. What is
/// absent or of the wrong kind has been reported before: the readers return a neutral value for it without a word, so
/// that everything else can still be checked.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// The part of a mapping, or an empty node.
const Node& part(const Node& mapping, std::string_view key);

std::string text_at(const Node& mapping, std::string_view key);
/// Empty unless there is a number; it may be infinite.
std::optional<double> number_at(const Node& mapping, std::string_view key);
std::optional<Vector3d> vector_at(const Node& mapping, std::string_view key);
bool boolean_at(const Node& mapping, std::string_view key);
/// A vector that must have length 1; `name` is the value's in messages.
Vector3d unit_vector_of(const Node& node, const std::string& name, FaultList& faults);
Vector3d unit_vector_at(const Node& mapping, std::string_view key, const std::string& path, FaultList& faults);

/// Meshes by what geometry.file says; null for one that could not be read, which has been reported.
using Meshes = std::map<std::string, std::shared_ptr<const TriangleMesh>, std::less<>>;

struct ReadRobot;

/// What values need to be read besides their tree.
struct ReadScope {
  FaultList& faults;
  const Meshes& meshes;               // that geometry.file names
  const ReadRobot* robot = nullptr;   // to which joint values belong; null: none
  RobotSetup* robot_setup = nullptr;  // of the robot that is read, which keeps shapes and ratings in lists by name
};

/// Reads the keys of a mapping into the structure that the type describes, with all that is below: numbers, names,
/// structures and lists of them, and values in forms of their own (forms.hpp). What is absent or faulty stays as it is,
/// and what has no meaning beside what has been read (Field::when()) is passed over. `path` leads to the mapping.
void read_members(const Node& mapping, const Type& type, const std::string& path, void* structure,
                  const ReadScope& scope);

/// Reads all that a mapping says into a structure that holds all of it: as the other, with values that may be written
/// in several ways (alternatives). A value that cannot be what its member holds leaves it as it is, and so does one in
/// a form of its own.
void read_structure(const Node& mapping, const Type& type, void* structure);

/// Results are filed under the names of things: a fault where a name cannot be a folder's.
void check_name(const std::string& name, const Mark& mark, const std::string& path, FaultList& faults);

/// Names of one kind of thing and where they were given.
class NameTable {
 public:
  explicit NameTable(std::string kind) : kind_(std::move(kind)) {}
  /// Takes the "name" of an entry; reports one that cannot be a name or occurs twice. An entry without a name makes the
  /// table incomplete.
  void add_from(const Node& entry, const std::string& path, FaultList& faults);
  /// Whether `name` is there, else a fault at the mark. True also where faults elsewhere leave the names in doubt.
  bool expect(const std::string& name, const Mark& mark, const std::string& path, FaultList& faults) const;
  bool contains(const std::string& name) const { return marks_.contains(name); }
  bool is_duplicate(const std::string& name) const { return duplicates_.contains(name); }
  const std::vector<std::string>& names() const { return names_; }
  void make_incomplete() { complete_ = false; }
  bool complete() const { return complete_; }

 private:
  std::string kind_;
  std::vector<std::string> names_;
  std::map<std::string, Mark, std::less<>> marks_;
  std::set<std::string, std::less<>> duplicates_;
  bool complete_ = true;
};

/// "dotted.path"; a prefix may be empty.
std::string below(const std::string& path, std::string_view key);
std::string item(const std::string& path, std::size_t index);

}  // namespace grapnel
