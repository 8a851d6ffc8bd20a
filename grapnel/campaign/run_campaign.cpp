#include "grapnel/campaign/run_campaign.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// Number of cases in the blocks of one task of a job array.
std::uint64_t cases_of(const ShardStore& store, std::uint64_t shard, std::uint64_t shards) {
  std::uint64_t cases = 0;
  const std::uint64_t blocks = block_count(store.block_size(), store.total());
  for (std::uint64_t number = shard; number < blocks; number += shards) {
    const Block block = block_at(number, store.block_size(), store.total());
    cases += block.end - block.begin;
  }
  return cases;
}

}  // namespace

BlockInProgress::BlockInProgress(ShardStore& store, const ShardStore::Missing& missing, double write_interval)
    : store_(store), block_(missing.block), write_interval_(write_interval), written_at_(Clock::now()) {
  if (missing.rows > 0) rows_ = store.rows(block_);
}

void BlockInProgress::add(std::vector<CaseRow> fresh) {
  std::move(fresh.begin(), fresh.end(), std::back_inserter(rows_));
  has_unwritten_ = has_unwritten_ || !fresh.empty();
  if (is_complete() || seconds_since(written_at_) >= write_interval_) write_rows();
}

void BlockInProgress::write_rows() {
  if (!has_unwritten_) return;
  store_.write(block_, rows_);
  written_at_ = Clock::now();
  has_unwritten_ = false;
}

void run_block(const BlockWork& work, const ShardStore::Missing& missing, std::uint64_t& part_size,
               const std::function<void(std::vector<CaseRow>)>& submit, const std::stop_token& stop) {
  constexpr double kShort = 0.5, kLong = 2;  // [s] of a part
  const Block& block = missing.block;
  for (std::uint64_t begin = block.begin + missing.rows; begin < block.end && !stop.stop_requested();) {
    const std::uint64_t end = std::min(block.end, begin + part_size);
    const Clock::time_point started = Clock::now();
    std::vector<CaseRow> fresh = work({block.number, begin, end}, stop);
    const bool cut_short = fresh.size() < end - begin;  // stopped
    begin = end;
    const double took = seconds_since(started);
    if (took < kShort) part_size *= 2;
    if (took > kLong) part_size = std::max<std::uint64_t>(1, part_size / 2);
    part_size = std::min<std::uint64_t>(part_size, 1 << 20);
    submit(std::move(fresh));
    if (cut_short) break;
  }
}

CaseProgress progress_of(const ShardStore& store, std::vector<ShardStore::Missing>& missing, std::uint64_t shard,
                         std::uint64_t shards) {
  StoreCounts there;
  missing = store.missing(shard, shards, &there);
  CaseProgress progress;
  progress.done = progress.begun_with = there.rows;
  progress.total = cases_of(store, shard, shards);
  progress.successes = there.successes;
  progress.not_ok = there.not_ok;
  return progress;
}

CaseProgress run_campaign(const BlockWork& work, ShardStore& store, const CampaignOptions& options) {
  std::vector<ShardStore::Missing> missing;
  const CaseProgress begun = progress_of(store, missing, options.shard, options.shards);
  // Threads share the estimate of cases per second.
  std::atomic<std::uint64_t> part_size = 1;
  const auto compute = [&](std::size_t job, const RowSink& submit, const std::stop_token& stop) {
    std::uint64_t own = part_size;
    run_block(
        work, missing[job], own,
        [&](std::vector<CaseRow> fresh) {
          part_size = own;
          submit(std::move(fresh));
        },
        stop);
  };
  std::map<std::size_t, BlockInProgress> in_progress;  // per job
  const auto write = [&](std::size_t job, std::vector<CaseRow> fresh) {
    const auto at = in_progress.try_emplace(job, store, missing[job], options.write_interval).first;
    at->second.add(std::move(fresh));
    if (at->second.is_complete()) in_progress.erase(at);
  };
  const auto write_all = [&] {
    for (auto& [job, block] : in_progress) block.write_rows();
  };
  try {
    const CaseProgress done = run_jobs(missing.size(), options, begun, compute, write);
    write_all();
    return done;
  } catch (...) {
    try {
      write_all();
    } catch (const std::exception&) {  // the first exception is reported
    }
    throw;
  }
}

std::vector<CaseRow> run_sweep(const Campaign& sweep, const PoolOptions& options,
                               const std::function<void(const CaseRow&)>& take) {
  std::vector<CaseRow> rows;
  std::map<std::uint64_t, CaseRow> early;  // that wait for earlier rows
  CaseProgress progress;
  progress.total = sweep.total();
  rows.reserve(progress.total);
  const auto compute = [&](std::size_t k, const RowSink& submit, const std::stop_token& stop) {
    if (std::optional<CaseRow> row = run_campaign_case(sweep, k, stop)) submit({std::move(*row)});
  };
  const auto put_in_order = [&](std::size_t k, std::vector<CaseRow> fresh) {
    early.emplace(k, std::move(fresh.front()));
    for (auto it = early.begin(); it != early.end() && it->first == rows.size(); it = early.erase(it)) {
      rows.push_back(std::move(it->second));
      if (take) take(rows.back());
    }
  };
  run_jobs(progress.total, options, progress, compute, put_in_order);
  for (auto& [k, row] : early) {  // after a stop, rows after an incomplete point
    rows.push_back(std::move(row));
    if (take) take(rows.back());
  }
  return rows;
}

namespace {

constexpr double kEnough = 1.0 / 3;  // [s]
constexpr std::uint64_t kGrowth = 4;

// The setting of the scenario for each reason that keeps a segment out of lanes.
struct Setting {
  std::string_view reason, setting;
};
constexpr auto kSettings = std::to_array<Setting>({
    {"loads are monitored", "the columns margins/…, which keep.columns can leave out"},
    {"loops are cut", "integration.loops"},
    {"loops are not closed by projection", "integration.loops"},
    {"efforts of joints that move as prescribed in closed loops are watched", "limits.effort of the robot's joints"},
    {"a law moves the joints together", "post_impact.joints"},
    {"joints stick", "friction.model of the robot's joints"},
    {"joints have stops", "limits.stop of the robot's joints"},
    {"joints have motors", "motor of the robot's joints"},
    {"rotors store momentum", "rotor_axis of the robot's joints, or modes of vibration that turn"},
    {"dampers outside the robot", "panels of targets"},
    {"continuous laws with a separate model", "without control; post_impact.model"},
    {"continuous control of reaction wheel speeds", "without control; base_control.wheel_speeds"},
    {"control moment gyros", "the robot's gyros"},
    {"plumes, or gyros, are watched in every step", "plume of the robot's thrusters, or its gyros"},
    {"thrusters switch depending on the state", "without control"},
    {"continuous feedforward of the base torque", "without control; base_control.feedforward"},
    {"the method is neither automatic nor adaptive_8", "integration.method"},
    {"closed loops on a fixed or held base", "the robot's base"},
    {"grasps close on arrival while sensors, controllers or thrusters are active", "closes_on_arrival, capture_at"},
});

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
  const std::string time = s < 99.5   ? fmt::format("{:.2g} s", s)
                           : s < 6000 ? fmt::format("{:.0f} min", s / 60)
                           : s < 2e5  ? fmt::format("{:.2g} h", s / 3600)
                                      : fmt::format("{:.2g} days", s / 86400);
  return fmt::format("about {} for {} cases on {} thread{}", time, estimate.cases, estimate.threads,
                     estimate.threads == 1 ? "" : "s");
}

std::vector<std::string> slow_settings(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop) {
  std::vector<std::string> lines;
  if (!campaign.problem) return lines;
  if (campaign.plan == CampaignPlan::per_case)
    lines.push_back("every case is planned separately (plan: nominal plans once)");
  try {
    const CaseClock clock(campaign, stop);
    const StudyCase point = campaign.problem(k);
    const bool impact = campaign.mode == StudyMode::impact;
    CaptureSteps steps(point.problem, detail_of(campaign.columns), clock.watch(),
                       impact ? CaptureSteps::Part::impact_only : CaptureSteps::Part::whole);
    std::set<std::string> reported;
    bool watched = false;
    while (const MotionTask* task = steps.next()) {
      const std::string reason = reason_alone(*task);
      if (!reason.empty() && reported.insert(task->phase + reason).second)
        lines.push_back(fmt::format("{} is integrated case by case instead of in SIMD lanes: {}", task->phase,
                                    with_setting(reason)));
      watched = watched || task->watch != nullptr;
    }
    const CaptureResult result = steps.finish();
    if (point.problem.clearance.enabled && !result.clearance.empty())
      lines.push_back(
          reads_clearance(campaign)
              ? "distances of all bodies are monitored, because criteria use them (clearance.ignore excludes pairs)"
              : "distances of all bodies are monitored, but no criterion uses them (clearance: {enabled: false} in "
                "'set')");
    else if (watched)
      lines.push_back("joint limits are monitored (limits of the robot's joints)");
    for (std::string& line : slow_phases(point.problem, result)) lines.push_back(std::move(line));
  } catch (const CaseStopped&) {
    lines.clear();
  } catch (const std::exception&) {
    // The time of a case without a result does not predict that of the others.
  }
  return lines;
}

}  // namespace grapnel
