#include "grapnel/scenario/read_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/scenario/grip_times.hpp"
#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/read_approach.hpp"
#include "grapnel/scenario/read_control.hpp"
#include "grapnel/scenario/read_impact.hpp"
#include "grapnel/scenario/read_loads.hpp"
#include "grapnel/scenario/read_targets.hpp"

namespace grapnel {
namespace {

// Where a path, or what of it is there, stands.
const Mark& mark_at(const Node& root, std::string_view path) {
  const Node* node = &root;
  while (!path.empty()) {
    const Node* below = nullptr;
    if (path[0] == '[') {
      const std::size_t close = path.find(']');
      std::size_t index = 0;
      std::from_chars(path.data() + 1, path.data() + close, index);
      below = index < node->items.size() ? &node->items[index] : nullptr;
      path.remove_prefix(close + 1);
    } else {
      const std::size_t end = std::min(path.find_first_of(".["), path.size());
      below = node->find(path.substr(0, end));
      path.remove_prefix(end);
    }
    if (path.starts_with('.')) path.remove_prefix(1);
    if (!below) break;
    node = below;
  }
  return node->mark;
}

class ScenarioReader {
 public:
  ScenarioReader(const Node& root, ReadRobot robot, const TrajectoryFile* trajectory, const Meshes& meshes,
                 FaultList& faults)
      : reading_(root, std::move(robot), meshes, faults), trajectory_(trajectory) {}

  CaptureProblem read() {
    problem_.name = text_at(root_, "name");
    problem_.gravity = vector_at(root_, "gravity").value_or(Vector3d::zero());
    read_base();
    read_joints();
    read_targets(reading_);
    read_grasps(reading_);
    if (root_.find("approach")) read_approach(part(root_, "approach"), trajectory_, reading_);
    read_contact(part(root_, "contact"));
    if (root_.find("impact")) read_impact(part(root_, "impact"), reading_);
    if (root_.find("post_impact")) read_post_impact(part(root_, "post_impact"));
    read_external_wrenches(reading_);
    read_clearance(reading_);
    read_members(part(root_, "integration"), "integration", &problem_.integration);
    read_members(part(root_, "output"), "output", &problem_);
    check_phases();
    check_conflicts();
    doubt_shared_points(part(root_, "grasps"), problem_, faults_);
    problem_.robot = std::move(robot_.setup);
    return std::move(problem_);
  }

 private:
  void read_base() {
    const Node& base = part(part(root_, "initial"), "base");
    problem_.X_WB = pose_of(base, "initial.base", faults_);
    if (robot_.setup.base_mode == RobotSetup::Base::fixed) {
      for (BodyDescription& body : robot_.setup.bodies) {
        if (body.name == robot_.setup.base) body.X_PF = problem_.X_WB;
      }
    }
    Momentumd momentum = Momentumd::zero();
    const Twistd V_WB{vector_at(base, "angular_velocity").value_or(Vector3d::zero()),
                      vector_at(base, "velocity").value_or(Vector3d::zero())};
    const Node* given = base.find("momentum");
    if (given) {
      momentum = {vector_at(*given, "angular").value_or(Vector3d::zero()),
                  vector_at(*given, "linear").value_or(Vector3d::zero())};
      problem_.momentum = momentum;
    } else {
      problem_.V_WB = V_WB;
    }
    if (robot_.setup.base_mode == RobotSetup::Base::free) return;
    const char* mode = robot_.setup.base_mode == RobotSetup::Base::fixed ? "fixed" : "held";
    for (const char* key : {"angular_velocity", "velocity", "momentum"}) {
      const NodeEntry* entry = base.entry(key);
      const bool at_rest = key == std::string_view("angular_velocity") ? is_zero(V_WB.angular)
                           : key == std::string_view("velocity")       ? is_zero(V_WB.linear)
                                                                       : false;
      if (entry && !at_rest) {
        faults_.add(entry->mark,
                    fmt::format("initial.base.{}: the robot's base is {}, so its motion cannot be given", key, mode));
      }
    }
  }
  static bool is_zero(const Vector3d& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

  void read_joints() {
    const Node& initial = part(root_, "initial");
    if (const Node* joints = initial.find("joints")) {
      problem_.joint_position =
          joint_values(*joints, "initial.joints", robot_, {}, faults_).value_or(std::vector<double>{});
      check_position_limits(*joints, "initial.joints", robot_, faults_);
    } else if (!part(root_, "approach").entry("trajectory") && !part(root_, "approach").entry("pieces") &&
               !robot_.joints.empty() && (initial.is_mapping() || initial.kind == Node::Kind::null)) {
      const Mark& mark = initial.is_mapping() ? initial.mark : root_.mark;
      faults_.add(mark, "missing key 'joints' in initial: every moving joint needs a value");
    }
    if (const Node* rates = initial.find("joint_rates")) {
      problem_.joint_rate =
          joint_values(*rates, "initial.joint_rates", robot_, 0.0, faults_).value_or(std::vector<double>{});
      check_rate_limits(*rates, "initial.joint_rates", robot_, faults_);
    }
  }

  void read_contact(const Node& node) {
    read_members(node, "contact", &problem_.contact);
    problem_.contact.largest_gap = number_at(node, "largest_gap");
    if (text_at(node, "largest_gap") == "any") problem_.contact.largest_gap = std::numeric_limits<double>::infinity();
  }

  void read_post_impact(const Node& node) {
    PostImpactSetup post;
    read_members(node, "post_impact", &post);
    if (post.joints == PostImpactSetup::Joints::pd) read_gains(node, "post_impact", reading_, post.kp, post.kd);
    const bool is_free = robot_.setup.base_mode != RobotSetup::Base::fixed;  // a held base is let go at the impact
    post.base_control = base_control_at(node, "post_impact", is_free, reading_);
    problem_.post_impact = std::move(post);
    read_releases(node, reading_);
  }

  // What phases need of each other.
  void check_phases() {
    if (root_.is_mapping() && !root_.entry("approach") && !root_.entry("impact") && !root_.entry("post_impact")) {
      faults_.add(root_.mark, "nothing to simulate: give 'approach', 'impact' or both");
    }
    check_arrival(reading_);
  }

  void check_conflicts() {
    const Node& approach = part(root_, "approach");
    const bool is_stated = approach.find("trajectory") || approach.find("pieces");  // though it may be faulty
    for (const ProblemFault& fault : problem_conflicts(problem_)) {
      if (is_stated && fault.path == "approach.profile") continue;
      faults_.add(mark_at(root_, fault.path), fault.message);
    }
  }

  Reading reading_;
  const TrajectoryFile* trajectory_;
  const Node& root_ = reading_.root;
  ReadRobot& robot_ = reading_.robot;
  FaultList& faults_ = reading_.faults;
  CaptureProblem& problem_ = reading_.problem;
};

}  // namespace

CaptureProblem read_scenario(const Node& node, ReadRobot robot, const TrajectoryFile* trajectory, const Meshes& meshes,
                             FaultList& faults) {
  return ScenarioReader(node, std::move(robot), trajectory, meshes, faults).read();
}

}  // namespace grapnel
