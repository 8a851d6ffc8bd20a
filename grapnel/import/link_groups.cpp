#include "grapnel/import/assembly_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

bool has_mass(const SourceLink& link) { return link.inertia && link.inertia->mass > 0; }

class LinkGrouper {
 public:
  LinkGrouper(const SourceModel& model, const LinkTree& tree, const std::vector<std::optional<Posed>>& settled,
              const ImportOptions& options, std::vector<ImportDecision>& decisions, FaultList& faults)
      : model_(model), tree_(tree), settled_(settled), options_(options), decisions_(decisions), faults_(faults) {}

  std::optional<GroupedLinks> group() {
    const std::size_t before = faults_.size();
    find_root_cluster();
    const int base = choose_base();
    if (faults_.size() > before) return {};
    result_.group_of.assign(model_.links.size(), -1);
    grow(base);
    name_groups(base);
    check_free_joints();
    say_what_is_left();
    say_base(base);
    if (faults_.size() > before) return {};
    return std::move(result_);
  }

 private:
  bool holds(int joint) const { return settled_[joint].has_value(); }

  // The links that are fixed to the root, and whether one of them has mass.
  void find_root_cluster() {
    in_root_cluster_.assign(model_.links.size(), false);
    std::vector<int> open{tree_.root};
    while (!open.empty()) {
      const int link = open.back();
      open.pop_back();
      in_root_cluster_[link] = true;
      root_has_mass_ = root_has_mass_ || has_mass(model_.links[link]);
      root_is_something_ = root_is_something_ || has_mass(model_.links[link]) || !model_.links[link].shapes.empty();
      for (const int joint : tree_.child_joints[link]) {
        if (holds(joint))
          open.push_back(tree_.child[joint]);
        else if (is_free(model_.joints[joint]))
          free_.push_back(joint);
        else
          root_moves_something_ = root_is_something_ = true;
      }
    }
    // In the order of the file.
    std::sort(free_.begin(), free_.end());
    const SourceLink& root = model_.links[tree_.root];
    if (root.name == "world" && !has_mass(root)) result_.world = tree_.root;
  }

  // Free joints at the root separate free bodies.
  bool is_cut(int joint) const {
    return !holds(joint) && is_free(model_.joints[joint]) && in_root_cluster_[tree_.parent[joint]];
  }

  int choose_base() {
    if (!options_.base.name.empty()) {
      const auto links = indices_of(model_.links);
      const auto it = links.find(options_.base.name);
      if (it != links.end()) return it->second;
      faults_.add(options_.base.mark, fmt::format("unknown link {} for the base{}", in_quotes(options_.base.name),
                                                  suggestion(options_.base.name, names_of(model_.links), "links")));
      return -1;
    }
    if (!free_.empty()) {
      std::vector<std::string> names;
      if (root_has_mass_ || root_moves_something_) names.push_back(model_.links[tree_.root].name);
      for (const int joint : free_) names.push_back(model_.links[tree_.child[joint]].name);
      if (names.size() == 1) return tree_.child[free_[0]];
      faults_.add(model_.joints[free_.back()].mark,
                  fmt::format("there are {} free bodies, {}: select the robot's base", names.size(), some_of(names)));
      return -1;
    }
    // The world is not a satellite: the only body fixed to it is the base.
    const std::vector<int>& below_root = tree_.child_joints[tree_.root];
    if (result_.world >= 0 && below_root.size() == 1 && holds(below_root[0])) return tree_.child[below_root[0]];
    return tree_.root;
  }

  // A planned group, before its links are known.
  struct Begun {
    LinkGroup group;
    int link;  // nearest to the base
    Posed X_GL = Posed::identity();
  };
  // A link of a group to be visited, and its joint.
  struct Reached {
    GroupedLink at;
    int joint;
  };

  // From the base outwards, arm by arm in the order of the file.
  void grow(int base) {
    std::vector<Begun> open(1);
    open[0].link = base;
    while (!open.empty()) {
      Begun begun = std::move(open.back());
      open.pop_back();
      std::vector<Begun> beyond = fill(std::move(begun));
      std::sort(beyond.begin(), beyond.end(),
                [](const Begun& a, const Begun& b) { return a.group.joint > b.group.joint; });
      std::move(beyond.begin(), beyond.end(), std::back_inserter(open));
    }
  }

  // Adds the links fixed to the group's first link; returns the groups on moving joints.
  std::vector<Begun> fill(Begun begun) {
    const int number = static_cast<int>(result_.groups.size());
    std::vector<Reached> open{{{begun.link, begun.X_GL}, begun.group.joint}};
    LinkGroup& group = result_.groups.emplace_back(std::move(begun.group));
    std::vector<Begun> beyond;
    while (!open.empty()) {
      const Reached here = open.back();
      open.pop_back();
      result_.group_of[here.at.link] = number;
      group.links.push_back(here.at);
      std::vector<int> joints = tree_.child_joints[here.at.link];
      if (tree_.carrier[here.at.link] >= 0) joints.push_back(tree_.carrier[here.at.link]);
      // The stack reverses the order.
      for (auto joint = joints.rbegin(); joint != joints.rend(); ++joint) {
        if (*joint == here.joint || is_cut(*joint)) continue;
        const bool reversed = tree_.child[*joint] == here.at.link;
        if (holds(*joint))
          open.push_back({across(here.at, *joint, reversed), *joint});
        else
          beyond.push_back(begin_beyond(here.at, *joint, reversed, number));
      }
    }
    return beyond;
  }

  GroupedLink across(const GroupedLink& from, int joint, bool reversed) const {
    const Posed& X_PC = *settled_[joint];
    return {reversed ? tree_.parent[joint] : tree_.child[joint], from.X_GL * (reversed ? inverse(X_PC) : X_PC)};
  }

  // X_PC(q) = X_PJ motion(q). The other way round X_CP(q) = motion(q)^-1 X_PJ^-1, and motion(q)^-1 is the motion by the
  // same q about the opposite axis: the child's frame carries a joint there, and the parent's group has its frame at J.
  Begun begin_beyond(const GroupedLink& from, int joint, bool reversed, int parent) const {
    const Posed& X_PJ = model_.joints[joint].X_PJ;
    Begun begun;
    begun.group.parent = parent;
    begun.group.joint = joint;
    begun.group.is_reversed = reversed;
    begun.group.X_PF = reversed ? from.X_GL : from.X_GL * X_PJ;
    begun.link = reversed ? tree_.parent[joint] : tree_.child[joint];
    if (reversed) begun.X_GL = inverse(X_PJ);
    return begun;
  }

  // A group has the name of the link that the source's joint carries, the base that of the chosen link.
  void name_groups(int base) {
    for (LinkGroup& group : result_.groups) {
      int top = group.links[0].link;
      for (const GroupedLink& one : group.links) {
        const int carrier = tree_.carrier[one.link];
        if (carrier < 0 || !holds(carrier)) top = one.link;
      }
      if (group.parent < 0) top = base;
      if (top == result_.world && group.links.size() > 1 && group.parent >= 0)
        top = group.links[group.links[0].link == top ? 1 : 0].link;
      group.name = model_.links[top].name;
      group.mark = model_.links[top].mark;
    }
  }

  void check_free_joints() {
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      const SourceJoint& joint = model_.joints[j];
      if (!is_free(joint) || holds(static_cast<int>(j)) || is_cut(static_cast<int>(j)) ||
          result_.group_of[tree_.parent[j]] < 0)
        continue;
      faults_.add(
          joint.mark,
          fmt::format("joint {} is {}: this is possible only between an empty root and the base; lock it at 0 "
                      "to fix it",
                      in_quotes(joint.name), joint.kind == SourceJoint::Kind::floating ? "floating" : "planar"));
    }
  }

  // Bodies separated from the base by free joints at the root.
  void say_what_is_left() {
    const auto leave_out = [&](int link, const SourceJoint& joint) {
      decisions_.push_back(
          {model_.links[link].mark,
           fmt::format("link {} and its child links are omitted: the free joint {} separates them from the robot",
                       in_quotes(model_.links[link].name), in_quotes(joint.name))});
    };
    for (const int j : free_) {
      const SourceJoint& joint = model_.joints[j];
      if (result_.group_of[tree_.child[j]] < 0) {
        leave_out(tree_.child[j], joint);
        continue;
      }
      const bool planar = joint.kind == SourceJoint::Kind::planar;
      decisions_.push_back({joint.mark,
                            fmt::format("joint {} is {} the base{}", in_quotes(joint.name),
                                        planar ? "planar and becomes the free joint of" : "the free joint of",
                                        planar ? ", which moves in all six directions" : ""),
                            result_.groups[0].name});
      if (root_is_something_) leave_out(tree_.root, joint);
    }
  }

  void say_base(int base) {
    const LinkGroup& group = result_.groups[0];
    std::vector<std::string> fixed;
    for (const GroupedLink& one : group.links) {
      if (one.link != base && one.link != result_.world) fixed.push_back(model_.links[one.link].name);
    }
    const bool asked = !options_.base.name.empty();
    decisions_.push_back(
        {group.mark,
         fmt::format("the base is link {}{}{}", in_quotes(group.name), asked ? ", as asked for" : "",
                     fixed.empty() ? "" : fmt::format(", with the links fixed to it: {}", some_of(fixed))),
         group.name});
    if (result_.world >= 0 && result_.group_of[result_.world] >= 0 && base != result_.world)
      decisions_.push_back(
          {model_.links[result_.world].mark,
           "link 'world' is not part of the robot: the base floats freely (use mode: fixed to bolt it to the ground)"});
    for (const LinkGroup& one : result_.groups) {
      if (!one.is_reversed) continue;
      const SourceJoint& joint = model_.joints[one.joint];
      decisions_.push_back(
          {joint.mark,
           fmt::format("joint {} is reversed, {} carries {}: the axis is reversed, so that its values keep their "
                       "meaning; the frame of {} is at the joint",
                       in_quotes(joint.name), in_quotes(joint.child), in_quotes(joint.parent), in_quotes(one.name)),
           joint.name});
    }
  }

  const SourceModel& model_;
  const LinkTree& tree_;
  const std::vector<std::optional<Posed>>& settled_;
  const ImportOptions& options_;
  std::vector<ImportDecision>& decisions_;
  FaultList& faults_;
  GroupedLinks result_;
  std::vector<bool> in_root_cluster_;
  std::vector<int> free_;  // joints that part bodies from the root
  bool root_has_mass_ = false, root_moves_something_ = false, root_is_something_ = false;
};

}  // namespace

std::optional<GroupedLinks> group_links(const SourceModel& model, const LinkTree& tree,
                                        const std::vector<std::optional<Posed>>& settled, const ImportOptions& options,
                                        std::vector<ImportDecision>& decisions, FaultList& faults) {
  return LinkGrouper(model, tree, settled, options, decisions, faults).group();
}

}  // namespace grapnel
