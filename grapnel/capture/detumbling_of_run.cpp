#include <fmt/format.h>
#include <algorithm>

#include "grapnel/capture/coordinated_law.hpp"
#include "grapnel/control/detumbling.hpp"

namespace grapnel {
namespace {

// A target is at rest if its angular momentum is below this fraction of its initial value.
constexpr double kTumblesNoMore = 1e-6;

class DetumblingOfRun : public CoordinatedLaw {
 public:
  explicit DetumblingOfRun(const CaptureProblem& problem)
      : CoordinatedLaw(LawReport::Law::detumbling),
        problem_(problem),
        target_(held_target(problem, problem.post_impact->detumble->target)) {}

  bool has_work(const CaptureSystem& system) const override { return is_held(problem_, system, target_); }

  std::shared_ptr<JointLaw> begin_segment(const CaptureSystem& system, const Model& law_model, const State& state,
                                          const State&, double time) override {
    const PostImpactSetup& post = *problem_.post_impact;
    system_ = &system;
    kinematics_ = Kinematics(system.model);
    LawScope scope{{}, system.closures, problem_.gravity, steady_joints(system)};
    law_ = {};
    law_.torque = post.detumble->torque;
    // A command held for a period must not remove more than the current angular momentum.
    if (problem_.control) {
      const double held = problem_.control->timing.period + problem_.control->timing.delay;
      law_.shortest = 2 * held, law_.settling = std::max(law_.settling, 2 * held);
    }
    law_.bodies = bodies_of_target(system, target_index(problem_, target_));
    limited_.clear();
    for (const HeldGrasp& grasp : system.grasps) {
      const GraspSetup& setup = problem_.grasps[grasp.grasp];
      if (setup.target != target_ || grasp.closure == HeldGrasp::kRedundant) continue;
      const LoadRating& rating = end_effector_of(problem_, setup).rating;
      law_.holds.push_back({grasp.frames, grasp.closure, rating.force, rating.moment});
    }
    for (const std::size_t j : joints_that_carry(problem_, system, target_)) {
      scope.joints.push_back(system.robot_joints[j]);
      law_.damping.push_back(post.kd[j]);
      const JointDescription& joint = system.model.joint_body(scope.joints.back()).description.joint;
      limited_.push_back(fmt::format("the effort limit of joint '{}' ({:.6g} {})", joint.name, joint.limits.effort,
                                     slides_along_axis(joint.type) ? "N" : "N m"));
    }
    for (const HeldGrasp& grasp : system.grasps) name_limits(grasp);
    const bool begins = !report_;
    if (begins) describe_start(state, time);
    auto law = std::make_shared<Detumbling>(law_model, law_, std::move(scope));
    if (begins) report_->first_share = law->at(time, state, {}).scale;
    return law;
  }

  void consider(const State& state, const Consider& consider) override {
    forward_kinematics(system_->model, state, kinematics_);
    const double L = norm(target_motion(system_->model, kinematics_, law_.bodies).angular_momentum);
    const double before = report_->angular_momentum_before;
    const double left = std::max(kTumblesNoMore * before, law_.torque * law_.shortest);
    consider(before > 0 ? (L - left) / before : 0, LawEnd::at_rest, "");
  }

  void note(const PhaseSample& sample, const JointLawCommand& command) override {
    note_torque(sample);
    note_command(sample.time, command);
    LawReport& r = *report_;
    if (command.limiting < 0 || !(command.demand > r.largest_demand)) return;
    r.largest_demand = command.demand, r.largest_demand_time = sample.time;
    r.limiting = limited_[command.limiting];
  }

  void describe(const State& state, double time) override {
    const Model& model = system_->model;
    const Kinematics kinematics = forward_kinematics(model, state);
    const TargetMotion3d motion = target_motion(model, kinematics, law_.bodies);
    report_->end = time;
    report_->angular_momentum_after = norm(motion.angular_momentum);
    report_->speed_after = norm(motion.velocity);
  }

  void write(CaptureResult& result) const override {
    CoordinatedLaw::write(result);
    if (report_) warn(*report_, result.warnings);
  }

 private:
  void describe_start(const State& state, double time) {
    forward_kinematics(system_->model, state, kinematics_);
    const TargetMotion3d motion = target_motion(system_->model, kinematics_, law_.bodies);
    LawReport& report = begin_report(time);
    report.target = target_, report.torque_bound = law_.torque;
    report.angular_momentum_before = norm(motion.angular_momentum), report.speed_before = norm(motion.velocity);
    report.expected_duration = detumbling_time(motion.angular_momentum, law_.torque);
    describe(state, time);  // until better estimates exist
  }

  // Names the limits of a grasp, in the order of DetumblingCommand::limiting.
  void name_limits(const HeldGrasp& grasp) {
    const GraspSetup& setup = problem_.grasps[grasp.grasp];
    if (setup.target != target_ || grasp.closure == HeldGrasp::kRedundant) return;
    const LoadRating& rating = end_effector_of(problem_, setup).rating;
    limited_.push_back(fmt::format("the force rating of '{}' ({:.6g} N)", setup.end_effector, rating.force));
    limited_.push_back(fmt::format("the moment rating of '{}' ({:.6g} N m)", setup.end_effector, rating.moment));
  }

  // Warns if limits prevent the commanded torque, or the rest within the phase.
  void warn(const LawReport& r, std::vector<std::string>& warnings) const {
    if (!r.within_limits) {
      warnings.push_back(
          fmt::format("post_impact.detumble: at t = {:.6g} s the law exceeds the limits: even without braking, "
                      "moving '{}' requires "
                      "{:.3g} times {}; efforts were scaled down, and the target did not follow its reference",
                      r.largest_demand_time, r.target, r.largest_demand, r.limiting));
    }
    const double left = problem_.post_impact->duration, takes = r.expected_duration / r.first_share;
    if (r.ended == LawEnd::at_rest || !(takes > left)) return;
    warnings.push_back(
        r.first_share > 0
            ? fmt::format(
                  "post_impact.detumble: at the start of the law, limits reduce its torque to {:.3g} of {:.6g} N m, so "
                  "that '{}' comes to rest after about {:.4g} s; post_impact ends after {:.6g} s",
                  r.first_share, r.torque_bound, r.target, takes, left)
            : fmt::format(
                  "post_impact.detumble: at the start of the law, limits reduce its torque from {:.6g} N m to zero",
                  r.torque_bound));
  }

  // The torque of the grasps on the target, from the motion of its bodies.
  void note_torque(const PhaseSample& sample) {
    const Model& model = system_->model;
    forward_kinematics(model, sample.state, kinematics_);
    const std::vector<BodyAcceleration> accelerations =
        body_accelerations(model, kinematics_, sample.dynamics->acceleration());
    const Vector3d com = held_body(model, kinematics_, law_.bodies).com;
    Vector3d torque = Vector3d::zero();
    for (int b : law_.bodies) {
      const BodyDescription& body = model.bodies()[b].description;
      const Symmetric3d I = rotate(kinematics_.X_WB[b].R, body.inertia);
      const Vector3d w = kinematics_.V_WB[b].angular, arm = kinematics_.X_WB[b].R * body.com;
      const Vector3d alpha = accelerations[b].angular;
      torque += I * alpha + cross(w, I * w);
      if (law_.bodies.size() == 1) continue;
      const Vector3d a = accelerations[b].linear + cross(alpha, arm) + cross(w, cross(w, arm)) - problem_.gravity;
      torque += body.mass * cross(kinematics_.X_WB[b].p + arm - com, a);
    }
    report_->largest_torque = std::max(report_->largest_torque, norm(torque));
  }

  const CaptureProblem& problem_;
  std::string target_;  // the target to detumble
  const CaptureSystem* system_ = nullptr;
  DetumblingLaw law_;                 // of the current piece
  std::vector<std::string> limited_;  // names of the limits that DetumblingCommand::limiting counts
  Kinematics kinematics_;
};

}  // namespace

std::unique_ptr<CoordinatedLaw> detumbling_of_run(const CaptureProblem& problem) {
  if (!problem.post_impact->detumble) return {};
  return std::make_unique<DetumblingOfRun>(problem);
}

}  // namespace grapnel
