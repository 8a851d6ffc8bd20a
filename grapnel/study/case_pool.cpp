#include "grapnel/study/case_pool.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace grapnel {
namespace {

constexpr std::chrono::milliseconds kLook{100};  // how often the calling thread reports

// What the threads share.
class Pool {
 public:
  Pool(std::size_t jobs, std::size_t threads, const JobWork& work)
      : work_(work), jobs_(jobs), most_waiting_(threads + 1), working_(threads) {}

  // The whole life of a thread that computes.
  void compute() {
    try {
      for (std::size_t job = 0; take_job(job);) {
        const HandIn hand_in = [&](std::vector<CaseRow> rows) { wait_and_hand_in(job, std::move(rows)); };
        work_(job, hand_in, stop_.get_token());
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      stop_.request_stop();
    }
    const std::lock_guard lock(mutex_);
    --working_;
    changed_.notify_all();
  }

  // The calling thread's part: takes what comes, and reports, until none of the others is left.
  void take_all(const PoolOptions& options, const TakeRows& take, CaseProgress& progress) {
    for (bool over = false; !over;) {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kLook, [&] { return !waiting_.empty() || working_ == 0; });
      std::optional<std::pair<std::size_t, std::vector<CaseRow>>> next;
      if (!waiting_.empty()) {
        next = std::move(waiting_.front());
        waiting_.pop_front();
        changed_.notify_all();
      }
      over = waiting_.empty() && working_ == 0;
      lock.unlock();
      if (next) {
        progress.count(next->second);
        if (take) take(next->first, std::move(next->second));
      }
      if (options.progress) options.progress(progress);
    }
    if (error_) std::rethrow_exception(error_);
  }

  // Nobody takes anything any more: the others must not wait for that.
  void abandon() {
    stop_.request_stop();
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
    changed_.notify_all();
  }

  void request_stop() { stop_.request_stop(); }

 private:
  bool take_job(std::size_t& job) {
    const std::lock_guard lock(mutex_);
    if (stop_.stop_requested() || next_ == jobs_) return false;
    job = next_++;
    return true;
  }

  void wait_and_hand_in(std::size_t job, std::vector<CaseRow> rows) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_.size() < most_waiting_ || abandoned_; });
    if (abandoned_) return;
    waiting_.emplace_back(job, std::move(rows));
    changed_.notify_all();
  }

  const JobWork& work_;
  const std::size_t jobs_;
  const std::size_t most_waiting_;
  std::stop_source stop_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<std::pair<std::size_t, std::vector<CaseRow>>> waiting_;  // for the calling thread, with their jobs
  std::size_t next_ = 0;                                              // job
  std::size_t working_;                                               // threads
  bool abandoned_ = false;
  std::exception_ptr error_;
};

}  // namespace

void CaseProgress::count(std::span<const CaseRow> rows) {
  done += rows.size();
  for (const CaseRow& row : rows) {
    if (row.success) ++successes;
    if (row.status != CaseStatus::ok) ++not_ok;
  }
}

CaseProgress run_jobs(std::size_t jobs, const PoolOptions& options, CaseProgress progress, const JobWork& work,
                      const TakeRows& take) {
  const std::size_t threads = std::min(jobs, static_cast<std::size_t>(std::max(options.threads, 1)));
  Pool pool(jobs, threads, work);
  const std::stop_callback forward(options.stop, [&pool] { pool.request_stop(); });
  std::vector<std::jthread> others;
  try {
    for (std::size_t i = 0; i < threads; ++i) others.emplace_back([&pool] { pool.compute(); });
    pool.take_all(options, take, progress);
  } catch (...) {
    pool.abandon();
    throw;
  }
  progress.stopped = progress.done < progress.total;
  return progress;
}

}  // namespace grapnel
