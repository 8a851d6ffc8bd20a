// Conflicts of the on-board computer's knowledge: sensors, estimates and replanning, identification.
#include <set>

#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"

namespace grapnel {
namespace {

class SensorConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void find() {
    if (problem_.sensors) check_sensors(*problem_.sensors);
    if (problem_.approach && problem_.approach->replan) check_replanning(*problem_.approach);
    if (problem_.post_impact) check_knowledge(*problem_.post_impact);
  }

 private:
  void check_sensors(const SensorSetup& s) {
    if (!problem_.control) {
      add_key("sensors",
              "sensors need the sample times of the on-board computer: control: {{period: ...}} is missing; laws that "
              "act continuously receive true values");
      return;
    }
    if (s.joints) check_time(s.joints->sample_time, "sensors.joints");
    if (s.gyro) check_time(s.gyro->sample_time, "sensors.gyro");
    if (s.attitude) check_time(s.attitude->sample_time, "sensors.attitude");
    if (s.wheels) check_time(s.wheels->sample_time, "sensors.wheels");
    if (s.wheels && problem_.robot.wheels.empty())
      add_key("sensors.wheels", "sensors.wheels: the robot has no reaction wheels");
    for (const auto& [is_there, path] :
         {std::pair{s.gyro.has_value(), "sensors.gyro"}, std::pair{s.attitude.has_value(), "sensors.attitude"}}) {
      if (is_there && problem_.robot.base_mode == RobotSetup::Base::fixed)
        add_key(path, "{}: the robot's base is fixed and does not turn", path);
    }
    if (s.joints && s.joints->counts_per_turn > 0) check_turning();
    std::set<std::string> seen;
    for (std::size_t i = 0; i < s.wrists.size(); ++i) {
      const std::string path = fmt::format("sensors.force_torque[{}]", i);
      check_time(s.wrists[i].sample_time, path);
      if (!seen.insert(s.wrists[i].end_effector).second && !s.wrists[i].end_effector.empty())
        add(path + ".end_effector", "{} is a second sensor of end-effector \"{}\"", path, s.wrists[i].end_effector);
    }
    seen.clear();
    for (std::size_t i = 0; i < s.relative_poses.size(); ++i) {
      const std::string path = fmt::format("sensors.relative_pose[{}]", i);
      check_time(s.relative_poses[i].sample_time, path);
      if (!seen.insert(s.relative_poses[i].target).second && !s.relative_poses[i].target.empty())
        add(path + ".target", "{} is a second sensor of target \"{}\"", path, s.relative_poses[i].target);
    }
  }

  void check_turning() {
    for (const BodyDescription& body : problem_.robot.bodies) {
      if (!slides_along_axis(body.joint.type)) continue;
      add("sensors.joints.counts_per_turn",
          "sensors.joints.counts_per_turn: joint \"{}\" is prismatic; state quantum instead", body.joint.name);
      return;
    }
  }

  void check_time(double sample_time, const std::string& path) {
    const double period = problem_.control ? problem_.control->timing.period : 0;
    if (!(sample_time > 0) || !(period > 0)) return;
    const double ticks = sample_time / period;
    if (ticks > 0.5 && std::abs(ticks - std::round(ticks)) <= 1e-6 * ticks) return;
    add(path + ".sample_time", "{}.sample_time is {} [s], must be a multiple of control.period, {}", path, sample_time,
        period)
        .relies_on = "control.period";
  }

  void check_replanning(const ApproachSetup& approach) {
    if (!approach.plan)
      add_key("approach.replan", "approach.replan needs approach.plan: a stated motion cannot be replanned");
    if (approach.profile == JointProfile::quartic && approach.plan)
      add_key(
          "approach.replan",
          "approach.replan: the quartic profile starts from rest, but joints move when the approach is replanned; use "
          "profile: quintic or cycloidal");
    const double least = shortest(problem_.approach).value_or(0), most = longest(problem_.approach).value_or(0);
    if (least > 0 && approach.replan->every >= least)
      add("approach.replan.every", "approach.replan.every is {} [s], must be less than {}, {}", approach.replan->every,
          least, approach.window ? "approach.window.earliest" : "the approach's duration");
    constexpr double kMost = 10000;
    if (approach.replan->every > 0 && most / approach.replan->every > kMost)
      add("approach.replan.every", "approach.replan.every is {} [s], which makes more than {} plans",
          approach.replan->every, kMost);
  }

  void check_knowledge(const PostImpactSetup& post) {
    if (post.assumed) check_held(post.assumed->target, "post_impact.assumed");
    if (post.model == LawModel::assumed && !post.assumed)
      add("post_impact.model", "post_impact.model is assumed, which needs post_impact.assumed");
    if (post.model == LawModel::estimated && !post.identify)
      add("post_impact.model", "post_impact.model is estimated, which needs post_impact.identify");
    if (post.assumed) check_assumed(*post.assumed);
    if (!post.identify) return;
    const IdentifySetup& identify = *post.identify;
    check_held(identify.target, "post_impact.identify");
    if (!problem_.control) {
      add_key("post_impact.identify",
              "post_impact.identify needs the sample times of the on-board computer: control: {{period: ...}} is "
              "missing");
    } else {
      check_time(identify.sample_time, "post_impact.identify");
    }
    const double end = identify.from + identify.duration;
    if (identify.duration > 0 && post.duration > 0 && end > post.duration)
      add("post_impact.identify.duration", "post_impact.identify ends after {} [s], must end within post_impact's {}",
          end, post.duration);
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add_key(
          "post_impact.identify",
          "post_impact.identify: the robot's base is fixed, so momentum is not conserved and cannot identify a target");
    const bool forced = problem_.orbit || !problem_.loads.empty() || !is_zero(problem_.gravity);
    if (forced && identify.base == IdentifySetup::Base::rotation)
      add("post_impact.identify.base",
          "post_impact.identify.base: rotation is for motion without external forces; use twist");
    if (forced && problem_.targets.size() > 1)
      add_key("post_impact.identify",
              "post_impact.identify: with gravity, an orbit or external_wrenches there must be only one target");
    if (identify.excitation) check_excitation(post, end);
  }

  void check_excitation(const PostImpactSetup& post, double end) {
    using Joints = PostImpactSetup::Joints;
    const std::string path = "post_impact.identify.excitation";
    if (post.joints != Joints::pd && post.joints != Joints::computed_torque && post.joints != Joints::controller)
      add_key(path, "{}: joints that are {} follow no reference; use joints: pd, computed_torque or controller", path,
              name_of(post.joints))
          .relies_on = "post_impact.joints";
    if (post.move && post.move->after < end)
      add("post_impact.move.after",
          "post_impact.move begins after {} [s], must not begin before {}, when the "
          "excitation ends",
          post.move->after, end);
  }

  // Each value may be valid with the true values of the others, but not all together.
  void check_assumed(const AssumedTarget& assumed) {
    if (!assumed.inertia) return;
    const std::string fault = inertia_fault(*assumed.inertia);
    if (!fault.empty()) add("post_impact.assumed.inertia", "post_impact.assumed.inertia: {}", fault);
  }

  void check_held(const std::string& name, const std::string& path) {
    std::set<std::string> held;
    for (const GraspSetup& grasp : problem_.grasps) {
      if (!grasp.contact && find_named(problem_.targets, grasp.target)) held.insert(grasp.target);
    }
    if (held.empty()) {
      if (!problem_.grasps.empty() && find_named(problem_.targets, problem_.grasps[0].target))
        add_key(path, "{}: no grasp holds a target", path);
    } else if (name.empty() && held.size() > 1) {
      add_key(path, "{}: the grasps hold {} targets; name one with 'target'", path, held.size());
    } else if (!name.empty() && find_named(problem_.targets, name) && !held.contains(name)) {
      add(path + ".target", "{}.target is \"{}\", which no grasp holds", path, name);
    }
  }
};

}  // namespace

void find_sensor_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  SensorConflicts(problem, found).find();
}

}  // namespace grapnel
