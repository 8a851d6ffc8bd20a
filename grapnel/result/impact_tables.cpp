// Tables of impacts.
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

/// The published magnitude for an end-effector, or a dash.
std::string published_impulse(const ImpactReport& impact, const std::string& end_effector) {
  if (impact.as_published) {
    for (const AsPublished::Grasp& grasp : impact.as_published->grasps) {
      if (grasp.end_effector == end_effector) return short_number(grasp.impulse_magnitude);
    }
  }
  return "-";
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
  std::vector<DescribedRow> rows;
  for (const GraspImpulse& g : impact.grasps) {
    if (g.profile) rows.push_back({&*g.profile, grasp_name(g.end_effector, g.target, g.grasp_point)});
  }
  return described_table(type_of<ForceProfile>(), rows,
                         "= compliant; peak_force; peak_force_time = at; peak_moment; largest_deformation = "
                         "deformation; duration; energy_lost");
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
                                                 law_words(impact), beyond_overlap(result, impact.time)),
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
  table.row({"base angular velocity change", "rad/s", short_vector(impact.base_angular_velocity_change)});
  table.row({"base velocity change", "m/s", short_vector(impact.base_velocity_change)});
  return out + table.text();
}

}  // namespace

std::string impact_tables(const CaptureResult& result) {
  std::string out;
  for (const ImpactReport& impact : result.impacts)
    out += impact_table(result, impact, out.empty() ? "impact" : "later impact");
  return out;
}

}  // namespace grapnel
