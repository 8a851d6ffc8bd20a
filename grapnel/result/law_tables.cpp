// Tables of laws that prescribe the motion of a body.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table_parts.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

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

}  // namespace

std::string law_tables(const CaptureResult& result) {
  std::string out;
  if (const auto& d = result.detumbling) {
    out += "\n" + paragraph("detumbling of " + d->target + ": " + law_end(d->ended, d->end, d->joint), "");
    TextTable table(2);
    table.row({"angular momentum before, after", "N m s", small_number(d->angular_momentum_before),
               small_number(d->angular_momentum_after)});
    table.row({"largest torque, its bound", "N m", short_number(d->largest_torque), short_number(d->torque_bound)});
    table.row(
        {"duration, with enough effort", "s", short_number(d->end - d->begin), short_number(d->expected_duration)});
    if (d->least_scale < 1) {
      table.row({"fraction of the torque at the start", "1", small_number(d->first_scale)});
      table.row({"minimum fraction, at", "1, s", small_number(d->least_scale), short_number(d->least_scale_time)});
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
    table.row({"largest distance, at the end", "m", small_number(i.largest_distance), small_number(i.distance_after)});
    table.row({"largest angle, at the end", "rad", small_number(i.largest_angle), small_number(i.angle_after)});
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
                 short_number(pair.reference), short_number(pair.force), small_number(pair.largest_error)});
    if (g->least_scale < 1)
      table.row({"minimum fraction of the internal force, at", "1, s", small_number(g->least_scale),
                 short_number(g->least_scale_time)});
    out += table.text();
    if (!g->within_limits)
      out += paragraph("efforts were limited: the target deviated from its commanded motion", "  ");
  }
  if (const auto& b = result.base_keeping) {
    out += "\n" + paragraph("base attitude controlled by the joints: " + law_end(b->ended, b->end, b->joint), "");
    TextTable table(2);
    table.row({"largest deviation, at the end", "rad", small_number(b->largest_angle), small_number(b->angle_after)});
    out += table.text();
    if (!b->within_limits) out += paragraph("efforts were limited: the base deviated from its attitude", "  ");
  }
  return out;
}

}  // namespace grapnel
