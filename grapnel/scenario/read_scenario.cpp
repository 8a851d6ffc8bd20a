#include "grapnel/scenario/read_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

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

// More samples than this are a slip of the pen: 10 million of a seven-joint dual arm are some 10 GB.
constexpr double kMostSamples = 1e7;

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
    read_integration(part(root_, "integration"));
    problem_.output_interval = number_at(part(root_, "output"), "interval").value_or(problem_.output_interval);
    problem_.output_as_published = boolean_at(part(root_, "output"), "as_published");
    check_phases();
    check_lengths();
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
    const std::string gap = text_at(node, "gap");
    if (gap == "translate_target") problem_.contact.gap = ContactSetup::Gap::translate_target;
    if (gap == "refuse") problem_.contact.gap = ContactSetup::Gap::refuse;
    problem_.contact.refuse_beyond = number_at(node, "limit").value_or(0);
    problem_.contact.largest_gap = number_at(node, "largest_gap");
    if (text_at(node, "largest_gap") == "any") problem_.contact.largest_gap = std::numeric_limits<double>::infinity();
  }

  void read_post_impact(const Node& node) {
    PostImpactSetup post;
    post.duration = number_at(node, "duration").value_or(0);
    const std::string joints = text_at(node, "joints");
    if (joints == "pd") {
      post.joints = PostImpactSetup::Joints::pd;
      read_gains(node, "post_impact", reading_, post.kp, post.kd);
    }
    if (joints == "braked") post.joints = PostImpactSetup::Joints::braked;
    const bool is_free = robot_.setup.base_mode != RobotSetup::Base::fixed;  // a held base is let go at the impact
    post.base_control = base_control_at(node, "post_impact", is_free, reading_);
    problem_.post_impact = std::move(post);
    read_releases(node, reading_);
  }

  void read_integration(const Node& node) {
    IntegrationSetup& setup = problem_.integration;
    if (text_at(node, "method") == "rk4") setup.method = IntegrationSetup::Method::rk4;
    if (text_at(node, "root_velocity") == "integrated")
      setup.root_velocity = IntegrationSetup::RootVelocity::integrated;
    const std::string loops = text_at(node, "loops");
    if (loops == "baumgarte") setup.loops = IntegrationSetup::Loops::baumgarte;
    if (loops == "acceleration") setup.loops = IntegrationSetup::Loops::acceleration;
    if (loops == "open") setup.loops = IntegrationSetup::Loops::open;
    setup.baumgarte_time = number_at(node, "baumgarte_time").value_or(setup.baumgarte_time);
    setup.relative_tolerance = number_at(node, "relative_tolerance").value_or(setup.relative_tolerance);
    setup.absolute_tolerance = number_at(node, "absolute_tolerance").value_or(setup.absolute_tolerance);
    setup.step = number_at(node, "step").value_or(setup.step);
    setup.max_step = number_at(node, "max_step").value_or(0);
    const double steps = number_at(node, "max_steps").value_or(static_cast<double>(setup.max_steps));
    // The schema's range; outside it the fault is known and the value must only be safe to convert.
    if (steps >= 1 && steps <= 1e9) setup.max_steps = static_cast<long>(steps);
  }

  // What phases need of each other.
  void check_phases() {
    if (root_.is_mapping() && !root_.entry("approach") && !root_.entry("impact") && !root_.entry("post_impact")) {
      faults_.add(root_.mark, "nothing to simulate: give 'approach', 'impact' or both");
    }
    check_closing_times(reading_);
    check_arrival(reading_);
  }

  // Sample and step counts that cannot be meant.
  void check_lengths() {
    const auto sound = [](double duration) { return duration > 0 && std::isfinite(duration) ? duration : 0.0; };
    const double approach = problem_.approach ? sound(problem_.approach->duration) : 0;
    const double post = problem_.post_impact ? sound(problem_.post_impact->duration) : 0;
    const double samples = (approach + post) / problem_.output_interval;
    if (problem_.output_interval > 0 && samples > kMostSamples) {
      faults_.add(
          part(part(root_, "output"), "interval").mark,
          fmt::format("output.interval is {} [s], which gives {:.3g} samples over {:.6g} s; at most {:.0f} are allowed",
                      problem_.output_interval, samples, approach + post, kMostSamples));
    }
    const IntegrationSetup& integration = problem_.integration;
    const bool fixed_step = integration.method == IntegrationSetup::Method::rk4 && integration.step > 0;
    const double steps = fixed_step ? std::max(approach, post) / integration.step : 0;
    if (steps > static_cast<double>(integration.max_steps)) {
      faults_.add(part(part(root_, "integration"), "step").mark,
                  fmt::format("integration.step is {} [s], which gives {:.3g} steps; integration.max_steps allows {}",
                              integration.step, steps, integration.max_steps));
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
