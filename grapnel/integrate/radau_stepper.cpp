#include "grapnel/integrate/radau_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace grapnel {
namespace {

// Increments of finite differences are a ten-millionth of this: 1e-8 m, rad, m/s, rad/s, or of a deformation relative
// to its limit. Contacts of 1e-6 m depth keep touching then, and rounding errors change derivatives by 1e-8.
constexpr double kSize = 0.1;
// Newton's method has converged if its remaining error is this share of the tolerances, or if it stalls below it.
constexpr double kNewtonShare = 0.02;

// Checks the indices => those of all n numbers: the coupled ones first.
std::vector<int> order_of(const std::vector<int>& coupled, int size) {
  std::vector<bool> is_coupled(static_cast<std::size_t>(size), false);
  int before = -1;
  for (const int index : coupled) {
    if (index <= before || index >= size) {
      throw std::invalid_argument("RadauStepper: index " + std::to_string(index) +
                                  " of a coupled number is out of order or outside the state of " +
                                  std::to_string(size) + " numbers");
    }
    is_coupled[static_cast<std::size_t>(index)] = true;
    before = index;
  }
  std::vector<int> order = coupled;
  for (int i = 0; i < size; ++i) {
    if (!is_coupled[static_cast<std::size_t>(i)]) order.push_back(i);
  }
  return order;
}

std::vector<double> filled(std::size_t count, double value) { return std::vector<double>(count, value); }

}  // namespace

RadauStepper::RadauStepper(const Manifold& manifold, const Tolerances& tolerances, const StepControl& control,
                           std::vector<int> coupled)
    : Stepper<double>(manifold),
      control_(control),
      rtol_(tolerances.rtol),
      atol_(tolerances.atol_components),
      coupled_(std::move(coupled)),
      order_(order_of(coupled_, manifold.size)),
      in_quaternion_(state_.size(), false),
      radau_(system(), state_, filled(coupled_.size(), kSize), filled(coupled_.size(), 1)),
      point_(state_.size()),
      slope_(state_.size()),
      ordered_(state_.size()),
      ordered_slope_(state_.size()),
      step_tolerances_(state_.size(), std::numeric_limits<double>::infinity()) {
  const ErrorNorm<double> checked(manifold, tolerances);  // refuses invalid tolerances
  if (!(control.initial_step >= 0.0 && std::isfinite(control.initial_step)))
    throw std::invalid_argument("StepControl: initial_step must be finite and not negative");
  if (!(control.max_step > 0.0)) throw std::invalid_argument("StepControl: max_step must be positive");
  if (control.max_steps <= 0) throw std::invalid_argument("StepControl: max_steps must be positive");
  if (atol_.empty()) atol_.assign(state_.size(), tolerances.atol);
  for (const int offset : manifold.quaternions) std::fill_n(in_quaternion_.begin() + offset, 4, true);
  radau_.accept_rounding(kNewtonShare);
  radau_.expect_rest(kNewtonShare);
  radau_.limit_quadratures(std::span(step_tolerances_).subspan(coupled_.size()));
  if (std::isfinite(control.max_step)) radau_.limit_step(control.max_step);
}

// All coupled numbers are rates for RadauIIA: its matrix contains all derivatives.
StiffSystem RadauStepper::system() {
  StiffSystem system;
  system.rates = static_cast<int>(coupled_.size());
  system.quadratures = size() - system.rates;
  system.derivatives = [this](std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
    evaluate_points(t, y, dydt);
  };
  return system;
}

void RadauStepper::refuse_backwards(double t0, double t_end) {
  if (t_end < t0)
    throw std::invalid_argument("RadauStepper: the end time " + std::to_string(t_end) + " lies before " +
                                std::to_string(t0) + "; it integrates forwards only");
}

void RadauStepper::propose_step(double size) {
  if (!(size > 0.0 && std::isfinite(size))) throw std::invalid_argument("propose_step: the size must be positive");
  radau_.restart(size);
}

// The first step, if none is given: an increment of a hundredth of the state, or a thousandth of the interval.
void RadauStepper::restart() {
  double first = control_.initial_step;
  if (first == 0.0) {
    double relative_rate = 1e3 / std::max(remaining(), 1e-300);
    for (const int i : coupled_) {
      const double scale = std::max(std::abs(state_[i]), 1e-5);
      relative_rate = std::max(relative_rate, 100.0 * std::abs(derivative_[i]) / scale);
    }
    first = 1.0 / relative_rate;
  }
  if (std::isfinite(first) && first > 0.0) radau_.restart(first);
}

void RadauStepper::gather(std::span<const double> from, std::span<double> to) const {
  for (std::size_t i = 0; i < order_.size(); ++i) to[i] = from[order_[i]];
}
void RadauStepper::scatter(std::span<const double> from, std::span<double> to) const {
  for (std::size_t i = 0; i < order_.size(); ++i) to[order_[i]] = from[i];
}

void RadauStepper::evaluate_points(std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
  const std::size_t n = order_.size();
  for (std::size_t k = 0; k < t.size(); ++k) {
    scatter(y.subspan(k * n, n), point_);
    ++statistics_.rhs_evaluations;
    (*active_)(t[k], point_, slope_);
    gather(slope_, dydt.subspan(k * n, n));
  }
}

// State => tolerance of each number; a quaternion's numbers have the size of its rotation vector [rad]. Sums that are
// not under error control have none.
void RadauStepper::set_tolerances() {
  const int controlled = manifold_.controlled_size();
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const auto k = static_cast<std::size_t>(order_[i]);
    if (i >= coupled_.size() && order_[i] >= controlled) continue;
    step_tolerances_[i] = atol_[k] + rtol_ * (in_quaternion_[k] ? 1.0 : std::abs(state_[k]));
  }
  radau_.set_tolerances(step_tolerances_);
}

// State and derivative at the begin => those at the end of one accepted step, on the manifold.
StepStatus RadauStepper::advance(const Derivative& derivative) {
  has_step_ = false;
  if (statistics_.accepted + statistics_.rejected >= control_.max_steps) return fail(StepStatus::too_many_steps);
  gather(state_, ordered_), gather(derivative_, ordered_slope_);
  radau_.continue_from(time_, ordered_, ordered_slope_);
  set_tolerances();
  active_ = &derivative;
  const long rejected_before = radau_.rejected();
  const bool done = radau_.step(end_time_);
  statistics_.rejected += radau_.rejected() - rejected_before;
  if (!done) return fail(StepStatus::step_too_small);
  scatter(radau_.y(), end_);
  const double defect = normalize(manifold_, std::span<double>(end_));
  ++statistics_.rhs_evaluations;
  derivative(radau_.time(), end_, slope_);
  if (!all_finite(std::span<const double>(end_)) || !all_finite(std::span<const double>(slope_)))
    return fail(StepStatus::non_finite);
  statistics_.sum_of_error_estimates += radau_.error();
  accept(radau_.time(), slope_, defect);
  return status_;
}

void RadauStepper::interpolate(double t, std::span<double> y) const {
  require_in_last_step(t);
  if (t == time_) {
    std::copy(end_.begin(), end_.end(), y.begin());
    return;
  }
  if (t == previous_time_) {
    std::copy(previous_state_.begin(), previous_state_.end(), y.begin());
    return;
  }
  radau_.at(t, ordered_);
  scatter(ordered_, y);
  normalize(manifold_, y);
}

}  // namespace grapnel
