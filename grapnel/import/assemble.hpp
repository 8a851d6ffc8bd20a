#pragma once

/// @file
/// A robot file from what a URDF or MJCF file describes. The file says links and joints; what of it is the base, what
/// moves as one body, what may be an end-effector and what data have to be corrected is decided here, by rules that
/// docs/formats/import.md states. Every decision is reported.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "grapnel/import/source_model.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// A name that the user gave, and where.
struct StatedName {
  std::string name;
  Mark mark;
};
struct LockedJoint {
  enum class WrittenAs { number, angle, length };
  std::string joint;
  double value = 0;  // [rad or m]
  Mark mark;
  WrittenAs written_as = WrittenAs::number;  // with which kind of unit
};
/// Where the files of a ROS package are: package://NAME/... is below the folder.
struct PackageFolder {
  std::string name;
  std::filesystem::path folder;
};

/// What the user chose.
struct ImportOptions {
  StatedName base;  // the link that becomes the base; no name: the root
  std::vector<LockedJoint> locked;
  std::vector<StatedName> wheels;         // joints that become reaction wheels of the base
  std::vector<StatedName> end_effectors;  // links or frames; empty: the outermost links
  std::vector<PackageFolder> packages;
  bool repair_inertia = false;  // take the nearest possible tensor where no body can have what the file says
  bool is_carried = false;      // the base goes onto something else: it may be without mass

  // Of the caller.
  std::filesystem::path source;  // the file that was read
  std::filesystem::path place;   // the file that will name the meshes, relative to its folder
  /// Why a mesh file that is there cannot be used; empty: it can. Null: nobody looks into it.
  std::function<std::string(const std::filesystem::path&)> mesh_fault;
};

/// The content of a robot file (docs/formats/robot.md), each value with its place in the source.
struct ImportedRobot {
  Node tree;                              // with decisions as comments beside what they concern
  std::vector<ImportDecision> decisions;  // all of them: those of the reader first
  std::string comment;                    // those that concern the whole, a line each
};

/// Empty after faults.
std::optional<ImportedRobot> assemble_robot(const SourceModel& model, const ImportOptions& options, FaultList& faults);

/// Where a robot is mounted on another.
struct Mount {
  std::string link;  // of the other; empty: its base
  Posed X_LM = Posed::identity();
  Mark mark;
};

/// Puts a robot's tree onto that of a bus: its links, and its end-effectors after those of the bus. Its base, if it has
/// a mass, becomes a link on a fixed joint `joint`; else what hangs on it hangs on the bus. Names are as they are, so
/// they must differ. Faults: a link that the bus does not have.
void mount_robot(Node& bus, Node robot, const Mount& mount, const std::string& joint, FaultList& faults);

/// Puts a prefix before all names of a robot's tree: bodies, joints, end-effectors.
void prefix_names(Node& robot, const std::string& prefix);

}  // namespace grapnel
