#include "grapnel/capture/loop_monitor.hpp"

#include <algorithm>

namespace grapnel {
namespace {

// The largest so far; a NaN stays.
void raise_to(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}

}  // namespace

void LoopMonitor::begin_phase(const std::string& name, const CaptureProblem& problem, const CaptureSystem& system) {
  problem_ = &problem;
  system_ = &system;
  phase_largest_ = {};
  if (system.closures.empty()) return;
  any_ = true;
  LoopReport report;
  report.phase = name;
  for (const HeldGrasp& grasp : system.grasps) {
    const GraspSetup& g = problem.grasps[grasp.grasp];
    if (grasp.closure >= 0) report.closures.push_back(g.end_effector + " - " + g.target);
  }
  reports_.push_back(std::move(report));
}

std::vector<GraspSample> LoopMonitor::sample(const PhaseSample& sample, const Kinematics& kinematics,
                                             std::span<double> motor) {
  std::vector<GraspSample> result(problem_->grasps.size());
  if (system_->grasps.empty()) return result;
  const std::vector<GraspWrench> wrenches = wrenches_of_grasps(*system_, kinematics, sample);
  Kinematics near;
  if (!system_->closures.empty()) {
    State at_origin = sample.state;
    move_roots_to_origin(system_->model, at_origin);
    near = forward_kinematics(system_->model, at_origin);
    add_self_stress(*system_, kinematics, wrenches, motor);
  }
  for (std::size_t i = 0; i < system_->grasps.size(); ++i) {
    const HeldGrasp& grasp = system_->grasps[i];
    GraspSample& s = result[grasp.grasp];
    s.holds = grasp.closure < 0 || sample.dynamics->loops() != nullptr;  // or the loop is cut
    s.F_WC = wrenches[i].F_WC;
    if (grasp.closure < 0) continue;
    s.defect = closure_defect(grasp.frames, near);
    phase_largest_.raise(*s.defect);
  }
  return result;
}

void LoopMonitor::end_phase(const LoopOutcome& outcome) {
  if (system_->closures.empty()) return;
  largest_.raise(phase_largest_);
  LoopReport& report = reports_.back();
  // Where loops are cut nothing brings them back, and what there is is what is left.
  const ClosureDefect& left = outcome.rows == 0 ? phase_largest_ : outcome.unprojected;
  report.rows = outcome.rows;
  report.rank = outcome.rank;
  report.unprojected_position = left.position;
  report.unprojected_angle = left.angle;
  report.unprojected_velocity = left.velocity;
  report.unprojected_angular_velocity = left.angular_velocity;
  report.correction_total = outcome.correction_total;
  report.integration_error = outcome.integration_error;
}

void LoopMonitor::write(CaptureResult& result) const {
  result.loops = reports_;
  const std::string none = "no closed loop in this run: no target is held by several arms";
  double unprojected = 0, corrections = 0, error = 0;
  for (const LoopReport& r : reports_) {
    raise_to(unprojected, std::max(r.unprojected_position, r.unprojected_angle));
    corrections += r.correction_total;
    error += r.integration_error;
  }
  const auto row = [&](const char* name, double value, double bound, const char* unit, const char* note) {
    result.ledger.entries.push_back({name, value, bound, unit, any_ ? note : none, any_});
  };
  row("loop_closure_position", largest_.position, 1e-12, "m",
      "largest distance of a grasp's frames on end-effector and target that close a loop, at any sample");
  row("loop_closure_angle", largest_.angle, 1e-12, "rad", "the same for their orientation");
  row("loop_closure_velocity", std::max(largest_.velocity, largest_.angular_velocity), 1e-12, "m/s or rad/s",
      "the same for their relative motion");
  row("unprojected_defect", unprojected, 1e-10, "m or rad", "largest defect that one step left before projection");
  row("correction_total", corrections, any_ ? error : 1e-10, "1",
      "sum of all projections; bound: the steps' error estimates and rounding; both in the norm that judges steps");
}

}  // namespace grapnel
