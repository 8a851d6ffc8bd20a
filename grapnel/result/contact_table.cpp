#include "grapnel/result/contact_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <vector>

#include "grapnel/result/text_table.hpp"

namespace grapnel {
namespace {

// "base, debris *"; the mark: beyond the contact model.
std::string pair_name(const ContactPairReport& pair) {
  return pair.body_a + ", " + pair.body_b + (pair.beyond_model ? " *" : "");
}

// The pairs that touched, in the order of the problem.
std::vector<const ContactPairReport*> touching_pairs(const CaptureResult& result) {
  std::vector<const ContactPairReport*> touching;
  for (const ContactPairReport& pair : result.contacts) {
    if (pair.touches > 0) touching.push_back(&pair);
  }
  return touching;
}

// The impacts of the hard ones among these pairs; empty: there are none.
std::string impact_table(std::span<const ContactPairReport* const> pairs) {
  TextTable table;
  table.row({"bodies", "impacts", "last at", "impulse", "restitution loss", "friction loss", "lasts from"});
  table.row({"", "", "s", "N s", "J", "J", "s"});
  bool any = false;
  for (const ContactPairReport* pair : pairs) {
    if (!pair->hard) continue;
    const HardContactReport& hard = *pair->hard;
    const auto time = [](const std::optional<double>& t) { return t ? short_number(*t) : std::string("-"); };
    any = true;
    table.row({pair_name(*pair), std::to_string(hard.impacts), time(hard.last_time), short_number(hard.impulse),
               short_number(hard.restitution_loss), short_number(hard.friction_loss), time(hard.persistent_since)});
  }
  return any ? table.text() : std::string();
}

}  // namespace

std::string stage_table(const CaptureResult& result) {
  if (result.stages.empty()) return "";
  TextTable table;
  table.row({"target", "contact", "closing", "closed", "caged", "settled", "latched", "grip force", "friction margin"});
  table.row({"", "s", "s", "s", "s", "s", "s", "N", ""});
  const auto time = [](const std::optional<double>& t) { return t ? short_number(*t) : "-"; };
  for (const StagesReport& s : result.stages) {
    table.row({s.target, time(s.contact_time), time(s.closing_time), time(s.closed_time), time(s.caged_time),
               time(s.settled_time), time(s.latched_time), short_number(s.grip_force), time(s.least_friction_margin)});
  }
  return "\nstages of captures\n" + table.text();
}

std::string contact_table(const CaptureResult& result) {
  constexpr std::size_t kMaxShown = 20;
  if (result.contacts.empty()) return "";
  const std::vector<const ContactPairReport*> touching = touching_pairs(result);
  std::string out = fmt::format("\ncontacts, {} of {} pairs that may touch\n", touching.size(), result.contacts.size());
  if (touching.empty()) return out;
  TextTable forces, losses;
  forces.row({"bodies", "touches", "first at", "duration", "impulse", "peak force", "at"});
  forces.row({"", "", "s", "s", "N s", "N", "s"});
  losses.row({"bodies", "depth", "slip", "damping loss", "friction loss", "elastic energy", "at the end"});
  losses.row({"", "m", "m", "J", "J", "J", ""});
  const std::size_t shown = std::min(kMaxShown, touching.size());
  for (std::size_t i = 0; i < shown; ++i) {
    const ContactPairReport& pair = *touching[i];
    forces.row({pair_name(pair), std::to_string(pair.touches), pair.first_time ? short_number(*pair.first_time) : "-",
                short_number(pair.duration), short_number(pair.impulse), short_number(pair.peak_force),
                short_number(pair.peak_time)});
    losses.row({pair_name(pair), short_number(pair.largest_depth), short_number(pair.slip_distance),
                short_number(pair.damping_loss), short_number(pair.friction_loss), short_number(pair.elastic_energy),
                pair.touches_at_end ? "contact" : "apart"});
  }
  out += forces.text() + losses.text() + impact_table(std::span(touching).first(shown));
  if (shown < touching.size()) out += fmt::format("  {} more, see contacts in summary.json\n", touching.size() - shown);
  if (std::ranges::any_of(touching, [](const ContactPairReport* pair) { return pair->beyond_model; }))
    out += paragraph("* an overlap was too deep for the contact model: these forces are not reliable", "  ");
  return out;
}

}  // namespace grapnel
