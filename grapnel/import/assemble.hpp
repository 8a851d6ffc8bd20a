#pragma once

/// @file
/// Builds a robot file from a URDF or MJCF model. The model has links and joints; the rules of docs/formats/import.md
/// determine the base, the rigid groups of links, the end-effectors and the corrections of data. Every decision is
/// reported.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "grapnel/import/source_model.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// A name given by the user, with its location.
struct StatedName {
  std::string name;
  Mark mark;
};
struct LockedJoint {
  enum class WrittenAs { number, angle, length };
  std::string joint;
  double value = 0;  // [rad or m]
  Mark mark;
  WrittenAs written_as = WrittenAs::number;  // kind of its unit
};
/// Folder of a ROS package: package://NAME/... is below it.
struct PackageFolder {
  std::string name;
  std::filesystem::path folder;
};

/// Options of the user.
struct ImportOptions {
  StatedName base;  // the link that becomes the base; no name: the root
  std::vector<LockedJoint> locked;
  std::vector<StatedName> wheels;         // joints that become reaction wheels of the base
  std::vector<StatedName> end_effectors;  // links or frames; empty: the outermost links
  std::vector<PackageFolder> packages;
  bool repair_inertia = false;  // replace physically impossible inertias by the nearest possible tensor
  bool is_carried = false;      // the base is mounted on another body and may have no mass

  // Set by the caller.
  std::filesystem::path source;  // the file that was read
  std::filesystem::path place;   // the file that will name the meshes, relative to its folder
  /// Why an existing mesh file cannot be used; empty: it can. Null: mesh files are not checked.
  std::function<std::string(const std::filesystem::path&)> mesh_fault;
};

/// The content of a robot file (docs/formats/robot.md), each value with its location in the source.
struct ImportedRobot {
  Node tree;                              // with decisions as comments at their objects
  std::vector<ImportDecision> decisions;  // all of them: those of the reader first
  std::string comment;                    // decisions about the whole robot, one line each
};

/// Empty after faults.
std::optional<ImportedRobot> assemble_robot(const SourceModel& model, const ImportOptions& options, FaultList& faults);

/// Where a robot is mounted on another.
struct Mount {
  std::string link;  // of the other; empty: its base
  Posed X_LM = Posed::identity();
  Mark mark;
};

/// Mounts a robot's tree on that of a bus: its links, and its end-effectors after those of the bus. Its base, if it has
/// a mass, becomes a link on a fixed joint `joint`; otherwise its children become children of the bus. Names are
/// unchanged, so they must differ. Reports an unknown link of the bus as an error.
void mount_robot(Node& bus, Node robot, const Mount& mount, const std::string& joint, FaultList& faults);

/// Adds a prefix to all names of a robot's tree: bodies, joints, end-effectors.
void prefix_names(Node& robot, const std::string& prefix);

}  // namespace grapnel
