#include "grapnel/campaign/run_campaign.hpp"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <map>
#include <optional>

namespace grapnel {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// How many of the campaign's cases are in the blocks of one task of a job array.
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

BlockOnItsWay::BlockOnItsWay(ShardStore& store, const ShardStore::Missing& missing, double keep_after)
    : store_(store), block_(missing.block), keep_after_(keep_after), kept_(Clock::now()) {
  if (missing.rows > 0) rows_ = store.rows(block_);
}

void BlockOnItsWay::add(std::vector<CaseRow> fresh) {
  std::move(fresh.begin(), fresh.end(), std::back_inserter(rows_));
  unkept_ = unkept_ || !fresh.empty();
  if (is_complete() || seconds_since(kept_) >= keep_after_) keep();
}

void BlockOnItsWay::keep() {
  if (!unkept_) return;
  store_.write(block_, rows_);
  kept_ = Clock::now();
  unkept_ = false;
}

void run_block(const BlockWork& work, const ShardStore::Missing& missing, std::uint64_t& part_size,
               const std::function<void(std::vector<CaseRow>)>& hand_in, const std::stop_token& stop) {
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
    hand_in(std::move(fresh));
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
  // Threads learn from one another how many cases take a second.
  std::atomic<std::uint64_t> part_size = 1;
  const auto compute = [&](std::size_t job, const HandIn& hand_in, const std::stop_token& stop) {
    std::uint64_t own = part_size;
    run_block(
        work, missing[job], own,
        [&](std::vector<CaseRow> fresh) {
          part_size = own;
          hand_in(std::move(fresh));
        },
        stop);
  };
  std::map<std::size_t, BlockOnItsWay> under_way;  // per job
  const auto write = [&](std::size_t job, std::vector<CaseRow> fresh) {
    const auto at = under_way.try_emplace(job, store, missing[job], options.hand_in).first;
    at->second.add(std::move(fresh));
    if (at->second.is_complete()) under_way.erase(at);
  };
  const auto keep_all = [&] {
    for (auto& [job, block] : under_way) block.keep();
  };
  try {
    const CaseProgress done = run_jobs(missing.size(), options, begun, compute, write);
    keep_all();
    return done;
  } catch (...) {
    try {
      keep_all();
    } catch (const std::exception&) {  // what came first is what is said
    }
    throw;
  }
}

std::vector<CaseRow> run_sweep(const Campaign& sweep, const PoolOptions& options,
                               const std::function<void(const CaseRow&)>& take) {
  std::vector<CaseRow> rows;
  std::map<std::uint64_t, CaseRow> early;  // that wait for others
  CaseProgress progress;
  progress.total = sweep.total();
  rows.reserve(progress.total);
  const auto compute = [&](std::size_t k, const HandIn& hand_in, const std::stop_token& stop) {
    if (std::optional<CaseRow> row = run_campaign_case(sweep, k, stop)) hand_in({std::move(*row)});
  };
  const auto put_in_order = [&](std::size_t k, std::vector<CaseRow> fresh) {
    early.emplace(k, std::move(fresh.front()));
    for (auto it = early.begin(); it != early.end() && it->first == rows.size(); it = early.erase(it)) {
      rows.push_back(std::move(it->second));
      if (take) take(rows.back());
    }
  };
  run_jobs(progress.total, options, progress, compute, put_in_order);
  return rows;
}

}  // namespace grapnel
