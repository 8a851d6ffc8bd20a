#include "grapnel/capture/capture_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/free_floating.hpp"

namespace grapnel {
namespace {

template <class Items>
auto find_named(const Items& items, const std::string& name) {
  return std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
}

void check_grasps(const CaptureProblem& problem, std::vector<std::string>& faults) {
  std::vector<std::string> used;
  for (const GraspSetup& g : problem.grasps) {
    if (find_named(problem.robot.end_effectors, g.end_effector) == problem.robot.end_effectors.end()) {
      faults.push_back(fmt::format("grasp: unknown end-effector '{}'", g.end_effector));
    }
    if (std::find(used.begin(), used.end(), g.end_effector) != used.end()) {
      faults.push_back(fmt::format("grasp: end-effector '{}' is used twice", g.end_effector));
    }
    used.push_back(g.end_effector);
    const auto target = find_named(problem.targets, g.target);
    if (target == problem.targets.end()) {
      faults.push_back(fmt::format("grasp: unknown target '{}'", g.target));
    } else if (find_named(target->grasp_points, g.grasp_point) == target->grasp_points.end()) {
      faults.push_back(fmt::format("grasp: target '{}' has no grasp point '{}'", g.target, g.grasp_point));
    }
    if (g.model == GraspModel::hinge && !(std::abs(norm(g.hinge_axis) - 1) < 1e-9)) {
      faults.push_back(fmt::format("grasp of '{}': hinge axis must be a unit vector", g.end_effector));
    }
  }
}

void check_phases(const CaptureProblem& problem, std::size_t joints, std::vector<std::string>& faults) {
  const auto check_size = [&](const std::vector<double>& values, const char* what) {
    if (values.size() != joints)
      faults.push_back(fmt::format("{}: {} values for {} joints", what, values.size(), joints));
    for (double x : values) {
      if (!std::isfinite(x)) faults.push_back(fmt::format("{}: a value is not finite", what));
    }
  };
  if (!problem.approach && !problem.impact)
    faults.push_back("neither approach nor impact: there is nothing to simulate");
  check_size(problem.joint_position, "initial joint positions");
  if (!problem.joint_rate.empty()) check_size(problem.joint_rate, "initial joint rates");
  if (const auto& approach = problem.approach) {
    if (!(approach->duration > 0) || !std::isfinite(approach->duration))
      faults.push_back("approach: duration must be positive");
    check_size(approach->final_position, "approach: final joint positions");
    if (approach->final_rates) check_size(*approach->final_rates, "approach: final joint rates");
    if (approach->match && problem.grasps.empty()) faults.push_back("approach: matching rates needs grasps");
    if (approach->tracking.mode == TrackingSetup::Mode::pd) {
      check_size(approach->tracking.kp, "approach: kp");
      check_size(approach->tracking.kd, "approach: kd");
    } else if (approach->profile == JointProfile::quartic &&
               std::any_of(problem.joint_rate.begin(), problem.joint_rate.end(), [](double r) { return r != 0; })) {
      faults.push_back(
          "approach: the quartic profile starts from rest; with initial joint rates choose quintic or cycloidal");
    }
  }
  if (problem.impact && problem.grasps.empty()) faults.push_back("impact: there are no grasps");
  if (problem.impact && !(problem.impact->duration > 0)) faults.push_back("impact: duration must be positive");
  if (const auto& post = problem.post_impact) {
    if (!problem.impact) faults.push_back("post_impact needs an impact");
    if (!(post->duration > 0) || !std::isfinite(post->duration))
      faults.push_back("post_impact: duration must be positive");
    if (post->joints == PostImpactSetup::Joints::pd) {
      check_size(post->kp, "post_impact: kp");
      check_size(post->kd, "post_impact: kd");
    }
    for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        if (problem.grasps[i].target == problem.grasps[k].target) {
          faults.push_back(
              fmt::format("target '{}' is gripped twice: the motion of closed loops after the impact is not modelled "
                          "yet; leave out "
                          "post_impact",
                          problem.grasps[i].target));
        }
      }
    }
  }
}

void check_initial(const CaptureProblem& problem, std::vector<std::string>& faults) {
  const bool moving = problem.V_WB.has_value() || problem.momentum.has_value();
  if (problem.V_WB && problem.momentum) faults.push_back("initial: give the base's twist or the momentum, not both");
  if (problem.robot.base_mode != RobotSetup::Base::free && moving) {
    const Twistd V = problem.V_WB.value_or(Twistd::zero());
    if (problem.momentum || dot(V.angular, V.angular) + dot(V.linear, V.linear) > 0) {
      faults.push_back("initial: a held or fixed base cannot move");
    }
  }
  for (const TargetSetup& t : problem.targets) {
    if (std::none_of(problem.grasps.begin(), problem.grasps.end(),
                     [&](const GraspSetup& g) { return g.target == t.name; }) &&
        problem.impact) {
      faults.push_back(fmt::format("target '{}' is gripped by nobody", t.name));
    }
  }
}

ModelBuilder servicer_builder(const CaptureProblem& problem) {
  ModelBuilder builder;
  for (BodyDescription body : problem.robot.bodies) {
    if (body.name == problem.robot.base) {
      const bool fixed = problem.robot.base_mode == RobotSetup::Base::fixed;
      body.parent.clear();
      body.joint = {};
      body.joint.name = body.name;
      body.joint.type = fixed ? JointType::fixed : JointType::free;
      body.X_PF = fixed ? problem.X_WB : Posed::identity();
    }
    builder.add(std::move(body));
  }
  for (const FrameDescription& frame : problem.robot.end_effectors) builder.add(frame);
  return builder;
}

CaptureSystem index(const CaptureProblem& problem, Model model, bool with_targets) {
  CaptureSystem system{std::move(model), 0, {}, {}, {}};
  system.base = system.model.body_index(problem.robot.base);
  for (const FrameDescription& f : problem.robot.end_effectors)
    system.end_effectors.push_back(system.model.frame_index(f.name));
  if (with_targets) {
    for (const TargetSetup& t : problem.targets) {
      system.target_frames.push_back(system.model.frame_index(target_body_name(t.name)));
    }
  }
  for (std::size_t j = 0; j < system.model.joints().size(); ++j) {
    const std::string& name = system.model.bodies()[system.model.joints()[j]].description.name;
    if (find_named(problem.robot.bodies, name) != problem.robot.bodies.end()) {
      system.robot_joints.push_back(static_cast<int>(j));
    }
  }
  return system;
}

}  // namespace

std::string target_body_name(const std::string& target) { return "target:" + target; }

BodyDescription target_body(const TargetSetup& target) {
  BodyDescription body;
  body.name = target_body_name(target.name);
  body.joint.name = body.name;
  body.joint.type = JointType::free;
  body.mass = target.mass;
  body.com = target.com;
  body.inertia = target.inertia;
  return body;
}

CaptureSystem make_servicer(const CaptureProblem& problem) {
  return index(problem, servicer_builder(problem).build(), false);
}

CaptureSystem make_capture_system(const CaptureProblem& problem) {
  ModelBuilder builder = servicer_builder(problem);
  for (const TargetSetup& t : problem.targets) {
    builder.add(target_body(t));
    builder.add(FrameDescription{target_body_name(t.name), target_body_name(t.name), Posed::identity()});
  }
  CaptureSystem system = index(problem, builder.build(), true);
  std::vector<std::string> faults;
  check_grasps(problem, faults);
  check_phases(problem, system.robot_joints.size(), faults);
  check_initial(problem, faults);
  if (!faults.empty()) throw CaptureProblemError(fmt::format("{}", fmt::join(faults, "\n")));
  return system;
}

State initial_servicer_state(const CaptureProblem& problem, const CaptureSystem& system) {
  State state = zero_state(system.model);
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    const Body& body = system.model.bodies()[system.model.joints()[system.robot_joints[j]]];
    state.q[body.q] = problem.joint_position[j];
    if (!problem.joint_rate.empty()) state.v[body.v] = problem.joint_rate[j];
  }
  if (!system.model.has_free_root(system.base)) return state;
  set_root_pose(system.model, system.base, problem.X_WB, state);
  if (problem.momentum) {
    set_root_twist(system.model, system.base,
                   base_twist_from_momentum(system.model, state, system.base, *problem.momentum), state);
  } else {
    set_root_twist(system.model, system.base, problem.V_WB.value_or(Twistd::zero()), state);
  }
  return state;
}

}  // namespace grapnel
