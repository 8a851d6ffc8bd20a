#include "grapnel/integrate/automatic_stepper.hpp"

#include <algorithm>

namespace grapnel {
namespace {

constexpr double kStabilityLimit = 6;  // of DOP853: the least h |lambda|, that of vibrations
constexpr double kNearLimit = 4.5;
constexpr double kLeastNoisy = 0.25;    // least h |lambda| of steps that rounding errors of stiff forces limit
constexpr double kQuiet = 10;           // largest change, beside the linear one, of motion at rest, in tolerances
constexpr double kExplicitCost = 14;    // evaluations per explicit step at the limit, with rejected ones
constexpr int kUnlimitedSteps = 6;      // end a sequence of limited steps
constexpr int kRarestTrial = 960;       // limited explicit steps, after trials that did not pay
constexpr int kJudgedSteps = 6;         // implicit steps judged together
constexpr double kFactorization = 0.5;  // cost of a factorization, in evaluations per coupled number

}  // namespace

bool StiffnessMonitor::explicit_step(double begin, double end, double product, double change) {
  const bool stable = product > kNearLimit, noisy = !stable && product > kLeastNoisy && change < kQuiet;
  if (!stable && !noisy) {
    if (limited_ > 0 && ++unlimited_ >= kUnlimitedSteps) forget();
    return false;
  }
  unlimited_ = 0;
  if (noisy) ++noisy_;
  constexpr double kShare = 0.2;  // of a step in the mean
  const double size = (end - begin) * (noisy ? 1 : kStabilityLimit / product);
  size_ = limited_ == 0 ? size : size_ + kShare * (size - size_);
  return ++limited_ >= required_;
}

void StiffnessMonitor::begin_trial() {
  judged_ = 0, before_ = {}, paid_ = false;
  is_noisy_ = 2 * noisy_ > limited_;
  limit_ = 0;
}

void StiffnessMonitor::postpone() { required_ = std::min(2 * required_, kRarestTrial); }

bool StiffnessMonitor::implicit_step(double begin) {
  if (judged_ == 0) since_ = begin;
  return ++judged_ >= kJudgedSteps;
}

// The first steps of a trial, which are short, and its first derivatives count as well.
bool StiffnessMonitor::prefers_explicit(double end, const Cost& cost, std::size_t coupled, double radius) {
  const double evaluations =
      static_cast<double>(cost.evaluations - before_.evaluations) +
      kFactorization * static_cast<double>(coupled) * static_cast<double>(cost.factorizations - before_.factorizations);
  if (limit_ == 0) limit_ = is_noisy_ ? std::min(kStabilityLimit, size_ * radius) : kStabilityLimit;
  if (radius > 0) size_ = std::min(limit_ / radius, end - since_);
  const bool pays = radius > 0 && evaluations * limit_ < kExplicitCost * radius * (end - since_);
  judged_ = 0;
  before_ = cost;
  if (pays) {
    paid_ = true;
  } else if (paid_) {
    required_ = kFirstTrial;
  } else {
    postpone();
  }
  return !pays;
}

IntegrationStatistics AutomaticStepper::statistics() const {
  IntegrationStatistics sum = done_;
  const IntegrationStatistics& now = implicit_ ? implicit_->statistics() : explicit_.statistics();
  sum.rhs_evaluations += now.rhs_evaluations;
  sum.accepted += now.accepted;
  sum.rejected += now.rejected;
  sum.largest_quaternion_defect = std::max(sum.largest_quaternion_defect, now.largest_quaternion_defect);
  sum.sum_of_error_estimates += now.sum_of_error_estimates;
  sum.sum_of_quaternion_corrections += now.sum_of_quaternion_corrections;
  return sum;
}

void AutomaticStepper::note_explicit_step() {
  const bool backwards = time() < previous_time();
  if (choice_ != Choice::automatic || backwards) return;
  const double h = time() - previous_time();
  const std::span<const double> y = state();
  for (std::size_t i = 0; i < y.size(); ++i) begin_[i] = y[i] - begin_[i] - h * begin_slope_[i];
  changes_ = monitor_.explicit_step(previous_time(), time(), explicit_.stiffness(), norm_(y, begin_));
}

void AutomaticStepper::note_implicit_step() {
  ++implicit_steps_;
  if (implicit_spans_.empty() || implicit_spans_.back()[1] != previous_time())
    implicit_spans_.push_back({previous_time(), time()});
  else
    implicit_spans_.back()[1] = time();
  if (choice_ != Choice::automatic || !monitor_.implicit_step(previous_time())) return;
  changes_ = monitor_.prefers_explicit(time(), {implicit_->statistics().rhs_evaluations, implicit_->factorizations()},
                                       implicit_->coupled().size(), implicit_->spectral_radius());
}

}  // namespace grapnel
