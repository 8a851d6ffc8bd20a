#pragma once

/// @file
/// Reads values from a Node tree whose structure has been checked, and performs the checks that a schema cannot
/// express. Absent values and values of the wrong kind have been reported before: the readers silently return a neutral
/// value for them, so that the remaining values can be checked.

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
/// The number, possibly infinite, else empty.
std::optional<double> number_at(const Node& mapping, std::string_view key);
std::optional<Vector3d> vector_at(const Node& mapping, std::string_view key);
bool boolean_at(const Node& mapping, std::string_view key);
/// A vector that must have length 1; `name` is its name in messages.
Vector3d unit_vector_of(const Node& node, const std::string& name, FaultList& faults);
Vector3d unit_vector_at(const Node& mapping, std::string_view key, const std::string& path, FaultList& faults);

/// Meshes by geometry.file; null for a mesh that could not be read, which has been reported.
using Meshes = std::map<std::string, std::shared_ptr<const TriangleMesh>, std::less<>>;

struct ReadRobot;

/// Context for reading values, in addition to their tree.
struct ReadScope {
  FaultList& faults;
  const Meshes& meshes;               // that geometry.file names
  const ReadRobot* robot = nullptr;   // robot of the joint values; null: none
  RobotSetup* robot_setup = nullptr;  // the robot being read, which stores shapes and ratings in lists by name
};

/// Reads the keys of a mapping into the structure that the type describes, recursively: numbers, names, structures and
/// lists of them, and values in special forms (forms.hpp). Absent and invalid values remain unchanged, and keys without
/// meaning for the values read so far (Field::when()) are skipped. `path` is the path of the mapping.
void read_members(const Node& mapping, const Type& type, const std::string& path, void* structure,
                  const ReadScope& scope);

/// Reads a whole mapping into a structure, as read_members(), including values with alternatives. A value of an
/// unsuitable type, and a value in a special form, leaves its member unchanged.
void read_structure(const Node& mapping, const Type& type, void* structure);

/// Results are stored under names: an error if a name cannot be a folder name.
void check_name(const std::string& name, const Mark& mark, const std::string& path, FaultList& faults);

/// Names of one kind of object and their locations in the file.
class NameTable {
 public:
  explicit NameTable(std::string kind) : kind_(std::move(kind)) {}
  /// Adds the "name" of an entry; reports invalid and duplicate names. An entry without a name makes the table
  /// incomplete.
  void add_from(const Node& entry, const std::string& path, FaultList& faults);
  /// Whether `name` exists, else an error at the mark. True also if other errors make the table incomplete.
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
