#include "grapnel/capture/capture_run.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace grapnel {

const Body& joint_body(const CaptureSystem& system, std::size_t joint) {
  return system.model.bodies()[system.model.joints()[system.robot_joints[joint]]];
}

// --- What joints do ---

RunJoints::RunJoints(const CaptureProblem& problem, const RunBodies& bodies) : problem_(problem) {
  control_.approaching = problem.approach.has_value();
  control_.settled.assign(bodies.system.robot_joints.size(), false);
  control_.hold.assign(bodies.system.robot_joints.size(), 0);
}

bool RunJoints::settle_to(PostImpactSetup::Joints joints) const {
  return problem_.post_impact && problem_.post_impact->joints == joints;
}

void RunJoints::settle(const RunBodies& bodies, std::size_t joint) {
  control_.settled[joint] = true;
  control_.hold[joint] = bodies.state.q[joint_body(bodies.system, joint).q];
}

void RunJoints::settle_all(const RunBodies& bodies) {
  control_.approaching = false;
  for (std::size_t j = 0; j < size(); ++j) settle(bodies, j);
}

void RunJoints::settle_arm(const RunBodies& bodies, std::size_t grasp) {
  const Model& model = bodies.system.model;
  int body = model.frames()[model.frame_index(problem_.grasps[grasp].end_effector)].body;
  for (; body >= 0; body = model.bodies()[body].parent) {
    for (std::size_t j = 0; j < size(); ++j) {
      if (model.joints()[bodies.system.robot_joints[j]] == body) settle(bodies, j);
    }
  }
}

void RunJoints::control_attitude(const std::optional<BaseControlSetup>& setup, const RunBodies& bodies) {
  control_.attitude.reset();
  if (setup) control_.attitude = attitude_control(*setup, bodies.system, bodies.state).R_WD;
}

PhaseSetup RunJoints::setup(const RunBodies& bodies) const {
  return segment_setup(problem_, bodies.system, bodies.state, trajectories_, control_);
}

PhaseSetup RunJoints::exact_approach(const RunBodies& bodies) const {
  return approach_setup(problem_, bodies.system, bodies.state, trajectories_, true);
}

bool RunJoints::are_controlled() const {
  return approaching() || settle_to(PostImpactSetup::Joints::pd) || problem_.post_impact->base_control.has_value();
}

bool RunJoints::efforts_are_cut() const {
  return approaching() ? problem_.approach->tracking.mode != JointControl::prescribed
                       : settle_to(PostImpactSetup::Joints::pd);
}

std::vector<JointTrajectory> RunJoints::references() const {
  if (!approaching()) return {};
  std::vector<JointTrajectory> joints = trajectories_;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (is_settled(j)) joints[j] = JointTrajectory::at_rest(control_.hold[j]);
  }
  return joints;
}

std::vector<HeldRate> RunJoints::driven_rates(const RunBodies& bodies) const {
  std::vector<HeldRate> held;
  if (!approaching() || problem_.approach->tracking.mode != JointControl::prescribed) return held;
  for (std::size_t j = 0; j < size(); ++j) {
    const int v = joint_body(bodies.free, j).v;
    if (!is_settled(j)) held.push_back({v, bodies.state.v[v]});
  }
  return held;
}

std::vector<HeldRate> RunJoints::rates_in_impact(const RunBodies& bodies) const {
  std::vector<HeldRate> held = driven_rates(bodies);
  const ImpactSetup::Joints joints = problem_.impact->joints;
  if (joints == ImpactSetup::Joints::free) return held;
  const std::size_t driven = held.size();
  for (std::size_t j = 0; j < size(); ++j) {
    const int v = joint_body(bodies.free, j).v;
    const auto end = held.begin() + static_cast<std::ptrdiff_t>(driven);
    if (std::any_of(held.begin(), end, [&](const HeldRate& h) { return h.velocity == v; })) continue;
    held.push_back({v, joints == ImpactSetup::Joints::braked ? 0.0 : bodies.state.v[v]});
  }
  return held;
}

// --- The run ---

CaptureRun::CaptureRun(const CaptureProblem& the_problem, const MovingFrame& the_frame, CaptureDetail the_detail,
                       CaptureProgress the_progress, SeriesSink* sink, CaptureResult& the_result)
    : problem(the_problem),
      frame(the_frame),
      detail(the_detail),
      progress(std::move(the_progress)),
      result(the_result),
      bodies(problem),
      joints(problem, bodies),
      schedule(problem),
      monitor(problem, bodies.free, frame, detail, sink, result) {}

std::string CaptureRun::next_name(const std::string& phase) {
  const int count = ++pieces_[phase];
  return count == 1 ? phase : fmt::format("{}_{}", phase, count);
}

void CaptureRun::to_free() {
  if (bodies.system.grasps.empty()) return;
  bodies.state = take_apart(bodies.free, bodies.system, bodies.state);
  bodies.system = bodies.free;
  monitor.set_system(bodies.system);
}

void CaptureRun::to_joined() {
  if (bodies.held.empty()) return;
  CapturedSystem joined = join_targets(bodies.free, bodies.state, bodies.held);
  bodies.system = std::move(joined.system);
  bodies.state = std::move(joined.state);
  monitor.set_system(bodies.system);
}

Momentumd CaptureRun::momentum_about_origin() const {
  return momentum_about(bodies.free.model, forward_kinematics(bodies.free.model, bodies.state), Vector3d::zero());
}

// Problems are large: with all of its grasps it is the problem itself.
const CaptureProblem& CaptureRun::with_grasps(const std::vector<std::size_t>& grasps) {
  bool all = grasps.size() == problem.grasps.size();
  for (std::size_t i = 0; all && i < grasps.size(); ++i) all = grasps[i] == i;
  if (all) return problem;
  if (!part_) {
    part_.emplace(problem);
    part_grasps_.clear();
    part_->grasps.clear();
  }
  if (part_grasps_ == grasps) return *part_;
  part_grasps_ = grasps;
  part_->grasps.clear();
  for (std::size_t i : grasps) part_->grasps.push_back(problem.grasps[i]);
  return *part_;
}

PhaseEnd CaptureRun::describe_now() const {
  PhaseEnd end = describe(problem, bodies.system, bodies.state, bodies.time);
  to_world(frame, end);
  return end;
}

}  // namespace grapnel
