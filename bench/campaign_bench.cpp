// Whole captures in lanes, per case: blocks of a campaign over the thesis's open-loop case 1, whose targets differ in
// mass and inertia from case to case. The first case of each block is the thesis's own. The ledger's bounds of all
// cases and the end-state error of the first are checked in every timed run.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "bench/capture_workload.hpp"
#include "bench/dynamics_bench.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/study/quantity.hpp"

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

// Columns as a campaign keeps them; the last is how far the end is from where it should be.
Campaign campaign_of(const CaptureWorkload& workload) {
  Campaign campaign;
  campaign.cases = kBlock;
  campaign.columns = standard_columns(workload.problem, true);
  campaign.columns.push_back({"end_error", "", "", [&workload](const StudyCase&, const CaptureResult& r) {
                                return r.post_impact_end ? end_error(workload, end_numbers(*r.post_impact_end)) : NAN;
                              }});
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [&workload](std::uint64_t k) {
    StudyCase point{workload.problem, inward_normals(workload.problem)};
    vary(k, point.problem);
    return point;
  };
  return campaign;
}

// What is wrong with the rows of a block; null: nothing.
const char* fault_of(const Campaign& campaign, const std::vector<CaseRow>& rows, std::size_t pass) {
  if (rows.size() != campaign.cases) return "cases are missing";
  for (const CaseRow& row : rows) {
    if (row.status != CaseStatus::ok || row.values[pass] != 1) return "the ledger's bounds are not held";
  }
  return rows[0].values.back() <= kEndError ? nullptr : "the end state is not reached";
}

void captures(benchmark::State& state, const CaptureWorkload& workload, lanes::InstructionSet set) {
  const Campaign campaign = campaign_of(workload);
  std::size_t pass = 0;
  while (campaign.columns[pass].name != "ledger/pass") ++pass;
  while (state.KeepRunningBatch(kBlock)) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, kBlock}, set, {});
    if (const char* fault = fault_of(campaign, rows, pass)) return state.SkipWithError(fault);
  }
}

}  // namespace

void register_campaign() {
  const auto workload = std::make_shared<const CaptureWorkload>(thesis_capture());
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    benchmark::RegisterBenchmark(("capture@" + std::string(lanes::name(set)) + "/thesis1").c_str(),
                                 [=](benchmark::State& state) { captures(state, *workload, set); });
  }
}

}  // namespace grapnel::bench
