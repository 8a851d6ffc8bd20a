#include "grapnel/campaign/campaign_cost.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>

#include "grapnel/campaign/run_block.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/lanes/lane_phase_setup.hpp"
#include "grapnel/study/run_case.hpp"

namespace grapnel {
namespace {

constexpr double kEnough = 1.0 / 3;  // [s]
constexpr std::uint64_t kGrowth = 4;

// What of the scenario keeps a piece of motion out of lanes, by why that is.
struct Setting {
  std::string_view reason, setting;
};
constexpr std::array<Setting, 7> kSettings{{
    {"loops are closed", "two or more grasps hold one target; simulate: impact leaves the motion afterwards out"},
    {"grasps close on arrival", "grasps[].closes_on_arrival, or approach.capture_at: envelope"},
    {"there is gravity", "gravity"},
    {"there are external loads", "loads"},
    {"a base is under attitude control", "post_impact.base_control"},
    {"the method is not adaptive_8", "integration.method"},
    {"a root is not free", "the robot's base"},
}};

std::string with_setting(const std::string& reason) {
  for (const Setting& one : kSettings)
    if (one.reason == reason) return fmt::format("{} ({})", one.reason, one.setting);
  return reason;
}

bool reads_clearance(const Campaign& campaign) {
  return std::any_of(campaign.success.begin(), campaign.success.end(), [&](const Criterion& criterion) {
    return std::any_of(criterion.reads().begin(), criterion.reads().end(), [&](std::size_t i) {
      if (i >= campaign.columns.size()) return false;
      const std::string& name = campaign.columns[i].name;
      return name.starts_with("clearance/") || name == "ledger/feasible" || name == "valid_until";
    });
  });
}

}  // namespace

std::optional<CampaignEstimate> estimate_campaign(const BlockWork& work, std::span<const ShardStore::Missing> missing,
                                                  int threads, double quick, const std::function<double()>& now,
                                                  const std::stop_token& stop) {
  CampaignEstimate estimate;
  for (const ShardStore::Missing& one : missing) estimate.cases += one.block.end - one.block.begin - one.rows;
  if (estimate.cases == 0) return std::nullopt;
  estimate.threads =
      static_cast<int>(std::clamp<std::uint64_t>(missing.size(), 1, static_cast<std::uint64_t>(std::max(threads, 1))));
  const Block& block = missing.front().block;
  const std::uint64_t begin = block.begin + missing.front().rows;
  double spent = 0;
  for (std::uint64_t size = 1; spent < kEnough; size *= kGrowth) {
    const std::uint64_t end = std::min(block.end, begin + size);
    const double started = now();
    if (work({block.number, begin, end}, stop).size() < end - begin || stop.stop_requested()) return std::nullopt;
    const double took = now() - started;
    spent += took;
    estimate.seconds = took / static_cast<double>(end - begin) * static_cast<double>(estimate.cases) / estimate.threads;
    if (end == block.end || estimate.seconds < quick) break;
  }
  return estimate;
}

std::string estimate_text(const CampaignEstimate& estimate) {
  const double s = estimate.seconds;
  const std::string time = s < 100    ? fmt::format("{:.2g} s", s)
                           : s < 6000 ? fmt::format("{:.0f} min", s / 60)
                           : s < 2e5  ? fmt::format("{:.2g} h", s / 3600)
                                      : fmt::format("{:.2g} days", s / 86400);
  return fmt::format("about {} for {} cases on {} thread{}", time, estimate.cases, estimate.threads,
                     estimate.threads == 1 ? "" : "s");
}

std::vector<std::string> slow_settings(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop) {
  std::vector<std::string> lines;
  if (!campaign.problem) return lines;
  if (campaign.plan == CampaignPlan::per_case) lines.push_back("every case is planned anew (plan: nominal plans once)");
  try {
    const CaseClock clock(campaign, stop);
    const StudyCase point = campaign.problem(k);
    const bool impact = campaign.mode == StudyMode::impact;
    CaptureSteps steps(point.problem, CaptureDetail::columns, clock.watch(),
                       impact ? CaptureSteps::Part::impact_only : CaptureSteps::Part::whole);
    std::set<std::string> said;
    bool watched = false;
    while (const MotionTask* task = steps.next()) {
      std::string reason = task->only_here;
      if (reason.empty())
        reason = lanes::lane_obstacle(*task->model, *task->setup, task->integration, task->begin, task->end);
      if (!reason.empty() && said.insert(task->phase + reason).second)
        lines.push_back(fmt::format("{} is integrated case by case instead of several at once: {}", task->phase,
                                    with_setting(reason)));
      watched = watched || task->watch != nullptr;
    }
    const CaptureResult result = steps.finish();
    if (point.problem.clearance.enabled && !result.clearance.empty())
      lines.push_back(reads_clearance(campaign)
                          ? "distances of all bodies are watched, which the criteria ask for (clearance.ignore leaves "
                            "pairs out)"
                          : "distances of all bodies are watched, and no criterion asks for them (clearance: {enabled: "
                            "false} in 'set')");
    else if (watched)
      lines.push_back("joints' limits are watched (limits of the robot's joints)");
    for (std::string& line : slow_phases(point.problem, result)) lines.push_back(std::move(line));
  } catch (const CaseStopped&) {
    lines.clear();
  } catch (const std::exception&) {
    // A case without a result tells nothing about the others' time.
  }
  return lines;
}

}  // namespace grapnel
