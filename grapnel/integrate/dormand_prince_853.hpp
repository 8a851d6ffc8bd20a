#pragma once

/// @file
/// Adaptive integration of order 8 with error estimators of order 5 and 3 and dense output of order 7: DOP853 of
/// Dormand, Prince, Hairer, Nørsett and Wanner (Solving Ordinary Differential Equations I, 2nd ed., 1993: method II.5,
/// initial step and step control II.4, error estimate II.10, dense output II.6), on a manifold with unit quaternions,
/// which are renormalized after every step and in every interpolated state. Thread safety: a stepper belongs to one
/// thread at a time; different ones are independent.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "grapnel/integrate/dormand_prince_853_kernel.hpp"
#include "grapnel/integrate/manifold.hpp"
#include "grapnel/integrate/stepper.hpp"

namespace grapnel {

// Norm of the difference of two states relative to tolerances on the manifold. An ordinary number is divided by atol +
// rtol·max(|y0|, |y1|). A quaternion contributes the rotation vector between the two orientations (3 numbers [rad], not
// 4), divided by atol + rtol·1 rad; a change of its norm is ignored, since it is projected away. Thread safety: an
// `ErrorNorm` is immutable and may be shared by threads.

/// Acceptable local error per step.
struct Tolerances {
  double rtol = 1e-10;  // relative to the number's magnitude; to one radian for a quaternion
  double atol = 1e-12;  // absolute, for every number, in that number's unit; must be positive
  // Instead of atol, one for each of the state's numbers; empty: atol holds for all. The entries at a quaternion's x,
  // y, z hold for the rotation vector [rad], the one at w is unused.
  std::vector<double> atol_components = {};
};

/// Weighted root-mean-square norm on a manifold.
template <class S>
class ErrorNorm {
 public:
  /// Throws std::invalid_argument if the manifold is invalid, if rtol is negative or not finite, if an absolute
  /// tolerance is not positive and finite, or if atol_components has neither 0 nor manifold.size entries.
  ErrorNorm(const Manifold& manifold, const Tolerances& tolerances);

  /// Number of independent errors: 3 for each controlled quaternion, 1 for each other controlled number.
  int dimension() const { return dimension_; }

  /// Sum over the controlled numbers of (difference/scale)²; the scale is that of the states y0 and y1. A
  /// quaternion's difference δq counts as its rotation vector 2 Im(conj(q1) ⊗ δq). Arguments are n numbers. Throws
  /// nothing.
  S sum_of_squares(std::span<const S> y0, std::span<const S> y1, std::span<const S> difference) const;

  /// Root mean square of y/scale(y): magnitude of a state in units of its tolerance; a quaternion counts as one radian.
  double magnitude(std::span<const S> y) const;

  /// Root mean square of difference/scale(y), for a difference or a rate at the state y. Throws nothing.
  double operator()(std::span<const S> y, std::span<const S> difference) const {
    return root_mean(sum_of_squares(y, y, difference));
  }

  /// The same of several differences in one pass, in less time.
  template <std::size_t kCount>
  std::array<double, kCount> of_each(std::span<const S> y,
                                     const std::array<std::span<const S>, kCount>& differences) const;

  /// Differences are zero in these ranges, which are increasing and outside of quaternions: their sums skip them.
  void skip(std::span<const NumberRange> ranges);

 private:
  S add_rotations(S sum, std::span<const S> y, std::span<const S> difference) const;
  double root_mean(const S& sum) const {
    using std::sqrt;
    return dimension_ == 0 ? 0.0 : static_cast<double>(sqrt(sum * S(1.0 / dimension_)));
  }

  double rtol_;
  std::vector<double> atol_;          // n numbers
  std::vector<NumberRange> vectors_;  // controlled runs of ordinary numbers
  std::vector<NumberRange> moving_;   // these without skipped ones
  std::vector<int> quaternions_;      // controlled quaternions
  int dimension_ = 0;
};

// Validates the tolerances and splits the controlled numbers into quaternions and runs of ordinary numbers.
template <class S>
ErrorNorm<S>::ErrorNorm(const Manifold& manifold, const Tolerances& tolerances)
    : rtol_(tolerances.rtol), atol_(tolerances.atol_components) {
  validate(manifold);
  const auto reject = [](const std::string& fault) { throw std::invalid_argument("Tolerances: " + fault); };
  if (!(rtol_ >= 0.0 && std::isfinite(rtol_))) reject("rtol must be finite and not negative");
  if (atol_.empty()) atol_.assign(static_cast<std::size_t>(manifold.size), tolerances.atol);
  if (atol_.size() != static_cast<std::size_t>(manifold.size)) {
    reject("atol_components has " + std::to_string(atol_.size()) + " entries for a state of " +
           std::to_string(manifold.size));
  }
  for (const double atol : atol_) {
    if (!(atol > 0.0 && std::isfinite(atol))) reject("every absolute tolerance must be positive and finite");
  }

  // The gaps between quaternions are the runs of ordinary numbers.
  const int controlled = manifold.controlled_size();
  std::vector<NumberRange> in_quaternions;
  for (const int offset : manifold.quaternions) {
    if (offset < controlled) quaternions_.push_back(offset), in_quaternions.push_back({offset, offset + 4});
  }
  std::ranges::sort(in_quaternions, {}, &NumberRange::begin);
  vectors_ = moving_ = numbers_beside(controlled, in_quaternions);
  dimension_ = controlled - static_cast<int>(quaternions_.size());
}

template <class S>
void ErrorNorm<S>::skip(std::span<const NumberRange> ranges) {
  moving_.clear();
  for (const NumberRange& vector : vectors_) {
    NumberRange rest = vector;
    for (const NumberRange& range : ranges) {
      if (range.end <= rest.begin || range.begin >= rest.end) continue;
      if (range.begin > rest.begin) moving_.push_back({rest.begin, range.begin});
      rest.begin = std::min(range.end, rest.end);
    }
    if (rest.end > rest.begin) moving_.push_back(rest);
  }
}

// Quaternion and its difference => the rotation vector Im(conj(q) ⊗ d) = q_w d_v − d_w q_v − q_v × d_v, twice.
template <class S>
std::array<S, 3> rotation_between(const S* q, const S* d) {
  return {S(2.0) * (q[0] * d[1] - d[0] * q[1] - q[2] * d[3] + q[3] * d[2]),
          S(2.0) * (q[0] * d[2] - d[0] * q[2] - q[3] * d[1] + q[1] * d[3]),
          S(2.0) * (q[0] * d[3] - d[0] * q[3] - q[1] * d[2] + q[2] * d[1])};
}

// Two states and a difference => sum of squares of (difference/scale), quaternions by their rotation vectors.
template <class S>
S ErrorNorm<S>::sum_of_squares(std::span<const S> y0, std::span<const S> y1, std::span<const S> difference) const {
  using std::abs;
  using std::max;
  S sum(0.0);
  for (const NumberRange& range : moving_) {
    for (int i = range.begin; i < range.end; ++i) {
      const S magnitude = max(S(abs(y0[i])), S(abs(y1[i])));
      const S ratio = difference[i] / (S(atol_[i]) + rtol_ * magnitude);
      sum = sum + ratio * ratio;
    }
  }
  return add_rotations(sum, y1, difference);
}

// Sum over ordinary numbers => the same with the quaternions.
template <class S>
S ErrorNorm<S>::add_rotations(S sum, std::span<const S> y, std::span<const S> difference) const {
  for (const int offset : quaternions_) {
    const std::array<S, 3> rotation = rotation_between(y.data() + offset, difference.data() + offset);
    for (int i = 0; i < 3; ++i) {
      const S ratio = rotation[i] * S(1.0 / (atol_[offset + 1 + i] + rtol_));
      sum = sum + ratio * ratio;
    }
  }
  return sum;
}

// The scale of each number is computed once; quotients of eight numbers are independent, and sums have the order of
// sum_of_squares().
template <class S>
template <std::size_t kCount>
std::array<double, kCount> ErrorNorm<S>::of_each(std::span<const S> y,
                                                 const std::array<std::span<const S>, kCount>& differences) const {
  using std::abs;
  constexpr int kAtOnce = 8;
  S sums[kCount] = {};
  const auto add = [&](int first, auto numbers) {
    S scale[kAtOnce], ratio[kAtOnce];
    for (int i = 0; i < numbers; ++i) scale[i] = S(atol_[first + i]) + rtol_ * S(abs(y[first + i]));
    for (std::size_t k = 0; k < kCount; ++k) {
      const S* difference = differences[k].data() + first;
      for (int i = 0; i < numbers; ++i) ratio[i] = difference[i] / scale[i];
      for (int i = 0; i < numbers; ++i) sums[k] = sums[k] + ratio[i] * ratio[i];
    }
  };
  for (const NumberRange& range : moving_) {
    int first = range.begin;
    for (; first + kAtOnce <= range.end; first += kAtOnce) add(first, std::integral_constant<int, kAtOnce>());
    add(first, range.end - first);
  }
  std::array<double, kCount> norms;
  for (std::size_t k = 0; k < kCount; ++k) norms[k] = root_mean(add_rotations(sums[k], y, differences[k]));
  return norms;
}

// State => root mean square of y/scale(y).
template <class S>
double ErrorNorm<S>::magnitude(std::span<const S> y) const {
  using std::abs;
  S sum(0.0);
  for (const NumberRange& range : vectors_) {
    for (int i = range.begin; i < range.end; ++i) {
      const S ratio = y[i] / (S(atol_[i]) + rtol_ * S(abs(y[i])));
      sum = sum + ratio * ratio;
    }
  }
  for (const int offset : quaternions_) {
    for (int i = 1; i < 4; ++i) {
      const double ratio = 1.0 / (atol_[offset + i] + rtol_);
      sum = sum + S(ratio * ratio);
    }
  }
  return root_mean(sum);
}

/// Bounds on the step size and on the work.
struct StepControl {
  double initial_step = 0.0;                                  // [time]; 0: chosen by start()
  double max_step = std::numeric_limits<double>::infinity();  // [time]; holds to rounding (1e-10 relative)
  std::int64_t max_steps = 10'000'000;                        // accepted and rejected steps from start() on
  bool predictive = false;                                    // sizes by dop853::predicted_root()
};

/// DOP853 as a stepper that the caller drives:
///
///     stepper.start(rhs, t0, y0, t_end);
///     while (stepper.step(rhs) == StepStatus::running) { … stepper.state() … }
///
/// Integrates forwards or backwards. The last step ends at the end time exactly. One step costs 12 evaluations of the
/// right-hand side, and 3 more for dense output. If rhs throws, the exception passes through, and the stepper remains
/// at the end of the last accepted step.
template <class S>
class DormandPrince853 : public Stepper<S> {
 public:
  /// Allocates everything but the ranges of numbers that remain constant (RightHandSide). Throws std::invalid_argument
  /// if the manifold or the tolerances are invalid (see `validate` and `ErrorNorm`), if initial_step is negative or not
  /// finite, or if max_step or max_steps is not positive.
  DormandPrince853(const Manifold& manifold, const Tolerances& tolerances, const StepControl& control = {});

  /// Begins at t0 with y0 (n numbers; quaternions are normalized) towards t_end, on either side of t0, and chooses the
  /// first step. Evaluates rhs twice. The status is `finished` if t_end equals t0, and `non_finite` if the derivative
  /// is not finite. Throws std::invalid_argument if a time is not finite or y0 has another size.
  template <RightHandSide<S> Rhs>
  void start(Rhs&& rhs, double t0, std::span<const S> y0, double t_end);

  /// Advances by one accepted step, at most to the end time. Does nothing unless the status is `running`. @return the
  /// new status; see `StepStatus`. Throws only exceptions of rhs.
  template <RightHandSide<S> Rhs>
  StepStatus step(Rhs&& rhs);

  /// Sets the first size to try in the next step, replacing the choice of start(): to resume an earlier integration.
  /// Throws std::invalid_argument unless it is positive and finite.
  void propose_step(double size);

  /// Step size times the magnitude of the fastest eigenvalue of df/dy in the last step, estimated from its last two
  /// evaluations at the same time (HNW IV.2, as in the program DOP853): at least 6 where stability limits the step.
  /// Zero without a completed step. Call it before dense output, which overwrites the data.
  double stiffness();

  /// The last step in tolerances: the norm of y(end) - y(begin) - h y'(begin), and that of h (y'(end) - y'(begin))
  /// relative to that of y(end) - y(begin).
  struct Bend {
    double bend = 0, motion = 0;
  };
  /// Zero without a completed step, and after stiffness() only before dense output.
  Bend bend();

  /// The size of the next step, if it is not rejected.
  double proposed_step() const { return proposed_step_; }

  /// Evaluates the additional stages for dense output in the last step, unless already done (3 evaluations). Throws
  /// std::logic_error if there is no completed step.
  template <RightHandSide<S> Rhs>
  void prepare_dense_output(Rhs&& rhs);

  /// The state at a time t of the last step, to order 7 (n numbers, quaternions normalized). Exact at the ends of the
  /// step. Throws std::logic_error if prepare_dense_output() has not been called for this step, std::out_of_range if t
  /// lies outside the step.
  void interpolate(double t, std::span<S> y) const;

  /// As interpolate(t, y), after calling prepare_dense_output(rhs).
  template <RightHandSide<S> Rhs>
  void interpolate(Rhs&& rhs, double t, std::span<S> y) {
    prepare_dense_output(rhs);
    interpolate(t, y);
  }

 private:
  static constexpr int kDenseCoefficients = 7;

  std::span<S> stage(int number) { return {stages_.data() + (number - 1) * this->size(), this->state_.size()}; }
  std::span<S> dense(int number) { return {dense_.data() + (number - 1) * this->size(), this->state_.size()}; }

  template <const auto& kRow>
  S weighted_sum(int i) const {
    return dop853::weighted_sum<kRow>(stages_.data(), this->size(), i);
  }

  /// Calls f(i) for the numbers that do not remain constant.
  template <class F>
  void each_moving(F&& f) const {
    for (const NumberRange& range : moving_) {
      for (int i = range.begin; i < range.end; ++i) f(i);
    }
  }
  void leave_still();
  /// As dop853::evaluate_stage, for these numbers.
  template <int kNumber, const auto& kRow, class Rhs>
  void evaluate_stage(Rhs& rhs, double t, double h, const std::vector<S>& from) {
    const S *const begin = from.data(), *const stages = stages_.data();
    S* const at = stage_state_.data();
    const int n = this->size();
    each_moving([=](int i) { at[i] = begin[i] + h * dop853::weighted_sum<kRow>(stages, n, i); });
    this->evaluate(rhs, t + dop853::kNodes[kNumber - 1] * h, stage_state_, stage(kNumber));
  }

  template <class Rhs>
  void evaluate_stages(Rhs& rhs, double h);
  double estimate_error(double h);
  template <class Rhs>
  double choose_initial_step(Rhs& rhs);

  ErrorNorm<S> norm_;
  StepControl control_;
  std::vector<NumberRange> left_;    // numbers that steps leave unchanged
  std::vector<NumberRange> moving_;  // the others
  double proposed_step_ = 0.0;
  dop853::AcceptedStep accepted_step_;
  bool dense_ready_ = false;
  std::vector<S> stages_;       // k_1 … k_16, n numbers each
  std::vector<S> dense_;        // coefficients 1 … 7 of the interpolating polynomial, n numbers each
  std::vector<S> stage_state_;  // argument of the right-hand side
  std::vector<S> error5_;       // estimates of the local error, per unit of step
  std::vector<S> error3_;
};

template <class S>
DormandPrince853<S>::DormandPrince853(const Manifold& manifold, const Tolerances& tolerances,
                                      const StepControl& control)
    : Stepper<S>(manifold),
      norm_(manifold, tolerances),
      control_(control),
      moving_{{0, manifold.size}},
      stages_(dop853::kExtendedStages * this->state_.size()),
      dense_(kDenseCoefficients * this->state_.size()),
      stage_state_(this->state_.size()),
      error5_(this->state_.size()),
      error3_(this->state_.size()) {
  if (!(control.initial_step >= 0.0 && std::isfinite(control.initial_step))) {
    throw std::invalid_argument("StepControl: initial_step must be finite and not negative");
  }
  if (!(control.max_step > 0.0)) throw std::invalid_argument("StepControl: max_step must be positive");
  if (control.max_steps <= 0) throw std::invalid_argument("StepControl: max_steps must be positive");
}

template <class S>
template <RightHandSide<S> Rhs>
void DormandPrince853<S>::start(Rhs&& rhs, double t0, std::span<const S> y0, double t_end) {
  dense_ready_ = false;
  this->begin(rhs, t0, y0, t_end);
  if (std::exchange(this->renewed_, false)) leave_still();
  proposed_step_ = control_.initial_step;
  accepted_step_ = {};
  if (this->status_ == StepStatus::running && control_.initial_step == 0.0) proposed_step_ = choose_initial_step(rhs);
}

// HNW II.4: a step whose Euler increment is small, then the second derivative from one more evaluation.
template <class S>
template <class Rhs>
double DormandPrince853<S>::choose_initial_step(Rhs& rhs) {
  const double longest = std::min(std::abs(this->remaining()), control_.max_step);
  const double size_f = norm_(this->state_, this->derivative_);
  const double euler = dop853::first_euler_step(norm_.magnitude(this->state_), size_f, longest);
  const double h = this->direction_ * euler;
  for (int i = 0; i < this->size(); ++i) stage_state_[i] = this->state_[i] + h * this->derivative_[i];
  this->evaluate(rhs, this->time_ + h, stage_state_, stage(2));
  for (int i = 0; i < this->size(); ++i) error5_[i] = stage(2)[i] - this->derivative_[i];
  const double second = norm_(this->state_, error5_) / euler;
  return dop853::first_step(euler, size_f, second, longest, [](double x) { return std::pow(0.01 / x, 1.0 / 8.0); });
}

template <class S>
void DormandPrince853<S>::propose_step(double size) {
  if (!(size > 0.0 && std::isfinite(size))) throw std::invalid_argument("propose_step: the size must be positive");
  proposed_step_ = size;
}

// Numbers that remain constant have the same value in all states of a step. The right-hand side writes their
// derivatives, which are zero, at every stage.
template <class S>
void DormandPrince853<S>::leave_still() {
  if (left_ != this->still_) {
    left_ = this->still_;
    moving_ = numbers_beside(this->size(), left_);
    norm_.skip(left_);
  }
  for (const auto [begin, end] : left_) {
    for (int i = begin; i < end; ++i) stage_state_[i] = this->end_[i] = this->state_[i];
  }
}

// Tries steps until one is accepted or the status is final: fits the size to the end, evaluates stages and error, and
// adapts the size (HNW II.4).
template <class S>
template <RightHandSide<S> Rhs>
StepStatus DormandPrince853<S>::step(Rhs&& rhs) {
  if (this->status_ != StepStatus::running) return this->status_;
  if (std::exchange(this->renewed_, false)) leave_still();
  this->has_step_ = dense_ready_ = false;
  bool rejected = false;
  bool finite = true;
  for (;;) {
    if (this->statistics_.accepted + this->statistics_.rejected >= control_.max_steps) {
      return this->fail(StepStatus::too_many_steps);
    }
    const dop853::FittedStep fitted =
        dop853::fit_step(proposed_step_, control_.max_step, std::abs(this->remaining()), this->time_);
    if (fitted.too_small) return this->fail(finite ? StepStatus::step_too_small : StepStatus::non_finite);
    const double t_new = fitted.last ? this->end_time_ : this->time_ + this->direction_ * fitted.wanted;
    const double h = t_new - this->time_;  // consistent with the rounded times, so that time does not drift

    evaluate_stages(rhs, h);
    double error = estimate_error(h);
    if (error <= 1.0) {
      const double defect = normalize(this->manifold_, std::span<S>(this->end_));
      // A step that diverges may have a small error estimate, but not unit quaternions.
      const bool diverged = !(defect <= dop853::kLargestDefect);
      if (!diverged) this->evaluate(rhs, t_new, this->end_, stage(13));
      if (!diverged && all_finite(std::span<const S>(stage(13)))) {
        const double root = std::pow(error, -1.0 / 8.0);
        const double next = control_.predictive ? dop853::predicted_root(std::abs(h), root, accepted_step_) : root;
        proposed_step_ = dop853::size_after_accepted(std::abs(h), next, rejected);
        accepted_step_ = {std::abs(h), root};
        // A step shortened by the end time does not limit the next one.
        if (fitted.last) proposed_step_ = std::max(proposed_step_, fitted.wanted);
        this->statistics_.sum_of_error_estimates += error;
        this->accept(t_new, stage(13), defect);
        return this->status_;
      }
      error = std::numeric_limits<double>::quiet_NaN();
    }
    rejected = true;
    finite = std::isfinite(error);
    ++this->statistics_.rejected;
    proposed_step_ = dop853::size_after_rejected(std::abs(h), std::pow(error, -1.0 / 8.0), finite);
  }
}

// Stages 1 to 12, the state of order 8 in end_, and the two error estimates per unit of step.
template <class S>
template <class Rhs>
void DormandPrince853<S>::evaluate_stages(Rhs& rhs, double h) {
  std::copy(this->derivative_.begin(), this->derivative_.end(), stages_.begin());
  const double t = this->time_;
  evaluate_stage<2, dop853::kStage2>(rhs, t, h, this->state_);
  evaluate_stage<3, dop853::kStage3>(rhs, t, h, this->state_);
  evaluate_stage<4, dop853::kStage4>(rhs, t, h, this->state_);
  evaluate_stage<5, dop853::kStage5>(rhs, t, h, this->state_);
  evaluate_stage<6, dop853::kStage6>(rhs, t, h, this->state_);
  evaluate_stage<7, dop853::kStage7>(rhs, t, h, this->state_);
  evaluate_stage<8, dop853::kStage8>(rhs, t, h, this->state_);
  evaluate_stage<9, dop853::kStage9>(rhs, t, h, this->state_);
  evaluate_stage<10, dop853::kStage10>(rhs, t, h, this->state_);
  evaluate_stage<11, dop853::kStage11>(rhs, t, h, this->state_);
  evaluate_stage<12, dop853::kStage12>(rhs, t, h, this->state_);
  const S *const begin = this->state_.data(), *const stages = stages_.data();
  S *const end = this->end_.data(), *const error5 = error5_.data(), *const error3 = error3_.data();
  const int n = this->size();
  each_moving([=](int i) {
    const S slope = dop853::weighted_sum<dop853::kSolution>(stages, n, i);
    end[i] = begin[i] + h * slope;
    error3[i] = slope - dop853::weighted_sum<dop853::kThirdOrder>(stages, n, i);
    error5[i] = dop853::weighted_sum<dop853::kError5>(stages, n, i);
  });
}

// Error estimate in units of the tolerance; at most 1: acceptable. NaN if any number is not finite.
template <class S>
double DormandPrince853<S>::estimate_error(double h) {
  if (norm_.dimension() == 0) return 0.0;
  return dop853::combined_error(std::abs(h), norm_.sum_of_squares(this->state_, this->end_, error5_),
                                norm_.sum_of_squares(this->state_, this->end_, error3_), norm_.dimension());
}

// (8.1a), from stages 12 and 13, both at the end of the step, of which stage_state_ still is the argument of the
// former.
template <class S>
double DormandPrince853<S>::stiffness() {
  if (!this->has_step_ || dense_ready_) return 0.0;
  each_moving([&](int i) {
    error5_[i] = this->end_[i] - stage_state_[i];
    error3_[i] = stage(13)[i] - stage(12)[i];
  });
  const auto [apart, change] = norm_.template of_each<2>(this->end_, {error5_, error3_});
  return apart > 0.0 ? std::abs(this->time_ - this->previous_time_) * change / apart : 0.0;
}

template <class S>
typename DormandPrince853<S>::Bend DormandPrince853<S>::bend() {
  if (!this->has_step_ || dense_ready_) return {};
  const double h = this->time_ - this->previous_time_;
  const std::span<S> motion = stage_state_;  // a later step sets it again
  each_moving([&](int i) {
    motion[i] = this->end_[i] - this->previous_state_[i];
    error5_[i] = motion[i] - h * stage(1)[i];
    error3_[i] = stage(13)[i] - stage(1)[i];
  });
  const auto [moved, bent, turned] = norm_.template of_each<3>(this->end_, {motion, error5_, error3_});
  return {bent, moved > 0.0 ? h * turned / moved : 0.0};
}

// Evaluates stages 14 to 16 and the coefficients 1 to 7 of the interpolating polynomial (HNW II.6).
template <class S>
template <RightHandSide<S> Rhs>
void DormandPrince853<S>::prepare_dense_output(Rhs&& rhs) {
  if (!this->has_step_) throw std::logic_error("dense output: there is no completed step: " + this->explanation());
  if (dense_ready_) return;
  const double t = this->previous_time_;
  const double h = this->time_ - t;
  const std::vector<S>& y = this->previous_state_;
  evaluate_stage<14, dop853::kStage14>(rhs, t, h, y);
  evaluate_stage<15, dop853::kStage15>(rhs, t, h, y);
  evaluate_stage<16, dop853::kStage16>(rhs, t, h, y);
  for (int i = 0; i < this->size(); ++i) {
    const S difference = this->end_[i] - y[i];
    const S start_slope = h * stage(1)[i] - difference;
    dense(1)[i] = difference;
    dense(2)[i] = start_slope;
    dense(3)[i] = difference - h * stage(13)[i] - start_slope;
    dense(4)[i] = h * weighted_sum<dop853::kDense4>(i);
    dense(5)[i] = h * weighted_sum<dop853::kDense5>(i);
    dense(6)[i] = h * weighted_sum<dop853::kDense6>(i);
    dense(7)[i] = h * weighted_sum<dop853::kDense7>(i);
  }
  dense_ready_ = true;
}

// t => state within the last step from the interpolating polynomial.
template <class S>
void DormandPrince853<S>::interpolate(double t, std::span<S> y) const {
  this->require_in_last_step(t);
  if (!dense_ready_) throw std::logic_error("interpolate: call prepare_dense_output() after each step that needs it");
  if (t == this->time_) {
    std::copy(this->end_.begin(), this->end_.end(), y.begin());
    return;
  }
  // Nested alternately in θ and 1 − θ: y0 + θ(d1 + (1−θ)(d2 + θ(d3 + (1−θ)(d4 + θ(d5 + (1−θ)(d6 + θ d7))))))
  const double theta = (t - this->previous_time_) / (this->time_ - this->previous_time_);
  const double rest = 1.0 - theta;
  const int n = this->size();
  const S* d = dense_.data();
  for (int i = 0; i < n; ++i) {
    S sum = theta * d[6 * n + i];
    sum = rest * (d[5 * n + i] + sum);
    sum = theta * (d[4 * n + i] + sum);
    sum = rest * (d[3 * n + i] + sum);
    sum = theta * (d[2 * n + i] + sum);
    sum = rest * (d[1 * n + i] + sum);
    y[i] = this->previous_state_[i] + theta * (d[i] + sum);
  }
  if (t != this->previous_time_) normalize(this->manifold_, y);
}

}  // namespace grapnel
