#pragma once

/// @file
/// A robot as described by a URDF or MJCF file, before the selection of its base and the grouping of its links. The
/// readers of both formats fill it; assemble_robot() converts it to a robot file. Every value has its location, for
/// errors and decisions.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/model/geometry.hpp"
#include "grapnel/spatial/spatial_vector.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// Mass and inertia as in the file, unchecked.
struct SourceInertia {
  Mark mark;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the link's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in the axes of the link's frame [kg m^2]
};

/// A shape of a link. `mesh_file` is the path in the source ("package://arm/meshes/link.stl").
struct SourceShape {
  Mark mark;
  Geometry shape;  // in the link's frame; of a mesh without its triangles: size is the scale, X_BG the file's frame
  std::string mesh_file;
  bool is_visual = false;  // visual shape; used if a link has no collision shape
};

struct SourceLink {
  std::string name;
  Mark mark;
  std::optional<SourceInertia> inertia;  // none: the file gives none
  std::vector<SourceShape> shapes;
};

/// The value of this joint is multiplier * (that of `joint`) + offset.
struct SourceMimic {
  Mark mark;
  std::string joint;
  double multiplier = 1, offset = 0;
};

struct SourceJoint {
  enum class Kind { fixed, revolute, continuous, prismatic, floating, planar };
  std::string name;
  Mark mark;
  Kind kind = Kind::fixed;
  std::string parent, child;  // links
  Mark parent_mark, child_mark;
  Posed X_PJ = Posed::identity();  // joint frame in the parent's frame; at zero it is the child's frame
  Vector3d axis{1, 0, 0};          // in the joint's frame, of length 1
  // Limits; none where the file gives none.
  std::optional<double> lower, upper;  // [rad or m]
  std::optional<double> rate;          // [rad/s or m/s]
  std::optional<double> effort;        // [N m or N]
  Mark limit_mark;
  double viscous_friction = 0;  // [N m s/rad or N s/m]
  double coulomb_friction = 0;  // [N m or N]
  double rotor_inertia = 0;     // of the motor about its own axis [kg m^2]
  double gear_ratio = 1;        // motor turns per joint turn
  std::optional<SourceMimic> mimic;
};

inline bool has_axis(const SourceJoint& joint) {
  return joint.kind == SourceJoint::Kind::revolute || joint.kind == SourceJoint::Kind::continuous ||
         joint.kind == SourceJoint::Kind::prismatic;
}
inline bool is_free(const SourceJoint& joint) {
  return joint.kind == SourceJoint::Kind::floating || joint.kind == SourceJoint::Kind::planar;
}

/// A named frame on a link: an MJCF site, a possible end-effector.
struct SourceFrame {
  std::string name;
  Mark mark;
  std::string link;
  Posed X_LF = Posed::identity();
};

/// A decision, omission or assumption of the importer: one line for the user.
struct ImportDecision {
  Mark mark;               // of its object
  std::string text;        // a sentence: "joint 'gripper' follows 'finger' (mimic) and is locked at 0.02 m"
  std::string about = {};  // name of the link or joint for the comment; empty: the whole robot
};

struct SourceModel {
  std::string name;
  std::vector<SourceLink> links;    // unique names; those of the file, in its order
  std::vector<SourceJoint> joints;  // likewise
  std::vector<SourceFrame> frames;
  std::vector<ImportDecision> decisions;  // of the reader; assemble_robot() adds its own
  std::string further_bytes;              // of included files, in the order of reading, for hashes of inputs
};

class XmlFile;

/// Reads URDF: links, joints and transmissions of a `<robot>`, unchanged. Other elements are omitted, with one decision
/// per kind. Errors, with their locations: files that are not URDF or are unexpanded xacro files, missing and duplicate
/// names, invalid numbers, unknown joint types. The tree structure is not checked.
SourceModel read_urdf(const XmlFile& file, FaultList& faults);

/// The triangles in a mesh file; null, with the reason, if they are not available.
using MeshReader =
    std::function<std::shared_ptr<const TriangleMesh>(const std::filesystem::path& file, std::string& why_not)>;

/// MJCF, MuJoCo's format: a file, whose content is `text`, and what it includes. The robot is the tree below the body
/// with a free joint; without one, what is jointed to the world. Joint coordinates are MuJoCo's; the frame of a link
/// has its body's axes and its origin at the joint. Mass matrix and bias are those that MuJoCo computes; what would
/// change the motion and cannot be read is a fault, all else that is passed over is a decision.
/// docs/formats/import-mjcf.md lists the supported elements. Without a reader no inertia comes from meshes. After
/// faults the model is what could be read.
SourceModel read_mjcf(const std::filesystem::path& file, std::string text, FaultList& faults,
                      const MeshReader& read_mesh = {});

}  // namespace grapnel
