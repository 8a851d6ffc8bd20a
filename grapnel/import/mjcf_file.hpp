#pragma once

/// @file
/// The text of an MJCF model, whose elements may be in several files and inherit attributes from default classes.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/import/source_model.hpp"
#include "grapnel/import/xml_file.hpp"

namespace grapnel {

/// An element; `<include>` is replaced by the content of the named file.
struct MjcfElement {
  const XmlFile* file = nullptr;
  pugi::xml_node node;
  std::vector<MjcfElement> children;

  std::string tag() const { return node.name(); }
  bool has(const char* attribute) const { return static_cast<bool>(node.attribute(attribute)); }
  std::string text(const char* attribute) const { return node.attribute(attribute).value(); }
  Mark mark() const { return file->mark(node); }
  Mark mark(const char* attribute) const { return file->mark(node, attribute); }
};

/// All files of a model. Elements and what points to them are valid as long as it lives.
class MjcfFiles {
 public:
  /// Parses `text` of the file `path`, and reads included files, each once. Unreadable files are errors.
  MjcfFiles(const std::filesystem::path& path, std::string text, FaultList& faults);

  /// `<mujoco>`, or null if there is none.
  const MjcfElement* root() const { return root_ ? &*root_ : nullptr; }
  /// Decisions: files found in the folder of the including file, not of the model's file; ignored text.
  const std::vector<ImportDecision>& decisions() const { return decisions_; }
  /// Of the files that are included, in the order of reading.
  const std::string& included_bytes() const { return included_bytes_; }

 private:
  const XmlFile& parse(const std::filesystem::path& path, std::string text);
  void add_children(const XmlFile& file, const pugi::xml_node& node, int depth, std::vector<MjcfElement>& into);
  void include(const XmlFile& file, const pugi::xml_node& node, int depth, std::vector<MjcfElement>& into);

  FaultList& faults_;
  std::filesystem::path folder_;  // of the model's file, from which MuJoCo resolves all names
  std::vector<std::unique_ptr<XmlFile>> files_;
  std::set<std::filesystem::path> loaded_;
  std::map<const XmlFile*, std::filesystem::path> folders_;
  std::vector<ImportDecision> decisions_;
  std::string included_bytes_;
  std::optional<MjcfElement> root_;
  std::size_t elements_ = 0, with_text_ = 0;
  MjcfElement first_with_text_;
};

/// The attributes of an element after its default classes: of several layers that give one, the last counts.
struct MjcfAttributes {
  std::vector<const MjcfElement*> layers;  // default classes from the outside in, the element itself last

  const MjcfElement& element() const { return *layers.back(); }
  /// The layer that gives an attribute; null if none does.
  const MjcfElement* giver(const char* attribute) const;
  /// Where an attribute is given, else the element.
  Mark mark(const char* attribute) const;
  std::string text(const char* attribute, const char* otherwise = "") const;
  /// Empty if not given, or invalid, which is reported.
  std::optional<double> number(const char* attribute, FaultList& faults) const;
  std::optional<Vector3d> vector(const char* attribute, FaultList& faults) const;
  std::optional<std::vector<double>> numbers(const char* attribute, std::size_t count, FaultList& faults) const;
  /// Lists whose first numbers may be given alone: each layer replaces as many of `values` as it gives.
  std::vector<double> overlaid(const char* attribute, std::vector<double> values, FaultList& faults) const;
  /// One of the words; otherwise an error, and the first word.
  std::string word(const char* attribute, std::span<const char* const> words, FaultList& faults) const;
  bool flag(const char* attribute, bool otherwise, FaultList& faults) const;
};

/// The tree of default classes. A class has what its parent had when it was made, as in MuJoCo.
class MjcfDefaults {
 public:
  /// Reads a `<default>` section.
  void read(const MjcfElement& section, FaultList& faults);

  /// An element's attributes; `childclass` is that of the bodies around it, which an own `class` replaces. `kind` is
  /// the name that elements of one family share ("actuator" of all actuators), or their tag.
  MjcfAttributes attributes(const MjcfElement& element, const std::string& kind, const std::string& childclass,
                            FaultList& faults) const;
  bool has(const std::string& name) const { return name.empty() || classes_.contains(name); }
  /// Reports an error at `element` unless the class exists.
  void check_class(const MjcfElement& element, const char* attribute, FaultList& faults) const;

 private:
  using Layers = std::map<std::string, std::vector<const MjcfElement*>>;  // by kind
  void read_class(const MjcfElement& section, Layers& layers, FaultList& faults);

  Layers main_;
  std::string main_name_ = "main";
  std::map<std::string, Layers> classes_;
};

/// "actuator" for the tags of actuators, which share their defaults; other tags unchanged.
std::string mjcf_kind(const std::string& tag);

/// Settings of `<compiler>`, with MuJoCo's defaults (of version 2.3 and later).
struct MjcfCompiler {
  bool degrees = true;
  std::string eulerseq = "xyz";  // upper case: about fixed axes
  bool autolimits = true;        // a range without an explicit `limited` attribute is active
  enum class Inertia { from_element, from_geoms, from_geoms_where_missing };
  Inertia inertia = Inertia::from_geoms_where_missing;
  int first_group = 0, last_group = 5;  // groups of geoms whose mass counts
  double least_mass = 0;                // [kg]
  double least_inertia = 0;             // of every principal moment [kg m^2]
  bool exact_meshes = false;            // exact inertia of meshes of any shape
  bool balance_inertia = false;         // three equal moments if they violate the triangle inequality
  std::optional<double> total_mass;     // [kg]
  std::string meshdir;
  bool strip_paths = false;

  /// An angle of the file [rad].
  double angle(double value) const;
  void read(const MjcfElement& element, FaultList& faults);
};

/// The rotation that pos' companions describe (quat, axisangle, xyaxes, zaxis or euler): from the element's frame to
/// the one around it. Identity if there is none, or after a fault.
Rotationd mjcf_rotation(const MjcfAttributes& attributes, const MjcfCompiler& compiler, FaultList& faults);
/// With `pos`.
Posed mjcf_pose(const MjcfAttributes& attributes, const MjcfCompiler& compiler, FaultList& faults);
/// The minimum rotation that turns z into the direction of `v`; about x if `v` is opposite to z.
Rotationd mjcf_rotation_of_z(const Vector3d& v);
/// Of a quaternion (w, x, y, z) of any length; empty if it has none.
std::optional<Rotationd> mjcf_rotation_of(const std::vector<double>& quaternion_wxyz);

/// Counts ignored elements and attributes without influence on the motion, to report them once per kind.
class MjcfPassedOver {
 public:
  /// Checks the attributes of an element against those that are known of its kind (absent: its tag): others are faults;
  /// those that do not matter are counted.
  void check_attributes(const MjcfElement& element, FaultList& faults, const char* kind = nullptr);
  /// Counts an element; `reason` follows its tag in the sentence.
  void element(const MjcfElement& element, const std::string& reason);

  void say(std::vector<ImportDecision>& decisions) const;

 private:
  struct Count {
    Mark first;
    std::size_t count = 0;
  };
  std::map<std::pair<std::string, std::string>, Count> elements_;   // by tag and reason
  std::map<std::string, std::map<std::string, Count>> attributes_;  // by tag
};

}  // namespace grapnel
