#pragma once

/// @file
/// Which links of a source model move together, and how these groups hang on each other as seen from the base.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/import/assemble.hpp"

namespace grapnel {

/// Links and joints by their indices, as a tree: every link but the root is the child of one joint.
struct LinkTree {
  int root = -1;
  std::vector<int> parent, child;              // per joint: links
  std::vector<int> carrier;                    // per link: the joint whose child it is; -1: none
  std::vector<std::vector<int>> child_joints;  // per link, in the order of the file
};

/// Empty after faults: links that are not there, a link that two joints carry, cycles, several roots.
std::optional<LinkTree> link_tree(const SourceModel& model, FaultList& faults);

/// Per joint the pose X_PC of its child, if it does not move: fixed joints, locked ones, and those that follow another
/// joint, at their value for the other at rest at 0. Empty for joints that move.
std::vector<std::optional<Posed>> settle_joints(const SourceModel& model, const ImportOptions& options,
                                                std::vector<ImportDecision>& decisions, FaultList& faults);

/// A link in the frame of its group.
struct GroupedLink {
  int link = -1;
  Posed X_GL = Posed::identity();
};

/// What moves as one body.
struct LinkGroup {
  std::string name;
  Mark mark;
  std::vector<GroupedLink> links;  // the first is nearest to the base
  int parent = -1;                 // group; -1: this is the base
  int joint = -1;                  // of the model, that carries it; -1: this is the base
  bool is_reversed = false;        // the joint's child carries its parent
  Posed X_PF = Posed::identity();  // joint frame in the parent group's frame; at zero it is this group's frame
};

/// The robot as groups, parents first, arm by arm. What a free joint at the root parts from the base is left out.
struct GroupedLinks {
  std::vector<LinkGroup> groups;
  std::vector<int> group_of;  // per link; -1: left out
  int world = -1;             // the link that stands for the world and is no part of the robot; -1: none
};

/// Empty after faults: an unknown base, free joints that are not at the root, several free bodies without a choice.
std::optional<GroupedLinks> group_links(const SourceModel& model, const LinkTree& tree,
                                        const std::vector<std::optional<Posed>>& settled, const ImportOptions& options,
                                        std::vector<ImportDecision>& decisions, FaultList& faults);

// What several of the steps ask.

inline bool has_axis(const SourceJoint& joint) {
  return joint.kind == SourceJoint::Kind::revolute || joint.kind == SourceJoint::Kind::continuous ||
         joint.kind == SourceJoint::Kind::prismatic;
}
inline bool is_free(const SourceJoint& joint) {
  return joint.kind == SourceJoint::Kind::floating || joint.kind == SourceJoint::Kind::planar;
}

/// Places by name.
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

}  // namespace grapnel
