#include "grapnel/campaign/run_campaign.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

namespace grapnel {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};  // how often the calling thread reports

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// Rows on their way to the disk.
struct Parcel {
  Block block;
  std::vector<CampaignRow> rows;
};

// What the threads share.
class Workshop {
 public:
  Workshop(const BlockWork& work, const ShardStore& store, const std::vector<ShardStore::Missing>& missing,
           const CampaignOptions& options, CampaignProgress progress)
      : work_(work),
        store_(store),
        missing_(missing),
        options_(options),
        progress_(progress),
        most_waiting_(static_cast<std::size_t>(options.threads) + 1) {}

  // A worker's whole life.
  void compute() {
    try {
      std::uint64_t part_size = kFirstPart;
      while (const ShardStore::Missing* next = take()) compute_block(*next, part_size);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      stop_.request_stop();
    }
    const std::lock_guard lock(mutex_);
    --working_;
    changed_.notify_all();
  }

  // The calling thread's part: writes what comes, and reports, until no worker is left.
  void write(ShardStore& store) {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait_for(lock, kLook, [&] { return !waiting_.empty() || working_ == 0; });
      if (options_.stop.stop_requested()) stop_.request_stop();
      if (!waiting_.empty()) {
        const Parcel parcel = std::move(waiting_.front());
        waiting_.pop_front();
        changed_.notify_all();
        lock.unlock();
        store.write(parcel.block, parcel.rows);
        lock.lock();
      }
      const bool over = waiting_.empty() && working_ == 0;
      const CampaignProgress now = progress_;
      lock.unlock();
      if (options_.progress) options_.progress(now);
      if (over) break;
      lock.lock();
    }
    if (error_) std::rethrow_exception(error_);
  }

  // Nobody writes any more: workers must not wait for that.
  void abandon() {
    stop_.request_stop();
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
    changed_.notify_all();
  }

  void begin(std::size_t workers) { working_ = workers; }
  CampaignProgress progress() const { return progress_; }

 private:
  static constexpr std::uint64_t kFirstPart = 1;

  const ShardStore::Missing* take() {
    const std::lock_guard lock(mutex_);
    return stop_.stop_requested() || next_ == missing_.size() ? nullptr : &missing_[next_++];
  }

  void compute_block(const ShardStore::Missing& missing, std::uint64_t& part_size) {
    std::vector<CampaignRow> rows;
    if (missing.rows > 0) rows = store_.rows(missing.block);
    const std::size_t there = rows.size();
    BlockParts parts;
    parts.hand_in = options_.hand_in;
    parts.fresh = [&](std::span<const CampaignRow> fresh) { count(fresh); };
    parts.worth_keeping = [&](const std::vector<CampaignRow>& so_far) { hand_in({missing.block, so_far}); };
    rows = run_block(work_, missing.block, std::move(rows), part_size, parts, stop_.get_token());
    if (rows.size() > there) hand_in({missing.block, std::move(rows)});
  }

  void count(std::span<const CampaignRow> fresh) {
    const std::lock_guard lock(mutex_);
    for (const CampaignRow& row : fresh) {
      ++progress_.done;
      if (row.success) ++progress_.successes;
      if (row.status != CaseStatus::ok) ++progress_.not_ok;
    }
  }

  void hand_in(Parcel parcel) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_.size() < most_waiting_ || abandoned_; });
    if (abandoned_) return;
    waiting_.push_back(std::move(parcel));
    changed_.notify_all();
  }

  const BlockWork& work_;
  const ShardStore& store_;
  const std::vector<ShardStore::Missing>& missing_;
  const CampaignOptions& options_;
  std::stop_source stop_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  CampaignProgress progress_;
  std::deque<Parcel> waiting_;
  const std::size_t most_waiting_;
  std::size_t next_ = 0;     // in missing_
  std::size_t working_ = 0;  // threads
  bool abandoned_ = false;
  std::exception_ptr error_;
};

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

std::vector<CampaignRow> run_block(const BlockWork& work, const Block& block, std::vector<CampaignRow> rows,
                                   std::uint64_t& part_size, const BlockParts& parts, const std::stop_token& stop) {
  constexpr double kShort = 0.5, kLong = 2;  // [s] of a part
  Clock::time_point handed_in = Clock::now();
  while (block.begin + rows.size() < block.end && !stop.stop_requested()) {
    const std::uint64_t begin = block.begin + rows.size(), end = std::min(block.end, begin + part_size);
    const Clock::time_point started = Clock::now();
    const std::vector<CampaignRow> fresh = work({block.number, begin, end}, stop);
    if (parts.fresh) parts.fresh(fresh);
    rows.insert(rows.end(), fresh.begin(), fresh.end());
    if (fresh.size() < end - begin) break;  // stopped
    const double took = seconds_since(started);
    if (took < kShort) part_size *= 2;
    if (took > kLong) part_size = std::max<std::uint64_t>(1, part_size / 2);
    part_size = std::min<std::uint64_t>(part_size, 1 << 20);
    const bool complete = block.begin + rows.size() == block.end;
    if (complete || seconds_since(handed_in) < parts.hand_in) continue;
    if (parts.worth_keeping) parts.worth_keeping(rows);
    handed_in = Clock::now();
  }
  return rows;
}

CampaignProgress run_campaign(const BlockWork& work, ShardStore& store, const CampaignOptions& options) {
  StoreCounts there;
  const std::vector<ShardStore::Missing> missing = store.missing(options.shard, options.shards, &there);
  CampaignProgress progress;
  progress.done = progress.begun_with = there.rows;
  progress.total = cases_of(store, options.shard, options.shards);
  progress.successes = there.successes;
  progress.not_ok = there.not_ok;
  CampaignOptions own = options;
  own.threads = static_cast<int>(
      std::clamp<std::size_t>(missing.size(), 1, static_cast<std::size_t>(std::max(options.threads, 1))));
  Workshop workshop(work, store, missing, own, progress);
  {
    std::vector<std::jthread> workers;
    workshop.begin(static_cast<std::size_t>(own.threads));
    for (int i = 0; i < own.threads; ++i) workers.emplace_back([&workshop] { workshop.compute(); });
    try {
      workshop.write(store);
    } catch (...) {
      workshop.abandon();
      throw;
    }
  }
  progress = workshop.progress();
  progress.stopped = progress.done < progress.total;
  return progress;
}

}  // namespace grapnel
