#include "grapnel/capture/coordinated_control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

// Minimum ratio of the smallest to the largest singular value that a law divides by; below it, joint rates become
// large.
constexpr double kRankLost = 1e-3;

// Distance of a joint from the nearer limit, relative to its range; infinite without a limit.
double room(const JointLimits& limits, double position) {
  const double range = limits.upper - limits.lower;
  return std::min(position - limits.lower, limits.upper - position) / (std::isfinite(range) && range > 0 ? range : 1.0);
}

struct LawEntry {
  PostImpactSetup::Joints joints;
  std::unique_ptr<CoordinatedLaw> (*make)(const CaptureProblem& problem);
};
constexpr LawEntry kLaws[] = {
    {PostImpactSetup::Joints::detumble, detumbling_of_run},
    {PostImpactSetup::Joints::keep_base_attitude, base_keeping_of_run},
    {PostImpactSetup::Joints::impedance, impedance_of_run},
    {PostImpactSetup::Joints::grasp_force, grasp_force_of_run},
};

}  // namespace

void CoordinatedLaw::write(CaptureResult& result) const {
  std::erase_if(result.laws, [&](const LawReport& r) { return r.law == law_ && r.in_approach == in_approach_; });
  if (report_) result.laws.push_back(*report_);
}

void CoordinatedLaw::note_command(double time, const JointLawCommand& command) {
  lower_to(report_->least_share, report_->least_share_time, command.scale, time);
  lower_to(report_->least_condition, report_->least_condition_time, command.condition, time);
  report_->within_limits = report_->within_limits && command.within_limits;
}

std::unique_ptr<CoordinatedLaw> coordinated_law_of_post_impact(const CaptureProblem& problem) {
  if (!problem.post_impact) return {};
  for (const LawEntry& law : kLaws) {
    if (law.joints == problem.post_impact->joints) return law.make(problem);
  }
  return {};
}

bool is_held(const CaptureProblem& problem, const CaptureSystem& system, const std::string& target) {
  return std::any_of(system.grasps.begin(), system.grasps.end(),
                     [&](const HeldGrasp& g) { return problem.grasps[g.grasp].target == target; });
}

// Target name => indices in robot_joints of all joints between the base and the end-effectors that hold the target.
std::vector<std::size_t> joints_that_carry(const CaptureProblem& problem, const CaptureSystem& system,
                                           const std::string& target) {
  const Model& model = system.model;
  std::vector<bool> carries(model.bodies().size(), false);
  for (const HeldGrasp& grasp : system.grasps) {
    if (problem.grasps[grasp.grasp].target != target) continue;
    for (int body = grasp.frames.body_a; body >= 0; body = model.bodies()[body].parent) carries[body] = true;
  }
  std::vector<std::size_t> joints;
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    if (carries[model.joints()[system.robot_joints[j]]]) joints.push_back(j);
  }
  return joints;
}

std::vector<int> steady_joints(const CaptureSystem& system) {
  std::vector<int> joints;
  for (const CaptureSystem::Gyro& gyro : system.gyros) joints.insert(joints.end(), {gyro.gimbal, gyro.rotor});
  return joints;
}

std::string held_target(const CaptureProblem& problem, const std::string& named) {
  std::string target = named;
  for (const GraspSetup& grasp : problem.grasps) {
    if (target.empty() && !grasp.contact) target = grasp.target;
  }
  return target;
}

CoordinatedControl::CoordinatedControl(const CaptureProblem& problem) : problem_(problem) {
  approach_.part = coordinated_law_of_approach(problem);
  after_.part = coordinated_law_of_post_impact(problem);
  if (approach_.part) now_ = &approach_;
}

void CoordinatedControl::begin_post_impact(const CaptureSystem& system, const State& known) {
  now_ = after_.part ? &after_ : nullptr;
  if (now_) now_->part->begin_post_impact(system, known);
}

void CoordinatedControl::next_phase(CaptureResult& result) {
  if (after_.part) after_.part->write(result);
  law_.reset();
  now_ = nullptr;
  after_ = {coordinated_law_of_post_impact(problem_)};
}

bool CoordinatedControl::ends_by_release(const CaptureSystem& system, double time) {
  if (!now_ || !now_->begun || now_->over || now_->part->has_work(system)) return false;
  // The motion up to the release is known from the end of the previous piece.
  now_->part->released_at(time);
  end(LawEnd::released, "");
  return true;
}

std::shared_ptr<JointLaw> CoordinatedControl::begin_segment(const CaptureSystem& system, const State& state,
                                                            const State& known, double time,
                                                            std::shared_ptr<const Model> law_model) {
  law_.reset();
  law_model_ = std::move(law_model);
  if (!now_ || now_->over || !now_->part->has_work(system)) return {};
  system_ = &system;
  law_ = now_->part->begin_segment(system, law_model_ ? *law_model_ : system.model, state, known, time);
  now_->begun = true;
  return law_;
}

// Time, state => smallest margin until the law must end and its cause: condition of the law over its minimum less 1,
// margins of the law itself, distances of its joints from their position limits. Zero or less ends the law.
CoordinatedControl::Margin CoordinatedControl::min_margin(double time, const State& state) {
  Margin least{std::numeric_limits<double>::infinity(), LawEnd::rank_lost, ""};
  if (!law_->continues_at_reduced_rank()) least.value = law_->at(time, state, {}).condition / kRankLost - 1;
  const auto consider = [&](double value, LawEnd end, const std::string& joint) {
    if (!(value >= least.value)) least = {value, end, joint};
  };
  now_->part->consider(state, consider);
  for (int j : law_->joints()) {
    const Body& body = system_->model.joint_body(j);
    consider(room(body.description.joint.limits, state.q[body.q]), LawEnd::joint_limit, body.description.joint.name);
  }
  return least;
}

double CoordinatedControl::margin(double time, const State& state) { return min_margin(time, state).value; }

void CoordinatedControl::step(const PhaseStep& step) {
  if (!works()) return;
  for (const double t : {step.begin, 0.5 * (step.begin + step.end), step.end}) {
    const PhaseSample sample = step.at(t);
    now_->part->note(sample, law_->at(t, sample.state, sample.dynamics->force_beside()));
  }
}

void CoordinatedControl::end(LawEnd how, const std::string& joint) {
  now_->over = true;
  now_->part->end(how, joint);
}

bool CoordinatedControl::end_segment(const State& state, double time, bool stopped, double other) {
  if (!works()) return false;
  now_->part->describe(state, time);
  if (!stopped) return false;
  const Margin least = min_margin(time, state);
  if (!(least.value < other)) return false;
  end(least.end, least.joint);
  return true;
}

void CoordinatedControl::write(CaptureResult& result) const {
  for (const Phase* phase : {&approach_, &after_}) {
    if (phase->part) phase->part->write(result);
  }
}

}  // namespace grapnel
