#include "grapnel/result/result_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/result/described_table.hpp"
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table_parts.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

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
      if (stability_of(result) == Stability::unstable)
        text += ", but control is UNSTABLE";
      else if (std::ranges::count(result.control_loops, LinearStability::unstable, &ControlLoopReport::verdict) > 0)
        text += ", but the linear model of control is UNSTABLE";
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
  for (const ControlLoopReport& report : result.control_loops) out += paragraph(control_loop_text(report), "");
  for (const std::string& warning : result.warnings) out += paragraph("warning: " + warning, "");
  return out;
}

// The selected capture time, if the planner searched for it.
std::string window_line(const CaptureResult& result) {
  if (!result.plan || !result.plan->window || result.plan->window->points.empty()) return "";
  return "\n" + paragraph("window: " + window_sentence(*result.plan->window), "");
}

// What the plan assumes of contacts, and the contacts that it predicts.
std::string contact_lines(const PlanReport& plan) {
  std::string text = "assumes that " + plan.assumes;
  for (const PlannedContact& contact : plan.contacts) {
    if (contact.predicted)
      text += fmt::format("; predicted: {} and {} at t = {} s", contact.body_a, contact.body_b,
                          short_number(*contact.predicted));
  }
  return text;
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
  if (!plan.assumes.empty()) text += paragraph(contact_lines(plan), "  ");
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
    std::vector<DescribedRow> rows;
    for (std::size_t i = 0; i < std::min(kMaxShown, e.modes.size()); ++i)
      rows.push_back({&e.modes[i], std::to_string(i + 1)});
    const std::string table = described_table(type_of<ElasticModeReport>(), rows,
                                              "= vibration; held = base held; braked = base free; free = and joints "
                                              "free; damping_ratio; effective_mass");
    out += fmt::format("\nfrequencies, {} (t = {} s): {} springs, fastest {} Hz\n{}",
                       e.at == "start" ? "in the initial posture" : "with the captured targets", short_number(e.time),
                       e.springs, short_number(e.fastest), table);
  }
  return out;
}

std::string approach_table(const CaptureResult& result) {
  if (!result.approach_end) return "";
  const PhaseEnd& end = *result.approach_end;
  std::string out =
      fmt::format("\napproach, at its end (t = {} s{})\n", short_number(end.time), beyond_overlap(result, end.time));
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
  base.row({"base angular velocity", "rad/s", short_vector(end.base.angular_velocity)});
  base.row({"base velocity", "m/s", short_vector(end.base.velocity)});
  return out + base.text();
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

// Closure of loops; the ledger has the bounds.
std::string loop_tables(const CaptureResult& result) {
  std::string out;
  for (const LoopReport& loops : result.loops) {
    out += "\n" + paragraph(fmt::format("closed loops, {}: {}; rank {} of {} rows", loops.phase,
                                        fmt::join(loops.closures, ", "), loops.rank, loops.rows),
                            "");
    TextTable table(2);
    table.row({"largest defect of a step", "m, rad", small_number(loops.unprojected_position),
               small_number(loops.unprojected_angle)});
    table.row({"and of its rate", "m/s, rad/s", small_number(loops.unprojected_velocity),
               small_number(loops.unprojected_angular_velocity)});
    table.row({"corrections, integration errors", "1", small_number(loops.correction_total),
               small_number(loops.integration_error)});
    out += table.text();
  }
  return out;
}

std::string load_table(const CaptureResult& result) {
  if (result.grasp_loads.empty()) return "";
  bool all_determined = true;
  const auto name = [&](const GraspLoad& load) {
    all_determined = all_determined && all_of(load.determined);
    return grasp_name(load.end_effector, load.target, "") + (all_of(load.determined) ? "" : " *");
  };
  std::string out = "\n" + described_table(result.grasp_loads,
                                           "= load on a grasp; phase; largest_force; force_time = at; largest_moment; "
                                           "moment_time = at",
                                           name);
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
  base.row({"base angular velocity", "rad/s", short_vector(end.base.angular_velocity)});
  base.row({"base velocity", "m/s", short_vector(end.base.velocity)});
  return fmt::format("\n{}, at its end (t = {} s{})\n", result.without_impact ? "motion" : "after the impact",
                     short_number(end.time), beyond_overlap(result, end.time)) +
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
               p.at_end ? short_vector(p.at_end->base.angular_velocity) : "-"});
  return "\n" + table.text();
}

std::string clearance_table(const CaptureResult& result) {
  if (result.clearance.empty()) return "";
  return "\n" + described_table(result.clearance, "phase = minimum clearance; distance; time; bodies");
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

std::string beyond_overlap(const CaptureResult& result, double time) {
  if (!result.valid_until || time <= *result.valid_until) return "";
  return fmt::format("; beyond validity, which ends at t = {} s", short_number(*result.valid_until));
}

std::string result_table(const CaptureResult& result) {
  return verdict(result) + margins_table(result) + window_line(result) + plan_table(result) + approach_table(result) +
         impact_tables(result) + slip_lines(result) + loss_lines(result) + release_lines(result) +
         phases_table(result) + post_impact_table(result) + law_tables(result) + elastic_table(result) +
         actuator_tables(result) + loop_tables(result) + load_table(result) + stage_table(result) +
         contact_table(result) + clearance_table(result) + ledger_table(result.ledger);
}

}  // namespace grapnel
