// Tables of contacts between shapes and of the stages of captures by them.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "grapnel/result/described_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table_parts.hpp"

namespace grapnel {
namespace {

constexpr const char* kBeyondModel = " *";  // marks a pair beyond the contact model

// The pairs that touched, in the order of the problem.
std::vector<ContactPairReport> touching_pairs(const CaptureResult& result) {
  std::vector<ContactPairReport> touching;
  std::ranges::copy_if(result.contacts, std::back_inserter(touching),
                       [](const auto& pair) { return pair.touches > 0; });
  return touching;
}

// The impacts of the hard ones among these pairs; empty: there are none.
std::string impact_table(const std::vector<ContactPairReport>& pairs) {
  std::vector<DescribedRow> rows;
  for (const ContactPairReport& pair : pairs) {
    if (pair.hard)
      rows.push_back({&*pair.hard, pair.body_a + ", " + pair.body_b + (pair.beyond_model ? kBeyondModel : "")});
  }
  return described_table(type_of<HardContactReport>(), rows,
                         "= bodies; impacts; last_time = last at; impulse; restitution_loss; friction_loss; "
                         "persistent_since = lasts from");
}

}  // namespace

std::string stage_table(const CaptureResult& result) {
  if (result.stages.empty()) return "";
  return "\nstages of captures\n" +
         described_table(result.stages,
                         "target; contact_time = contact; closing_time = closing; closed_time = closed; caged_time = "
                         "caged; settled_time = settled; latched_time = latched; grip_force; least_friction_margin = "
                         "friction margin");
}

std::string contact_table(const CaptureResult& result) {
  constexpr std::size_t kMaxShown = 20;
  if (result.contacts.empty()) return "";
  std::vector<ContactPairReport> shown = touching_pairs(result);
  const std::size_t touching = shown.size();
  std::string out = fmt::format("\ncontacts, {} of {} pairs that may touch\n", touching, result.contacts.size());
  if (touching == 0) return out;
  const bool unreliable = std::ranges::any_of(shown, [](const auto& pair) { return pair.beyond_model; });
  const auto mark = [](const ContactPairReport& pair) { return pair.beyond_model ? kBeyondModel : ""; };
  shown.resize(std::min(kMaxShown, touching));
  out += described_table(shown, "bodies; touches; first_time = first at; duration; impulse; peak_force; peak_time = at",
                         mark);
  out += described_table(shown,
                         "bodies; largest_depth = depth; slip_distance = slip; damping_loss; friction_loss; "
                         "elastic_energy; touches_at_end = touch at end",
                         mark);
  out += impact_table(shown);
  if (shown.size() < touching) out += fmt::format("  {} more, see contacts in summary.json\n", touching - shown.size());
  if (unreliable)
    out += paragraph("* an overlap was too deep for the contact model: these forces are not reliable", "  ");
  return out;
}

}  // namespace grapnel
