#include "grapnel/capture/grasp_slips.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {
namespace {

// Held part of a slip, from the parts that slip => its closure, or none.
void hold_remaining_part(SlippingGrasp& slip) {
  const HeldPart held = held_part(slip.slip.model, slip.slip.parts());
  slip.has_closure = held.any;
  if (held.any) slip.frames.model = held.model;
}

// Slip, parts that begin to slip at this load => the slip with these parts too (8.17).
void add_parts(SlippingGrasp& slip, const GraspLimits& limits, const HoldLoad& load, SlipParts parts) {
  GraspSlip& s = slip.slip;
  const SlipParts already = s.parts();
  if (parts.force) s.force = limits.kinetic_ratio * limits.force;
  if (parts.moment) s.moment = limits.kinetic_ratio * limits.moment;
  const Twistd offset = slip_offset(s, load.F_C);
  if (parts.force && !already.force) s.offset_C.linear = offset.linear;
  if (parts.moment && !already.moment) s.offset_C.angular = offset.angular;
  hold_remaining_part(slip);
}

// Held grasp, its limits => the slip that begins, still without slipping parts.
SlippingGrasp slip_of(const HeldGrasp& held, const GraspLimits& limits) {
  SlippingGrasp slip;
  slip.grasp = held.grasp;
  slip.slip = {held.frames.body_a, held.frames.X_AC, held.frames.body_b, held.X_BD_closing};
  slip.slip.separate = limits.combined == GraspLimits::Combined::components;
  slip.slip.model = held.frames.model, slip.slip.hinge_C = held.frames.hinge_C;
  slip.frames = held.frames;
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
  std::vector<std::size_t> touching;  // these bodies exchange momentum
  for (const HeldGrasp& each : bodies.holding()) {
    grasps.push_back(grasp_of(each, k));
    touching.push_back(each.grasp);
  }
  run.monitor.touch(touching);
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

// A slip of which these parts are at rest and the others continue => a closure holds them in their present relative
// pose.
void hold_parts(CaptureRun& run, RunSlip& slip, SlipParts at_rest) {
  GraspSlip& s = slip.grasp.slip;
  if (at_rest.force) s.force = 0, s.offset_C.linear = Vector3d::zero(), slip.moved.force = false;
  if (at_rest.moment) s.moment = 0, s.offset_C.angular = Vector3d::zero(), slip.moved.moment = false;
  const Kinematics k = forward_kinematics(run.bodies.free.model, run.bodies.state);
  slip.grasp.frames = hold_grasp(run.problem, run.bodies.free, k, slip.grasp.grasp).frames;
  hold_remaining_part(slip.grasp);
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
  std::vector<RunSlip>& slips = run.bodies.slips;
  for (const HoldLoad& load : loads) {
    const GraspLimits& limits = *run.problem.grasps[load.grasp].holds;
    auto slip = std::ranges::find(slips, load.grasp, [](const RunSlip& each) { return each.grasp.grasp; });
    if (const auto grasp = std::ranges::find(held, load.grasp, &HeldGrasp::grasp); grasp != held.end()) {
      slip = slips.insert(slips.end(), RunSlip{slip_of(*grasp, limits), {}, report_of(run, load)});
      held.erase(grasp);
    }
    if (slip == slips.end()) continue;
    add_parts(slip->grasp, limits, load, parts_beyond(limits, load));
    run.schedule.slip(load.grasp, load.time);
    run.schedule.note_load(load);
  }
}

void end_slips(CaptureRun& run, const GraspOverloads& overloads) {
  std::vector<RunSlip>& slips = run.bodies.slips;
  std::vector<RunSlip> lasting;
  bool any_held = false;
  for (std::size_t i = 0; i < slips.size(); ++i) {
    if (std::ranges::find(overloads.slipped_out, i) != overloads.slipped_out.end()) {
      lose_slip(run, slips[i]);
      continue;
    }
    const auto resting = std::ranges::find(overloads.at_rest, i, &RestingSlip::slip);
    const SlipParts parts = slips[i].grasp.slip.parts();
    const SlipParts rest = resting != overloads.at_rest.end() ? resting->parts : SlipParts{};
    const bool continues = (parts.force && !rest.force) || (parts.moment && !rest.moment);
    any_held = any_held || rest.any();
    if (!continues) {
      hold_again(run, slips[i]);
      continue;
    }
    if (rest.any()) hold_parts(run, slips[i], rest);
    lasting.push_back(slips[i]);
  }
  slips = std::move(lasting);
  if (any_held) stop_relative_motion(run);
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
