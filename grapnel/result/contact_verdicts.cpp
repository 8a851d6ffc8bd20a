#include <fmt/format.h>

#include <algorithm>

#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"

// Verdicts on contacts between shapes and on the stages of a capture by contacts.

namespace grapnel {
namespace {

// The pairs that left the contact model, the first one first.
std::vector<const ContactPairReport*> too_deep_pairs(const CaptureResult& result) {
  std::vector<const ContactPairReport*> deep;
  for (const ContactPairReport& pair : result.contacts) {
    if (pair.beyond_model) deep.push_back(&pair);
  }
  std::ranges::stable_sort(deep, {}, [](const auto* pair) { return pair->beyond_model_since.value_or(0); });
  return deep;
}

std::string too_deep_text(const ContactPairReport& pair) {
  std::string text = pair.body_a + " and " + pair.body_b;
  if (pair.beyond_model_since && pair.beyond_model_depth) {
    text += fmt::format(" from t = {} s on (depth {} m there, at most {} m)", short_number(*pair.beyond_model_since),
                        short_number(*pair.beyond_model_depth), short_number(pair.largest_depth));
  }
  return text;
}

}  // namespace

std::string contact_sentence(const CaptureResult& result) {
  if (result.contacts.empty()) return "";
  const auto touching = std::ranges::count_if(result.contacts, [](const auto& pair) { return pair.touches > 0; });
  std::string text = fmt::format("contacts: {} of {} pairs touched", touching, result.contacts.size());
  if (touching == 0) return text;
  int impacts = 0;
  for (const ContactPairReport& pair : result.contacts) impacts += pair.hard ? pair.hard->impacts : 0;
  if (impacts > 0) text += fmt::format("; {} {} in an instant", impacts, impacts == 1 ? "impact" : "impacts");
  const ContactPairReport& hardest = *std::ranges::max_element(result.contacts, {}, &ContactPairReport::peak_force);
  if (hardest.peak_force > 0)
    text += fmt::format("; largest force {} N between {} and {} at t = {} s", short_number(hardest.peak_force),
                        hardest.body_a, hardest.body_b, short_number(hardest.peak_time));
  const std::vector<const ContactPairReport*> deep = too_deep_pairs(result);
  if (deep.empty()) return text;
  text += "; TOO DEEP for the contact model: " + too_deep_text(*deep.front());
  if (deep.size() > 1) text += fmt::format(" ({} more)", deep.size() - 1);
  return text;
}

std::string contact_warning(const CaptureResult& result) {
  const std::vector<const ContactPairReport*> deep = too_deep_pairs(result);
  if (deep.empty()) return "";
  std::string text = "contact too deep for the model: " + too_deep_text(*deep.front()) +
                     "; forces and the motion are not reliable from then on";
  if (deep.size() > 1) text += fmt::format("; {} more, see contacts in summary.json", deep.size() - 1);
  return text;
}

namespace {

std::string failure_words(StagesReport::Failure failure) {
  using Failure = StagesReport::Failure;
  switch (failure) {
    case Failure::none:
      break;
    case Failure::no_contact:
      return "not touched";
    case Failure::closed_on_nothing:
      return "closed on nothing";
    case Failure::pushed_away:
      return "pushed away";
    case Failure::not_settled:
      return "not settled";
    case Failure::jammed:
      return "jammed, an escape path was found";
    case Failure::slipped:
      return "slipped";
    case Failure::lost:
      return "lost";
  }
  return "";
}

std::string at_time(const std::optional<double>& time) {
  return time ? fmt::format(" at t = {} s", short_number(*time)) : "";
}

// "latched at t = 5.62 s; caged (search of 3,000 poses)"
std::string stage_text(const StagesReport& report) {
  std::string text = std::string(name_of(report.reached)) + at_time(stage_time(report, report.reached));
  if (report.failure != StagesReport::Failure::none)
    text = fmt::format("{}{}, last stage: {}", failure_words(report.failure), at_time(report.failure_time), text);
  using Cage = StagesReport::Cage;
  if (report.cage == Cage::caged) text += "; caged, no escape path exists";
  if (report.cage == Cage::can_leave) text += "; not caged, an escape path exists";
  if (report.cage == Cage::undecided) text += "; cage undecided, no escape path was found";
  return text;
}

}  // namespace

std::string stage_sentence(const CaptureResult& result) {
  std::string text;
  for (const StagesReport& report : result.stages)
    text += (text.empty() ? "stages: " : "; ") + report.target + " " + stage_text(report);
  return text;
}

}  // namespace grapnel
