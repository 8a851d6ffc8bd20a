#include "grapnel/capture/planned_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "grapnel/problem/contact_pairs.hpp"

namespace grapnel {
namespace {

// Whether a contact of the pair changes the motion of the servicer or of a target that is to be grasped.
bool concerns_capture(const CaptureProblem& problem, const ContactPair& pair) {
  return std::ranges::any_of(std::array{pair.a, pair.b}, [&](const BodyName& body) {
    if (body.obstacle) return false;
    return !body.target || std::ranges::any_of(problem.grasps, [&](const GraspSetup& grasp) {
      return target_index(problem, grasp.target) == *body.target;
    });
  });
}

// Pairs, their history until `end` => first contacts of the simulation, beside those of the prediction.
void add_simulated(const CaptureRun& run, double end, std::vector<PlannedContact>& contacts) {
  const std::vector<ContactPair> pairs = contact_pairs(run.problem, run.bodies.free);
  for (std::size_t g = 0; g < pairs.size() && g < run.result.contacts.size(); ++g) {
    const ContactPairReport& report = run.result.contacts[g];
    if (!report.first_time || !(*report.first_time < end)) continue;
    auto known = std::ranges::find_if(contacts, [&](const PlannedContact& c) {
      return (c.body_a == report.body_a && c.body_b == report.body_b) ||
             (c.body_a == report.body_b && c.body_b == report.body_a);
    });
    if (known == contacts.end()) known = contacts.insert(contacts.end(), {report.body_a, report.body_b});
    known->simulated = report.first_time;
    known->disturbs = !known->predicted && concerns_capture(run.problem, pairs[g]);
  }
  std::ranges::stable_sort(contacts, {}, [](const PlannedContact& c) { return c.simulated.value_or(*c.predicted); });
}

// Pairs => "a and b at t = 1 s, c and d at t = 2 s and 3 more"; the times by the simulation, otherwise the prediction.
std::string listed(const std::vector<PlannedContact>& contacts) {
  constexpr std::size_t kNamed = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kNamed, contacts.size()); ++i) {
    const PlannedContact& c = contacts[i];
    text += fmt::format("{}{} and {} at t = {:.4g} s", i == 0 ? "" : ", ", c.body_a, c.body_b,
                        c.simulated ? *c.simulated : *c.predicted);
  }
  if (contacts.size() > kNamed) text += fmt::format(" and {} more pairs", contacts.size() - kNamed);
  return text;
}

std::vector<PlannedContact> those(const std::vector<PlannedContact>& contacts, bool (*is_one)(const PlannedContact&)) {
  std::vector<PlannedContact> result;
  std::ranges::copy_if(contacts, std::back_inserter(result), is_one);
  return result;
}

// Pairs => warnings of contacts that the plan does not include, and of predicted ones that do not occur.
void warn_of_differences(CaptureRun& run, const std::vector<PlannedContact>& disturbing, double end) {
  const ApproachSetup& approach = *run.problem.approach;
  if (!disturbing.empty()) {
    const bool kept_apart = approach.plan && approach.plan->clearance;
    run.result.warnings.push_back(fmt::format(
        "approach: bodies touch before the capture at t = {:.6g} s, and the plan does not include it: {}; servicer and "
        "targets move differently from then on{}",
        end, listed(disturbing),
        kept_apart ? ""
                   : "; approach.plan.clearance keeps bodies apart until end-effectors are near their grasp points"));
  }
  const auto absent = those(run.result.plan->contacts, [](const PlannedContact& c) { return !c.simulated; });
  if (!absent.empty() && run.result.approach_end)
    run.result.warnings.push_back(
        fmt::format("approach: the plan includes contacts that do not occur in the simulation: {}; the targets move "
                    "differently from then on",
                    listed(absent)));
}

}  // namespace

void compare_contacts_with_plan(CaptureRun& run) {
  CaptureResult& result = run.result;
  if (!run.problem.approach || !run.contacts.any() || !result.plan || result.plan->assumes.empty()) return;
  const double end = result.approach_end ? result.approach_end->time : run.bodies.time;
  add_simulated(run, end, result.plan->contacts);
  const auto disturbing = those(result.plan->contacts, [](const PlannedContact& c) { return c.disturbs; });
  warn_of_differences(run, disturbing, result.approach_end ? end : run.problem.approach->duration);
  const bool failed = !disturbing.empty() && !result.grasps.empty() && !result.captured();
  result.ledger.entries.push_back(
      {"unplanned_contact", failed ? static_cast<double>(disturbing.size()) : 0.0, 0, "1",
       "pairs with a link or a grasped target that touched before the capture, which the plan does not include, if not "
       "all grasps captured their targets",
       failed, LedgerEntry::Kind::feasibility});
}

}  // namespace grapnel
