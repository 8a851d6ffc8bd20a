#pragma once

/// @file
/// Work that may take long, counted while it is done, so that somebody can follow and end it. The limit is a number of
/// evaluations and no time: whether it is reached depends on the problem alone, on every machine.

#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>

namespace grapnel {

/// Thrown where work reaches its limit.
struct WorkLimit : std::runtime_error {
  WorkLimit() : std::runtime_error("the limit of evaluations is reached") {}
};

class WorkWatch {
 public:
  using Look = std::function<void(long done)>;
  static constexpr long kNoLimit = std::numeric_limits<long>::max();

  WorkWatch() = default;
  /// `look` is called now and then with the evaluations so far; what it throws ends the work, as does WorkLimit from
  /// `most` evaluations on. Where somebody on the way takes such an exception for a failure of his own (optimizers
  /// do), the next evaluation throws again.
  explicit WorkWatch(long most, Look look = {}) : most_(most), look_(std::move(look)) {}

  void count(long evaluations = 1) {
    done_ += evaluations;
    if (done_ >= next_look_) look_up();
  }
  long done() const { return done_; }

 private:
  static constexpr long kBetweenLooks = 256;

  void look_up() {
    if (done_ >= most_) throw WorkLimit();
    if (look_) look_(done_);
    next_look_ = done_ + kBetweenLooks;
  }

  long most_ = kNoLimit, done_ = 0, next_look_ = 1;
  Look look_;
};

}  // namespace grapnel
