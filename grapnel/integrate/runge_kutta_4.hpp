#pragma once

/// @file
/// The classical Runge-Kutta method of order 4 with a fixed step (Kutta 1901; HNW I, II.1), with the same interface as
/// `DormandPrince853`: for comparison with published work, and as an independent check. Dense output is cubic Hermite
/// (order 3), without further evaluations. Thread safety: a stepper belongs to one thread at a time.

#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "grapnel/integrate/stepper.hpp"

namespace grapnel {

/// RK4 as a stepper that the caller drives; see `DormandPrince853` for the pattern. Steps end at t0 + i·step, computed
/// without accumulation; the last one is shortened to end at the end time exactly (set_end_time() then returns to the
/// grid). One step costs 4 evaluations. There is no error control: `Manifold::controlled` has no effect.
template <class S>
class RungeKutta4 : public Stepper<S> {
 public:
  /// Allocates everything; `step` is the step size [time]. Throws std::invalid_argument if the manifold is invalid or
  /// step is not positive and finite.
  RungeKutta4(const Manifold& manifold, double step)
      : Stepper<S>(manifold),
        step_(step),
        first_derivative_(this->state_.size()),
        slope_(this->state_.size()),
        sum_(this->state_.size()),
        stage_state_(this->state_.size()) {
    if (!(step > 0.0 && std::isfinite(step)))
      throw std::invalid_argument("RungeKutta4: step must be positive and finite");
  }

  /// Begins at t0 with y0 (n numbers; quaternions are normalized) towards t_end. Evaluates rhs once. The status is then
  /// as for DormandPrince853::start. Throws std::invalid_argument if a time is not finite or y0 has another size.
  template <RightHandSide<S> Rhs>
  void start(Rhs&& rhs, double t0, std::span<const S> y0, double t_end) {
    this->begin(rhs, t0, y0, t_end);
    start_time_ = t0;
    steps_ = 0;
  }

  /// Advances by one step, at most to the end time. Does nothing unless the status is `running`.
  /// @return the new status: `running`, `finished`, `step_too_small` if the step vanishes against t, or `non_finite`.
  template <RightHandSide<S> Rhs>
  StepStatus step(Rhs&& rhs);

  /// No effect; part of the common stepper interface. Throws std::logic_error if there is no completed step.
  template <RightHandSide<S> Rhs>
  void prepare_dense_output(Rhs&&) {
    if (!this->has_step_) throw std::logic_error("dense output: there is no completed step: " + this->explanation());
  }

  /// The state at a time t of the last step by cubic Hermite interpolation (n numbers, quaternions normalized). Throws
  /// std::logic_error if there is no completed step, std::out_of_range if t lies outside it.
  void interpolate(double t, std::span<S> y) const;

  /// As interpolate(t, y); rhs is not used.
  template <RightHandSide<S> Rhs>
  void interpolate(Rhs&&, double t, std::span<S> y) {
    interpolate(t, y);
  }

 private:
  double step_;
  double start_time_ = 0.0;          // steps end at start_time_ + i step_
  std::int64_t steps_ = 0;           // i
  std::vector<S> first_derivative_;  // at previous_time_
  std::vector<S> slope_;             // of the current stage; after a step, at the end as integrated
  std::vector<S> sum_;               // Σ b_i k_i
  std::vector<S> stage_state_;
};

// Makes one step on the grid, or to the end time, with the four classical stages.
template <class S>
template <RightHandSide<S> Rhs>
StepStatus RungeKutta4<S>::step(Rhs&& rhs) {
  if (this->status_ != StepStatus::running) return this->status_;
  this->has_step_ = false;
  const double t = this->time_;
  double t_new = start_time_ + this->direction_ * static_cast<double>(steps_ + 1) * step_;
  const double beyond = (this->end_time_ - t_new) * this->direction_;
  // Avoids a tiny last step if the interval is a multiple of the step up to rounding error.
  const bool reaches_grid = beyond >= -1e-9 * step_;
  if (beyond <= 1e-9 * step_) t_new = this->end_time_;
  const double h = t_new - t;
  if (h * this->direction_ <= 0.0) return this->fail(StepStatus::step_too_small);

  const int n = this->size();
  const auto add_stage = [&](double weight, double node) {  // next slope, at t + node h
    for (int i = 0; i < n; ++i) stage_state_[i] = this->state_[i] + (node * h) * slope_[i];
    this->evaluate(rhs, t + node * h, stage_state_, slope_);
    for (int i = 0; i < n; ++i) sum_[i] = sum_[i] + weight * slope_[i];
  };
  first_derivative_ = this->derivative_;
  slope_ = this->derivative_;
  for (int i = 0; i < n; ++i) sum_[i] = (1.0 / 6.0) * slope_[i];
  add_stage(1.0 / 3.0, 0.5);
  add_stage(1.0 / 3.0, 0.5);
  add_stage(1.0 / 6.0, 1.0);
  for (int i = 0; i < n; ++i) this->end_[i] = this->state_[i] + h * sum_[i];
  const double defect = normalize(this->manifold_, std::span<S>(this->end_));
  this->evaluate(rhs, t_new, this->end_, slope_);
  if (!all_finite(std::span<const S>(this->end_)) || !all_finite(std::span<const S>(slope_))) {
    return this->fail(StepStatus::non_finite);
  }
  if (reaches_grid) ++steps_;
  this->accept(t_new, slope_, defect);
  return this->status_;
}

// t => state within the last step by cubic Hermite interpolation.
template <class S>
void RungeKutta4<S>::interpolate(double t, std::span<S> y) const {
  this->require_in_last_step(t);
  if (t == this->time_) {
    std::copy(this->end_.begin(), this->end_.end(), y.begin());
    return;
  }
  const double h = this->time_ - this->previous_time_;
  const double theta = (t - this->previous_time_) / h;
  const double rest = 1.0 - theta;
  for (int i = 0; i < this->size(); ++i) {
    const S difference = this->end_[i] - this->previous_state_[i];
    const S bend = rest * (h * first_derivative_[i] - difference) + theta * (difference - h * slope_[i]);
    y[i] = this->previous_state_[i] + theta * (difference + rest * bend);
  }
  if (t != this->previous_time_) normalize(this->manifold_, y);
}

}  // namespace grapnel
