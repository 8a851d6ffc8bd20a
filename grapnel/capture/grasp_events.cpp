#include "grapnel/capture/grasp_events.hpp"

#include "grapnel/capture/coordinated_drive.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "grapnel/capture/elastic_report.hpp"
#include "grapnel/capture/grasp_slips.hpp"
#include "grapnel/capture/impact_figures.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/impact/yielding_drives.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

namespace {

// Without an impact no grasp closes; a grasp beyond the gap limit is not captured either.
void refuse_distant(CaptureRun& run, const std::vector<std::size_t>& closing) {
  const RunBodies& bodies = run.bodies;
  for (std::size_t i : closing) {
    const CaptureProblem& one = run.with_grasps({i});
    const Contact contact = make_contact(one, bodies.free, bodies.state);
    const std::string refused =
        gap_too_wide(run.problem, run.problem.grasps[i], bodies.free, contact.gaps[0], contact.displacement[0]);
    if (!refused.empty()) run.schedule.refuse({i}, refused);
  }
}

[[noreturn]] void fail_contact(const CaptureRun& run, std::string why) {
  for (const std::string& gains : run.unstable_gains) why += "; " + gains;
  throw RunFailure("contact refused: " + why);
}

// One grasp with too large a gap refuses the impact of all.
void refuse_wide_gaps(CaptureRun& run, const std::vector<std::size_t>& closing, const Contact& contact) {
  std::string all;
  std::vector<std::string> own(closing.size(), "contact refused together with another grasp's contact");
  for (std::size_t i = 0; i < closing.size(); ++i) {
    const GraspSetup& grasp = run.problem.grasps[closing[i]];
    const std::string text =
        gap_too_wide(run.problem, grasp, run.bodies.free, contact.gaps[i], contact.displacement[i]);
    if (text.empty()) continue;
    all += (all.empty() ? "" : "; ") + text;
    own[i] = "contact refused: " + text;
  }
  if (all.empty()) return;
  for (std::size_t i = 0; i < closing.size(); ++i) run.schedule.refuse({closing[i]}, own[i]);
  fail_contact(run, all);
}

// Contact with its state => also the grasps, and parts of slipping grasps, that hold.
void add_held(const CaptureRun& run, Contact& contact) {
  const CaptureSystem& free = run.bodies.free;
  const Kinematics k = forward_kinematics(free.model, contact.state);
  const std::vector<GraspGap> gaps = grasp_gaps(run.problem, free, k);
  for (const HeldGrasp& each : run.bodies.holding()) {
    contact.gaps.push_back(gaps[each.grasp]);
    contact.displacement.push_back(Vector3d::zero());
    contact.grasps.push_back(grasp_of(each, k));
  }
}

// The contact of the grasps that close, by the rule for gaps, after those that already hold.
Contact contact_of(CaptureRun& run, const std::vector<std::size_t>& closing) {
  const CaptureProblem& problem = run.problem;
  const CaptureSystem& free = run.bodies.free;
  std::vector<bool> held(problem.targets.size(), false);
  for (const HeldGrasp& each : run.bodies.held) held[target_index(problem, problem.grasps[each.grasp].target)] = true;
  for (const RunSlip& each : run.bodies.slips)
    held[target_index(problem, problem.grasps[each.grasp.grasp].target)] = true;
  const Contact fresh = make_contact(run.with_grasps(closing), free, run.bodies.state, held);
  if (!fresh.refused.empty()) {
    run.schedule.refuse(closing, "contact refused: " + fresh.refused);
    fail_contact(run, fresh.refused);
  }
  refuse_wide_gaps(run, closing, fresh);
  for (std::size_t i = 0; i < closing.size(); ++i) run.schedule.moved(closing[i], norm(fresh.displacement[i]));
  Contact contact;
  contact.state = fresh.state;
  add_held(run, contact);
  for (std::size_t i = 0; i < closing.size(); ++i) {
    contact.gaps.push_back(fresh.gaps[i]);
    contact.displacement.push_back(fresh.displacement[i]);
    contact.grasps.push_back(fresh.grasps[i]);
  }
  return contact;
}

// --- Common parts of all impact laws ---

// A contact that begins.
struct ContactEvent {
  std::string phase;                 // its name
  std::vector<std::size_t> closing;  // grasps of the problem
  Contact contact;                   // in the free system: grasps that already hold, then these
};

// Converts the bodies to the free system, moves targets by the rule for gaps, and settles the arms that close. Throws
// RunFailure if gaps are too large.
ContactEvent begin_contact_event(CaptureRun& run, const std::vector<std::size_t>& closing) {
  ContactEvent event{run.next_name("contact"), closing, {}};
  run.monitor.begin_contact(event.phase);
  if (run.joints.approaching()) {
    for (std::size_t i : closing) run.joints.settle_arm(run.bodies, i);
  }
  run.to_free();
  event.contact = contact_of(run, closing);
  // A moved target keeps the momentum about its own centre of mass.
  run.bodies.state = event.contact.state;
  return event;
}

// Contact and its report => grasps that hold after this law become held grasps; the others are recorded as refused,
// with their relative speed [m/s] or `unfinished` reason.
void hold_or_part(CaptureRun& run, const ContactEvent& event, ImpactSetup::Law law, const ImpactReport& report,
                  std::span<const std::string> unfinished = {}) {
  const CaptureProblem& problem = run.problem;
  const CaptureSystem& free = run.bodies.free;
  const Kinematics k = forward_kinematics(free.model, run.bodies.state);
  for (std::size_t n = 0; n < event.closing.size(); ++n) {
    const std::size_t i = event.closing[n];
    if (!problem.grasps[i].contact && !impact_law(law).separates) {
      run.bodies.held.push_back(hold_grasp(problem, free, k, i));
      run.monitor.stages().latch(target_index(problem, problem.grasps[i].target), run.bodies.time);
      if (!impact_law(law).in_time) run.contacts.close(i, free, run.bodies.state, run.bodies.time);
      continue;
    }
    run.rebounded = true;
    for (const GraspImpulse& g : report.grasps) {
      if (g.end_effector != problem.grasps[i].end_effector) continue;
      const bool cut_short = n < unfinished.size() && !unfinished[n].empty();
      run.schedule.refuse(
          {i}, fmt::format("{}: {}", problem.grasps[i].contact ? "a contact that does not hold" : "rebounded",
                           cut_short
                               ? "it is " + unfinished[n]
                               : fmt::format("relative speed {:.4g} m/s afterwards", norm(g.relative_velocity_after))));
    }
  }
}

// Report in the frame of the computation => report in W (9.8), with margins, appended to the result; adds warnings of
// overpowered drives, created energy, inconsistent restitution and dependence on contact order.
void add_report(CaptureRun& run, ImpactReport report) {
  const auto warn = [&](std::string text) { run.result.warnings.push_back(std::move(text)); };
  add_margins(run.problem, report);
  const std::string overpowered = describe_overpowered_drives(run.bodies.free.model, report);
  if (!overpowered.empty()) warn(fmt::format("impact at t = {:.6g} s: {}", report.time, overpowered));
  if (!run.frame.is_world()) {
    const Momentumd h = run.momentum_about_origin();
    to_world(run.frame, h.linear, run.bodies.free.model.mass(), report);
  }
  if (report.energy_created) {
    warn(
        fmt::format("impact: the energy increases; the {} hypothesis permits this with friction "
                    "(impact.hypothesis: stronge cannot)",
                    report.hypothesis));
  }
  if (!report.inconsistent.empty()) {
    warn("impact: no motion has the specified restitution; in the least-squares sense it is violated in: " +
         report.inconsistent);
  }
  if (!report.unique) {
    warn(
        "impact: simultaneous contacts; the distribution of the impulse depends on their stiffnesses, which this law "
        "does "
        "not include (impact.grasps.rebound.spread)");
  }
  run.result.impacts.push_back(std::move(report));
}

// Impacts of closing grasps: instantaneous, or compliant, in which grasps and contacts are springs and dampers until
// they are at rest or apart; and brakes that lock joints.

// --- Instantaneous impact ---

// Hard contacts that took part => contacts' histories and the report, ledger.
void note_hard_contacts(CaptureRun& run, std::span<const HardPoint> points, ImpactOutcome& outcome) {
  const RunBodies& bodies = run.bodies;
  outcome.report.hard_contacts =
      run.contacts.note_impact(points, outcome.hard, bodies.free, outcome.after, bodies.time);
  std::vector<bool> pushed(run.contacts.last()->groups(), false);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (outcome.hard[i].normal > 0)
      pushed[static_cast<std::size_t>(run.contacts.last()->group_of(points[i].pair))] = true;
  }
  run.monitor.touch_targets(run.contacts.targets_of(pushed));
  run.monitor.add_hard_impact(*run.contacts.last(), bodies.time, outcome.exchanged_with_contacts);
}

// Sizes are correct by construction, so the solver rejects only numbers: inertias that span more than doubles resolve.
// `contact`: of the grasps that hold, then of those of `closing`; none: `held` are brakes.
ImpactOutcome solve_impact(CaptureRun& run, const Contact& contact, std::span<const std::size_t> closing,
                           std::span<const HeldRate> held, ImpactSetup::Law law) {
  const RunBodies& bodies = run.bodies;
  std::vector<std::size_t> all;
  for (const HeldGrasp& each : bodies.holding()) all.push_back(each.grasp);
  const std::size_t already_closed = all.size();
  all.insert(all.end(), closing.begin(), closing.end());
  const CaptureProblem& taking_part = run.with_grasps(all);
  const CaptureDetail detail = closing.empty() ? CaptureDetail::columns : run.detail;
  const std::vector<HardPoint> hard = run.contacts.hard_points(closing, bodies.free, contact.state, bodies.time);
  try {
    ImpactOutcome outcome =
        run_impact({taking_part, bodies.free, contact, bodies.time, already_closed, held, law, detail, hard});
    if (!outcome.hard.empty()) note_hard_contacts(run, hard, outcome);
    return outcome;
  } catch (const std::invalid_argument& error) {
    throw RunFailure(
        fmt::format("impact at t = {:.6g} s: the system is numerically singular ({})", bodies.time, error.what()));
  }
}

// Loads => the grasps are opened and recorded as lost; velocities do not change. Requires the free system.
void lose_grasps(CaptureRun& run, const std::vector<HoldLoad>& lost, bool in_impact) {
  for (const HoldLoad& load : lost) {
    std::erase_if(run.bodies.held, [&](const HeldGrasp& held) { return held.grasp == load.grasp; });
    std::erase_if(run.bodies.slips, [&](const RunSlip& slip) {
      if (slip.grasp.grasp != load.grasp) return false;
      run.result.slips[slip.report].ended = SlipEnd::lost;
      return true;
    });
    run.schedule.lose(load, in_impact);
    const GraspSetup& grasp = run.problem.grasps[load.grasp];
    run.result.losses.push_back(
        {load.time, grasp.end_effector, grasp.target, load.force, load.moment, load.share, in_impact});
  }
}

// Run => report of the locking impulse (docs/theory, section 7, Locking) that stops the settled joints; empty unless
// post_impact.joints is braked. Requires the free system; the held grasps remain closed. Their loads are added.
std::optional<BrakeReport> lock_settled_joints(CaptureRun& run, std::vector<HoldLoad>& loads) {
  if (!run.joints.settle_to(PostImpactSetup::Joints::braked)) return {};
  RunBodies& bodies = run.bodies;
  Contact contact;
  contact.state = bodies.state;
  add_held(run, contact);
  std::vector<std::size_t> joints;
  std::vector<HeldRate> rates = coupling_rates(bodies.free.model);
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    const Body& body = joint_body(bodies.free, j);
    if (follows_others(body) || is_pulled(run.problem.robot, *run.problem.post_impact, body.description.joint.name))
      continue;
    if (run.joints.is_settled(j)) joints.push_back(j), rates.push_back({joint_body(bodies.free, j).v, 0});
  }
  const std::vector<HeldRate> driven = run.joints.driven_rates(bodies);
  rates.insert(rates.end(), driven.begin(), driven.end());
  ImpactOutcome outcome = solve_impact(run, contact, {}, rates, ImpactSetup::Law::plastic);
  outcome.residuals = {.brake = outcome.residuals.energy};
  run.monitor.impact(run.next_name("brake"), outcome);
  std::ranges::copy(loads_in_impact(run.problem, outcome.report), std::back_inserter(loads));
  bodies.state = std::move(outcome.after);
  return brake_report(joints, outcome.report);
}

// Loads of grasps in an impact => those beyond their limits open now, at its end; larger loads replace the grasps'
// largest ones. Requires the free system.
void open_after_impact(CaptureRun& run, const std::vector<HoldLoad>& loads) {
  std::vector<HoldLoad> lost;
  const std::vector<HeldGrasp> holding = run.bodies.holding();
  for (HoldLoad load : loads) {
    if (std::ranges::find(holding, load.grasp, &HeldGrasp::grasp) == holding.end()) continue;
    load.time = run.bodies.time;
    run.schedule.note_load(load);
    if (load.share > 1 && std::ranges::find(lost, load.grasp, &HoldLoad::grasp) == lost.end()) lost.push_back(load);
  }
  lose_grasps(run, lost, true);
}

// Report of the impact, further loads in it => brakes lock joints; grasps beyond their limits open; report in the
// result; joined system.
void end_contact_event(CaptureRun& run, ImpactReport report, std::vector<HoldLoad> loads = {}) {
  std::ranges::copy(loads_in_impact(run.problem, report), std::back_inserter(loads));
  report.brake = lock_settled_joints(run, loads);
  add_report(run, std::move(report));
  open_after_impact(run, loads);
  run.to_joined();
  const RunBodies& bodies = run.bodies;
  if (run.detail == CaptureDetail::full && !bodies.system.elastic_joints.empty() && !bodies.held.empty())
    run.result.elastic.push_back(elastic_report(bodies.system, bodies.state, "captured", bodies.time));
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
}

// Closing grasps, law => state after the instantaneous impact (docs/theory, sections 7 and 11) and after brakes; adds
// its report and conservation checks just before and after it. Throws RunFailure for a singular system.
void impact_at_once(CaptureRun& run, const std::vector<std::size_t>& closing, ImpactSetup::Law law) {
  const RunBodies& bodies = run.bodies;
  const ContactEvent event = begin_contact_event(run, closing);
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
  run.monitor.touch(closing);
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  ImpactOutcome outcome = solve_impact(run, event.contact, closing, held, law);
  run.monitor.impact(event.phase, outcome);
  run.bodies.state = std::move(outcome.after);
  hold_or_part(run, event, law, outcome.report);
  if (const std::string text = describe_dependence_on_modes(outcome.report);
      !text.empty() && run.problem.impact->modes == ImpactSetup::Modes::all)
    run.result.warnings.push_back(fmt::format("impact at t = {:.6g} s: {}", bodies.time, text));
  end_contact_event(run, std::move(outcome.report));
}

// --- Compliant impact ---

// Index of a velocity of a robot joint in another representation.
int velocity_in(const CaptureRun& run, const CaptureSystem& system, int free_velocity) {
  for (std::size_t j = 0; j < run.joints.size(); ++j) {
    if (joint_body(run.bodies.free, j).v == free_velocity) return joint_body(system, j).v;
  }
  return free_velocity;
}

// The contact of closing grasps only, without those that already hold.
Contact without_held(Contact contact, std::size_t held) {
  const auto n = static_cast<std::ptrdiff_t>(held);
  contact.gaps.erase(contact.gaps.begin(), contact.gaps.begin() + n);
  contact.grasps.erase(contact.grasps.begin(), contact.grasps.begin() + n);
  contact.displacement.erase(contact.displacement.begin(), contact.displacement.begin() + n);
  return contact;
}

// Locks braked joints at the first instant of a compliant impact, in the joined system. Returns the impulse per held
// rate.
std::vector<double> brake_at_once(CaptureRun& run, std::span<const HeldRate> held, std::optional<double>& residual) {
  if (run.problem.impact->joints != ImpactSetup::Joints::braked) return std::vector<double>(held.size(), 0.0);
  const CaptureSystem& system = run.bodies.system;
  const Kinematics k = forward_kinematics(system.model, run.bodies.state);
  std::vector<Grasp> closed;
  for (const LoopClosure& loop : system.closures) closed.push_back(grasp_of(HeldGrasp{0, loop}, k));
  const ImpactSolution stopped = plastic_impact(system.model, run.bodies.state, closed, held);
  residual = stopped.energy_identity_residual;
  run.bodies.state.v = stopped.velocity;
  return stopped.held_impulses;
}

// Records the targets' speeds along the contacts' normals after the impact, relative to the end-effectors' motion
// before.
void note_target_speeds(const Model& model, const State& before, const State& after,
                        std::span<const ClosingContact> contacts, std::span<EffectiveMass> masses) {
  const Kinematics then = forward_kinematics(model, before), now = forward_kinematics(model, after);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const CompliantContact& c = contacts[i].contact;
    // The point of the target that was touched first.
    const Vector3d arm = now.X_WB[c.target_body].R * (inverse(then.X_WB[c.target_body]) * c.p_WC);
    const Vector3d target = shift(now.V_WB[c.target_body], arm).linear;
    const Vector3d end_effector = shift(then.V_WB[c.robot_body], c.p_WC - then.X_WB[c.robot_body].p).linear;
    masses[i].target_speed_after = dot(c.n_W, target - end_effector);
  }
}

// Contacts between shapes in an impact => per pair of bodies, whether it exchanged an impulse.
std::vector<bool> pairs_that_pushed(const ImpactShapes& shapes) {
  std::vector<bool> pushed;
  for (std::size_t g = 0; g < shapes.integrals.size(); ++g)
    pushed.push_back(shapes.integrals[g].impulse > 0 || shapes.contacts.history(g).impacts > 0);
  return pushed;
}

// Integrates from the state in which the bodies meet until the springs are at rest or apart. In the joined system.
// `held_loads` becomes the largest loads of the grasps that already hold.
ImpactOutcome let_yield(CaptureRun& run, const CaptureProblem& with_closing, const ContactEvent& event,
                        std::vector<HeldRate> held, std::vector<HoldLoad>& held_loads) {
  RunBodies& bodies = run.bodies;
  const Contact contact = without_held(event.contact, bodies.holding().size());
  for (HeldRate& h : held) h.velocity = velocity_in(run, bodies.system, h.velocity);
  const State start = bodies.state;
  std::optional<double> brake_residual;
  const std::vector<double> stopping = brake_at_once(run, held, brake_residual);
  std::function<void(double)> each_step;
  if (run.progress)
    each_step = [&](double t) {
      run.progress("contact", bodies.time + t, bodies.time + with_closing.impact->compliant.longest);
    };
  const std::vector<ClosingContact> contacts = closing_contacts(with_closing, bodies.free, contact, bodies.system);
  std::vector<EffectiveMass> masses = effective_masses(run.problem, bodies.system, bodies.state, contacts);
  std::optional<CoordinatedDrive> drive;
  const std::shared_ptr<const Model> assumed = run.identification.law_model(bodies.system);
  if (auto law = law_in_impact(run.problem, bodies.system, assumed ? *assumed : bodies.system.model,
                               run.joints.known_posture(bodies), bodies.time, {contacts, masses}))
    drive.emplace(std::move(law), bodies.system, bodies.time, run.joints.clock(), run.sensors.get());
  const std::shared_ptr<ContactSet> set = run.contacts.in(bodies.system);
  std::optional<ImpactShapes> shapes;
  if (set) {
    set->begin(bodies.time, forward_kinematics(bodies.system.model, bodies.state));
    shapes.emplace(ImpactShapes{*set, bodies.time});
  }
  bool begun = false;
  const auto observe = [&](const CompliantSample& sample) {
    raise_held_loads(run.problem, bodies.system, sample, held_loads);
    if (!begun) {
      if (shapes && shapes->touched) run.monitor.touch_targets(run.contacts.targets_of(pairs_that_pushed(*shapes)));
      run.monitor.begin_impact_in_time(event.phase, bodies.system, start, bodies.time, event.closing,
                                       run.schedule.opened());
    }
    begun = true;
    run.monitor.check_in_impact(sample);
  };
  ImpactOutcome outcome =
      run_compliant({with_closing, bodies.free, contact, bodies.system, start, bodies.time, held, stopping, each_step,
                     drive ? &*drive : nullptr, shapes ? &*shapes : nullptr, observe},
                    bodies.state);
  outcome.residuals.brake = brake_residual;
  note_target_speeds(bodies.system.model, start, outcome.after, contacts, masses);
  outcome.report.effective_masses = std::move(masses);
  for (const std::string& warning : outcome.warnings) run.result.warnings.push_back(warning);
  run.monitor.end_impact_in_time(outcome.from_ground);
  bodies.state = outcome.after;
  bodies.time += outcome.report.duration;
  if (shapes) run.monitor.add_contacts(*shapes, bodies.time);
  return outcome;
}

// Rigid grasps may not permit the rates that springs permitted; corrects the held joints.
void correct_held_joints(const Model& model, const std::vector<HeldRate>& held, const ImpactSolution& rest,
                         ImpactReport& report) {
  const std::vector<bool> was_overpowered = which_was_overpowered(model, held, rest.velocity);
  for (std::size_t i = 0; i < held.size(); ++i) {
    const std::string& name = held_joint(model, held[i]).name;
    for (HeldJoint& joint : report.held_joints) {
      if (joint.joint == name)
        joint.rate_after = rest.velocity[held[i].velocity], joint.was_overpowered = was_overpowered[i];
    }
  }
}

// Makes grasps that have come to rest rigid. In the free system.
void stiffen(CaptureRun& run, const ContactEvent& event, ImpactOutcome& yielded) {
  RunBodies& bodies = run.bodies;
  const Model& model = bodies.free.model;
  ImpactReport& report = yielded.report;
  hold_or_part(run, event, run.problem.impact->law, report, yielded.unfinished);
  std::vector<Grasp> holding;
  const Kinematics k = forward_kinematics(model, bodies.state);
  for (const HeldGrasp& each : bodies.holding()) holding.push_back(grasp_of(each, k));
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  const ImpactSolution rest = plastic_impact(model, bodies.state, holding, held);
  correct_held_joints(model, held, rest, report);
  for (const ContactImpulse& c : rest.contacts)
    report.compliant->residual_impulse = std::max(report.compliant->residual_impulse, norm(c.P_WC.linear));
  const Momentumd before = run.momentum_about_origin();
  bodies.state.v = rest.velocity;
  const bool grounded = !model.has_free_root(bodies.free.base);  // otherwise the momentum cannot have changed
  yielded.from_ground = grounded ? run.momentum_about_origin() - before : Momentumd::zero();
  run.monitor.impact(event.phase, yielded);
}

// Closing grasps => state and time after the compliant impact (docs/theory, section 12): integrates the springs in the
// joined system, then makes the grasps at rest rigid in the free system and applies brakes.
void impact_in_time(CaptureRun& run, const std::vector<std::size_t>& closing) {
  const RunBodies& bodies = run.bodies;
  const CaptureProblem with_closing = run.with_grasps(closing);  // a copy: with_grasps() is called again below
  const ContactEvent event = begin_contact_event(run, closing);
  const std::vector<HeldRate> held = run.joints.rates_in_impact(bodies);
  for (std::size_t n = 0; n < closing.size(); ++n) {  // pairs in contact continue to push, unless the target was moved
    const bool moved = norm(event.contact.displacement[bodies.holding().size() + n]) > 0;
    if (!run.problem.grasps[closing[n]].contact)
      run.contacts.close(closing[n], bodies.free, bodies.state, bodies.time, !moved);
  }
  run.to_joined();
  run.monitor.instant(bodies.system, bodies.state, bodies.time);
  run.monitor.touch(closing);
  std::vector<HoldLoad> held_loads;
  ImpactOutcome yielded = let_yield(run, with_closing, event, held, held_loads);
  run.to_free();
  stiffen(run, event, yielded);
  end_contact_event(run, std::move(yielded.report), std::move(held_loads));
}

}  // namespace

// --- Order of events ---

bool close_due_grasps(CaptureRun& run, const MotionPhase& phase) {
  const RunBodies& bodies = run.bodies;
  const bool moves = bodies.time < phase.end;
  if (!moves && run.joints.approaching()) return false;  // grasps due at its end close with the others
  run.schedule.note_departures(bodies.system, bodies.state);
  close_grasps(run, run.schedule.arrived(bodies.system, bodies.state));
  close_grasps(run, run.schedule.due_at(bodies.time));
  close_grasps(run, run.schedule.settled(run.monitor.stages()));
  if (!moves) return false;
  return !ends_in_envelopes(run) || !run.schedule.together_in_envelopes(bodies.system, bodies.state);
}

// Due grasps => whether an impact took place: those within their envelopes close under impact.law. Under the
// instantaneous laws, grasps close before contacts touch, in separate impacts.
bool close_grasps(CaptureRun& run, const std::vector<std::size_t>& grasps) {
  const RunBodies& bodies = run.bodies;
  const std::vector<std::size_t> closing = run.schedule.decide(grasps, bodies.system, bodies.state, bodies.time);
  if (!run.problem.impact) refuse_distant(run, closing);
  if (closing.empty() || !run.problem.impact) return false;
  const ImpactLaw& law = impact_law(*run.problem.impact);
  if (law.in_time) {
    impact_in_time(run, closing);
    return true;
  }
  std::vector<std::size_t> grasping, touching;
  for (std::size_t i : closing) (run.problem.grasps[i].contact ? touching : grasping).push_back(i);
  if (!grasping.empty()) impact_at_once(run, grasping, law.of_grasps ? law.law : ImpactSetup::Law::plastic);
  if (!touching.empty()) impact_at_once(run, touching, law.law);
  return true;
}

// Loads at the limits, ends of slips => their grasps open, slip or hold again; law and joints settle if the law's
// grasps no longer hold.
void open_overloaded_grasps(CaptureRun& run) {
  if (!run.overloads.any()) return;
  const GraspOverloads overloads = std::exchange(run.overloads, {});
  const auto slips = [&](const HoldLoad& load) { return run.problem.grasps[load.grasp].holds->slips(); };
  std::vector<HoldLoad> slipping, lost;
  std::ranges::copy_if(overloads.reached, std::back_inserter(slipping), slips);
  std::ranges::copy_if(overloads.reached, std::back_inserter(lost), std::not_fn(slips));
  run.to_free();
  end_slips(run, overloads);
  begin_slips(run, slipping);
  lose_grasps(run, lost, false);
  run.to_joined();
  if (run.law.ends_by_release(run.bodies.system, run.bodies.time) && !run.joints.approaching())
    run.joints.settle_all(run.bodies);
}

// Phase => removes the grasps of all releases that are due at the current time and reports them; law and joints settle
// if the law's grasps are released.
void release_due_grasps(CaptureRun& run, MotionPhase& phase) {
  const auto& releases = run.problem.post_impact->releases;
  const double now = run.bodies.time;
  // In the order of time; a compliant impact may have passed some.
  for (; phase.released < releases.size(); ++phase.released) {
    const PostImpactSetup::Release& release = releases[phase.released];
    const double due = phase.begin + release.after;
    if (due > now && !GraspSchedule::is_now(due, now)) return;
    ReleaseReport report;
    report.time = now;
    run.to_free();
    std::erase_if(run.bodies.held, [&](const HeldGrasp& each) {
      const GraspSetup& g = run.problem.grasps[each.grasp];
      const auto& named = release.end_effectors;
      if (!named.empty() && std::find(named.begin(), named.end(), g.end_effector) == named.end()) return false;
      report.end_effectors.push_back(g.end_effector);
      report.targets.push_back(g.target);
      run.schedule.release(each.grasp, now);
      return true;
    });
    release_slips(run, release, report);
    run.to_joined();
    if (!report.end_effectors.empty()) run.result.releases.push_back(std::move(report));
    if (run.law.ends_by_release(run.bodies.system, now)) run.joints.settle_all(run.bodies);
  }
}

// --- Brakes ---

void stop_joints(CaptureRun& run) {
  if (!run.joints.settle_to(PostImpactSetup::Joints::braked)) return;
  run.to_free();
  std::vector<HoldLoad> loads;
  lock_settled_joints(run, loads);
  open_after_impact(run, loads);
  run.to_joined();
}

}  // namespace grapnel
