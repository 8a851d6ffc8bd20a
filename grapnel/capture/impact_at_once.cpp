/// Impacts without duration, and brakes that lock joints at once.

#include <fmt/format.h>

#include "grapnel/capture/grasp_events.hpp"

namespace grapnel {
namespace {

// Sizes fit by construction, so what the solver refuses are numbers: inertias that span more than doubles resolve.
ImpactOutcome solve_impact(CaptureRun& run, const Meeting& meeting, ImpactSetup::Law law) {
  const RunBodies& bodies = run.bodies;
  std::vector<std::size_t> all;
  for (const HeldGrip& grip : bodies.grips) all.push_back(grip.grasp);
  all.insert(all.end(), meeting.closing.begin(), meeting.closing.end());
  const CaptureProblem& taking_part = run.with_grasps(all);
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  try {
    return run_impact(
        {taking_part, bodies.free, meeting.contact, bodies.time, bodies.grips.size(), held, law, run.detail});
  } catch (const std::invalid_argument& error) {
    throw RunFailure(
        fmt::format("impact at t = {:.6g} s: the system is numerically singular ({})", bodies.time, error.what()));
  }
}

}  // namespace

void impact_at_once(CaptureRun& run, const std::vector<std::size_t>& closing, ImpactSetup::Law law) {
  const RunBodies& bodies = run.bodies;
  const Meeting meeting = meet(run, closing);
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
  run.monitor.touch(closing);
  ImpactOutcome outcome = solve_impact(run, meeting, law);
  run.monitor.impact(meeting.phase, outcome);
  run.bodies.state = std::move(outcome.after);
  hold_or_part(run, meeting, law, outcome.report);
  outcome.report.brake = lock_settled_joints(run);
  keep_report(run, std::move(outcome.report));
  run.to_joined();
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
}

std::optional<BrakeReport> lock_settled_joints(CaptureRun& run) {
  if (!run.joints.settle_to(PostImpactSetup::Joints::braked)) return {};
  RunBodies& bodies = run.bodies;
  std::vector<Grasp> grasps;
  const Kinematics k = forward_kinematics(bodies.free.model, bodies.state);
  for (const HeldGrip& grip : bodies.grips) grasps.push_back(grasp_of(grip, k));
  std::vector<std::size_t> joints, holding;
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    if (run.joints.is_settled(j)) joints.push_back(j);
  }
  for (const HeldGrip& grip : bodies.grips) holding.push_back(grip.grasp);
  BrakeOutcome outcome =
      run_brake(run.with_grasps(holding), bodies.free, bodies.state, grasps, joints, run.joints.driven_rates(bodies));
  run.monitor.brake(run.next_name("brake"), bodies.time, outcome);
  bodies.state = std::move(outcome.after);
  return outcome.report;
}

void stop_joints(CaptureRun& run) {
  if (!run.joints.settle_to(PostImpactSetup::Joints::braked)) return;
  run.to_free();
  lock_settled_joints(run);
  run.to_joined();
}

}  // namespace grapnel
