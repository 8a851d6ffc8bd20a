#include "grapnel/capture/motion_phases.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/capture/grasp_events.hpp"
#include "grapnel/capture/sampled_gains.hpp"

namespace grapnel {
namespace {

// Relative distance of a decreasing quantity from its limit: 0 at the limit.
double margin_above(double value, double limit) { return value / limit - 1; }

double largest_joint_rate(const CaptureSystem& system, const State& state) {
  double most = 0;
  for (const int joint : system.robot_joints)
    most = std::max(most, std::abs(state.v[system.model.joint_body(joint).v]));
  return most;
}

// The maximum share of its momentum capacity that a wheel holds.
double largest_wheel_share(const CaptureProblem& problem, const CaptureSystem& system, const State& state) {
  double most = 0;
  for (std::size_t w = 0; w < system.wheels.size(); ++w) {
    const double rate = state.v[system.model.joint_body(system.wheels[w]).v];
    most = std::max(most, std::abs(rate) / problem.robot.wheels[w].rate);
  }
  return most;
}

// The margin of a phase's conditions on the state: their maximum, since all must hold. Minus infinity without
// conditions.
class StateMargin {
 public:
  StateMargin(const CaptureProblem& problem, const PhaseUntil& until, const CaptureSystem& system)
      : problem_(problem), until_(until), system_(system), kinematics_(system.model) {}

  double operator()(const State& state) {
    double margin = -std::numeric_limits<double>::infinity();
    const auto fall = [&](const std::optional<double>& limit, auto value) {
      if (limit) margin = std::max(margin, margin_above(value(), *limit));
    };
    if (until_.base_rate || until_.target_rate || until_.relative_rate)
      forward_kinematics(system_.model, state, kinematics_);
    const Vector3d base = kinematics_.V_WB[system_.base].angular;
    fall(until_.base_rate, [&] { return norm(base); });
    fall(until_.target_rate, [&] { return largest_target_rate(Vector3d::zero()); });
    fall(until_.relative_rate, [&] { return largest_target_rate(base); });
    fall(until_.joint_rate, [&] { return largest_joint_rate(system_, state); });
    const auto share = [&] { return largest_wheel_share(problem_, system_, state); };
    fall(until_.wheel_momentum_below, share);
    if (until_.wheel_momentum_above) margin = std::max(margin, 1 - share() / *until_.wheel_momentum_above);
    return margin;
  }

 private:
  double largest_target_rate(const Vector3d& relative_to) const {
    double most = 0;
    for (const int frame : system_.target_frames)
      most = std::max(most, norm(frame_twist(system_.model, kinematics_, frame).angular - relative_to));
    return most;
  }

  const CaptureProblem& problem_;
  PhaseUntil until_;
  const CaptureSystem& system_;
  Kinematics kinematics_;
};

bool is_of_state(const PhaseUntil& until) {
  return until.base_rate || until.target_rate || until.relative_rate || until.joint_rate ||
         until.wheel_momentum_below || until.wheel_momentum_above;
}

// The condition of the current phase, if it requires no event that has not occurred; null: it cannot hold yet.
const PhaseUntil* open_condition(const CaptureRun& run) {
  if (run.joints.approaching() || !run.problem.post_impact || !run.problem.post_impact->until) return nullptr;
  const PhaseUntil& until = *run.problem.post_impact->until;
  if (until.event == PhaseUntil::Event::law_ended && !run.law.is_over()) return nullptr;
  if (until.event == PhaseUntil::Event::latched && !run.monitor.stages().has_latched()) return nullptr;
  return &until;
}

}  // namespace

StopCondition phase_condition(const CaptureRun& run, const CaptureSystem& system) {
  const PhaseUntil* until = open_condition(run);
  if (!until || !is_of_state(*until)) return {};
  return
      [margin = StateMargin(run.problem, *until, system)](double, const State& state) mutable { return margin(state); };
}

MotionPhase begin_motion_phase(CaptureRun& run) {
  const PostImpactSetup& setup = *run.problem.post_impact;
  const double now = run.bodies.time;
  run.joints.control_attitude(setup.base_control, run.bodies);
  run.joints.begin_post_impact(run.bodies);
  run.identification.begin_post_impact(now);
  run.law.begin_post_impact(run.bodies.system, run.joints.known_posture(run.bodies));
  run.condition_met = false;
  run.monitor.stages().begin_motion(run.phase_name(), setup, now);
  for (std::string& text : unstable_gains(run, false)) run.result.warnings.push_back(std::move(text));
  return {run.phase_name(), now, now + setup.duration};
}

bool moves_on(CaptureRun& run, const MotionPhase& phase) {
  const bool any_left = close_due_grasps(run, phase);
  const PhaseUntil* until = open_condition(run);
  if (until && StateMargin(run.problem, *until, run.bodies.system)(run.bodies.state) <= 0) run.condition_met = true;
  return any_left && !run.condition_met;
}

bool end_motion_phase(CaptureRun& run, const MotionPhase& phase) {
  using End = MotionPhaseReport::End;
  run.result.phases.push_back({phase.name, phase.begin, run.bodies.time,
                               run.condition_met ? End::condition : End::duration, run.describe_now()});
  run.monitor.stages().end_motion(run.bodies.time);
  const PostImpactSetup before = *run.problem.post_impact;
  if (!run.next_motion_phase()) return false;
  run.law.next_phase(run.result);
  run.joints.next_phase(before, run.bodies);
  if (before.joints != PostImpactSetup::Joints::braked) stop_joints(run);
  return true;
}

}  // namespace grapnel
