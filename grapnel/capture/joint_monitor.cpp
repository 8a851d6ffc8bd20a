#include "grapnel/capture/joint_monitor.hpp"

#include <algorithm>

namespace grapnel {
namespace {

constexpr std::size_t kMaxRecorded = 100;  // maximum number of recorded impacts at stops

JointReport::Mode mode_of(const PhaseDynamics& dynamics, std::size_t joint) {
  using Mode = JointReport::Mode;
  if (output_of(dynamics.setup().drives[joint].control) == ControlOutput::motion) return Mode::prescribed;
  const JointModes::Joint* modes = dynamics.joint_modes().of(joint);
  if (!modes || modes->mode == JointModes::Mode::moving) return Mode::moving;
  if (modes->end == JointModes::End::none) return Mode::stuck;
  return modes->end == JointModes::End::lower ? Mode::at_lower_stop : Mode::at_upper_stop;
}

}  // namespace

void JointMonitor::begin_phase(const std::string& name, const PhaseDynamics& dynamics) {
  name_ = name, dynamics_ = &dynamics;
}

// Phase outcome => per joint its mode, friction heat, motor work and copper loss [J], friction share (19.21), and up to
// kMaxRecorded impacts at stops (19.2), (19.4).
void JointMonitor::end_phase(const PhaseOutcome& outcome) {
  const Model& model = dynamics_->model();
  const auto description = [&](std::size_t joint) -> const JointDescription& {
    return model.joint_body(joint).description.joint;
  };
  for (const JointIntegrals& integrals : outcome.integrals.joints) {
    const JointDescription& joint = description(integrals.joint);
    JointReport& report = reports_.emplace_back();
    report.phase = name_, report.joint = joint.name;
    report.mode = mode_of(*dynamics_, integrals.joint);
    report.friction_heat = -integrals.friction_work, report.motor_work = integrals.motor_work;
    if (joint.motor && joint.motor->torque_constant > 0) report.copper_loss = integrals.copper_loss;
    const JointModes::Joint* modes = dynamics_->joint_modes().of(integrals.joint);
    if (!modes) continue;
    if (modes->breakaway > 0) report.friction_share = modes->largest_share;
    report.friction_determined = !modes->undetermined;
    report.sticks = modes->sticks_count, report.breakaways = modes->breakaways;
    report.stop_impacts = modes->stop_impacts, report.stop_energy_lost = modes->stop_energy_lost;
  }
  stop_impact_count_ += dynamics_->joint_modes().stop_impact_count();
  for (const JointModes::StopImpact& impact : dynamics_->joint_modes().stop_impacts()) {
    if (stop_impacts_.size() == kMaxRecorded) break;
    stop_impacts_.push_back({impact.time, description(impact.joint).name, impact.end == JointModes::End::upper,
                             impact.rate_before, impact.rate_after, impact.impulse, impact.energy_lost});
  }
}

// Absent without joints with static friction.
void JointMonitor::write_row(CaptureResult& result) const {
  constexpr double kRounding = 1e-9;
  std::optional<double> largest;
  bool determined = true;
  for (const JointReport& joint : reports_) {
    if (!joint.friction_share) continue;
    if (!largest || !(*joint.friction_share <= *largest)) largest = joint.friction_share;
    determined = determined && joint.friction_determined;
  }
  if (!largest) return;
  std::string note = "maximum friction effort of a joint at rest, over its breakaway effort";
  if (!determined) note += "; friction that closed loops leave undetermined is the minimum-norm admissible one";
  result.ledger.entries.push_back({"joint_friction_share", *largest, 1 + kRounding, "1", note, true});
}

void JointMonitor::write(CaptureResult& result) const {
  write_row(result);
  result.joints = reports_, result.stop_impacts = stop_impacts_, result.stop_impact_count = stop_impact_count_;
}

}  // namespace grapnel
