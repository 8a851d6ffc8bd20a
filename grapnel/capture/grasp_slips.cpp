#include "grapnel/capture/grasp_slips.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {
namespace {

// Limits => limit while it slips; zero without a limit: this part does not slip.
double kinetic_limit(double limit, double ratio) { return std::isfinite(limit) ? ratio * limit : 0; }

// Held grasp, load at its limits => the slip that begins (8.17).
SlippingGrasp slip_of(const HeldGrasp& held, const GraspLimits& limits, const HoldLoad& load) {
  SlippingGrasp slip;
  slip.grasp = held.grasp;
  slip.slip = {held.frames.body_a,
               held.frames.X_AC,
               held.frames.body_b,
               held.X_BD_closing,
               kinetic_limit(limits.force, limits.kinetic_ratio),
               kinetic_limit(limits.moment, limits.kinetic_ratio)};
  slip.slip.offset_C = slip_offset(slip.slip, load.F_C);
  slip.frames = held.frames;
  slip.frames.model = slip.slip.force > 0 ? GraspModel::orientation : GraspModel::point;
  return slip;
}

// The report of a slip that begins now: that of the last slip of the grasp, if it ended at this instant.
std::size_t report_of(CaptureRun& run, const HoldLoad& load) {
  const GraspSetup& grasp = run.problem.grasps[load.grasp];
  std::vector<SlipReport>& slips = run.result.slips;
  for (std::size_t i = slips.size(); i-- > 0;) {
    if (slips[i].end_effector != grasp.end_effector) continue;
    if (slips[i].ended != SlipEnd::sticks || slips[i].until != load.time) break;
    slips[i].ended = SlipEnd::slips;
    return i;
  }
  slips.push_back({load.time, grasp.end_effector, grasp.target, load.force, load.moment, SlipEnd::slips, load.time});
  return slips.size() - 1;
}

// The rest of the relative velocity, at most the slip resolution, vanishes in a plastic impact of all grasps and
// closures, which conserves momentum.
void stop_relative_motion(CaptureRun& run) {
  RunBodies& bodies = run.bodies;
  const Kinematics k = forward_kinematics(bodies.free.model, bodies.state);
  std::vector<Grasp> grasps;
  for (const HeldGrasp& each : bodies.held) grasps.push_back(grasp_of(each, k));
  for (const RunSlip& each : bodies.slips) {
    if (each.grasp.has_closure()) grasps.push_back(grasp_of({each.grasp.grasp, each.grasp.frames}, k));
  }
  bodies.state.v =
      plastic_impact(bodies.free.model, bodies.state, grasps, run.joints.prescribed_rates(bodies)).velocity;
}

// A slip at rest => the grasp holds in its present relative pose.
void hold_again(CaptureRun& run, const RunSlip& slip) {
  const Kinematics k = forward_kinematics(run.bodies.free.model, run.bodies.state);
  HeldGrasp held = hold_grasp(run.problem, run.bodies.free, k, slip.grasp.grasp);
  held.X_BD_closing = slip.grasp.slip.X_BD;
  run.bodies.held.push_back(std::move(held));
  run.schedule.stick(slip.grasp.grasp);
  run.result.slips[slip.report].ended = SlipEnd::sticks;
}

// A slip beyond its limits => the grasp is open.
void lose_slip(CaptureRun& run, const RunSlip& slip) {
  run.schedule.lose_by_slip(slip.grasp.grasp, run.bodies.time);
  SlipReport& report = run.result.slips[slip.report];
  report.ended = SlipEnd::lost;
  LossReport loss{run.bodies.time, report.end_effector, report.target};
  loss.force = slip.grasp.slip.force, loss.moment = slip.grasp.slip.moment;
  loss.by_slip = true;
  run.result.losses.push_back(std::move(loss));
}

}  // namespace

void begin_slips(CaptureRun& run, const std::vector<HoldLoad>& loads) {
  std::vector<HeldGrasp>& held = run.bodies.held;
  for (const HoldLoad& load : loads) {
    const auto grasp = std::ranges::find(held, load.grasp, &HeldGrasp::grasp);
    if (grasp == held.end()) continue;
    run.bodies.slips.push_back(
        {slip_of(*grasp, *run.problem.grasps[load.grasp].holds, load), false, report_of(run, load)});
    held.erase(grasp);
    run.schedule.slip(load.grasp, load.time);
    run.schedule.note_load(load);
  }
}

void end_slips(CaptureRun& run, const GraspOverloads& overloads) {
  std::vector<RunSlip>& slips = run.bodies.slips;
  const auto contains = [](const std::vector<std::size_t>& list, std::size_t i) {
    return std::ranges::find(list, i) != list.end();
  };
  std::vector<RunSlip> ending, lasting;
  for (std::size_t i = 0; i < slips.size(); ++i) {
    if (contains(overloads.slipped_out, i)) {
      lose_slip(run, slips[i]);
    } else {
      (contains(overloads.at_rest, i) ? ending : lasting).push_back(slips[i]);
    }
  }
  slips = std::move(lasting);
  for (const RunSlip& slip : ending) hold_again(run, slip);
  if (!ending.empty()) stop_relative_motion(run);
}

void release_slips(CaptureRun& run, const PostImpactSetup::Release& release, ReleaseReport& report) {
  std::erase_if(run.bodies.slips, [&](const RunSlip& slip) {
    const GraspSetup& g = run.problem.grasps[slip.grasp.grasp];
    if (!release.end_effectors.empty() &&
        std::ranges::find(release.end_effectors, g.end_effector) == release.end_effectors.end())
      return false;
    report.end_effectors.push_back(g.end_effector);
    report.targets.push_back(g.target);
    run.schedule.release(slip.grasp.grasp, run.bodies.time);
    run.result.slips[slip.report].ended = SlipEnd::released;
    return true;
  });
}

}  // namespace grapnel
