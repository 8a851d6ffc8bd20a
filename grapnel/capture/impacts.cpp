/// Impacts of grasps that close: at once, or resolved in time, where grasps and contacts are springs and dampers until
/// they are at rest or apart; and brakes that lock joints.

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/capture/grasp_events.hpp"
#include "grapnel/impact/yielding_drives.hpp"

namespace grapnel {

// --- At once ---

namespace {

// Sizes fit by construction, so what the solver refuses are numbers: inertias that span more than doubles resolve.
ImpactOutcome solve_impact(CaptureRun& run, const Meeting& meeting, ImpactSetup::Law law) {
  const RunBodies& bodies = run.bodies;
  std::vector<std::size_t> all;
  for (const HeldGrasp& each : bodies.held) all.push_back(each.grasp);
  all.insert(all.end(), meeting.closing.begin(), meeting.closing.end());
  const CaptureProblem& taking_part = run.with_grasps(all);
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  try {
    return run_impact(
        {taking_part, bodies.free, meeting.contact, bodies.time, bodies.held.size(), held, law, run.detail});
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
  for (const HeldGrasp& each : bodies.held) grasps.push_back(grasp_of(each, k));
  std::vector<std::size_t> joints, holding;
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    if (run.joints.is_settled(j)) joints.push_back(j);
  }
  for (const HeldGrasp& each : bodies.held) holding.push_back(each.grasp);
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

// --- In time ---

namespace {

// Where a velocity of a joint of the robot is in another representation.
int velocity_in(const CaptureRun& run, const CaptureSystem& system, int free_velocity) {
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    if (joint_body(run.bodies.free, j).v == free_velocity) return joint_body(system, j).v;
  }
  return free_velocity;
}

// A contact of grasps that close, without those that hold already.
Contact without_held(Contact contact, std::size_t held) {
  const auto n = static_cast<std::ptrdiff_t>(held);
  contact.gaps.erase(contact.gaps.begin(), contact.gaps.begin() + n);
  contact.grasps.erase(contact.grasps.begin(), contact.grasps.begin() + n);
  contact.displacement.erase(contact.displacement.begin(), contact.displacement.begin() + n);
  return contact;
}

// Joints that are braked are at rest from the first instant of an impact in time on: what that takes, per held rate.
// In the joined system, which has no closed loops.
std::vector<double> brake_at_once(CaptureRun& run, std::span<const HeldRate> held) {
  if (run.problem.impact->joints != ImpactSetup::Joints::braked) return std::vector<double>(held.size(), 0.0);
  const ImpactSolution stopped = plastic_impact(run.bodies.system.model, run.bodies.state, {}, held);
  run.monitor.brake_at_once(stopped.energy_identity_residual);
  run.bodies.state.v = stopped.velocity;
  return stopped.held_impulses;
}

// From the state in which the bodies meet to that in which springs are at rest or apart. In the joined system.
CompliantRun let_yield(CaptureRun& run, const CaptureProblem& with_closing, const Meeting& meeting,
                       std::vector<HeldRate> held) {
  RunBodies& bodies = run.bodies;
  const Contact contact = without_held(meeting.contact, bodies.held.size());
  for (HeldRate& h : held) h.velocity = velocity_in(run, bodies.system, h.velocity);
  const State met = bodies.state;
  const std::vector<double> stopping = brake_at_once(run, held);
  std::function<void(double)> each_step;
  if (run.progress)
    each_step = [&](double t) {
      run.progress("contact", bodies.time + t, bodies.time + with_closing.impact->compliant.longest);
    };
  CompliantRun outcome = run_compliant(
      {with_closing, bodies.free, contact, bodies.system, met, bodies.time, held, stopping, each_step}, bodies.state);
  if (!outcome.failure.empty()) throw RunFailure(outcome.failure);
  for (const std::string& warning : outcome.warnings) run.result.warnings.push_back(warning);
  run.monitor.impact_in_time(meeting.phase, bodies.system, met, bodies.time, meeting.closing, outcome);
  bodies.state = outcome.after;
  bodies.time += outcome.duration;
  return outcome;
}

// Rigid grasps may not allow the rates that springs did.
void correct_held_joints(const Model& model, const std::vector<HeldRate>& held, const ImpactSolution& rest,
                         ImpactReport& report) {
  const std::vector<bool> gave_way = which_gave_way(model, held, rest.velocity);
  for (std::size_t i = 0; i < held.size(); ++i) {
    const std::string& name = held_joint(model, held[i]).name;
    for (HeldJoint& joint : report.held_joints) {
      if (joint.joint == name) joint.rate_after = rest.velocity[held[i].velocity], joint.gave_way = gave_way[i];
    }
  }
}

// Grasps that have come to rest hold rigidly from now on. In the free system.
void stiffen(CaptureRun& run, const Meeting& meeting, CompliantRun& yielded) {
  RunBodies& bodies = run.bodies;
  const Model& model = bodies.free.model;
  ImpactReport& report = yielded.report;
  hold_or_part(run, meeting, ImpactSetup::Law::compliant, report, yielded.unfinished);
  std::vector<Grasp> holding;
  const Kinematics k = forward_kinematics(model, bodies.state);
  for (const HeldGrasp& each : bodies.held) holding.push_back(grasp_of(each, k));
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  const ImpactSolution rest = plastic_impact(model, bodies.state, holding, held);
  correct_held_joints(model, held, rest, report);
  for (const ContactImpulse& c : rest.contacts)
    report.compliant->residual_impulse = std::max(report.compliant->residual_impulse, norm(c.P_WC.linear));
  const Momentumd before = run.momentum_about_origin();
  bodies.state.v = rest.velocity;
  const bool grounded = !model.has_free_root(bodies.free.base);  // else nothing can have changed it
  run.monitor.stiffened(meeting.phase, grounded ? run.momentum_about_origin() - before : Momentumd::zero(), report,
                        yielded.joint_peaks);
}

}  // namespace

void impact_in_time(CaptureRun& run, const std::vector<std::size_t>& closing) {
  const RunBodies& bodies = run.bodies;
  const CaptureProblem with_closing = run.with_grasps(closing);  // a copy: others are asked for meanwhile
  const Meeting meeting = meet(run, closing);
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  run.to_joined();
  if (!bodies.system.closures.empty())
    throw RunFailure("impact.law: compliant is not there for targets that are held in closed loops already");
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
  run.monitor.touch(closing);
  CompliantRun yielded = let_yield(run, with_closing, meeting, held);
  run.to_free();
  stiffen(run, meeting, yielded);
  yielded.report.brake = lock_settled_joints(run);
  keep_report(run, std::move(yielded.report));
  run.to_joined();
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
}

}  // namespace grapnel
