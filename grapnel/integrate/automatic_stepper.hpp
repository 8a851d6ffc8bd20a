#pragma once

/// @file
/// DOP853 where a motion is not stiff, Radau IIA of order 9 where it is. docs/theory/08-after-the-impact.md, stiff
/// motion. Thread safety: a stepper belongs to one thread at a time; different ones are independent.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/radau_stepper.hpp"

namespace grapnel {

/// Decides between the methods from counts only, so that results do not depend on the machine.
///
/// If stability, rounding errors of stiff forces, or fast modes of a slow motion limit explicit steps for some time,
/// implicit steps are tried. They continue as long as they cost fewer evaluations per time than explicit steps would.
class StiffnessMonitor {
 public:
  /// The least `product` of explicit steps that fast modes limit. `bend` and `motion` of other steps do not matter.
  static constexpr double kLeastProduct = 0.1;
  /// An explicit step of length `size`.
  struct ExplicitStep {
    double size = 0;
    double product = 0;  // DormandPrince853::stiffness()
    double bend = 0;     // norm of y(end) - y(begin) - size y'(begin) in tolerances
    double motion = 0;   // size |y'(end) - y'(begin)| / |y(end) - y(begin)|: of the motion what `product` is of f
  };
  /// Notes an explicit step. @return whether implicit steps should be tried.
  bool explicit_step(const ExplicitStep& step);
  /// The present explicit step that is limited.
  double explicit_size() const { return size_; }

  /// What implicit steps have cost since a trial began.
  struct Cost {
    std::int64_t evaluations = 0;
    long factorizations = 0;
  };
  void begin_trial();
  /// Notes an implicit step after which the trial has cost this much. @return whether steps are to be judged now.
  bool implicit_step(double begin);
  /// Judges the steps since the last judgement, up to the time `end`. `coupled`: numbers in Newton's matrix; `radius`:
  /// magnitude of the fastest eigenvalue. @return whether explicit steps cost less.
  bool prefers_explicit(double end, const Cost& cost, std::size_t coupled, double radius);
  /// No implicit step was possible.
  void implicit_failed() { cause().postpone(); }
  /// The motion changed, as at an event: the counts of limited steps restart.
  void forget() { stable_.forget(), short_.forget(); }

 private:
  // Limited explicit steps, interrupted by few others.
  struct Count {
    int first_trial, rarest_trial;  // steps before a trial: at first; at most, after trials that do not pay
    int required = first_trial;     // the same for the next trial
    int steps = 0, others = 0;      // limited steps; others since the last of them
    int noisy = 0;                  // of the steps, those that rounding errors limit
    double size = 0;                // of the steps, in the mean

    bool note(bool is_limited, bool is_noisy, double step);
    void forget() { steps = others = noisy = 0; }
    void postpone() { required = std::clamp(2 * required, first_trial, rarest_trial); }
  };

  Count& cause() { return is_short_ ? short_ : stable_; }

  Count stable_{.first_trial = 15, .rarest_trial = 960};   // steps that stability or rounding errors limit
  Count short_{.first_trial = 240, .rarest_trial = 3840};  // steps of slow motions that fast modes limit
  double size_ = 0;                                        // of explicit steps, before and after implicit ones
  int judgements_before_check_ = 0;                        // by explicit steps; 0: the initial number
  // The present trial:
  bool is_short_ = false;  // its cause
  bool by_size_ = false;   // compared with the explicit steps before it; otherwise with those at the limit of stability
  double limit_ = 0;       // h |lambda| of the explicit steps; 0: not known yet
  double since_ = 0;       // begin of the implicit steps that are judged together
  int judged_ = 0;         // their number
  Cost before_;            // them
  int paid_ = 0;           // judgements in favour of implicit steps
};

/// A stepper with the interface of DormandPrince853, and error control by the same tolerances. It begins with explicit
/// steps, also after each start(), and integrates backwards with them only. A right-hand side may have the member
/// `coupled(std::vector<int>& numbers)`, which appends the indices, increasing, of the numbers on which the derivatives
/// depend at present; without it all do. It allocates when it changes to implicit steps.
class AutomaticStepper {
  // The result of use(stepper) for the stepper in use. Before its uses, since its type is deduced.
  template <class Use>
  decltype(auto) on_active(Use&& use) {
    return implicit_ ? use(*implicit_) : use(explicit_);
  }
  template <class Use>
  decltype(auto) on_active(Use&& use) const {
    return implicit_ ? use(*implicit_) : use(explicit_);
  }

 public:
  using Scalar = double;
  /// automatic: as above. implicit: implicit steps throughout, except backwards.
  enum class Choice { automatic, implicit };

  /// Throws std::invalid_argument as DormandPrince853 does.
  AutomaticStepper(const Manifold& manifold, const Tolerances& tolerances, const StepControl& control = {},
                   Choice choice = Choice::automatic)
      : tolerances_(tolerances), control_(control), choice_(choice), explicit_(manifold, tolerances, control) {}

  /// As DormandPrince853::start. Statistics count from here.
  template <RightHandSide<double> Rhs>
  void start(Rhs&& rhs, double t0, std::span<const double> y0, double t_end);
  /// As DormandPrince853::step. If no implicit step is possible, explicit ones continue, unless the choice is implicit.
  template <RightHandSide<double> Rhs>
  StepStatus step(Rhs&& rhs);

  const Manifold& manifold() const { return explicit_.manifold(); }
  double time() const {
    return on_active([](const auto& s) { return s.time(); });
  }
  double previous_time() const {
    return on_active([](const auto& s) { return s.previous_time(); });
  }
  double end_time() const {
    return on_active([](const auto& s) { return s.end_time(); });
  }
  StepStatus status() const {
    return steps_used_up_ ? StepStatus::too_many_steps : on_active([](const auto& s) { return s.status(); });
  }
  std::span<const double> state() const {
    return on_active([](const auto& s) { return s.state(); });
  }
  std::span<const double> derivative() const {
    return on_active([](const auto& s) { return s.derivative(); });
  }
  std::string explanation() const { return explain(status(), time()); }
  /// Of the steps of both methods.
  IntegrationStatistics statistics() const;
  /// Accepted steps of the implicit method, and the intervals that it integrated.
  std::int64_t implicit_steps() const { return implicit_steps_; }
  const std::vector<std::array<double, 2>>& implicit_spans() const { return implicit_spans_; }

  /// These as of Stepper and DormandPrince853.
  void set_end_time(double end_time) {
    on_active([&](auto& s) { s.set_end_time(end_time); });
  }
  template <RightHandSide<double> Rhs>
  void set_state(Rhs&& rhs, std::span<const double> y) {
    on_active([&](auto& s) { s.set_state(rhs, y); });
  }
  template <RightHandSide<double> Rhs>
  void reset_derivative(Rhs&& rhs) {
    on_active([&](auto& s) { s.reset_derivative(rhs); });
  }
  /// The size of the next step, if it is not rejected and the method does not change; of implicit steps unlimited.
  double proposed_step() const {
    return implicit_ ? std::numeric_limits<double>::infinity() : explicit_.proposed_step();
  }
  void propose_step(double size) {
    on_active([&](auto& s) { s.propose_step(size); });
  }
  template <RightHandSide<double> Rhs>
  void prepare_dense_output(Rhs&& rhs) {
    on_active([&](auto& s) { s.prepare_dense_output(rhs); });
  }
  void interpolate(double t, std::span<double> y) const {
    on_active([&](const auto& s) { s.interpolate(t, y); });
  }
  template <RightHandSide<double> Rhs>
  void interpolate(Rhs&& rhs, double t, std::span<double> y) {
    on_active([&](auto& s) { s.interpolate(rhs, t, y); });
  }

 private:
  template <class Rhs>
  std::vector<int> coupled(Rhs& rhs) const;
  template <class Rhs>
  void begin_implicit(Rhs& rhs, double first_step);
  template <class Rhs>
  void begin_explicit(Rhs& rhs);
  template <class Rhs>
  void change_method(Rhs& rhs);
  void note_explicit_step();
  void note_implicit_step();

  Tolerances tolerances_;
  StepControl control_;
  Choice choice_;
  DormandPrince853<double> explicit_;
  std::optional<RadauStepper> implicit_;  // where it is used
  StiffnessMonitor monitor_;
  IntegrationStatistics done_;  // by steppers used before, since start()
  bool changes_ = false;        // of the method before the next step
  bool steps_used_up_ = false;
  std::int64_t implicit_steps_ = 0;
  std::vector<std::array<double, 2>> implicit_spans_;
};

template <RightHandSide<double> Rhs>
void AutomaticStepper::start(Rhs&& rhs, double t0, std::span<const double> y0, double t_end) {
  implicit_.reset();
  done_ = {};
  steps_used_up_ = changes_ = false;
  implicit_steps_ = 0;
  implicit_spans_.clear();
  monitor_.forget();
  explicit_.start(rhs, t0, y0, t_end);
  changes_ = choice_ == Choice::implicit && t_end > t0;
}

template <class Rhs>
std::vector<int> AutomaticStepper::coupled(Rhs& rhs) const {
  std::vector<int> numbers;
  if constexpr (requires { rhs.coupled(numbers); }) {
    rhs.coupled(numbers);
  } else {
    for (int i = 0; i < manifold().size; ++i) numbers.push_back(i);
  }
  return numbers;
}

// Present state => implicit stepper there. Its first step may be longer than the explicit ones: growth is limited.
template <class Rhs>
void AutomaticStepper::begin_implicit(Rhs& rhs, double first_step) {
  const std::vector<double> y(state().begin(), state().end());
  const double t = time(), end = end_time();
  done_ = statistics();
  implicit_.emplace(manifold(), tolerances_, control_, coupled(rhs));
  implicit_->start(rhs, t, y, end);
  if (first_step > 0) implicit_->propose_step(first_step);
  monitor_.begin_trial();
}

template <class Rhs>
void AutomaticStepper::begin_explicit(Rhs& rhs) {
  const std::vector<double> y(state().begin(), state().end());
  const double t = time(), end = end_time();
  done_ = statistics();
  implicit_.reset();
  explicit_.start(rhs, t, y, end);
  explicit_.propose_step(monitor_.explicit_size());
  monitor_.forget();
}

// Changes the method if the last step has decided so; also if other numbers are coupled than before.
template <class Rhs>
void AutomaticStepper::change_method(Rhs& rhs) {
  if (implicit_ && !changes_ && coupled(rhs) == implicit_->coupled()) return;
  if (!implicit_ && !changes_) return;
  const bool renews = implicit_ && !changes_;
  changes_ = false;
  constexpr double kFirstStep = 4;  // in explicit steps
  if (implicit_ && !renews)
    begin_explicit(rhs);
  else
    begin_implicit(rhs, choice_ == Choice::automatic ? kFirstStep * monitor_.explicit_size() : 0);
}

template <RightHandSide<double> Rhs>
StepStatus AutomaticStepper::step(Rhs&& rhs) {
  if (status() != StepStatus::running) return status();
  change_method(rhs);
  const IntegrationStatistics before = statistics();
  steps_used_up_ = before.accepted + before.rejected >= control_.max_steps;
  if (steps_used_up_) return status();
  const auto goes_on = [&] { return status() == StepStatus::running || status() == StepStatus::finished; };
  if (implicit_) {
    implicit_->step(rhs);
    if (goes_on()) {
      note_implicit_step();
      return status();
    }
    if (choice_ == Choice::implicit) return status();
    monitor_.implicit_failed();
    begin_explicit(rhs);
  }
  explicit_.step(rhs);
  if (goes_on()) note_explicit_step();
  return status();
}

}  // namespace grapnel
