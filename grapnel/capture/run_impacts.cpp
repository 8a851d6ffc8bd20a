#include "grapnel/capture/run_impacts.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/capture/load_margins.hpp"
#include "grapnel/capture/problem_lookup.hpp"
#include "grapnel/impact/yielding_drives.hpp"

namespace grapnel {

// Decides on grasps, and lets those that fit meet: at once, in one impact; but what grips does so before what only
// touches. Whether any did.
bool RunImpacts::close(const std::vector<std::size_t>& grasps) {
  const std::vector<std::size_t> closing = run_.schedule.decide(grasps, run_.system, run_.state, run_.time);
  if (!run_.problem.impact) refuse_distant(closing);
  if (closing.empty() || !run_.problem.impact) return false;
  const ImpactSetup::Law law = run_.problem.impact->law;
  if (law == ImpactSetup::Law::compliant) {
    yield(closing);
    return true;
  }
  std::vector<std::size_t> gripping, touching;
  for (std::size_t i : closing) (run_.problem.grasps[i].contact ? touching : gripping).push_back(i);
  const bool contacts_only = law == ImpactSetup::Law::restitution || law == ImpactSetup::Law::friction;
  if (!gripping.empty()) impact(gripping, contacts_only ? ImpactSetup::Law::plastic : law);
  if (!touching.empty()) impact(touching, law);
  return true;
}

// Without an impact nothing is welded, and what is too far away is not captured either.
void RunImpacts::refuse_distant(const std::vector<std::size_t>& closing) {
  for (std::size_t i : closing) {
    const CaptureProblem& one = with_grasps({i});
    const std::string refused = gaps_too_wide(one, run_.free, make_contact(one, run_.free, run_.state));
    if (!refused.empty()) run_.schedule.refuse({i}, refused);
  }
}

// --- What joints do once their arm holds a target ---

void RunImpacts::settle(std::size_t joint) {
  run_.control.settled[joint] = true;
  run_.control.hold[joint] = run_.state.q[run_.joint_body(run_.system, joint).q];
}

void RunImpacts::settle_all() {
  run_.control.approaching = false;
  for (std::size_t j = 0; j < run_.control.settled.size(); ++j) settle(j);
}

// The joints between the base and an end-effector, in the approach.
void RunImpacts::settle_arm(std::size_t grasp) {
  const Model& model = run_.system.model;
  int body = model.frames()[model.frame_index(run_.problem.grasps[grasp].end_effector)].body;
  for (; body >= 0; body = model.bodies()[body].parent) {
    for (std::size_t j = 0; j < run_.control.settled.size(); ++j) {
      if (model.joints()[run_.system.robot_joints[j]] == body) settle(j);
    }
  }
}

// Joints that follow a trajectory exactly keep its rate through an impact. In the free system.
std::vector<HeldRate> RunImpacts::driven_rates() const {
  std::vector<HeldRate> held;
  if (!run_.control.approaching || run_.problem.approach->tracking.mode != TrackingSetup::Mode::ideal) return held;
  for (std::size_t j = 0; j < run_.control.settled.size(); ++j) {
    const int v = run_.joint_body(run_.free, j).v;
    if (!run_.control.settled[j]) held.push_back({v, run_.state.v[v]});
  }
  return held;
}

// The same, and what impact.joints asks of the others.
std::vector<HeldRate> RunImpacts::rates_in_impact() const {
  std::vector<HeldRate> held = driven_rates();
  const ImpactSetup::Joints joints = run_.problem.impact->joints;
  if (joints == ImpactSetup::Joints::free) return held;
  const std::size_t driven = held.size();
  for (std::size_t j = 0; j < run_.control.settled.size(); ++j) {
    const int v = run_.joint_body(run_.free, j).v;
    const auto end = held.begin() + static_cast<std::ptrdiff_t>(driven);
    if (std::any_of(held.begin(), end, [&](const HeldRate& h) { return h.velocity == v; })) continue;
    held.push_back({v, joints == ImpactSetup::Joints::braked ? 0.0 : run_.state.v[v]});
  }
  return held;
}

// --- Impacts ---

// A sample outside any integration: just before and just after the impact.
void RunImpacts::sample_contact() { sample_instant(run_.time, run_.state, {}); }
void RunImpacts::sample_instant(double time, const State& state, std::span<const GripSample> grips) {
  const Kinematics kinematics = forward_kinematics(run_.system.model, state);
  const SystemBooks books = system_books(run_.system.model, kinematics, state);
  run_.bookkeeper.instant(books);
  run_.last_look = time;
  if (!run_.recorder) return;
  const std::vector<double> zeros(run_.system.model.joints().size(), 0.0);
  const PhaseIntegrals none;
  run_.recorder->sample(run_.system, kinematics, books, {time, state, none, zeros, zeros}, grips,
                        run_.watches.instant(run_.system, kinematics));
}

// An instant of an impact in time; `closing`: the grasps of the problem that the sample has wrenches of.
void RunImpacts::sample_yielding(const std::vector<std::size_t>& closing, const CompliantSample& sample) {
  std::vector<GripSample> grips(run_.problem.grasps.size());
  for (std::size_t i = 0; i < closing.size(); ++i) {
    grips[closing[i]].holds = true;
    grips[closing[i]].F_WC = sample.grasp_wrenches[i];
  }
  for (std::size_t i = 0; i < run_.system.grips.size(); ++i) {
    GripSample& held = grips[run_.system.grips[i].grasp];
    held.holds = true;
    held.F_WC = sample.held_wrenches[i];
  }
  sample_instant(run_.time + sample.time, sample.state, grips);
}

// From here on what meets is one group of bodies.
void RunImpacts::touch(const std::vector<std::size_t>& closing) {
  std::vector<std::size_t> targets;
  for (std::size_t i : closing) targets.push_back(target_index(run_.problem, run_.problem.grasps[i].target));
  run_.bookkeeper.touch(targets);
}

Momentumd RunImpacts::momentum_about_origin(const State& state) const {
  return momentum_about(run_.free.model, forward_kinematics(run_.free.model, state), Vector3d::zero());
}

// The problem with some of its grasps. Problems are large: with all of them it is the problem itself.
const CaptureProblem& RunImpacts::with_grasps(const std::vector<std::size_t>& grasps) {
  bool all = grasps.size() == run_.problem.grasps.size();
  for (std::size_t i = 0; all && i < grasps.size(); ++i) all = grasps[i] == i;
  if (all) return run_.problem;
  if (!part_) {
    part_.emplace(run_.problem);
    part_grasps_.clear();
    part_->grasps.clear();
  }
  if (part_grasps_ == grasps) return *part_;
  part_grasps_ = grasps;
  part_->grasps.clear();
  for (std::size_t i : grasps) part_->grasps.push_back(run_.problem.grasps[i]);
  return *part_;
}

// One that is too far away refuses the impact of all.
void RunImpacts::refuse_wide_gaps(const std::vector<std::size_t>& closing, const Contact& contact) {
  std::string all;
  std::vector<std::string> own(closing.size(), "contact refused, since another grip's is");
  for (std::size_t i = 0; i < closing.size(); ++i) {
    Contact one;
    one.gaps = {contact.gaps[i]}, one.displacement = {contact.displacement[i]};
    const std::string text = gaps_too_wide(with_grasps({closing[i]}), run_.free, one);
    if (text.empty()) continue;
    all += (all.empty() ? "" : "; ") + text;
    own[i] = "contact refused: " + text;
  }
  if (all.empty()) return;
  for (std::size_t i = 0; i < closing.size(); ++i) run_.schedule.refuse({closing[i]}, own[i]);
  throw RunFailure("contact refused: " + all);
}

// The contact of the grips that close, by the rule for gaps, after those that hold already.
Contact RunImpacts::contact_of(const std::vector<std::size_t>& closing) {
  std::vector<bool> held(run_.problem.targets.size(), false);
  for (const HeldGrip& grip : run_.grips)
    held[target_index(run_.problem, run_.problem.grasps[grip.grasp].target)] = true;
  const Contact fresh = make_contact(with_grasps(closing), run_.free, run_.state, held);
  if (!fresh.refused.empty()) {
    run_.schedule.refuse(closing, "contact refused: " + fresh.refused);
    throw RunFailure("contact refused: " + fresh.refused);
  }
  refuse_wide_gaps(closing, fresh);
  for (std::size_t i = 0; i < closing.size(); ++i) run_.schedule.moved(closing[i], norm(fresh.displacement[i]));
  Contact contact = fresh;
  contact.gaps.clear(), contact.displacement.clear(), contact.grasps.clear();
  const Kinematics k = forward_kinematics(run_.free.model, fresh.state);
  const std::vector<GraspGap> gaps = grasp_gaps(run_.problem, run_.free, k);
  for (const HeldGrip& grip : run_.grips) {
    contact.gaps.push_back(gaps[grip.grasp]);
    contact.displacement.push_back(Vector3d::zero());
    contact.grasps.push_back(grasp_of(grip, k));
  }
  for (std::size_t i = 0; i < closing.size(); ++i) {
    contact.gaps.push_back(fresh.gaps[i]);
    contact.displacement.push_back(fresh.displacement[i]);
    contact.grasps.push_back(fresh.grasps[i]);
  }
  return contact;
}

// Sizes fit by construction, so what the solver refuses are numbers: inertias that span more than doubles resolve.
ImpactOutcome RunImpacts::solve_impact(const std::vector<std::size_t>& closing, const Contact& contact,
                                       ImpactSetup::Law law) {
  std::vector<std::size_t> all;
  for (const HeldGrip& grip : run_.grips) all.push_back(grip.grasp);
  all.insert(all.end(), closing.begin(), closing.end());
  const CaptureProblem& taking_part = with_grasps(all);
  const std::vector<HeldRate> held = rates_in_impact();
  try {
    return run_impact({taking_part, run_.free, contact, run_.time, run_.grips.size(), held, law, run_.detail});
  } catch (const std::invalid_argument& error) {
    throw RunFailure(
        fmt::format("impact at t = {:.6g} s: the system is numerically singular ({})", run_.time, error.what()));
  }
}

// The contact of what closes, in the free system, with targets where the rule for gaps puts them.
Contact RunImpacts::meet(const std::vector<std::size_t>& closing) {
  phase_ = run_.next_name("contact");
  if (run_.recorder) run_.recorder->begin_phase(phase_);
  if (run_.control.approaching) {
    for (std::size_t i : closing) settle_arm(i);
  }
  run_.to_free();
  Contact contact = contact_of(closing);
  run_.state = contact.state;  // of a target put elsewhere the momentum about its own centre of mass stays
  return contact;
}

void RunImpacts::keep(ImpactReport report) {
  add_margins(run_.problem, report);
  const std::string giving_way = describe_giving_way(run_.free.model, report);
  if (!giving_way.empty())
    run_.result.warnings.push_back(fmt::format("impact at t = {:.6g} s: {}", report.time, giving_way));
  if (!run_.frame.is_world()) {
    const Momentumd h = momentum_about_origin(run_.state);
    to_world(run_.frame, h.linear, run_.free.model.mass(), report);
  }
  if (report.energy_created) {
    run_.result.warnings.push_back(fmt::format(
        "impact: the result has more energy than there was before; the {} hypothesis can do this with friction "
        "(impact.hypothesis: stronge cannot)",
        report.hypothesis));
  }
  if (!report.inconsistent.empty()) {
    run_.result.warnings.push_back(
        "impact: no motion has the restitution that is asked for; in the least-squares sense "
        "it is not met in: " +
        report.inconsistent);
  }
  if (!report.unique) {
    run_.result.warnings.push_back(
        "impact: simultaneous contacts; how they share the impulse depends on their stiffnesses, "
        "which this law does not know (impact.grasps.rebound.spread)");
  }
  if (run_.result.impact) {
    run_.result.later_impacts.push_back(std::move(report));
  } else {
    run_.result.impact = std::move(report);
  }
}

bool RunImpacts::holds_after(std::size_t grasp, ImpactSetup::Law law) const {
  return !run_.problem.grasps[grasp].contact && law != ImpactSetup::Law::bilateral_restitution;
}

// What has met holds, or is apart again. In the free system. `unfinished`: of an impact in time, per grasp that closes
// (may be empty): how it was still under way at its end.
void RunImpacts::hold_or_part(const std::vector<std::size_t>& closing, ImpactSetup::Law law, const ImpactReport& report,
                              std::span<const std::string> unfinished) {
  const Kinematics k = forward_kinematics(run_.free.model, run_.state);
  for (std::size_t n = 0; n < closing.size(); ++n) {
    const std::size_t i = closing[n];
    if (holds_after(i, law)) {
      run_.grips.push_back(close_grip(run_.problem, run_.free, k, i));
      continue;
    }
    run_.rebounded = true;
    for (const GraspImpulse& g : report.grasps) {
      if (g.end_effector != run_.problem.grasps[i].end_effector) continue;
      const bool cut_short = n < unfinished.size() && !unfinished[n].empty();
      run_.schedule.refuse(
          {i}, fmt::format("{}: it {}", run_.problem.grasps[i].contact ? "a contact, no grip" : "thrown back",
                           cut_short ? "is " + unfinished[n]
                                     : fmt::format("parts at {:.4g} m/s", norm(g.relative_velocity_after))));
    }
  }
}

// Grips close, or contacts touch: in the free system, where those that hold already are constraints like the new ones.
void RunImpacts::impact(const std::vector<std::size_t>& closing, ImpactSetup::Law law) {
  const Contact contact = meet(closing);
  sample_contact();
  touch(closing);
  ImpactOutcome outcome = solve_impact(closing, contact, law);
  run_.bookkeeper.enter(outcome.from_ground);
  run_.impact_book.note(outcome.residuals);
  run_.state = outcome.after;
  hold_or_part(closing, law, outcome.report, {});
  run_.loads.impact(phase_, outcome.report);
  outcome.report.brake = brake();
  keep(std::move(outcome.report));
  run_.to_joined();
  sample_contact();
}

// The impact takes its time: grips and contacts yield meanwhile, then grips are rigid.
void RunImpacts::yield(const std::vector<std::size_t>& closing) {
  const CaptureProblem meeting = with_grasps(closing);  // a copy: others are asked for meanwhile
  Contact contact = meet(closing);
  const auto held_already = static_cast<std::ptrdiff_t>(run_.grips.size());
  contact.gaps.erase(contact.gaps.begin(), contact.gaps.begin() + held_already);
  contact.grasps.erase(contact.grasps.begin(), contact.grasps.begin() + held_already);
  contact.displacement.erase(contact.displacement.begin(), contact.displacement.begin() + held_already);
  std::vector<HeldRate> held = rates_in_impact();
  run_.to_joined();
  if (!run_.system.closures.empty())
    throw RunFailure("impact.law: compliant is not there for targets that are held in closed loops already");
  for (HeldRate& h : held) h.velocity = velocity_in(run_.system, h.velocity);
  sample_contact();
  touch(closing);
  const State met = run_.state;
  const std::vector<double> stopping = brake_at_once(held);
  std::function<void(double)> each_step;
  if (run_.progress)
    each_step = [&](double t) {
      run_.progress("contact", run_.time + t, run_.time + meeting.impact->compliant.longest);
    };
  CompliantRun run =
      run_compliant({meeting, run_.free, contact, run_.system, met, run_.time, held, stopping, each_step}, run_.state);
  if (!run.failure.empty()) throw RunFailure(run.failure);
  for (const std::string& warning : run.warnings) run_.result.warnings.push_back(warning);
  // Where the approach was: not if the impact alone is asked for.
  const bool watched = run_.watches.watching();
  if (watched) {
    run_.watches.begin_phase(phase_, run_.system, false);
    run_.watches.sample(run_.time, met, {});
  }
  for (const CompliantSample& sample : run.samples) {
    run_.bookkeeper.enter(sample.from_ground);
    if (watched) run_.watches.sample(run_.time + sample.time, sample.state, {});
    sample_yielding(closing, sample);
  }
  if (watched) run_.watches.end_phase();
  std::vector<std::string> hands;
  for (const HeldGrip& grip : run_.system.grips) hands.push_back(run_.problem.grasps[grip.grasp].end_effector);
  run_.loads.held(phase_, run_.time, hands, run.samples);
  run_.bookkeeper.enter(run.from_ground);
  run_.impact_book.note_compliant(run.energy_residual);
  run_.state = run.after;
  run_.time += run.duration;
  stiffen(closing, run);
}

// Where a velocity of a joint of the robot is in another representation.
int RunImpacts::velocity_in(const CaptureSystem& system, int free_velocity) const {
  for (std::size_t j = 0; j < run_.control.settled.size(); ++j) {
    if (run_.joint_body(run_.free, j).v == free_velocity) return run_.joint_body(system, j).v;
  }
  return free_velocity;
}

// Joints that are braked are at rest from the first instant of an impact in time on: what that takes, per held rate.
// In the joined system, which has no closed loops.
std::vector<double> RunImpacts::brake_at_once(std::span<const HeldRate> held) {
  if (run_.problem.impact->joints != ImpactSetup::Joints::braked) return std::vector<double>(held.size(), 0.0);
  const ImpactSolution stopped = plastic_impact(run_.system.model, run_.state, {}, held);
  run_.impact_book.note_brake(stopped.energy_identity_residual);
  run_.state.v = stopped.velocity;
  return stopped.held_impulses;
}

// Grips that have come to rest hold rigidly from now on.
void RunImpacts::stiffen(const std::vector<std::size_t>& closing, CompliantRun& run) {
  ImpactReport& report = run.report;
  run_.to_free();
  hold_or_part(closing, ImpactSetup::Law::compliant, report, run.unfinished);
  std::vector<Grasp> holding;
  const Kinematics k = forward_kinematics(run_.free.model, run_.state);
  for (const HeldGrip& grip : run_.grips) holding.push_back(grasp_of(grip, k));
  const std::vector<HeldRate> held = rates_in_impact();
  const ImpactSolution rest = plastic_impact(run_.free.model, run_.state, holding, held);
  const std::vector<bool> gave_way = which_gave_way(run_.free.model, held, rest.velocity);
  for (std::size_t i = 0; i < held.size(); ++i) {  // rigid grips may not allow the rates that springs did
    const std::string& name = held_joint(run_.free.model, held[i]).name;
    for (HeldJoint& joint : report.held_joints) {
      if (joint.joint == name) joint.rate_after = rest.velocity[held[i].velocity], joint.gave_way = gave_way[i];
    }
  }
  for (const ContactImpulse& c : rest.contacts)
    report.compliant->residual_impulse = std::max(report.compliant->residual_impulse, norm(c.P_WC.linear));
  const Momentumd before = momentum_about_origin(run_.state);
  run_.state.v = rest.velocity;
  if (!run_.free.model.has_free_root(run_.free.base))  // only the ground can have changed it
    run_.bookkeeper.enter(momentum_about_origin(run_.state) - before);
  run_.loads.impact(phase_, report, run.joint_peaks);
  report.brake = brake();
  keep(std::move(report));
  run_.to_joined();
  sample_contact();
}

// Settled joints stop at once, if they are braked. In the free system.
std::optional<BrakeReport> RunImpacts::brake() {
  if (!run_.holds_by(PostImpactSetup::Joints::braked)) return {};
  std::vector<Grasp> grasps;
  const Kinematics k = forward_kinematics(run_.free.model, run_.state);
  for (const HeldGrip& grip : run_.grips) grasps.push_back(grasp_of(grip, k));
  std::vector<std::size_t> joints, holding;
  for (std::size_t j = 0; j < run_.control.settled.size(); ++j) {
    if (run_.control.settled[j]) joints.push_back(j);
  }
  for (const HeldGrip& grip : run_.grips) holding.push_back(grip.grasp);
  BrakeOutcome outcome = run_brake(with_grasps(holding), run_.free, run_.state, grasps, joints, driven_rates());
  run_.bookkeeper.enter(outcome.from_ground);
  run_.impact_book.note_brake(outcome.energy_identity_residual);
  run_.state = std::move(outcome.after);
  bear(run_.next_name("brake"), outcome);
  return outcome.report;
}

// The brakes' loads, as of an impact of their own.
void RunImpacts::bear(const std::string& phase, const BrakeOutcome& brake) {
  ImpactReport as_impact;
  as_impact.time = run_.time, as_impact.duration = run_.problem.impact->duration;
  as_impact.joints = brake.joints;
  for (const BrakeGrip& g : brake.report.grasps) {
    GraspImpulse& grasp = as_impact.grasps.emplace_back();
    grasp.end_effector = g.end_effector, grasp.target = g.target;
    grasp.impulse = g.impulse, grasp.angular_impulse = g.angular_impulse;
  }
  run_.loads.impact(phase, as_impact);
}

// Joints that settle while no grip closes still have to stop, if they are braked.
void RunImpacts::stop_joints() {
  if (!run_.holds_by(PostImpactSetup::Joints::braked)) return;
  run_.to_free();
  brake();
  run_.to_joined();
}

void RunImpacts::release_due(double post_start) {
  if (run_.control.approaching) return;
  const auto& releases = run_.problem.post_impact->releases;
  // In the order of time; an impact in time may have passed over some.
  for (; released_ < releases.size(); ++released_) {
    const PostImpactSetup::Release& release = releases[released_];
    const double due = post_start + release.after;
    if (due > run_.time && !GripSchedule::is_now(due, run_.time)) return;
    ReleaseReport report;
    report.time = run_.time;
    run_.to_free();
    std::erase_if(run_.grips, [&](const HeldGrip& grip) {
      const GraspSetup& g = run_.problem.grasps[grip.grasp];
      const auto& named = release.end_effectors;
      if (!named.empty() && std::find(named.begin(), named.end(), g.end_effector) == named.end()) return false;
      report.end_effectors.push_back(g.end_effector);
      report.targets.push_back(g.target);
      run_.schedule.release(grip.grasp, run_.time);
      return true;
    });
    run_.to_joined();
    if (!report.end_effectors.empty()) run_.result.releases.push_back(std::move(report));
  }
}

}  // namespace grapnel
