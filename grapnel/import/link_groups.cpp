#include "grapnel/import/link_groups.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

bool has_axis(const SourceJoint& joint) {
  return joint.kind == SourceJoint::Kind::revolute || joint.kind == SourceJoint::Kind::continuous ||
         joint.kind == SourceJoint::Kind::prismatic;
}
bool is_free(const SourceJoint& joint) {
  return joint.kind == SourceJoint::Kind::floating || joint.kind == SourceJoint::Kind::planar;
}
const char* unit_of(const SourceJoint& joint) { return joint.kind == SourceJoint::Kind::prismatic ? "m" : "rad"; }

bool has_mass(const SourceLink& link) { return link.inertia && link.inertia->mass > 0; }

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

// ---- The tree ----

void check_roots(const SourceModel& model, LinkTree& tree, FaultList& faults) {
  std::vector<std::string> roots;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (tree.carrier[i] >= 0) continue;
    roots.push_back(model.links[i].name);
    if (tree.root < 0) tree.root = static_cast<int>(i);
  }
  if (roots.size() == 1) return;
  if (roots.empty()) {
    faults.add(model.links[0].mark, "every link is the child of a joint, so there is no root: the joints form a cycle");
    return;
  }
  for (std::size_t i = 0, seen = 0; i < model.links.size(); ++i) {
    if (tree.carrier[i] >= 0 || seen++ == 0) continue;
    faults.add(model.links[i].mark,
               fmt::format("link {} is the child of no joint, as is {}: a robot has one root; there are {}: {}",
                           in_quotes(model.links[i].name), in_quotes(roots[0]), roots.size(), some_of(roots)));
    return;  // of many that are loose one says it
  }
}

// Links that the root does not reach stand on cycles, or hang on them.
void check_reached(const SourceModel& model, const LinkTree& tree, FaultList& faults) {
  std::vector<bool> reached(model.links.size(), false);
  std::vector<int> open{tree.root};
  while (!open.empty()) {
    const int link = open.back();
    open.pop_back();
    reached[link] = true;
    for (const int joint : tree.child_joints[link]) open.push_back(tree.child[joint]);
  }
  const auto lost = std::find(reached.begin(), reached.end(), false);
  if (lost == reached.end()) return;
  // From a link that nobody reaches up the tree, until one comes again.
  std::vector<bool> seen(model.links.size(), false);
  int link = static_cast<int>(lost - reached.begin());
  while (!seen[link]) seen[link] = true, link = tree.parent[tree.carrier[link]];
  std::vector<std::string> names;
  int at = link;
  do {
    names.push_back(model.links[at].name);
    at = tree.parent[tree.carrier[at]];
  } while (at != link);
  std::reverse(names.begin(), names.end());
  faults.add(
      model.joints[tree.carrier[link]].mark,
      fmt::format("the joints of {} form a cycle; loops are closed by grasps, a robot is a tree", some_of(names)));
}

}  // namespace

std::optional<LinkTree> link_tree(const SourceModel& model, FaultList& faults) {
  const std::size_t before = faults.size();
  const auto links = indices_of(model.links);
  LinkTree tree;
  tree.carrier.assign(model.links.size(), -1);
  tree.child_joints.resize(model.links.size());
  const auto find = [&](const SourceJoint& joint, const std::string& name, const Mark& mark, const char* role) {
    const auto it = links.find(name);
    if (it != links.end()) return it->second;
    if (!name.empty())
      faults.add(mark, fmt::format("joint {} has the unknown {} link {}{}", in_quotes(joint.name), role,
                                   in_quotes(name), suggestion(name, names_of(model.links), "links")));
    return -1;
  };
  for (std::size_t j = 0; j < model.joints.size() && !faults.full(); ++j) {
    const SourceJoint& joint = model.joints[j];
    const int parent = find(joint, joint.parent, joint.parent_mark, "parent");
    const int child = find(joint, joint.child, joint.child_mark, "child");
    tree.parent.push_back(parent), tree.child.push_back(child);
    if (parent < 0 || child < 0) continue;
    if (tree.carrier[child] >= 0) {
      faults.add(joint.child_mark,
                 fmt::format("joint {} carries link {}, which joint {} carries already; loops are closed by grasps, a "
                             "robot is a tree",
                             in_quotes(joint.name), in_quotes(joint.child),
                             in_quotes(model.joints[tree.carrier[child]].name)));
      continue;
    }
    tree.carrier[child] = static_cast<int>(j);
    tree.child_joints[parent].push_back(static_cast<int>(j));
  }
  if (model.links.empty() || faults.size() > before) return {};
  check_roots(model, tree, faults);
  if (tree.root >= 0) check_reached(model, tree, faults);
  if (faults.size() > before) return {};
  return tree;
}

// ---- Joints that do not move ----

namespace {

class JointSettler {
 public:
  JointSettler(const SourceModel& model, const ImportOptions& options, std::vector<ImportDecision>& decisions,
               FaultList& faults)
      : model_(model), joints_(indices_of(model.joints)), decisions_(decisions), faults_(faults) {
    values_.resize(model.joints.size());
    is_in_chain_.resize(model.joints.size(), false);
    for (const LockedJoint& locked : options.locked) lock(locked);
  }

  std::vector<std::optional<Posed>> settle() {
    std::vector<std::optional<Posed>> settled(model_.joints.size());
    for (std::size_t j = 0; j < model_.joints.size() && !faults_.full(); ++j) {
      const SourceJoint& joint = model_.joints[j];
      if (joint.kind == SourceJoint::Kind::fixed) settled[j] = joint.X_PJ;
      if (joint.kind == SourceJoint::Kind::fixed) continue;
      if (joint.mimic && has_axis(joint) && !values_[j]) follow(static_cast<int>(j));
      if (values_[j]) settled[j] = joint.X_PJ * motion(joint, *values_[j]);
    }
    return settled;
  }

 private:
  static Posed motion(const SourceJoint& joint, double value) {
    if (value == 0 || is_free(joint)) return Posed::identity();
    if (joint.kind == SourceJoint::Kind::prismatic) return {Rotationd::identity(), value * joint.axis};
    return {rotation_about(joint.axis, value), Vector3d::zero()};
  }

  void lock(const LockedJoint& locked) {
    const auto it = joints_.find(locked.joint);
    if (it == joints_.end()) {
      faults_.add(locked.mark, fmt::format("there is no joint {} to lock{}", in_quotes(locked.joint),
                                           suggestion(locked.joint, names_of(model_.joints), "joints")));
      return;
    }
    const SourceJoint& joint = model_.joints[it->second];
    if (joint.kind == SourceJoint::Kind::fixed) {
      faults_.add(locked.mark, fmt::format("joint {} cannot be locked: it is fixed", in_quotes(joint.name)));
      return;
    }
    if (is_free(joint) && locked.value != 0) {
      faults_.add(locked.mark, fmt::format("joint {} has more than one coordinate, so it can be locked at 0 only",
                                           in_quotes(joint.name)));
      return;
    }
    values_[it->second] = locked.value;
    const bool outside =
        locked.value < joint.lower.value_or(locked.value) || locked.value > joint.upper.value_or(locked.value);
    decisions_.push_back({joint.mark,
                          fmt::format("joint {} is locked at {} {}, as asked for{}", in_quotes(joint.name),
                                      locked.value, unit_of(joint), outside ? ", which is outside of its limits" : ""),
                          joint.name});
  }

  // The value of a joint that follows others: up the chain to one that is locked or moves, which counts as 0, and back.
  void follow(int first) {
    std::vector<int> chain;
    int at = first;
    double value = 0;
    bool found = true;
    while (true) {
      const SourceJoint& joint = model_.joints[at];
      if (values_[at]) {
        value = *values_[at];
        break;
      }
      if (!joint.mimic || !has_axis(joint)) break;
      if (is_in_chain_[at]) {
        faults_.add(joint.mimic->mark, fmt::format("joint {} follows itself (mimic)", in_quotes(joint.name)));
        found = false;
        break;
      }
      is_in_chain_[at] = true;
      chain.push_back(at);
      const auto it = joints_.find(joint.mimic->joint);
      if (it == joints_.end()) {
        if (!joint.mimic->joint.empty())
          faults_.add(joint.mimic->mark,
                      fmt::format("joint {} follows the unknown joint {} (mimic){}", in_quotes(joint.name),
                                  in_quotes(joint.mimic->joint),
                                  suggestion(joint.mimic->joint, names_of(model_.joints), "joints")));
        found = false;
        break;
      }
      at = it->second;
    }
    for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
      const SourceJoint& joint = model_.joints[*link];
      is_in_chain_[*link] = false;
      const double master = value;
      value = joint.mimic->multiplier * master + joint.mimic->offset;
      if (!std::isfinite(value) && found)
        faults_.add(joint.mimic->mark,
                    fmt::format("joint {}: the value that it follows to (mimic) is not finite", in_quotes(joint.name)));
      if (!std::isfinite(value)) found = false, value = 0;
      values_[*link] = value;
      if (!found) continue;
      decisions_.push_back({joint.mimic->mark,
                            fmt::format("joint {} follows {} (mimic) and is locked at {} {}, its value where {} is {}; "
                                        "another value: lock {}",
                                        in_quotes(joint.name), in_quotes(joint.mimic->joint), value, unit_of(joint),
                                        in_quotes(joint.mimic->joint), master, in_quotes(joint.name)),
                            joint.name});
    }
  }

  const SourceModel& model_;
  std::map<std::string, int, std::less<>> joints_;
  std::vector<ImportDecision>& decisions_;
  FaultList& faults_;
  std::vector<std::optional<double>> values_;  // of joints that do not move
  std::vector<bool> is_in_chain_;
};

}  // namespace

std::vector<std::optional<Posed>> settle_joints(const SourceModel& model, const ImportOptions& options,
                                                std::vector<ImportDecision>& decisions, FaultList& faults) {
  return JointSettler(model, options, decisions, faults).settle();
}

// ---- Groups ----

namespace {

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

  // Free joints at the root part bodies that fly by themselves.
  bool is_cut(int joint) const {
    return !holds(joint) && is_free(model_.joints[joint]) && in_root_cluster_[tree_.parent[joint]];
  }

  int choose_base() {
    if (!options_.base.name.empty()) {
      const auto links = indices_of(model_.links);
      const auto it = links.find(options_.base.name);
      if (it != links.end()) return it->second;
      faults_.add(options_.base.mark, fmt::format("there is no link {} to be the base{}", in_quotes(options_.base.name),
                                                  suggestion(options_.base.name, names_of(model_.links), "links")));
      return -1;
    }
    if (!free_.empty() && !root_has_mass_ && !root_moves_something_) {
      if (free_.size() == 1) return tree_.child[free_[0]];
      std::vector<std::string> names;
      for (const int joint : free_) names.push_back(model_.links[tree_.child[joint]].name);
      faults_.add(
          model_.joints[free_[1]].mark,
          fmt::format("there are {} free bodies, {}: say which is the robot's base", names.size(), some_of(names)));
      return -1;
    }
    // The world is no satellite: what alone is fixed to it is the base.
    const std::vector<int>& below_root = tree_.child_joints[tree_.root];
    if (result_.world >= 0 && below_root.size() == 1 && holds(below_root[0])) return tree_.child[below_root[0]];
    return tree_.root;
  }

  // A group that is to be: what of it is known before its links are.
  struct Begun {
    LinkGroup group;
    int link;  // nearest to the base
    Posed X_GL = Posed::identity();
  };
  // A link of a group that is to be looked at, and the joint that led to it.
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

  // What is fixed to the group's first link joins it; returned are the groups on the joints that move.
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
      // The last comes first off the stack.
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

  // What free joints at the root part from the base.
  void say_what_is_left() {
    const auto leave_out = [&](int link, const SourceJoint& joint) {
      decisions_.push_back({model_.links[link].mark,
                            fmt::format("link {} and what hangs on it is left out: the free joint {} parts it from the "
                                        "robot",
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
                     fixed.empty() ? "" : fmt::format(", with what is fixed to it: {}", some_of(fixed))),
         group.name});
    if (result_.world >= 0 && result_.group_of[result_.world] >= 0 && base != result_.world)
      decisions_.push_back(
          {model_.links[result_.world].mark,
           "link 'world' is no part of the robot: the base floats freely (write mode: fixed to bolt it "
           "to the ground)"});
    for (const LinkGroup& one : result_.groups) {
      if (!one.is_reversed) continue;
      const SourceJoint& joint = model_.joints[one.joint];
      decisions_.push_back(
          {joint.mark,
           fmt::format("joint {} is taken the other way round, {} carries {}: the axis is reversed, "
                       "so that its values mean the same; the frame of {} is at the joint",
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
