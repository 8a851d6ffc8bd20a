/// The interface of a phase's dynamics to JointModes: the efforts that hold joints at rest, and the accelerations
/// without them.

#include <algorithm>
#include <cmath>

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

// Prescribes held joints at rest.
void PhaseDynamics::hold_joints() {
  for (const JointModes::Joint& joint : modes_.joints()) {
    const bool held = joint.mode == JointModes::Mode::held;
    const bool computed = output_of(setup_.drives[joint.joint].control) == ControlOutput::acceleration;
    prescribed_[joint.v] = held;
    commanded_[joint.v] = held || computed;
    if (held) acceleration_[joint.v] = 0;
  }
}

// Time and y => modes of all joints with static friction or stops, by JointModes::choose(), whose queries are answered
// by evaluations at this fixed state: response, mobility (19.16) and released accelerations.
void PhaseDynamics::choose_joint_modes(double t, std::span<const double> y) {
  JointModes::Dynamics dynamics;
  dynamics.respond = [&] {
    hold_joints();
    load(t, y);
    if (projects()) close_loops(t);
    accelerate(t);
    return held_response();
  };
  dynamics.mobility = [&](std::span<const int> velocities) { return mobility_of(velocities); };
  dynamics.released = [&](std::span<const int> velocities) { return accelerations_released(velocities); };
  modes_.choose(y.first(model_.coordinates()), y.subspan(model_.coordinates(), model_.velocities()), dynamics);
  hold_joints();
}

// Undetermined efforts of the last evaluation.
JointModes::OpenEfforts PhaseDynamics::open_efforts() const {
  if (!solver_ || !modes_.any_held() || solver_->rank() == solver_->rows()) return {};
  LoopSolver::JointEfforts efforts = solver_->self_stress_efforts(workspace_);
  return {std::move(efforts.effort), std::move(efforts.terms)};
}

// The transmitted wrench of a joint is I A + p; its component along the axis has a rounding error of the wrench's size.
JointModes::Response PhaseDynamics::held_response() {
  constexpr double kRounding = 1e-13;
  rounding_.assign(friction_.size(), 0.0);
  for (const JointModes::Joint& joint : modes_.joints()) {
    const Body& body = model_.joint_body(joint.joint);
    const LinkScratch<double>& link = workspace_.kernel.links[body.placement.link];
    const Wrenchd F = link.I * link.A + link.p;
    rounding_[joint.joint] =
        kRounding * (body.description.joint.type == JointType::prismatic ? norm(F.linear) : norm(F.angular));
  }
  JointModes::Response response{vdot_, friction_, rounding_};
  response.open = open_efforts();
  response.possible = !solver_ || solver_->contradiction() <= loop_limits::kContradiction;
  return response;
}

// Columns of M^-1 with and without loops, from unit efforts on the system at rest.
JointModes::Mobility PhaseDynamics::mobility_of(std::span<const int> velocities) {
  std::vector<std::uint8_t> prescribed = prescribed_;
  for (const int v : velocities) prescribed[v] = 0;
  const std::vector<double> none(prescribed.size(), 0.0);
  std::vector<double> force(none), unit(none);
  DynamicsInput<double> in;
  in.q = now_.q, in.v = at_rest_, in.force = unit, in.prescribed = prescribed, in.acceleration = none;
  const auto count = static_cast<Eigen::Index>(velocities.size());
  JointModes::Mobility mobility{Eigen::MatrixXd(count, count), Eigen::VectorXd(count)};
  std::vector<double> vdot(none);
  for (Eigen::Index j = 0; j < count; ++j) {
    const int v = velocities[j];
    unit[v] = 1;
    articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot, force);
    mobility.without_loops[j] = vdot[v];
    if (solver_) solver_->accelerations(in, 0, workspace_, vdot, force);
    for (Eigen::Index i = 0; i < count; ++i) mobility.with_loops(i, j) = vdot[velocities[i]];
    unit[v] = 0;
  }
  mobility.with_loops = (0.5 * (mobility.with_loops + mobility.with_loops.transpose())).eval();
  return mobility;
}

// Velocities of joints at rest => their accelerations b of (19.16), without friction and stops. Other forces are those
// of the last evaluation, and these joints are not prescribed.
Eigen::VectorXd PhaseDynamics::accelerations_released(std::span<const int> velocities) {
  for (std::size_t j = 0; j < motor_.size(); ++j)
    force_[model_.joint_body(j).v] = motor_[j] + friction_[j] + spring_[j];
  for (const JointModes::Joint& joint : modes_.joints()) {
    if (std::find(velocities.begin(), velocities.end(), joint.v) != velocities.end())
      force_[joint.v] = motor_[joint.joint] + spring_[joint.joint];
  }
  std::vector<std::uint8_t> prescribed = prescribed_;
  for (const int v : velocities) prescribed[v] = 0;
  solve(prescribed);
  Eigen::VectorXd accelerations(static_cast<Eigen::Index>(velocities.size()));
  for (std::size_t i = 0; i < velocities.size(); ++i) accelerations[i] = vdot_[velocities[i]];
  return accelerations;
}

// If loops leave the efforts of stuck joints undetermined: replaces them by the minimum-norm friction, without a change
// of motion, and updates the loops' multipliers.
void PhaseDynamics::settle_friction() {
  if (!modes_.any_held()) return;
  const std::vector<int> released = modes_.share_out(open_efforts(), friction_);
  if (!released.empty()) {
    open_stresses_ = solver_->self_stresses();
    std::vector<std::uint8_t> prescribed = prescribed_;
    for (const JointModes::Joint& joint : modes_.joints()) {
      if (std::find(released.begin(), released.end(), joint.v) == released.end()) continue;
      prescribed[joint.v] = 0;
      force_[joint.v] = motor_[joint.joint] + spring_[joint.joint] + friction_[joint.joint];
    }
    solve(prescribed);
    for (const int v : released) vdot_[v] = 0;
    for (std::size_t j = 0; j < motor_.size(); ++j) {
      if (output_of(setup_.drives[j].control) == ControlOutput::motion)
        motor_[j] = smooth_effort_[j] = workspace_.force[model_.joint_body(j).v] - friction_[j] - spring_[j];
    }
  }
  modes_.note_holding(friction_);
}

}  // namespace grapnel
