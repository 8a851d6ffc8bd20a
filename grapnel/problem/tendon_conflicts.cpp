// Tendons: faults of a robot's tendons, and conflicts of their commands with the rest of a problem.
#include <set>

#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {

const TendonSetup* tendon_named(const RobotSetup& robot, const std::string& name) {
  return find_named(robot.tendons, name);
}

bool is_pulled(const RobotSetup& robot, const PostImpactSetup& phase, const std::string& joint) {
  return std::ranges::any_of(phase.tendons, [&](const TendonCommand& command) {
    const TendonSetup* tendon = tendon_named(robot, command.tendon);
    return tendon && std::ranges::any_of(tendon->joints, [&](const TendonArm& one) { return one.joint == joint; });
  });
}

namespace {

// Why a tendon cannot pull a joint; empty: it can.
std::string obstacle(const JointDescription& joint) {
  if (!has_one_axis(joint.type)) return "is fixed";
  if (!joint.mimic.empty())
    return fmt::format("follows {}; state the moment arm at the joint that it follows, with the ratio as factor",
                       in_quotes(joint.mimic.front().joint));
  if (joint.motor) return "has a motor; leave out 'motor', since the tendon drives the joint";
  if (joint.elasticity) return "has a flexible gear; leave out 'elasticity', since the tendon drives the joint";
  return {};
}

class TendonConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  // The checks of other parts call the current phase post_impact; its place is inserted later.
  void find() {
    if (!problem_.post_impact) return;
    const PostImpactSetup& phase = *problem_.post_impact;
    std::vector<std::string> names;
    for (const TendonSetup& tendon : problem_.robot.tendons) names.push_back(tendon.name);
    std::set<std::string_view> commanded;
    for (std::size_t i = 0; i < phase.tendons.size(); ++i) {
      const TendonCommand& command = phase.tendons[i];
      const std::string path = fmt::format("post_impact.tendons[{}]", i);
      const TendonSetup* tendon = tendon_named(problem_.robot, command.tendon);
      if (!tendon) {
        add(path + ".tendon", "{}.tendon: the robot has no tendon {}{}", path, in_quotes(command.tendon),
            names.empty() ? " (tendons: [...] in the robot file)" : suggestion(command.tendon, names, "tendons"));
        continue;
      }
      if (!commanded.insert(command.tendon).second)
        add(path + ".tendon", "{}.tendon: {} has two commands in this phase", path, in_quotes(command.tendon));
      if (command.speed && !tendon->stiffness)
        add(path + ".speed", "{}.speed needs the stiffness of tendon {}: state 'stiffness' in the robot file", path,
            in_quotes(command.tendon));
    }
    using Joints = PostImpactSetup::Joints;
    if (phase.tendons.empty() || (!is_law(phase.joints) && phase.joints != Joints::controller)) return;
    add("post_impact.tendons",
        "post_impact.tendons: joints {} commands all joints and does not support tendons; use joints free, pd, "
        "computed_torque or braked",
        name_of(phase.joints));
  }
};

}  // namespace

void find_tendon_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  TendonConflicts(problem, found).find();
}

void add_tendon_faults(const RobotSetup& robot, const std::string& before, std::vector<ProblemFault>& found) {
  std::vector<std::string> names;
  for (const BodyDescription& body : robot.bodies) {
    if (has_one_axis(body.joint.type)) names.push_back(body.joint.name);
  }
  for (std::size_t i = 0; i < robot.tendons.size(); ++i) {
    std::set<std::string_view> pulled;
    for (std::size_t k = 0; k < robot.tendons[i].joints.size(); ++k) {
      const TendonArm& one = robot.tendons[i].joints[k];
      const std::string path = fmt::format("tendons[{}].joints[{}]", i, k);
      const auto add = [&](const char* key, const std::string& what) {
        found.push_back({path + key, fmt::format("{}{}{}: {}", before, path, key, what)});
      };
      const auto is_its = [&](const BodyDescription& body) { return body.joint.name == one.joint; };
      const auto body = std::ranges::find_if(robot.bodies, is_its);
      if (body == robot.bodies.end()) {
        add(".joint", fmt::format("unknown joint {}{}", in_quotes(one.joint), suggestion(one.joint, names, "joints")));
      } else if (const std::string why = obstacle(body->joint); !why.empty()) {
        add(".joint", fmt::format("joint {} {}", in_quotes(one.joint), why));
      } else if (!pulled.insert(one.joint).second) {
        add(".joint", fmt::format("joint {} is named twice; state the sum of its moment arms", in_quotes(one.joint)));
      }
      if (one.arm != 0) continue;
      add(".arm", "is 0, so the tendon has no effect on the joint; leave the joint out");
      found.back().relies_on = path + ".arm";
    }
  }
}

}  // namespace grapnel
