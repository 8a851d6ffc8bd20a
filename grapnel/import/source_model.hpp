#pragma once

/// @file
/// A robot as a URDF or MJCF file describes it, before Grapnel decides what its base is, which links move and what each
/// weighs. The readers of both formats fill it; assemble_robot() makes a robot file of it. Every value carries the
/// place where it stands, so that faults and decisions can name it.

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

/// Mass and inertia as they stand in the file; nothing has been judged.
struct SourceInertia {
  Mark mark;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the link's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in the axes of the link's frame [kg m^2]
};

/// A shape of a link. `mesh_file` is the path as the source says it ("package://arm/meshes/link.stl").
struct SourceShape {
  Mark mark;
  Geometry shape;  // in the link's frame; of a mesh without its triangles: size is the scale, X_BG the file's frame
  std::string mesh_file;
  bool is_visual = false;  // for looks only; used where a link has no collision shape
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

/// Something that the importer decided, left out or assumed: one line for the user.
struct ImportDecision {
  Mark mark;               // of what it is about
  std::string text;        // a sentence: "joint 'gripper' follows 'finger' (mimic) and is locked at 0.02 m"
  std::string about = {};  // name of the link or joint beside which it is written; empty: of the whole
};

struct SourceModel {
  std::string name;
  std::vector<SourceLink> links;    // unique names; those of the file, in its order
  std::vector<SourceJoint> joints;  // likewise
  std::vector<SourceFrame> frames;
  std::vector<ImportDecision> decisions;  // of the reader; assemble_robot() adds its own
  std::string further_bytes;  // of files that this one includes, in the order of reading: for those who hash inputs
};

class XmlFile;

/// URDF as it is found in the wild: links, joints and transmissions of a `<robot>`, taken as they stand. What Grapnel
/// has no use for is left out, with a line per kind that says so. Faults, at their places: what is no URDF or still a
/// xacro file, names that lack or occur twice, values that are no numbers, types of joints that do not exist. Whether
/// links and joints form a tree is not looked at.
SourceModel read_urdf(const XmlFile& file, FaultList& faults);

/// The triangles in a mesh file; null where they cannot be had, with the reason.
using MeshReader =
    std::function<std::shared_ptr<const TriangleMesh>(const std::filesystem::path& file, std::string& why_not)>;

/// MJCF, MuJoCo's format: a file, whose content is `text`, and what it includes. The robot is the tree below the body
/// with a free joint; without one, what is jointed to the world. Joint coordinates are MuJoCo's; the frame of a link
/// has its body's axes and its origin at the joint. Mass matrix and bias are those that MuJoCo computes; what would
/// change the motion and cannot be read is a fault, all else that is passed over is a decision.
/// docs/formats/import-mjcf.md says what is taken and how. Without a reader no inertia comes from meshes. After faults
/// the model is what could be read.
SourceModel read_mjcf(const std::filesystem::path& file, std::string text, FaultList& faults,
                      const MeshReader& read_mesh = {});

}  // namespace grapnel
