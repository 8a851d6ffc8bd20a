#include "grapnel/study/case_pool.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace grapnel {
namespace {

// What the threads share.
class Pool {
 public:
  Pool(std::size_t begin, std::size_t end, const CaseWork& work, const CaseSink& sink,
       const std::function<void(const CaseRow&)>& finished, std::stop_token stop)
      : next_(begin), end_(end), due_(begin), work_(work), sink_(sink), finished_(finished), stop_(std::move(stop)) {}

  void work_on() {
    try {
      while (!stop_.stop_requested() && !broken_.load()) {
        const std::size_t index = next_.fetch_add(1);
        if (index >= end_) return;
        hand_in(index, work_(index));
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      broken_ = true;
    }
  }

  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void hand_in(std::size_t index, CaseRow row) {
    const std::lock_guard lock(mutex_);
    if (broken_.load()) return;
    if (finished_) finished_(row);
    early_.emplace(index, std::move(row));
    for (auto it = early_.find(due_); it != early_.end(); it = early_.find(due_)) {
      CaseRow ready = std::move(it->second);
      early_.erase(it);
      ++due_;
      sink_(std::move(ready));
    }
  }

  std::atomic<std::size_t> next_;
  const std::size_t end_;
  std::atomic<bool> broken_ = false;
  std::mutex mutex_;                      // guards what follows
  std::size_t due_;                       // number of the row that the sink gets next
  std::map<std::size_t, CaseRow> early_;  // that wait for others
  std::exception_ptr error_;
  const CaseWork& work_;
  const CaseSink& sink_;
  const std::function<void(const CaseRow&)>& finished_;
  const std::stop_token stop_;
};

}  // namespace

void run_cases(std::size_t begin, std::size_t end, int threads, const CaseWork& work, const CaseSink& sink,
               const std::function<void(const CaseRow&)>& finished, std::stop_token stop) {
  if (end <= begin) return;
  Pool pool(begin, end, work, sink, finished, std::move(stop));
  const std::size_t helpers = std::min(static_cast<std::size_t>(std::max(threads, 1)), end - begin) - 1;
  {
    std::vector<std::jthread> others;
    for (std::size_t i = 0; i < helpers; ++i) others.emplace_back([&pool] { pool.work_on(); });
    pool.work_on();
  }
  pool.rethrow();
}

}  // namespace grapnel
