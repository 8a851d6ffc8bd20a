// Whole captures in lanes, per case. One group has external forces, closed loops, sensors or grasps on arrival, and is
// compared with the same cases run one by one. The other is a block of a campaign over the thesis's open-loop case 1,
// whose target masses and inertias differ between cases; its first case is unchanged. Every timed run checks the
// ledger's bounds of all cases and the end-state error of the first.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "bench/capture_workload.hpp"
#include "bench/dynamics_bench.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/quantity.hpp"

namespace grapnel::bench {
namespace {

constexpr std::uint64_t kBlock = 64;

// Masses and inertias within 10 %, by the case's index.
void vary(std::uint64_t k, CaptureProblem& problem) {
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const double factor = 1 + 0.1 * std::sin(static_cast<double>(k * (t + 1)));
    TargetSetup& target = problem.targets[t];
    target.mass *= factor;
    Symmetric3d& J = target.inertia;
    J = {factor * J.xx, factor * J.yy, factor * J.zz, factor * J.xy, factor * J.xz, factor * J.yz};
  }
}

// A block of cases of the problem with varied targets.
Campaign campaign_of(const CaptureProblem& problem) {
  Campaign campaign;
  campaign.cases = kBlock;
  campaign.columns = standard_columns(problem, true);
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [&problem](std::uint64_t k) {
    StudyCase point{problem, inward_normals(problem)};
    vary(k, point.problem);
    return point;
  };
  return campaign;
}

// The columns of a campaign, and the end-state error.
Campaign campaign_of(const CaptureWorkload& workload) {
  Campaign campaign = campaign_of(workload.problem);
  campaign.columns.push_back({"end_error", "", "", [&workload](const StudyCase&, const CaptureResult& r) {
                                return r.post_impact_end ? end_error(workload, end_numbers(*r.post_impact_end)) : NAN;
                              }});
  return campaign;
}

std::size_t ledger_column(const Campaign& campaign) {
  std::size_t pass = 0;
  while (campaign.columns[pass].name != "ledger/pass") ++pass;
  return pass;
}

// The error in the rows of a block; null: none.
const char* fault_of(const Campaign& campaign, const std::vector<CaseRow>& rows, std::size_t pass) {
  if (rows.size() != campaign.cases) return "cases are missing";
  for (const CaseRow& row : rows) {
    if (row.status != CaseStatus::ok || row.values[pass] != 1) return "the ledger's bounds are not held";
  }
  return nullptr;
}

void captures(benchmark::State& state, const CaptureWorkload& workload, lanes::InstructionSet set) {
  const Campaign campaign = campaign_of(workload);
  const std::size_t pass = ledger_column(campaign);
  while (state.KeepRunningBatch(kBlock)) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, kBlock}, set, {});
    if (const char* fault = fault_of(campaign, rows, pass)) return state.SkipWithError(fault);
    if (!(rows[0].values.back() <= kEndError)) return state.SkipWithError("the end state is not reached");
  }
}

// The same for a problem with external forces, closed loops or grasps on arrival; without an instruction set, one by
// one.
void disturbed(benchmark::State& state, const CaptureProblem& problem, std::optional<lanes::InstructionSet> set) {
  const Campaign campaign = campaign_of(problem);
  const std::size_t pass = ledger_column(campaign);
  while (state.KeepRunningBatch(kBlock)) {
    std::vector<CaseRow> rows;
    if (set) {
      rows = run_block_in_lanes(campaign, {0, 0, kBlock}, *set, {});
    } else {
      for (std::uint64_t k = 0; k < kBlock; ++k) rows.push_back(run_campaign_case(campaign, k).value());
    }
    if (const char* fault = fault_of(campaign, rows, pass)) return state.SkipWithError(fault);
  }
}

void register_disturbed(const std::string& scenario, const std::string& name,
                        const std::vector<Override>& overrides = {}) {
  const auto problem = std::make_shared<const CaptureProblem>(frozen_scenario(scenario, overrides));
  benchmark::RegisterBenchmark(("disturbed/" + name).c_str(),
                               [=](benchmark::State& state) { disturbed(state, *problem, std::nullopt); });
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    benchmark::RegisterBenchmark(("disturbed@" + std::string(lanes::name(set)) + "/" + name).c_str(),
                                 [=](benchmark::State& state) { disturbed(state, *problem, set); });
  }
}

}  // namespace

void register_campaign() {
  const auto workload = std::make_shared<const CaptureWorkload>(thesis_capture());
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    benchmark::RegisterBenchmark(("capture@" + std::string(lanes::name(set)) + "/thesis1").c_str(),
                                 [=](benchmark::State& state) { captures(state, *workload, set); });
  }
  register_disturbed("orbit-drift", "orbit");                                // an orbit's field, two streams
  register_disturbed("thesis/open-loop-case-1-stabilized", "base_control");  // attitude control, computed torque
  register_disturbed("wheels-keep-attitude", "wheels");                      // by four reaction wheels, PD
  register_disturbed("thesis/closed-loop", "closed_loop");                   // both arms on one target, joints free
  // Controller updates run case by case: noisy sensors, and computed torque with an assumed target that differs from
  // the true one. The plan is computed once, since planning would take most of the time.
  register_disturbed("noisy-sensors", "sensors",
                     {{"control", "{period: 0.1, delay: 0.01}"},
                      {"approach",
                       "{duration: 30, profile: quintic, plan: {objective: excursion}, tracking: {mode: "
                       "computed_torque, kp: 25, kd: 10}}"},
                      {"post_impact",
                       "{duration: 10, joints: computed_torque, kp: 0.09, kd: 0.6, base_control: {kp: 0, kd: 4000, "
                       "limit: 60}, assumed: {mass: 3000, com: [0, 0, 0], inertia: [9000, 4000, 11000]}}"}});
  const std::string thesis1 = "thesis/open-loop-case-1";
  const Override as_found{"contact", "{gap: weld_as_found}"};
  register_disturbed(thesis1 + "-planned", "base_held", {{"robot.base.mode", "held"}, as_found});
  register_disturbed(thesis1 + "-planned", "base_fixed", {{"robot.base.mode", "fixed"}, as_found});
  register_disturbed(thesis1, "on_arrival",  // each arm separately
                     {{"robot.end_effectors.tip-1.envelope", "{position: 0.2}"},
                      {"robot.end_effectors.tip-2.envelope", "{position: 0.25}"},
                      {"grasps[0].closes_on_arrival", "true"},
                      {"grasps[1].closes_on_arrival", "true"},
                      as_found});
}

}  // namespace grapnel::bench
