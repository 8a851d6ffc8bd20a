#include <algorithm>

#include "grapnel/capture/law_of_run.hpp"
#include "grapnel/control/detumbling.hpp"

namespace grapnel {
namespace {

// A target is at rest where this part is left of its angular momentum.
constexpr double kTumblesNoMore = 1e-6;

class DetumblingOfRun : public LawOfRun {
 public:
  explicit DetumblingOfRun(const CaptureProblem& problem)
      : problem_(problem), target_(held_target(problem, problem.post_impact->detumble->target)) {}

  bool has_work(const CaptureSystem& system) const override { return is_held(problem_, system, target_); }

  std::shared_ptr<JointLaw> begin_piece(const CaptureSystem& system, const Model& law_model, const State& state,
                                        const State&, double time) override {
    const PostImpactSetup& post = *problem_.post_impact;
    system_ = &system;
    kinematics_ = Kinematics(system.model);
    LawScope scope{{}, system.closures, problem_.gravity, steady_joints(system)};
    law_ = {};
    law_.torque = post.detumble->torque;
    // Held for a period, a command must not take more than is there.
    if (problem_.control) law_.shortest = 2 * (problem_.control->timing.period + problem_.control->timing.delay);
    for (const HeldGrasp& grasp : system.grasps) {
      if (problem_.grasps[grasp.grasp].target == target_) law_.target = grasp.frames.body_b;
    }
    for (const std::size_t j : joints_that_carry(problem_, system, target_)) {
      scope.joints.push_back(system.robot_joints[j]);
      law_.damping.push_back(post.kd[j]);
    }
    if (!report_) begin_report(state, time);
    return std::make_shared<Detumbling>(law_model, law_, std::move(scope));
  }

  void consider(const State& state, const Consider& consider) override {
    forward_kinematics(system_->model, state, kinematics_);
    const double L = norm(target_motion(system_->model, kinematics_, law_.target).angular_momentum);
    const double before = report_->angular_momentum_before;
    const double left = std::max(kTumblesNoMore * before, law_.torque * law_.shortest);
    consider(before > 0 ? (L - left) / before : 0, LawEnd::at_rest, "");
  }

  void note(const PhaseSample& sample, const JointLawCommand& command) override {
    note_torque(sample);
    DetumblingReport& r = *report_;
    lower_to(r.least_scale, r.least_scale_time, command.scale, sample.time);
    lower_to(r.least_condition, r.least_condition_time, command.condition, sample.time);
    r.within_limits = r.within_limits && command.within_limits;
  }

  void describe(const State& state, double time) override {
    const Model& model = system_->model;
    const Kinematics kinematics = forward_kinematics(model, state);
    const TargetMotion3d motion = target_motion(model, kinematics, model.body_index(target_body_name(target_)));
    report_->end = time;
    report_->angular_momentum_after = norm(motion.angular_momentum);
    report_->speed_after = norm(motion.velocity);
  }

  void end(LawEnd how, const std::string& joint) override { report_->ended = how, report_->joint = joint; }
  void released_at(double time) override { report_->end = time; }
  void write(CaptureResult& result) const override { result.detumbling = report_; }

 private:
  void begin_report(const State& state, double time) {
    forward_kinematics(system_->model, state, kinematics_);
    const TargetMotion3d motion = target_motion(system_->model, kinematics_, law_.target);
    DetumblingReport& report = report_.emplace();
    report.target = target_, report.begin = time, report.torque_bound = law_.torque;
    report.angular_momentum_before = norm(motion.angular_momentum), report.speed_before = norm(motion.velocity);
    report.expected_duration = detumbling_time(motion.angular_momentum, law_.torque);
    describe(state, time);  // until more is known
  }

  // What the grasps give the target, by its motion.
  void note_torque(const PhaseSample& sample) {
    const int target = law_.target;
    forward_kinematics(system_->model, sample.state, kinematics_);
    const Vector3d alpha =
        body_accelerations(system_->model, kinematics_, sample.dynamics->acceleration())[target].angular;
    const Symmetric3d I = rotate(kinematics_.X_WB[target].R, system_->model.bodies()[target].description.inertia);
    const Vector3d w = kinematics_.V_WB[target].angular;
    report_->largest_torque = std::max(report_->largest_torque, norm(I * alpha + cross(w, I * w)));
  }

  const CaptureProblem& problem_;
  std::string target_;  // that is detumbled
  const CaptureSystem* system_ = nullptr;
  DetumblingLaw law_;  // of the piece at hand
  Kinematics kinematics_;
  std::optional<DetumblingReport> report_;  // of all pieces
};

}  // namespace

std::unique_ptr<LawOfRun> detumbling_of_run(const CaptureProblem& problem) {
  if (!problem.post_impact->detumble) return {};
  return std::make_unique<DetumblingOfRun>(problem);
}

}  // namespace grapnel
