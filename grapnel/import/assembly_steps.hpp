#pragma once

/// @file
/// The steps of assemble_robot(): rigid groups of links and their tree from the base; valid inertias; paths of mesh
/// files; poses and shapes in the form of robot files.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/import/assemble.hpp"

namespace grapnel {

// ---- Links that move together ----

/// Links and joints by their indices, as a tree: every link but the root is the child of one joint.
struct LinkTree {
  int root = -1;
  std::vector<int> parent, child;              // per joint: links
  std::vector<int> carrier;                    // per link: the joint whose child it is; -1: none
  std::vector<std::vector<int>> child_joints;  // per link, in the order of the file
};

/// Empty after errors: unknown links, a link carried by two joints, cycles, several roots.
std::optional<LinkTree> link_tree(const SourceModel& model, FaultList& faults);

/// Per joint the pose X_PC of its child, if it does not move: fixed joints, locked ones, and those that follow a locked
/// joint. Empty for joints that move; those with SourceJoint::mimic move with another.
std::vector<std::optional<Posed>> settle_joints(const SourceModel& model, const ImportOptions& options,
                                                std::vector<ImportDecision>& decisions, FaultList& faults);

/// A link in the frame of its group.
struct GroupedLink {
  int link = -1;
  Posed X_GL = Posed::identity();
};

/// Links that move as one rigid body.
struct LinkGroup {
  std::string name;
  Mark mark;
  std::vector<GroupedLink> links;  // the first is nearest to the base
  int parent = -1;                 // group; -1: this is the base
  int joint = -1;                  // of the model, that carries it; -1: this is the base
  bool is_reversed = false;        // the joint's child carries its parent
  Posed X_PF = Posed::identity();  // joint frame in the parent group's frame; at zero it is this group's frame
};

/// The robot as groups, parents first, arm by arm. Bodies separated from the base by a free joint at the root are
/// omitted.
struct GroupedLinks {
  std::vector<LinkGroup> groups;
  std::vector<int> group_of;  // per link; -1: omitted
  int world = -1;             // the link that represents the world and is not part of the robot; -1: none
};

/// Empty after faults: an unknown base, free joints that are not at the root, several free bodies without a choice.
std::optional<GroupedLinks> group_links(const SourceModel& model, const LinkTree& tree,
                                        const std::vector<std::optional<Posed>>& settled, const ImportOptions& options,
                                        std::vector<ImportDecision>& decisions, FaultList& faults);

/// A joint that becomes a reaction wheel of the base.
struct WheelOfJoint {
  int joint = -1;
  std::vector<int> links;  // that turn with it
  Vector3d axis;           // in the base's frame
  double inertia = 0;      // about it, of all that turns [kg m^2]
};

/// The wheels named by the user, after settle_joints(): on links of the base, carrying balanced rotors. Others are
/// errors.
std::vector<WheelOfJoint> wheels_of_joints(const SourceModel& model, const LinkTree& tree, const GroupedLinks& grouped,
                                           const ImportOptions& options, std::vector<ImportDecision>& decisions,
                                           FaultList& faults);

/// Places by name, for messages and look-ups.
template <class Named>
std::map<std::string, int, std::less<>> indices_of(const std::vector<Named>& list) {
  std::map<std::string, int, std::less<>> result;
  for (std::size_t i = 0; i < list.size(); ++i) result.emplace(list[i].name, static_cast<int>(i));
  return result;
}
template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& list) {
  std::vector<std::string> names;
  for (const Named& one : list) names.push_back(one.name);
  return names;
}

// ---- Inertias ----
//
// A body's principal moments are sums of two of three second moments of its mass, none of which is negative. Therefore
// no moment is above the sum of the others.

/// I = axes diag(values) axes^T, values in ascending order.
struct PrincipalMoments {
  Vector3d values;
  Rotationd axes;
};
PrincipalMoments principal_moments(const Symmetric3d& inertia);

/// Whether the inertia is possible, including thin bodies and points: no second moment is below zero by more
/// than 2.5e-10 of the largest moment, a tolerance for rounded data.
bool is_possible_inertia(const Symmetric3d& inertia);

/// The possible inertia nearest in the Frobenius norm; itself if it is possible. `flattest`: how small second moments
/// may be, relative to the largest moment; above 0 the result is positive definite unless `inertia` is zero.
Symmetric3d nearest_possible_inertia(const Symmetric3d& inertia, double flattest = 0);

/// For a tensor with a single principal moment I, as in planar models: the tensor of a thin disc perpendicular to its
/// axis, with I/2 about the other two axes. Empty for any other tensor.
std::optional<Symmetric3d> disc_of_planar_inertia(const Symmetric3d& inertia);

/// Mass, centre of mass and inertia of all links of a group together, in its frame; empty if none has mass. Impossible
/// tensors are errors, or repaired if requested; likewise a total inertia without thickness.
std::optional<SourceInertia> weigh(const SourceModel& model, const LinkGroup& group, const ImportOptions& options,
                                   std::vector<ImportDecision>& decisions, FaultList& faults);

// ---- Mesh files ----

/// An existing mesh file, or the reason for its absence.
struct FoundMesh {
  std::filesystem::path file;  // empty: none
  std::string why_not;         // a clause: ".ply files are not read; .stl, .obj and .dae are"
};

/// Resolves a path in the source: package://NAME/rest and similar forms by the folders of the user, else in a folder of
/// that name beside the source or above it, else in the folders above it as if one of these were the package; file://,
/// absolute paths, paths relative to the source.
FoundMesh find_mesh(const std::string& named, const ImportOptions& options);

// ---- Poses and shapes in trees of robot files (docs/formats/robot.md) ----

/// Without the sign of zero.
Node vector_node_of(const Vector3d& v, const Mark& mark);
bool is_identity(const Posed& X);
/// Replaces the pose in a mapping by position and quaternion_wxyz (rpy for half turns about z), without zero parts.
void put_pose(Node& mapping, const Posed& X, const Mark& mark);
Node pose_node(const Posed& X, const Mark& mark);
/// The pose in a mapping; identity if there is no valid one.
Posed pose_in(const Node& mapping);

/// A shape of a body in whose frame that of the shape's owner is X_BL; `file` is a mesh's path.
Node shape_node(const Geometry& shape, const Posed& X_BL, const std::string& file, const Mark& mark);

}  // namespace grapnel
