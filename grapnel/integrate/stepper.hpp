#pragma once

/// @file
/// Common base of all steppers: state, time, status, statistics. A stepper advances y' = f(t, y) by one step per call
/// of the caller. It allocates in its constructor only. Thread safety: a stepper belongs to one thread at a time;
/// different steppers are independent.

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/integrate/manifold.hpp"

namespace grapnel {

/// Status of an integration. All values except `running` end it; all except `not_started`, `running` and `finished` are
/// failures.
enum class StepStatus {
  not_started,     // start() has not been called
  running,         // the end time is not reached
  finished,        // the state is that at the end time, exactly
  step_too_small,  // the tolerances require a step below the resolution of time: a singularity, or tolerances that are
                   // too tight
  too_many_steps,  // the step limit is reached
  non_finite,      // the right-hand side is not finite at this time, or just after it for any step size
};

/// One sentence that describes a status and its time, such as "step too small at t = 0.99999999999999".
std::string explain(StepStatus status, double time);

/// Cost of an integration and its deviation from the manifold, since start().
struct IntegrationStatistics {
  std::int64_t rhs_evaluations = 0;            // calls of the right-hand side, including those for dense output
  std::int64_t accepted = 0;                   // steps taken
  std::int64_t rejected = 0;                   // discarded steps
  double largest_quaternion_defect = 0.0;      // largest |‖q‖ − 1| at the end of a step, before renormalization
  double sum_of_error_estimates = 0.0;         // over accepted steps, in units of the tolerance; 0 with fixed steps
  double sum_of_quaternion_corrections = 0.0;  // sum over steps of the step's largest |‖q‖ − 1|
};

/// A right-hand side y' = f(t, y): called as rhs(t, y, dydt) with spans of n numbers, it writes all of dydt. At
/// intermediate stages quaternions have norm 1 only to the order of the stage; rhs must be a smooth function of y
/// there. A right-hand side may have the member `still(std::vector<NumberRange>& ranges)`, which appends the ranges,
/// increasing, of those numbers outside of quaternions whose derivatives are zero until the next start(), set_state()
/// or reset_derivative(). Steppers leave them unchanged.
template <class F, class S>
concept RightHandSide = std::invocable<F&, double, std::span<const S>, std::span<S>>;

/// State and statistics of a stepper; the methods derive from it.
template <class S>
class Stepper {
 public:
  using Scalar = S;

  const Manifold& manifold() const { return manifold_; }
  /// The time reached: the end of the last accepted step, or the time of failure.
  double time() const { return time_; }
  /// The start of the last accepted step; equal to time() when there is none.
  double previous_time() const { return previous_time_; }
  /// The time at which the integration ends.
  double end_time() const { return end_time_; }
  StepStatus status() const { return status_; }
  /// The state at time(), n numbers, quaternions normalized. Valid until the next call that changes the stepper.
  std::span<const S> state() const { return state_; }
  /// f(time(), state()), n numbers.
  std::span<const S> derivative() const { return derivative_; }
  const IntegrationStatistics& statistics() const { return statistics_; }
  /// One sentence about status() and time().
  std::string explanation() const { return explain(status_, time_); }

  /// Moves the end time; the integration continues with its present step size. Throws std::logic_error before start(),
  /// after a failure, or after a finished integration of zero length, and std::invalid_argument if the new end time is
  /// not finite or lies behind time() in the direction of integration.
  void set_end_time(double end_time);

  /// Replaces the state at time(), for instance by its projection onto constraints or the state after an impact (n
  /// numbers; quaternions are normalized), and evaluates the derivative there. The step size is kept; call start()
  /// instead after a change of the time scale. Dense output still describes the step as integrated. Throws
  /// std::logic_error before start() or after a failure, std::invalid_argument if y has another size.
  template <RightHandSide<S> Rhs>
  void set_state(Rhs&& rhs, std::span<const S> y);

  /// Re-evaluates the derivative at time(), required after a change of f, for instance when a controller or a force
  /// switches. The step size is kept. Throws std::logic_error before start() or after a failure.
  template <RightHandSide<S> Rhs>
  void reset_derivative(Rhs&& rhs);

 protected:
  explicit Stepper(const Manifold& manifold)
      : manifold_(manifold),
        state_(checked_size(manifold)),
        derivative_(state_),
        previous_state_(state_),
        end_(state_) {}

  int size() const { return manifold_.size; }
  double remaining() const { return end_time_ - time_; }

  /// Common part of start(): stores times and state, clears statistics, evaluates the derivative.
  template <class Rhs>
  void begin(Rhs& rhs, double t0, std::span<const S> y0, double t_end);

  template <class Rhs>
  void evaluate(Rhs& rhs, double t, std::span<const S> y, std::span<S> dydt) {
    ++statistics_.rhs_evaluations;
    rhs(t, y, dydt);
  }

  /// Asks rhs for the numbers that remain constant from now on.
  template <class Rhs>
  void find_still(Rhs& rhs) {
    renewed_ = true;
    if constexpr (requires { rhs.still(still_); }) {
      still_.clear();
      rhs.still(still_);
    }
  }

  /// Accepts end_ at time t_new as the new state, with the derivative dydt.
  void accept(double t_new, std::span<const S> dydt, double quaternion_defect);

  StepStatus fail(StepStatus reason) { return status_ = reason; }

  /// Throws std::logic_error unless there is a last step, std::out_of_range unless it holds t.
  void require_in_last_step(double t) const;
  void require_active(const char* what) const;

  Manifold manifold_;
  StepStatus status_ = StepStatus::not_started;
  double time_ = std::numeric_limits<double>::quiet_NaN();
  double previous_time_ = std::numeric_limits<double>::quiet_NaN();
  double end_time_ = std::numeric_limits<double>::quiet_NaN();
  double direction_ = 1.0;  // +1 or −1
  bool has_step_ = false;   // previous_state_, end_ and the stages describe a complete step
  IntegrationStatistics statistics_;
  std::vector<NumberRange> still_;  // numbers that remain constant
  bool renewed_ = true;             // still_ since the last step
  std::vector<S> state_;            // at time_
  std::vector<S> derivative_;       // f(time_, state_)
  std::vector<S> previous_state_;   // at previous_time_, at the begin of the last step
  std::vector<S> end_;              // at time_, as integrated in the last step (state_ may have been replaced since)

 private:
  static std::size_t checked_size(const Manifold& manifold) {
    validate(manifold);
    return static_cast<std::size_t>(manifold.size);
  }
};

template <class S>
void Stepper<S>::require_active(const char* what) const {
  if (status_ != StepStatus::running && status_ != StepStatus::finished) {
    throw std::logic_error(std::string(what) + ": the integration is not under way: " + explanation());
  }
}

template <class S>
void Stepper<S>::set_end_time(double end_time) {
  require_active("set_end_time");
  if (!std::isfinite(end_time) || (end_time - time_) * direction_ < 0.0) {
    throw std::invalid_argument("set_end_time: " + std::to_string(end_time) + " is not ahead of t = " +
                                std::to_string(time_) + " in the direction of integration; use start() to turn around");
  }
  end_time_ = end_time;
  status_ = end_time == time_ ? StepStatus::finished : StepStatus::running;
}

template <class S>
template <RightHandSide<S> Rhs>
void Stepper<S>::set_state(Rhs&& rhs, std::span<const S> y) {
  require_active("set_state");
  if (y.size() != state_.size()) {
    throw std::invalid_argument("set_state: the state has " + std::to_string(y.size()) + " numbers instead of " +
                                std::to_string(state_.size()));
  }
  std::copy(y.begin(), y.end(), state_.begin());
  normalize(manifold_, std::span<S>(state_));
  reset_derivative(rhs);
}

template <class S>
template <RightHandSide<S> Rhs>
void Stepper<S>::reset_derivative(Rhs&& rhs) {
  require_active("reset_derivative");
  find_still(rhs);
  evaluate(rhs, time_, state_, derivative_);
  if (!all_finite(std::span<const S>(state_)) || !all_finite(std::span<const S>(derivative_))) {
    fail(StepStatus::non_finite);
  }
}

// Times and initial state => initialized stepper with the derivative at t0.
template <class S>
template <class Rhs>
void Stepper<S>::begin(Rhs& rhs, double t0, std::span<const S> y0, double t_end) {
  if (!std::isfinite(t0) || !std::isfinite(t_end)) throw std::invalid_argument("start: the times must be finite");
  if (y0.size() != state_.size()) {
    throw std::invalid_argument("start: the state has " + std::to_string(y0.size()) + " numbers instead of " +
                                std::to_string(state_.size()));
  }
  statistics_ = {};
  time_ = previous_time_ = t0;
  end_time_ = t_end;
  direction_ = t_end < t0 ? -1.0 : 1.0;
  has_step_ = false;
  status_ = t0 == t_end ? StepStatus::finished : StepStatus::running;
  set_state(rhs, y0);
}

template <class S>
void Stepper<S>::accept(double t_new, std::span<const S> dydt, double quaternion_defect) {
  previous_time_ = time_;
  time_ = t_new;
  std::copy(state_.begin(), state_.end(), previous_state_.begin());
  std::copy(end_.begin(), end_.end(), state_.begin());
  std::copy(dydt.begin(), dydt.end(), derivative_.begin());
  has_step_ = true;
  ++statistics_.accepted;
  statistics_.largest_quaternion_defect = std::max(statistics_.largest_quaternion_defect, quaternion_defect);
  statistics_.sum_of_quaternion_corrections += quaternion_defect;
  status_ = time_ == end_time_ ? StepStatus::finished : StepStatus::running;
}

template <class S>
void Stepper<S>::require_in_last_step(double t) const {
  if (!has_step_) throw std::logic_error("interpolate: there is no completed step: " + explanation());
  if (!(t >= std::min(previous_time_, time_) && t <= std::max(previous_time_, time_))) {
    throw std::out_of_range("interpolate: t = " + std::to_string(t) + " lies outside the last step from " +
                            std::to_string(previous_time_) + " to " + std::to_string(time_));
  }
}

}  // namespace grapnel
