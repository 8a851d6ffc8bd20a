#include "grapnel/result/result_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/result/contact_table.hpp"
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

// Components at the level of rounding error relative to the others are printed as zero; summary.json has all digits.
std::string vector(const Vector3d& v) {
  const double size = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  const auto component = [&](double x) { return short_number(std::abs(x) < 1e-12 * size ? 0.0 : x); };
  return "[" + component(v[0]) + ", " + component(v[1]) + ", " + component(v[2]) + "]";
}

// The verdict, then the reasons for which grasps did not close.
std::string capture_lines(const CaptureResult& result) {
  if (result.grasps.empty()) return "";
  std::string out = paragraph(capture_sentence(result), "");
  for (const GraspOutcome& g : result.grasps) {
    if (!g.captured) out += paragraph(grasp_name(g.end_effector, g.target, g.grasp_point) + ": " + g.reason, "  ");
  }
  return out;
}

// The verdict; then the worst violation of each phase, and the number of further violations.
std::string feasibility_lines(const CaptureResult& result) {
  std::string out = paragraph(feasibility_sentence(result), "");
  if (result.ledger.feasibility() != Verdict::no) return out;
  for (const Remark& remark : violation_remarks(result)) out += paragraph(remark.of + ": " + remark.text, "  ");
  return out;
}

std::string verdict(const CaptureResult& result) {
  std::string text;
  switch (result.status) {
    case CaptureStatus::not_run:
      text = "not run";
      break;
    case CaptureStatus::completed:
      text = "completed";
      break;
    case CaptureStatus::failed:
      text = "FAILED: " + result.failure;
      break;
  }
  std::string out = paragraph(result.scenario_name + ": " + text, "");
  out += capture_lines(result) + worst_margin_line(result) + ledger_sentence(result.ledger) + "\n";
  if (!result.ledger.entries.empty()) out += feasibility_lines(result);
  for (const std::string& sentence : {ratings_sentence(result), saturation_sentence(result), stability_sentence(result),
                                      rest_sentence(result), contact_sentence(result), stage_sentence(result)}) {
    if (!sentence.empty()) out += paragraph(sentence, "");
  }
  for (const std::string& warning : result.warnings) out += paragraph("warning: " + warning, "");
  return out;
}

// Marks what follows the first overlap.
std::string beyond(const CaptureResult& result, double time) {
  if (!result.valid_until || time <= *result.valid_until) return "";
  return fmt::format("; beyond validity, which ends at t = {} s", short_number(*result.valid_until));
}

// The selected capture time, if the planner searched for it.
std::string window_line(const CaptureResult& result) {
  if (!result.plan || !result.plan->window || result.plan->window->points.empty()) return "";
  return "\n" + paragraph("window: " + window_sentence(*result.plan->window), "");
}

// The terms of the objective, and the margins of the planned trajectory to its constraints.
std::string plan_lines(const PlanReport& plan) {
  std::string text;
  if (plan.terms.size() > 1 && std::isfinite(plan.objective_value)) {
    std::string terms;
    for (const PlanTerm& term : plan.terms) {
      terms += fmt::format("{}{} x {} {}", terms.empty() ? "" : " + ", short_number(term.weight), term.name,
                           short_number(term.value));
    }
    text += paragraph("objective: " + terms, "  ");
  }
  if (!plan.path) return text;
  const PlannedPath& path = *plan.path;
  std::string parts = fmt::format("trajectory with {} knots: ", path.knots);
  if (path.clearance) {
    parts += fmt::format("clearance {} m, {} and {} at t = {} s; ", short_number(*path.clearance), path.body_a,
                         path.body_b, short_number(path.clearance_time));
  }
  parts += path.attitude_held ? "assumes that the base keeps its attitude exactly"
                              : fmt::format("the base turns by up to {} rad", short_number(path.base_turn));
  if (path.position_margin)
    parts += fmt::format("; joints stay {} within their limits", short_number(*path.position_margin));
  if (path.rate_share) parts += fmt::format("; rates up to {:.1f} % of their limits", 100 * *path.rate_share);
  for (const WheelShare& w : path.wheels)
    parts += fmt::format("; {} uses up to {:.1f} % of its capacity", w.wheel, 100 * w.share);
  if (path.effort_share) parts += fmt::format("; efforts up to {:.1f} % of their limits", 100 * *path.effort_share);
  return text + paragraph(parts, "  ");
}

// The planner may find final values although it finds no approach.
bool is_unplanned(const CaptureResult& result) {
  return result.status == CaptureStatus::failed && result.failure.starts_with("planning");
}

// The result of the search for final joint values.
std::string plan_table(const CaptureResult& result) {
  if (!result.plan || !result.plan->searched) return "";
  const PlanReport& plan = *result.plan;
  std::string out = fmt::format("\nplan: {}, {} of {} initial guesses, {} Newton steps",
                                plan.found && !is_unplanned(result) ? "found" : "NOT FOUND", plan.solutions,
                                plan.starts, plan.iterations);
  if (std::isfinite(plan.objective_value))
    out += fmt::format(", objective {} = {}", plan.objective, short_number(plan.objective_value));
  out += "\n";
  out += plan_lines(plan);
  TextTable table;
  table.row({"joint", "final value", "final rate"});
  table.row({"", "rad or m", "rad/s or m/s"});
  for (std::size_t j = 0; j < plan.joints.size() && j < plan.final_position.size(); ++j) {
    table.row(
        {plan.joints[j], fmt::format("{:.6f}", plan.final_position[j]), fmt::format("{:.6f}", plan.final_rates[j])});
  }
  return out + table.text();
}

// Frequencies of flexible modes.
std::string elastic_table(const CaptureResult& result) {
  constexpr std::size_t kMaxShown = 8;
  std::string out;
  for (const ElasticReport& e : result.elastic) {
    TextTable table;
    table.row({"vibration", "base held", "base free", "and joints free", "damping ratio", "effective mass"});
    table.row({"", "Hz", "Hz", "Hz", "1", "kg"});
    const auto known = [](double x) { return std::isnan(x) ? "-" : short_number(x); };
    for (std::size_t i = 0; i < std::min(kMaxShown, e.modes.size()); ++i) {
      const ElasticModeReport& m = e.modes[i];
      const Vector3d& mass = m.effective_mass;
      table.row({std::to_string(i + 1), known(m.held), known(m.braked), known(m.free), short_number(m.damping_ratio),
                 fmt::format("[{}, {}, {}]", short_number(mass[0]), short_number(mass[1]), short_number(mass[2]))});
    }
    out += fmt::format("\nfrequencies, {} (t = {} s): {} springs, fastest {} Hz\n{}",
                       e.at == "start" ? "in the initial posture" : "with the captured targets", short_number(e.time),
                       e.springs, short_number(e.fastest), table.text());
  }
  return out;
}

// Impulses of a plastic impact against the number of flexible modes.
std::string modes_table(const ImpactReport& impact) {
  if (impact.by_modes.empty()) return "";
  TextTable table;
  std::vector<std::string> head{"with the slowest modes only", "up to"}, units{"", "Hz"};
  for (const GraspImpulse& g : impact.grasps) head.push_back(g.end_effector), units.push_back("N s");
  table.row(head), table.row(units);
  for (const RetainedModes& m : impact.by_modes) {
    std::vector<std::string> row{std::to_string(m.modes), short_number(m.frequency)};
    for (double impulse : m.impulses) row.push_back(short_number(impulse));
    table.row(row);
  }
  return table.text();
}

std::string wheel_table(const CaptureResult& result) {
  if (result.wheels.empty()) return "";
  TextTable table;
  table.row({"reaction wheel", "rate before", "after", "largest", "limit", "largest torque", "limit", "momentum"});
  table.row({"", "rad/s", "rad/s", "rad/s", "rad/s", "N m", "N m", "N m s"});
  const auto limit = [](double x) { return std::isfinite(x) ? short_number(x) : "none"; };
  for (const WheelReport& w : result.wheels) {
    table.row({w.name, short_number(w.rate_before), short_number(w.rate_after), short_number(w.largest_rate),
               limit(w.rate_limit), std::isnan(w.largest_torque) ? "-" : short_number(w.largest_torque),
               limit(w.torque_limit), short_number(w.momentum_after())});
  }
  return "\nreaction wheels, relative to the base\n" + table.text();
}

std::string gyro_table(const CaptureResult& result) {
  if (!result.gyros) return "";
  const GyrosReport& all = *result.gyros;
  TextTable table;
  table.row({"control moment gyro", "momentum", "angle before", "after", "largest rate", "limit", "largest torque",
             "limit", "of rotor"});
  table.row({"", "N m s", "rad", "rad", "rad/s", "rad/s", "N m", "N m", "N m"});
  const auto limit = [](double x) { return std::isfinite(x) ? short_number(x) : "none"; };
  const auto known = [](double x) { return std::isnan(x) ? "-" : short_number(x); };
  for (const GyroReport& g : all.each) {
    table.row({g.name, short_number(g.momentum), short_number(g.angle_before), short_number(g.angle_after),
               short_number(g.largest_rate), limit(g.rate_limit), known(g.largest_torque), limit(g.torque_limit),
               known(g.largest_spin_torque)});
  }
  std::string out = "\ncontrol moment gyros, relative to the base\n" + table.text();
  out += fmt::format("minimum singularity measure {}", short_number(all.least_singularity_measure));
  if (all.steered)
    out += fmt::format(", near a singularity below {}; missing torque at most {} N m", short_number(all.near),
                       known(all.largest_torque_lacking));
  out += "\n";
  for (const SingularityHazard& h : all.hazards)
    out += fmt::format("NEAR A SINGULARITY from t = {} s for {} s: measure {}, missing torque {} N m\n",
                       short_number(h.begin), short_number(h.duration()), short_number(h.least_measure),
                       short_number(h.largest_torque_lacking));
  return out;
}

// Of every actuator that saturated.
std::string saturation_table(const CaptureResult& result) {
  if (result.saturation.empty()) return "";
  TextTable table;
  table.row({"saturated", "quantity", "name", "limit", "time", "share", "first at", "at the end"});
  table.row({"", "", "", "rad/s, N m, N", "s", "%", "s", ""});
  for (const SaturationReport& s : result.saturation)
    table.row({name_of(s.actuator), name_of(s.quantity), s.name, short_number(s.limit), short_number(s.duration),
               fmt::format("{:.1f}", 100 * s.share), short_number(s.first_time), s.at_end ? "yes" : "no"});
  return "\n" + table.text();
}

std::string joint_mode_table(const CaptureResult& result) {
  if (result.joints.empty()) return "";
  TextTable table;
  table.row({"joint", "phase", "at its end", "sticks", "breaks away", "friction heat", "stop hits", "stop loss",
             "motor work", "electrical"});
  table.row({"", "", "", "", "", "J", "", "J", "J", "J"});
  bool determined = true;
  for (const JointReport& j : result.joints) {
    const auto electrical = j.electrical_energy();
    determined = determined && j.friction_determined;
    const std::string mode = std::string(name_of(j.mode)) + (j.friction_determined ? "" : " *");
    table.row({j.joint, j.phase, mode, std::to_string(j.sticks), std::to_string(j.breakaways),
               short_number(j.friction_heat), std::to_string(j.stop_impacts), short_number(j.stop_energy_lost),
               short_number(j.motor_work), electrical ? short_number(*electrical) : "-"});
  }
  std::string out = "\njoints with sticking friction, stops or motor models\n" + table.text();
  if (!determined)
    out += paragraph(
        "* closed loops leave the friction of these joints undetermined while they are held: joint efforts and loads "
        "of the loops belong to the admissible friction with the minimum sum of squared shares of breakaway",
        "");
  return out;
}

std::string thruster_table(const CaptureResult& result) {
  if (!result.thrusters) return "";
  const ThrustersReport& all = *result.thrusters;
  TextTable table;
  table.row({"thruster", "firings", "time on", "duty", "impulse", "propellant"});
  table.row({"", "", "s", "%", "N s", "kg"});
  for (const ThrusterReport& t : all.each)
    table.row({t.name, std::to_string(t.firings), short_number(t.on_time), fmt::format("{:.1f}", 100 * t.duty),
               short_number(t.impulse), short_number(t.propellant)});
  std::string out = "\nthrusters: " + short_number(all.propellant) + " kg of propellant";
  if (!std::isnan(all.available)) out += " of " + short_number(all.available) + " kg available";
  if (all.excess() > 0) out += fmt::format(", EXCEEDS THE SUPPLY BY {} kg", short_number(all.excess()));
  out += "\n" + table.text();
  if (const auto& d = all.dumping)
    out += fmt::format("wheel momentum unloaded {} time{}, for {} s{}\n", d->begun, d->begun == 1 ? "" : "s",
                       short_number(d->duration), d->active ? ", still active at the end" : "");
  for (const PlumeHazard& h : all.hazards)
    out += fmt::format("plume of {} on {}: {} s, first at t = {} s\n", h.thruster, h.body, short_number(h.duration),
                       short_number(h.first_time));
  return out;
}

std::string approach_table(const CaptureResult& result) {
  if (!result.approach_end) return "";
  const PhaseEnd& end = *result.approach_end;
  std::string out =
      fmt::format("\napproach, at its end (t = {} s{})\n", short_number(end.time), beyond(result, end.time));
  TextTable table;
  table.row({"end-effector", "miss distance", "relative speed", "relative angular velocity"});
  table.row({"", "m", "m/s", "rad/s"});
  bool any = false;
  for (const EndEffectorMotion& e : end.end_effectors) {
    if (e.target.empty()) continue;
    any = true;
    table.row({grasp_name(e.name, e.target, e.grasp_point), short_number(e.miss_distance),
               short_number(norm(e.relative_velocity)), short_number(norm(e.relative_angular_velocity))});
  }
  if (any) out += table.text();
  TextTable base(3);
  base.row({"base angular velocity", "rad/s", vector(end.base.angular_velocity)});
  base.row({"base velocity", "m/s", vector(end.base.velocity)});
  return out + base.text();
}

/// The published magnitude for an end-effector, or a dash.
std::string published_impulse(const ImpactReport& impact, const std::string& end_effector) {
  if (impact.as_published) {
    for (const AsPublished::Grasp& grasp : impact.as_published->grasps) {
      if (grasp.end_effector == end_effector) return short_number(grasp.impulse_magnitude);
    }
  }
  return "-";
}

// Every component is unique.
bool all_of(const std::vector<bool>& determined) {
  return std::all_of(determined.begin(), determined.end(), [](bool unique) { return unique; });
}

std::string grasp_table(const ImpactReport& impact) {
  TextTable table;
  const bool published = impact.show_as_published;
  const auto row = [&](std::vector<std::string> cells) {
    if (!published) cells.erase(cells.begin() + 2);
    table.row(cells);
  };
  row({"grasp", "impulse", "as publ.", "ang. impulse", "mean force", "gap", "rel. speed"});
  row({"", "N s", "N s", "N m s", "N", "m", "m/s"});
  bool all_determined = true;
  for (const GraspImpulse& g : impact.grasps) {
    const std::string mark = all_of(g.determined) ? "" : " *";
    all_determined = all_determined && all_of(g.determined);
    row({grasp_name(g.end_effector, g.target, g.grasp_point) + mark, short_number(g.impulse_magnitude),
         published_impulse(impact, g.end_effector), short_number(norm(g.angular_impulse)), short_number(g.mean_force),
         short_number(g.gap), short_number(norm(g.relative_velocity_before))});
  }
  std::string out = table.text();
  if (!all_determined) {
    const bool contacts = !impact.hypothesis.empty();
    out += paragraph(contacts ? "* how simultaneous contacts share the impulse depends on their stiffnesses: see "
                                "rebound.spread in summary.json"
                              : "* some components are not unique (a self-stress of the closed loops is free): see "
                                "determined and null_space in summary.json",
                     "  ");
  }
  return out;
}

// Rebound of contacts.
std::string rebound_table(const ImpactReport& impact) {
  TextTable table;
  table.row({"contact", "normal", "tangential", "speed after", "modes"});
  table.row({"", "N s", "N s", "m/s", ""});
  bool any = false;
  for (const GraspImpulse& g : impact.grasps) {
    if (!g.rebound) continue;
    any = true;
    const ContactRebound& r = *g.rebound;
    table.row({grasp_name(g.end_effector, g.target, g.grasp_point), short_number(r.normal_impulse),
               short_number(norm(r.tangential_impulse)), short_number(norm(g.relative_velocity_after)),
               fmt::format("{}", fmt::join(r.modes, ", "))});
  }
  return any ? table.text() : "";
}

// Force histories of contacts and grasps in a compliant impact.
std::string profile_table(const ImpactReport& impact) {
  TextTable table;
  table.row({"compliant", "peak force", "at", "peak moment", "deformation", "duration", "energy lost"});
  table.row({"", "N", "s", "N m", "m", "s", "J"});
  bool any = false;
  for (const GraspImpulse& g : impact.grasps) {
    if (!g.profile) continue;
    any = true;
    const ForceProfile& p = *g.profile;
    table.row({grasp_name(g.end_effector, g.target, g.grasp_point), short_number(p.peak_force),
               short_number(p.peak_force_time), short_number(p.peak_moment), short_number(p.largest_deformation),
               short_number(p.duration), short_number(p.energy_lost)});
  }
  return any ? table.text() : "";
}

// Drives that were overpowered by the constraint and did not hold their commanded rates.
std::string drive_table(const ImpactReport& impact) {
  TextTable table;
  table.row({"overpowered drive", "commanded", "rate after", "difference"});
  table.row({"", "rad/s, m/s", "rad/s, m/s", "rad/s, m/s"});
  bool any = false;
  for (const HeldJoint& held : impact.held_joints) {
    if (!held.was_overpowered) continue;
    any = true;
    table.row({held.joint, short_number(held.commanded_rate), short_number(held.rate_after),
               short_number(held.rate_after - held.commanded_rate)});
  }
  return any ? table.text() : "";
}

// Loads of the impact against ratings, the worst of each joint or gripper, and the maximum speed of each arm.
std::string margin_table(const ImpactReport& impact) {
  if (impact.margins.empty()) return "";
  TextTable table;
  table.row({"rated", "load", "", "rating", "margin"});
  std::vector<std::string> done;
  bool assumed = false;
  for (const LoadMargin& first : impact.margins) {
    if (std::find(done.begin(), done.end(), first.of) != done.end()) continue;
    done.push_back(first.of);
    const LoadMargin* worst = &first;
    for (const LoadMargin& m : impact.margins) {
      if (m.of == first.of && m.margin() < worst->margin()) worst = &m;
    }
    table.row({worst->of, worst->quantity, short_number(worst->load), short_number(worst->rating),
               fmt::format("{:.1f} %{}{}", 100 * worst->margin(), worst->margin() < 0 ? "  EXCEEDED" : "",
                           rests_on_duration(impact, *worst) ? " *" : "")});
    assumed = assumed || rests_on_duration(impact, *worst);
  }
  std::string out = table.text();
  if (assumed) out += fmt::format("  * a mean over an assumed {} ms\n", short_number(1e3 * impact.duration));
  for (const SpeedLimit& limit : impact.speed_limits) {
    if (limit.of.empty() || !(limit.largest_speed > 0)) continue;
    out += paragraph(fmt::format("maximum speed of {} at its target: {} m/s ({} times the present relative motion); "
                                 "there the {} of {} reaches its rating",
                                 limit.end_effector, short_number(limit.largest_speed), short_number(limit.factor),
                                 limit.quantity, limit.of),
                     "  ");
  }
  return out;
}

// The impact law and the rank of its constraints.
std::string law_words(const ImpactReport& impact) {
  std::string out = impact.law;
  if (!impact.hypothesis.empty()) out += " (" + impact.hypothesis + ")";
  if (impact.joints_during != "free") out += ", joints " + impact.joints_during;
  if (impact.compliant)
    return out + fmt::format(", {} after {} s", impact.compliant->end, short_number(impact.duration));
  if (impact.rows > 0) {
    out += fmt::format(", rank {} of {} rows{}", impact.rank, impact.rows,
                       impact.rank < impact.rows ? ", impulses not unique" : "");
  }
  return out + fmt::format(", mean force over {} s", short_number(impact.duration));
}

// Loops that cannot close on their grasp points for any position of the target.
std::string gap_lines(const ImpactReport& impact) {
  constexpr double kShown = 1e-6;  // [m]
  std::string out;
  for (const LoopGap& loop : impact.loops) {
    if (loop.gap() <= kShown) continue;
    out += paragraph(fmt::format("the loop over {} has a gap of {} m: {} and {} are {} m apart, {} and {} {} m",
                                 loop.target, short_number(loop.gap()), loop.end_effectors[0], loop.end_effectors[1],
                                 short_number(loop.end_effector_distance), loop.grasp_points[0], loop.grasp_points[1],
                                 short_number(loop.grasp_point_distance)),
                     "  ");
  }
  return out;
}

std::string published_line(const ImpactReport& impact) {
  if (!impact.show_as_published) return "";
  if (impact.as_published) {
    return paragraph(fmt::format("as published, (3.8)-(3.13), violates momentum conservation: linear by {} N s ({} of "
                                 "scale), angular by {} N m s ({} of scale)",
                                 short_number(impact.as_published->linear_momentum_error),
                                 short_number(impact.as_published->relative_linear_momentum_error),
                                 short_number(impact.as_published->angular_momentum_error),
                                 short_number(impact.as_published->relative_angular_momentum_error)),
                     "  ");
  }
  if (impact.as_published_absent.empty()) return "";
  return paragraph("as published: absent, " + impact.as_published_absent, "  ");
}

// `name`: "impact" or "later impact".
std::string impact_table(const CaptureResult& result, const ImpactReport& impact, std::string_view name) {
  std::string out = "\n" + paragraph(fmt::format("{} at t = {} s: {}{}", name, short_number(impact.time),
                                                 law_words(impact), beyond(result, impact.time)),
                                     "");
  out += grasp_table(impact) + rebound_table(impact) + profile_table(impact) + drive_table(impact) + gap_lines(impact) +
         modes_table(impact) + published_line(impact) + margin_table(impact);
  TextTable table(3);
  table.row(
      {"kinetic energy", "J",
       fmt::format("{} -> {}", short_number(impact.kinetic_energy_before), short_number(impact.kinetic_energy_after))});
  if (impact.brake) {
    table.row({"kinetic energy, brake", "J",
               fmt::format("{} -> {}", short_number(impact.brake->kinetic_energy_before),
                           short_number(impact.brake->kinetic_energy_after))});
  }
  table.row({"base angular velocity change", "rad/s", vector(impact.base_angular_velocity_change)});
  table.row({"base velocity change", "m/s", vector(impact.base_velocity_change)});
  return out + table.text();
}

std::string impact_tables(const CaptureResult& result) {
  std::string out;
  for (const ImpactReport& impact : result.impacts)
    out += impact_table(result, impact, out.empty() ? "impact" : "later impact");
  return out;
}

// "loss at t = 45 s: left loses debris, under 31 N and 2.1 N m"
std::string loss_lines(const CaptureResult& result) {
  std::string out;
  for (const LossReport& loss : result.losses) {
    out += "\n" +
           paragraph(fmt::format("loss at t = {} s: {} loses {}, under {} N and {} N m ({})", short_number(loss.time),
                                 loss.end_effector, loss.target, short_number(loss.force), short_number(loss.moment),
                                 loss.by_slip ? "it slipped too far"
                                              : fmt::format("{:.4g} of its limits{}", loss.load,
                                                            loss.in_impact ? ", in an impact" : "")),
                     "");
  }
  return out;
}

// "slip at t = 2.5 s: left on debris until 3.1 s, by 12 mm and 0.1 rad, dissipates 1.2 J"
std::string slip_lines(const CaptureResult& result) {
  std::string out;
  for (const SlipReport& slip : result.slips) {
    out += "\n" +
           paragraph(fmt::format("slip at t = {} s: {} on {} until t = {} s ({}), by {} and {} rad, dissipates {} J",
                                 short_number(slip.time), slip.end_effector, slip.target, short_number(slip.until),
                                 name_of(slip.ended), length_text(slip.distance), short_number(slip.angle),
                                 short_number(slip.energy)),
                     "");
  }
  return out;
}

// "release at t = 45 s: left releases debris"
std::string release_lines(const CaptureResult& result) {
  std::string out;
  for (const ReleaseReport& release : result.releases) {
    std::vector<std::string> grasps;
    for (std::size_t i = 0; i < release.end_effectors.size() && i < release.targets.size(); ++i) {
      grasps.push_back(release.end_effectors[i] + " releases " + release.targets[i]);
    }
    const std::string what = grasps.empty() ? "nothing was held" : fmt::format("{}", fmt::join(grasps, ", "));
    out += "\n" + paragraph(fmt::format("release at t = {} s: {}", short_number(release.time), what), "");
  }
  return out;
}

std::string small(double value) { return fmt::format("{:.3g}", value); }

// Closure of loops; the ledger has the bounds.
std::string loop_tables(const CaptureResult& result) {
  std::string out;
  for (const LoopReport& loops : result.loops) {
    out += "\n" + paragraph(fmt::format("closed loops, {}: {}; rank {} of {} rows", loops.phase,
                                        fmt::join(loops.closures, ", "), loops.rank, loops.rows),
                            "");
    TextTable table(2);
    table.row(
        {"largest defect of a step", "m, rad", small(loops.unprojected_position), small(loops.unprojected_angle)});
    table.row({"and of its rate", "m/s, rad/s", small(loops.unprojected_velocity),
               small(loops.unprojected_angular_velocity)});
    table.row({"corrections, integration errors", "1", small(loops.correction_total), small(loops.integration_error)});
    out += table.text();
  }
  return out;
}

std::string load_table(const CaptureResult& result) {
  if (result.grasp_loads.empty()) return "";
  TextTable table;
  table.row({"load on a grasp", "phase", "largest force", "at", "largest moment", "at"});
  table.row({"", "", "N", "s", "N m", "s"});
  bool all_determined = true;
  for (const GraspLoad& load : result.grasp_loads) {
    const std::string mark = all_of(load.determined) ? "" : " *";
    all_determined = all_determined && all_of(load.determined);
    table.row({grasp_name(load.end_effector, load.target, "") + mark, load.phase, short_number(load.largest_force),
               short_number(load.force_time), short_number(load.largest_moment), short_number(load.moment_time)});
  }
  std::string out = "\n" + table.text();
  if (!all_determined) {
    out += paragraph(
        "* some components are not unique (a self-stress of the closed loops is free): the minimum is reported", "  ");
  }
  return out;
}

std::string post_impact_table(const CaptureResult& result) {
  if (!result.post_impact_end) return "";
  const PhaseEnd& end = *result.post_impact_end;
  TextTable base(3);
  base.row({"base angular velocity", "rad/s", vector(end.base.angular_velocity)});
  base.row({"base velocity", "m/s", vector(end.base.velocity)});
  return fmt::format("\n{}, at its end (t = {} s{})\n", result.without_impact ? "motion" : "after the impact",
                     short_number(end.time), beyond(result, end.time)) +
         base.text();
}

// Phases, if there are several or one ended before its duration.
std::string phases_table(const CaptureResult& result) {
  const auto by_condition = [](const MotionPhaseReport& p) { return p.ended == MotionPhaseReport::End::condition; };
  if (result.phases.size() < 2 && std::none_of(result.phases.begin(), result.phases.end(), by_condition)) return "";
  TextTable table;
  table.row({"phase", "begin", "end", "ended by", "base angular velocity"});
  table.row({"", "s", "s", "", "rad/s"});
  for (const MotionPhaseReport& p : result.phases)
    table.row({p.name, short_number(p.begin), short_number(p.end), name_of(p.ended),
               p.at_end ? vector(p.at_end->base.angular_velocity) : "-"});
  return "\n" + table.text();
}

// "at rest at t = 75.2 s" and the like.
std::string law_end(LawEnd ended, double time, const std::string& joint) {
  const std::string at = fmt::format(" at t = {} s", short_number(time));
  switch (ended) {
    case LawEnd::running:
      return "still active" + at + ", the end of the run";
    case LawEnd::at_rest:
      return "at rest" + at;
    case LawEnd::rank_lost:
      return "ended" + at + ": the joints are near a singular configuration";
    case LawEnd::joint_limit:
      return "ended" + at + ": " + joint + " reaches the end of its range";
    case LawEnd::released:
      break;
  }
  return "ended" + at + ": the target is released";
}

std::string law_tables(const CaptureResult& result) {
  std::string out;
  if (const auto& d = result.detumbling) {
    out += "\n" + paragraph("detumbling of " + d->target + ": " + law_end(d->ended, d->end, d->joint), "");
    TextTable table(2);
    table.row({"angular momentum before, after", "N m s", small(d->angular_momentum_before),
               small(d->angular_momentum_after)});
    table.row({"largest torque, its bound", "N m", short_number(d->largest_torque), short_number(d->torque_bound)});
    table.row(
        {"duration, with enough effort", "s", short_number(d->end - d->begin), short_number(d->expected_duration)});
    if (d->least_scale < 1) {
      table.row({"fraction of the torque at the start", "1", small(d->first_scale)});
      table.row({"minimum fraction, at", "1, s", small(d->least_scale), short_number(d->least_scale_time)});
    }
    out += table.text();
    if (!d->within_limits)
      out += paragraph(fmt::format("efforts were scaled down, and the target deviated from its commanded motion, which "
                                   "requires {} times {} (t = {} s)",
                                   short_number(d->largest_demand), d->limiting, short_number(d->largest_demand_time)),
                       "  ");
  }
  const auto impedance = [&](const std::string& what, const ImpedanceReport& i) {
    out += "\n" + paragraph(what + ": " + law_end(i.ended, i.end, i.joint), "");
    TextTable table(2);
    table.row({"largest distance, at the end", "m", small(i.largest_distance), small(i.distance_after)});
    table.row({"largest angle, at the end", "rad", small(i.largest_angle), small(i.angle_after)});
    out += table.text();
    if (!i.within_limits)
      out += paragraph("efforts were limited: the end-effectors deviated from their commanded motion", "  ");
  };
  if (result.approach_impedance)
    impedance("impedance of the end-effectors in the approach", *result.approach_impedance);
  if (result.impedance) impedance("impedance of the end-effectors", *result.impedance);
  if (const auto& g = result.grasp_force) {
    out += "\n" + paragraph("grasp forces on " + g->target + ": " + law_end(g->ended, g->end, g->joint), "");
    TextTable table(2);
    for (const GraspForceReport::Pair& pair : g->pairs)
      table.row({fmt::format("{}: reference, force, largest error", fmt::join(pair.between, " - ")), "N",
                 short_number(pair.reference), short_number(pair.force), small(pair.largest_error)});
    if (g->least_scale < 1)
      table.row({"minimum fraction of the internal force, at", "1, s", small(g->least_scale),
                 short_number(g->least_scale_time)});
    out += table.text();
    if (!g->within_limits)
      out += paragraph("efforts were limited: the target deviated from its commanded motion", "  ");
  }
  if (const auto& b = result.base_keeping) {
    out += "\n" + paragraph("base attitude controlled by the joints: " + law_end(b->ended, b->end, b->joint), "");
    TextTable table(2);
    table.row({"largest deviation, at the end", "rad", small(b->largest_angle), small(b->angle_after)});
    out += table.text();
    if (!b->within_limits) out += paragraph("efforts were limited: the base deviated from its attitude", "  ");
  }
  return out;
}

std::string clearance_table(const CaptureResult& result) {
  if (result.clearance.empty()) return "";
  TextTable table;
  table.row({"minimum clearance", "distance", "time", "bodies"});
  table.row({"", "m", "s", ""});
  for (const MinimumClearance& c : result.clearance) {
    table.row({c.phase, short_number(c.distance), short_number(c.time), c.body_a + ", " + c.body_b});
  }
  return "\n" + table.text();
}

std::string ledger_table(const Ledger& ledger) {
  if (ledger.entries.empty()) return "";
  TextTable table;
  table.row({"quantity", "largest value", "bound", "unit", "pass"});
  for (const LedgerEntry& entry : ledger.entries) {
    const bool unseen = !entry.not_checked.empty() && entry.pass();
    if (!entry.applies && !unseen) continue;  // nothing to check
    table.row({entry.name, entry.applies ? fmt::format("{:.3g}", entry.value) : "-", fmt::format("{:.3g}", entry.bound),
               entry.unit,
               unseen         ? "not checked"
               : entry.pass() ? "yes"
                              : "NO"});
  }
  return "\nledger\n" + table.text() +
         paragraph(fmt::format("relative to: linear momentum {} N s, angular momentum {} N m s, energy {} J",
                               short_number(ledger.scale.linear_momentum), short_number(ledger.scale.angular_momentum),
                               short_number(ledger.scale.energy)),
                   "  ");
}

}  // namespace

std::string result_table(const CaptureResult& result) {
  return verdict(result) + margins_table(result) + window_line(result) + plan_table(result) + approach_table(result) +
         impact_tables(result) + slip_lines(result) + loss_lines(result) + release_lines(result) +
         phases_table(result) + post_impact_table(result) + law_tables(result) + elastic_table(result) +
         wheel_table(result) + gyro_table(result) + thruster_table(result) + saturation_table(result) +
         joint_mode_table(result) + loop_tables(result) + load_table(result) + stage_table(result) +
         contact_table(result) + clearance_table(result) + ledger_table(result.ledger);
}

}  // namespace grapnel
