// Tables of control laws that move all joints together.
#include <fmt/format.h>

#include <string_view>

#include "grapnel/result/described_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table_parts.hpp"

namespace grapnel {
namespace {

// "at rest at t = 75.2 s" and the like.
std::string law_end(const LawReport& report) {
  const std::string at = fmt::format(" at t = {} s", short_number(report.end));
  if (report.ended == LawEnd::running) return "still active" + at + ", the end of the run";
  if (report.ended == LawEnd::at_rest) return "at rest" + at;
  return "ended" + at + ": " +
         (report.ended == LawEnd::rank_lost     ? "the joints are near a singular configuration"
          : report.ended == LawEnd::joint_limit ? report.joint + " reaches the end of its range"
                                                : "the target is released");
}

}  // namespace

std::string law_tables(const CaptureResult& result) {
  using enum LawReport::Law;
  struct Kind {
    LawReport::Law law;
    bool in_approach;
    std::string_view what, deviation;
  };
  static constexpr Kind kinds[] = {
      {detumbling, false, "detumbling of ", "the target deviated from its commanded motion"},
      {impedance, true, "impedance of the end-effectors in the approach",
       "the end-effectors deviated from their commanded motion"},
      {impedance, false, "impedance of the end-effectors", "the end-effectors deviated from their commanded motion"},
      {grasp_force, false, "grasp forces on ", "the target deviated from its commanded motion"},
      {base_keeping, false, "base attitude controlled by the joints", "the base deviated from its attitude"},
  };
  std::string out;
  for (const Kind& kind : kinds) {
    const LawReport* report = result.law(kind.law, kind.in_approach);
    if (!report) continue;
    const LawReport& r = *report;
    out += "\n" + paragraph(std::string(kind.what) + r.target + ": " + law_end(r), "");
    out += described_pairs(type_of<LawReport>(), report,
                           "begin; expected_duration = duration with enough effort; angular_momentum_before~; "
                           "angular_momentum_after~; largest_torque; torque_bound; first_scale~ = fraction of the "
                           "torque at the start; largest_distance~; distance_after~ = distance at the end; "
                           "largest_angle~; angle_after~ = angle at the end; least_scale~ = minimum fraction that "
                           "limits admit; least_share~ = minimum fraction that limits admit");
    out += described_table(r.pairs, "between; reference; force; largest_error~");
    if (r.within_limits) continue;
    std::string demand;
    if (!r.limiting.empty())
      demand = fmt::format(", which requires {} times {} (t = {} s)", short_number(r.largest_demand), r.limiting,
                           short_number(r.largest_demand_time));
    out += paragraph(fmt::format("efforts were limited: {}{}", kind.deviation, demand), "  ");
  }
  return out;
}

}  // namespace grapnel
