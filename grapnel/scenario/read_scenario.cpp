#include "grapnel/scenario/read_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/spelling.hpp"

namespace grapnel {
namespace {

// More samples than this are a slip of the pen: 10 million of a seven-joint dual arm are some 10 GB.
constexpr double kMostSamples = 1e7;

class ScenarioReader {
 public:
  ScenarioReader(const Node& root, ReadRobot robot, FaultList& faults)
      : root_(root), robot_(std::move(robot)), faults_(faults) {}

  CaptureProblem read() {
    problem_.name = text_at(root_, "name");
    problem_.gravity = vector_at(root_, "gravity").value_or(Vector3d::zero());
    read_base();
    read_joints();
    read_targets();
    read_grasps();
    if (root_.find("approach")) read_approach(part(root_, "approach"));
    read_contact(part(root_, "contact"));
    if (root_.find("impact"))
      problem_.impact = ImpactSetup{number_at(part(root_, "impact"), "duration").value_or(1e-3)};
    if (root_.find("post_impact")) read_post_impact(part(root_, "post_impact"));
    read_integration(part(root_, "integration"));
    problem_.output_interval = number_at(part(root_, "output"), "interval").value_or(problem_.output_interval);
    check_phases();
    check_lengths();
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
    } else if (!robot_.joints.empty() && (initial.is_mapping() || initial.kind == Node::Kind::null)) {
      const Mark& mark = initial.is_mapping() ? initial.mark : root_.mark;
      faults_.add(mark, "missing key 'joints' in initial: every moving joint needs a value");
    }
    if (const Node* rates = initial.find("joint_rates")) {
      problem_.joint_rate =
          joint_values(*rates, "initial.joint_rates", robot_, 0.0, faults_).value_or(std::vector<double>{});
      check_rate_limits(*rates, "initial.joint_rates", robot_, faults_);
    }
  }

  void read_targets() {
    const Node& list = part(root_, "targets");
    if (!list.is_sequence()) targets_.make_incomplete();
    for (std::size_t i = 0; i < list.items.size(); ++i) read_target(list.items[i], item("targets", i));
  }

  void read_target(const Node& node, const std::string& path) {
    targets_.add_from(node, path, faults_);
    TargetSetup target;
    target.name = text_at(node, "name");
    target.mass = number_at(node, "mass").value_or(1);
    target.com = vector_at(node, "com").value_or(Vector3d::zero());
    target.inertia = inertia_at(node, path, faults_);
    target.geometry = geometry_at(node, path, faults_);
    const Node& state = part(node, "state");
    target.given_at = text_at(state, "at") == "start" ? TargetSetup::Instant::start : TargetSetup::Instant::capture;
    target.X_WT = pose_of(state, below(path, "state"), faults_);
    target.V_WT = {vector_at(state, "angular_velocity").value_or(Vector3d::zero()),
                   vector_at(state, "velocity").value_or(Vector3d::zero())};
    NameTable points("grasp point");
    const Node& list = part(node, "grasp_points");
    if (!list.is_sequence()) points.make_incomplete();
    for (std::size_t i = 0; i < list.items.size(); ++i) {
      const std::string here = item(below(path, "grasp_points"), i);
      points.add_from(list.items[i], here, faults_);
      target.grasp_points.push_back({text_at(list.items[i], "name"), pose_of(list.items[i], here, faults_)});
    }
    points_.emplace(target.name, std::move(points));
    problem_.targets.push_back(std::move(target));
  }

  void read_grasps() {
    const Node& list = part(root_, "grasps");
    const bool doubtful = list.kind != Node::Kind::null && !list.is_sequence();
    std::map<std::string, std::size_t, std::less<>> user_of;  // end-effector to grasp
    bool all_known = !doubtful;
    for (std::size_t i = 0; i < list.items.size() && !faults_.full(); ++i) {
      const Node& node = list.items[i];
      const std::string path = item("grasps", i);
      GraspSetup grasp;
      grasp.end_effector = text_at(node, "end_effector");
      grasp.target = text_at(node, "target");
      grasp.grasp_point = text_at(node, "point");
      const std::string model = text_at(node, "model");
      grasp.model = model == "hinge" ? GraspModel::hinge : model == "point" ? GraspModel::point : GraspModel::rigid;
      if (grasp.model == GraspModel::hinge) grasp.hinge_axis = unit_vector_at(node, "axis", path, faults_);

      robot_.end_effectors.expect(grasp.end_effector, part(node, "end_effector").mark, path, faults_);
      const auto [first, fresh] = user_of.emplace(grasp.end_effector, i);
      if (!fresh && !grasp.end_effector.empty()) {
        faults_.add(part(node, "end_effector").mark,
                    fmt::format("end-effector {} in {} is used twice; it already holds in {}",
                                in_quotes(grasp.end_effector), path, item("grasps", first->second)));
      }
      const bool target_known =
          targets_.expect(grasp.target, part(node, "target").mark, path, faults_) && !grasp.target.empty();
      all_known = all_known && target_known;
      if (const auto it = points_.find(grasp.target); it != points_.end()) {
        it->second.expect(grasp.grasp_point, part(node, "point").mark, below(path, "point"), faults_);
      }
      grasps_of_[grasp.target].push_back(i);
      problem_.grasps.push_back(std::move(grasp));
    }
    // A misspelt target in a grasp may well mean the one that seems to be left alone.
    if (all_known) check_all_targets_grasped();
  }

  void check_all_targets_grasped() {
    const Node& list = part(root_, "targets");
    for (const Node& target : list.items) {
      const std::string name = text_at(target, "name");
      if (name.empty() || grasps_of_.contains(name)) continue;
      faults_.add(part(target, "name").mark,
                  fmt::format("target {} is grasped by nobody; add a grasp or remove the target", in_quotes(name)));
    }
  }

  void read_approach(const Node& node) {
    ApproachSetup approach;
    approach.duration = number_at(node, "duration").value_or(0);
    const std::string profile = text_at(node, "profile");
    approach.profile = profile == "cycloidal" ? JointProfile::cycloidal
                       : profile == "quintic" ? JointProfile::quintic
                                              : JointProfile::quartic;
    const Node& final_joints = part(node, "final_joints");
    approach.final_position =
        joint_values(final_joints, "approach.final_joints", robot_, {}, faults_).value_or(std::vector<double>{});
    check_position_limits(final_joints, "approach.final_joints", robot_, faults_);
    if (const Node* rates = node.find("final_rates")) read_final_rates(*rates, approach);
    const Node& tracking = part(node, "tracking");
    if (text_at(tracking, "mode") == "pd") {
      approach.tracking.mode = TrackingSetup::Mode::pd;
      read_gains(tracking, "approach.tracking", approach.tracking.kp, approach.tracking.kd);
    }
    check_start(node, approach);
    problem_.approach = std::move(approach);
  }

  // The thesis's profile has no initial rate in it, so joints that follow it exactly cannot have one either.
  void check_start(const Node& node, const ApproachSetup& approach) {
    const bool ideal = approach.tracking.mode == TrackingSetup::Mode::ideal;
    const auto& rates = problem_.joint_rate;
    if (approach.profile != JointProfile::quartic || !ideal ||
        std::all_of(rates.begin(), rates.end(), [](double r) { return r == 0; })) {
      return;
    }
    faults_.add(
        part(node, "profile").mark,
        "approach.profile: the quartic profile starts from rest; with initial.joint_rates use quintic or cycloidal");
  }

  void read_final_rates(const Node& node, ApproachSetup& approach) {
    const std::string path = "approach.final_rates";
    const NodeEntry* match = node.entry("match");
    if (!match) {
      for (const NodeEntry& entry : node.entries) {
        // A slip in this one key would otherwise read as the name of a joint.
        if (robot_.joint_names.contains(entry.key) || nearest(entry.key, {"match"}).empty()) continue;
        faults_.add(entry.mark, fmt::format("unknown key {} in {}; did you mean 'match'?", in_quotes(entry.key), path));
        return;
      }
      approach.final_rates = joint_values(node, path, robot_, 0.0, faults_);
      check_rate_limits(node, path, robot_, faults_);
      return;
    }
    const std::string value = text_at(node, "match");
    approach.match = value == "twist"                  ? RateMatch::twist
                     : value == "velocity_least_rates" ? RateMatch::velocity_least_rates
                                                       : RateMatch::velocity;
    if (!root_.entry("grasps")) faults_.add(match->mark, path + ".match needs 'grasps': there is no motion to match");
  }

  void read_gains(const Node& node, const std::string& path, std::vector<double>& kp, std::vector<double>& kd) {
    kp = joint_values(part(node, "kp"), below(path, "kp"), robot_, {}, faults_).value_or(std::vector<double>{});
    kd = joint_values(part(node, "kd"), below(path, "kd"), robot_, {}, faults_).value_or(std::vector<double>{});
  }

  void read_contact(const Node& node) {
    const std::string gap = text_at(node, "gap");
    if (gap == "translate_target") problem_.contact.gap = ContactSetup::Gap::translate_target;
    if (gap == "refuse") problem_.contact.gap = ContactSetup::Gap::refuse;
    problem_.contact.refuse_beyond = number_at(node, "limit").value_or(0);
    if (gap != "translate_target") return;
    for (const auto& [target, grasps] : grasps_of_) {
      if (target.empty() || grasps.size() < 2) continue;
      faults_.add(part(node, "gap").mark,
                  fmt::format("contact.gap: translate_target cannot move target {} to {} end-effectors at "
                              "once; use weld_as_found or refuse",
                              in_quotes(target), grasps.size()));
    }
  }

  void read_post_impact(const Node& node) {
    PostImpactSetup post;
    post.duration = number_at(node, "duration").value_or(0);
    const std::string joints = text_at(node, "joints");
    if (joints == "pd") {
      post.joints = PostImpactSetup::Joints::pd;
      read_gains(node, "post_impact", post.kp, post.kd);
    }
    if (joints == "braked") post.joints = PostImpactSetup::Joints::braked;
    problem_.post_impact = std::move(post);
  }

  void read_integration(const Node& node) {
    IntegrationSetup& setup = problem_.integration;
    if (text_at(node, "method") == "rk4") setup.method = IntegrationSetup::Method::rk4;
    if (text_at(node, "root_velocity") == "integrated")
      setup.root_velocity = IntegrationSetup::RootVelocity::integrated;
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
    const NodeEntry* post = root_.entry("post_impact");
    if (!post) return;
    for (const auto& [target, grasps] : grasps_of_) {
      if (target.empty() || grasps.size() < 2) continue;
      faults_.add(post->mark,
                  fmt::format("post_impact: {} and {} hold the same target {}; the motion of closed loops after the "
                              "impact is not modelled yet; leave out post_impact",
                              item("grasps", grasps[0]), item("grasps", grasps[1]), in_quotes(target)));
    }
  }

  // Sample and step counts that cannot be meant.
  void check_lengths() {
    const auto phase = [&](const char* name) {
      const double duration = number_at(part(root_, name), "duration").value_or(0);
      return root_.entry(name) && duration > 0 && std::isfinite(duration) ? duration : 0.0;
    };
    const double approach = phase("approach"), post = phase("post_impact");
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

  const Node& root_;
  ReadRobot robot_;
  FaultList& faults_;
  CaptureProblem problem_;
  NameTable targets_{"target"};
  std::map<std::string, NameTable, std::less<>> points_;                    // by target
  std::map<std::string, std::vector<std::size_t>, std::less<>> grasps_of_;  // by target
};

}  // namespace

CaptureProblem read_scenario(const Node& node, ReadRobot robot, FaultList& faults) {
  return ScenarioReader(node, std::move(robot), faults).read();
}

}  // namespace grapnel
