#include "grapnel/integrate/automatic_stepper.hpp"

#include <algorithm>

namespace grapnel {
namespace {

constexpr double kStabilityLimit = 6;  // of DOP853: the least h |lambda|, that of vibrations
constexpr double kNearLimit = 4.5;
constexpr double kLeastNoisy = 0.25;    // least h |lambda| of steps that rounding errors of stiff forces limit
constexpr double kQuiet = 10;           // largest change, beside the linear one, of motion at rest, in tolerances
constexpr double kSlowMotion = 0.1;     // largest rate of a slow motion, relative to the fastest modes
constexpr double kExplicitCost = 14;    // evaluations per explicit step at the limit, with rejected ones
constexpr int kUnlimitedSteps = 6;      // end a sequence of limited steps
constexpr int kJudgedSteps = 6;         // implicit steps judged together
constexpr double kFactorization = 0.5;  // cost of a factorization, in evaluations per coupled number
// After short explicit steps: judgements in favour of implicit steps before explicit ones are checked, and the number
// of these.
constexpr int kFirstCheck = 16, kRarestCheck = 256, kCheckedSteps = 15;

}  // namespace

// @return whether enough steps have been limited for a trial.
bool StiffnessMonitor::Count::note(bool is_limited, bool is_noisy, double step) {
  if (!is_limited) {
    if (steps > 0 && ++others >= kUnlimitedSteps) {
      forget();
      required = std::max(required, first_trial);
    }
    return false;
  }
  others = 0;
  if (is_noisy) ++noisy;
  constexpr double kShare = 0.2;  // of a step in the mean
  size = steps == 0 ? step : size + kShare * (step - size);
  return ++steps >= required;
}

bool StiffnessMonitor::explicit_step(const ExplicitStep& step) {
  const double h = step.size, product = step.product;
  const bool stable = product > kNearLimit, noisy = !stable && product > kLeastNoisy && step.bend < kQuiet;
  const bool limited = stable_.note(stable || noisy, noisy, stable ? h * kStabilityLimit / product : h);
  const bool resolving = short_.note(product > kLeastProduct && step.motion < kSlowMotion * product, false, h);
  if (!limited && !resolving) return false;
  is_short_ = !limited;
  size_ = cause().size;
  return true;
}

void StiffnessMonitor::begin_trial() {
  judged_ = paid_ = 0, before_ = {};
  by_size_ = is_short_ || 2 * stable_.noisy > stable_.steps;
  limit_ = 0;
}

bool StiffnessMonitor::implicit_step(double begin) {
  if (judged_ == 0) since_ = begin;
  return ++judged_ >= kJudgedSteps;
}

// The first steps of a trial, which are short, and its first derivatives count as well. The steps that followed a trial
// by short steps may become longer, so they are checked after some time.
bool StiffnessMonitor::prefers_explicit(double end, const Cost& cost, std::size_t coupled, double radius) {
  const double evaluations =
      static_cast<double>(cost.evaluations - before_.evaluations) +
      kFactorization * static_cast<double>(coupled) * static_cast<double>(cost.factorizations - before_.factorizations);
  if (limit_ == 0) limit_ = by_size_ ? std::min(kStabilityLimit, size_ * radius) : kStabilityLimit;
  if (radius > 0) size_ = std::min(limit_ / radius, end - since_);
  const bool pays = radius > 0 && evaluations * limit_ < kExplicitCost * radius * (end - since_);
  judged_ = 0;
  before_ = cost;
  if (!pays) {
    judgements_before_check_ = 0;
    if (paid_ == 0) cause().postpone();
    return true;
  }
  cause().required = cause().first_trial;  // of the next trial, also if an event ends this one
  const int check = std::max(judgements_before_check_, kFirstCheck);
  if (++paid_ < check || !is_short_) return false;
  judgements_before_check_ = std::min(2 * check, kRarestCheck);
  short_.required = kCheckedSteps;
  return true;
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
  StiffnessMonitor::ExplicitStep step{.size = time() - previous_time(), .product = explicit_.stiffness()};
  if (step.product > StiffnessMonitor::kLeastProduct) {
    const auto [bend, motion] = explicit_.bend();
    step.bend = bend, step.motion = motion;
  }
  changes_ = monitor_.explicit_step(step);
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
