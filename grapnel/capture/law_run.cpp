#include "grapnel/capture/law_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

// A target is at rest where this part is left of its angular momentum.
constexpr double kAtRest = 1e-6;
// Of the singular values that a law divides by, the least over the largest: below, joints move fast for little.
constexpr double kRankLost = 1e-3;
// Of the base's turning by the joints, as the law begins: what is less is no more than rounding.
constexpr double kNoTurning = 1e-9;

void raise(double& most, double& when, double value, double time) {
  if (!(value <= most)) most = value, when = time;
}
void lower(double& least, double& when, double value, double time) {
  if (!(value >= least)) least = value, when = time;
}

// How far a joint is from the nearer end of its range, relative to it; an end that is not there is far away.
double room(const JointLimits& limits, double position) {
  const double range = limits.upper - limits.lower;
  return std::min(position - limits.lower, limits.upper - position) / (std::isfinite(range) && range > 0 ? range : 1.0);
}

}  // namespace

LawRun::LawRun(const CaptureProblem& problem) : problem_(problem) {
  if (!problem.post_impact || !problem.post_impact->detumble) return;
  target_ = problem.post_impact->detumble->target;
  for (const GraspSetup& grasp : problem.grasps) {
    if (target_.empty() && !grasp.contact) target_ = grasp.target;
  }
}

void LawRun::begin_post_impact(const Rotationd& R_WB) {
  may_work_ = problem_.post_impact && is_law(problem_.post_impact->joints);
  R_WD_ = R_WB;
}

bool LawRun::is_held(const CaptureSystem& system) const {
  return std::any_of(system.grasps.begin(), system.grasps.end(),
                     [&](const HeldGrasp& g) { return problem_.grasps[g.grasp].target == target_; });
}

bool LawRun::ends_by_release(const CaptureSystem& system, double time) {
  if (!detumbling_ || over_ || is_held(system)) return false;
  // How it moved is known from the end of the piece before: now it hangs on nothing.
  detumbling_->end = time;
  end(LawEnd::released, "");
  return true;
}

std::optional<JointLaw> LawRun::begin_piece(const CaptureSystem& system, const State& state, double time,
                                            std::shared_ptr<const Model> law_model) {
  evaluation_.reset();
  law_model_ = std::move(law_model);
  const bool detumbles = may_work_ && problem_.post_impact->joints == PostImpactSetup::Joints::detumble;
  if (!may_work_ || over_ || (detumbles && !is_held(system))) return {};
  system_ = &system;
  kinematics_ = Kinematics(system.model);
  law_ = make_law(system);
  if (!detumbling_ && !base_keeping_) report_begin(state, time);
  if (auto* keeping = std::get_if<BaseKeepingLaw>(&law_->law)) keeping->rank = base_keeping_->rank;
  evaluation_.emplace(law_model_ ? *law_model_ : system.model, *law_);
  return law_;
}

JointLaw LawRun::make_law(const CaptureSystem& system) const {
  const PostImpactSetup& post = *problem_.post_impact;
  const Model& model = system.model;
  JointLaw law;
  law.gravity = problem_.gravity;
  for (const CaptureSystem::Gyro& gyro : system.gyros) law.steady.insert(law.steady.end(), {gyro.gimbal, gyro.rotor});
  if (post.joints == PostImpactSetup::Joints::keep_base_attitude) {
    const KeepBaseSetup keep = post.keep_base_attitude.value_or(KeepBaseSetup{});
    law.joints = system.robot_joints;
    law.law = BaseKeepingLaw{system.base, keep.R_WD.value_or(R_WD_), keep.rate, keep.posture, keep.posture_rate};
    return law;
  }
  law.closures = system.closures;
  DetumblingLaw detumbling;
  detumbling.torque = post.detumble->torque;
  // Held for a period, a command must not take more than is there.
  if (problem_.control) detumbling.shortest = 2 * (problem_.control->timing.period + problem_.control->timing.delay);
  std::vector<bool> carries(model.bodies().size(), false);
  for (const HeldGrasp& grasp : system.grasps) {
    if (problem_.grasps[grasp.grasp].target != target_) continue;
    detumbling.target = grasp.frames.body_b;
    for (int body = grasp.frames.body_a; body >= 0; body = model.bodies()[body].parent) carries[body] = true;
  }
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    if (!carries[model.joints()[system.robot_joints[j]]]) continue;
    law.joints.push_back(system.robot_joints[j]);
    detumbling.damping.push_back(post.kd[j]);
  }
  law.law = std::move(detumbling);
  return law;
}

void LawRun::report_begin(const State& state, double time) {
  if (const auto* detumbling = std::get_if<DetumblingLaw>(&law_->law)) {
    forward_kinematics(system_->model, state, kinematics_);
    const TargetMotion3d motion = target_motion(system_->model, kinematics_, detumbling->target);
    DetumblingReport& report = detumbling_.emplace();
    report.target = target_, report.begin = time, report.torque_bound = detumbling->torque;
    report.angular_momentum_before = norm(motion.angular_momentum), report.speed_before = norm(motion.velocity);
    report.expected_duration = detumbling_time(motion.angular_momentum, detumbling->torque);
    describe(state, time);  // until more is known
    return;
  }
  EffortResponse response(system_->model, law_->joints, {}, law_->steady);
  const BaseKeepingCommand first =
      base_keeping_command(std::get<BaseKeepingLaw>(law_->law), state, {}, law_->gravity, response);
  BaseKeepingReport& report = base_keeping_.emplace();
  report.begin = time;
  for (int i = 0; i < 3; ++i) report.rank += first.singular_values[i] > kNoTurning * first.singular_values[0];
  describe(state, time);
}

LawRun::Margin LawRun::least_margin(const State& state) {
  Margin least{evaluation_->at(state, {}).condition / kRankLost - 1, LawEnd::rank_lost, ""};
  const auto consider = [&](double value, LawEnd end, const std::string& joint) {
    if (!(value >= least.value)) least = {value, end, joint};
  };
  if (const auto* detumbling = std::get_if<DetumblingLaw>(&law_->law)) {
    forward_kinematics(system_->model, state, kinematics_);
    const double L = norm(target_motion(system_->model, kinematics_, detumbling->target).angular_momentum);
    const double before = detumbling_->angular_momentum_before;
    const double left = std::max(kAtRest * before, detumbling->torque * detumbling->shortest);
    consider(before > 0 ? (L - left) / before : 0, LawEnd::at_rest, "");
  }
  for (int j : law_->joints) {
    const Body& body = system_->model.bodies()[system_->model.joints()[j]];
    consider(room(body.description.joint.limits, state.q[body.q]), LawEnd::joint_limit, body.description.joint.name);
  }
  return least;
}

double LawRun::margin(const State& state) { return least_margin(state).value; }

void LawRun::note(double time, const State& state, const JointLawCommand& command) {
  if (detumbling_) {
    DetumblingReport& r = *detumbling_;
    lower(r.least_scale, r.least_scale_time, command.scale, time);
    lower(r.least_condition, r.least_condition_time, command.condition, time);
    r.within_limits = r.within_limits && command.within_limits;
    return;
  }
  BaseKeepingReport& r = *base_keeping_;
  lower(r.least_share, r.least_share_time, command.scale, time);
  lower(r.least_condition, r.least_condition_time, command.condition, time);
  r.within_limits = r.within_limits && command.within_limits;
  const Rotationd R_WB = root_pose(system_->model, state, system_->base).R;
  raise(r.largest_angle, r.largest_angle_time, norm(attitude_deviation(std::get<BaseKeepingLaw>(law_->law), R_WB)),
        time);
}

// What the grasps give the target, by its motion.
void LawRun::note_torque(const PhaseSample& sample) {
  const int target = std::get<DetumblingLaw>(law_->law).target;
  forward_kinematics(system_->model, sample.state, kinematics_);
  const Vector3d alpha =
      body_accelerations(system_->model, kinematics_, sample.dynamics->acceleration())[target].angular;
  const Symmetric3d I = rotate(kinematics_.X_WB[target].R, system_->model.bodies()[target].description.inertia);
  const Vector3d w = kinematics_.V_WB[target].angular;
  detumbling_->largest_torque = std::max(detumbling_->largest_torque, norm(I * alpha + cross(w, I * w)));
}

void LawRun::step(const PhaseStep& step) {
  if (!works()) return;
  for (const double t : {step.begin, 0.5 * (step.begin + step.end), step.end}) {
    const PhaseSample sample = step.at(t);
    if (detumbling_) note_torque(sample);
    note(t, sample.state, evaluation_->at(sample.state, sample.dynamics->force_beside()));
  }
}

// How things are now, for the report.
void LawRun::describe(const State& state, double time) {
  const Model& model = system_->model;
  const Kinematics kinematics = forward_kinematics(model, state);
  if (detumbling_) {
    const TargetMotion3d motion = target_motion(model, kinematics, model.body_index(target_body_name(target_)));
    detumbling_->end = time;
    detumbling_->angular_momentum_after = norm(motion.angular_momentum);
    detumbling_->speed_after = norm(motion.velocity);
    return;
  }
  base_keeping_->end = time;
  base_keeping_->angle_after =
      norm(attitude_deviation(std::get<BaseKeepingLaw>(law_->law), kinematics.X_WB[system_->base].R));
  base_keeping_->angular_velocity_after = norm(kinematics.V_WB[system_->base].angular);
}

void LawRun::end(LawEnd how, const std::string& joint) {
  over_ = true;
  (detumbling_ ? detumbling_->ended : base_keeping_->ended) = how;
  (detumbling_ ? detumbling_->joint : base_keeping_->joint) = joint;
}

bool LawRun::end_piece(const State& state, double time, bool stopped, double other) {
  if (!works()) return false;
  describe(state, time);
  if (!stopped) return false;
  const Margin least = least_margin(state);
  if (!(least.value < other)) return false;
  end(least.end, least.joint);
  return true;
}

void LawRun::write(CaptureResult& result) const {
  result.detumbling = detumbling_;
  result.base_keeping = base_keeping_;
}

}  // namespace grapnel
