#include "grapnel/import/assembly_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

const char* unit_of(const SourceJoint& joint) { return joint.kind == SourceJoint::Kind::prismatic ? "m" : "rad"; }

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
    faults.add(model.links[0].mark,
               "every link is the child of a joint, so there is no root link: the joints form a cycle");
    return;
  }
  for (std::size_t i = 0, seen = 0; i < model.links.size(); ++i) {
    if (tree.carrier[i] >= 0 || seen++ == 0) continue;
    faults.add(model.links[i].mark,
               fmt::format("links {} and {} are not children of a joint: a robot must have one root; there are {}: {}",
                           in_quotes(model.links[i].name), in_quotes(roots[0]), roots.size(), some_of(roots)));
    return;  // one message for all loose links
  }
}

// Links that are not reachable from the root are on cycles, or below them.
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
  // From an unreachable link up the tree until a link repeats.
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
      fmt::format("the joints of {} form a cycle; a robot must be a tree, loops are closed by grasps", some_of(names)));
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
      faults.add(joint.child_mark, fmt::format("joint {} carries link {}, which joint {} carries already; a robot must "
                                               "be a tree, loops are closed by grasps",
                                               in_quotes(joint.name), in_quotes(joint.child),
                                               in_quotes(model.joints[tree.carrier[child]].name)));
      continue;
    }
    tree.carrier[child] = static_cast<int>(j);
    tree.child_joints[parent].push_back(static_cast<int>(j));
  }
  if (model.links.empty() || faults.size() > before) return {};
  check_roots(model, tree, faults);
  if (faults.size() == before) check_reached(model, tree, faults);
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
    is_coupled_.resize(model.joints.size(), false);
    for (const LockedJoint& locked : options.locked) lock(locked);
    for (const StatedName& wheel : options.wheels) lock_wheel(wheel);
  }

  std::vector<std::optional<Posed>> settle() {
    std::vector<std::optional<Posed>> settled(model_.joints.size());
    for (std::size_t j = 0; j < model_.joints.size() && !faults_.full(); ++j) {
      const SourceJoint& joint = model_.joints[j];
      if (joint.kind == SourceJoint::Kind::fixed) settled[j] = joint.X_PJ;
      if (joint.kind == SourceJoint::Kind::fixed) continue;
      if (joint.mimic && has_axis(joint) && !values_[j] && !is_coupled_[j]) follow(static_cast<int>(j));
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
      faults_.add(locked.mark, fmt::format("unknown joint {} in lock{}", in_quotes(locked.joint),
                                           suggestion(locked.joint, names_of(model_.joints), "joints")));
      return;
    }
    const SourceJoint& joint = model_.joints[it->second];
    if (joint.kind == SourceJoint::Kind::fixed) {
      faults_.add(locked.mark, fmt::format("joint {} cannot be locked: it is fixed", in_quotes(joint.name)));
      return;
    }
    const bool slides = joint.kind == SourceJoint::Kind::prismatic;
    if (locked.written_as == (slides ? LockedJoint::WrittenAs::angle : LockedJoint::WrittenAs::length)) {
      faults_.add(
          locked.mark,
          fmt::format("joint {} {}, so it is locked at {}", in_quotes(joint.name), slides ? "slides" : "turns",
                      slides ? "a length [m, mm, cm], not at an angle" : "an angle [rad, deg], not at a length"));
      return;
    }
    if (is_free(joint) && locked.value != 0) {
      faults_.add(locked.mark, fmt::format("joint {} has more than one coordinate and can only be locked at 0",
                                           in_quotes(joint.name)));
      return;
    }
    values_[it->second] = locked.value;
    const bool outside =
        locked.value < joint.lower.value_or(locked.value) || locked.value > joint.upper.value_or(locked.value);
    decisions_.push_back({joint.mark,
                          fmt::format("joint {} is locked at {:.9g} {}, as requested{}", in_quotes(joint.name),
                                      locked.value, unit_of(joint), outside ? ", which is outside its limits" : ""),
                          joint.name});
  }

  // A wheel rotates without moving other bodies: its rotor is balanced, and part of the base.
  void lock_wheel(const StatedName& wheel) {
    const auto it = joints_.find(wheel.name);
    if (it == joints_.end())
      faults_.add(wheel.mark, fmt::format("unknown joint {} for a wheel{}", in_quotes(wheel.name),
                                          suggestion(wheel.name, names_of(model_.joints), "joints")));
    else if (values_[it->second])
      faults_.add(wheel.mark, fmt::format("joint {} is locked or selected already: it cannot be a wheel too",
                                          in_quotes(wheel.name)));
    else
      values_[it->second] = 0;
  }

  // A mimic joint: along the chain to a locked joint, which locks the chain at its values, or to a moving one, and
  // back.
  void follow(int first) {
    std::vector<int> chain;
    int at = first;
    double value = 0;
    bool found = true, moves = false;
    while (true) {
      const SourceJoint& joint = model_.joints[at];
      if (values_[at]) {
        value = *values_[at];
        moves = false;
        break;
      }
      moves = has_axis(joint);
      if (!joint.mimic || !has_axis(joint) || is_coupled_[at]) break;
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
      if (moves && found && joint.mimic->multiplier != 0) {
        couple(*link);
        continue;
      }
      moves = false;
      const double master = value;
      value = joint.mimic->multiplier * master + joint.mimic->offset;
      if (!std::isfinite(value) && found)
        faults_.add(joint.mimic->mark, fmt::format("joint {}: its mimic value is not finite", in_quotes(joint.name)));
      if (!std::isfinite(value)) found = false, value = 0;
      values_[*link] = value;
      if (!found) continue;
      decisions_.push_back({joint.mimic->mark,
                            fmt::format("joint {} follows {} (mimic) and is locked at {:.9g} {}, its value for {} = "
                                        "{:.9g}; for another value lock {}",
                                        in_quotes(joint.name), in_quotes(joint.mimic->joint), value, unit_of(joint),
                                        in_quotes(joint.mimic->joint), master, in_quotes(joint.name)),
                            joint.name});
    }
  }

  // A joint that moves with another.
  void couple(int joint) {
    is_coupled_[joint] = true;
    const SourceJoint& follower = model_.joints[joint];
    const SourceMimic& mimic = *follower.mimic;
    decisions_.push_back({mimic.mark,
                          fmt::format("joint {} follows {} (mimic) with ratio {:.9g} and offset {:.9g} {}, without a "
                                      "separate motor",
                                      in_quotes(follower.name), in_quotes(mimic.joint), mimic.multiplier, mimic.offset,
                                      unit_of(follower)),
                          follower.name});
  }

  const SourceModel& model_;
  std::map<std::string, int, std::less<>> joints_;
  std::vector<ImportDecision>& decisions_;
  FaultList& faults_;
  std::vector<std::optional<double>> values_;  // of joints that do not move
  std::vector<bool> is_in_chain_;
  std::vector<bool> is_coupled_;  // moves with another joint
};

}  // namespace

std::vector<std::optional<Posed>> settle_joints(const SourceModel& model, const ImportOptions& options,
                                                std::vector<ImportDecision>& decisions, FaultList& faults) {
  return JointSettler(model, options, decisions, faults).settle();
}

}  // namespace grapnel
