#include "grapnel/simulate/simulate_phase.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/integrate/automatic_stepper.hpp"
#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/integrate.hpp"
#include "grapnel/integrate/runge_kutta_4.hpp"

namespace grapnel {
namespace {

// t0, the grid instants between, and t1; instants within rounding of t0 or t1 are omitted. Their number may exceed the
// memory.
class OutputTimes {
 public:
  OutputTimes() = default;
  OutputTimes(double t0, double t1, const OutputGrid& grid)
      : t0_(t0), t1_(t1), origin_(grid.origin.value_or(t0)), step_(t1 < t0 ? -grid.interval : grid.interval) {
    constexpr double kMaxMultiple = 1e15;  // beyond, multiples are not distinguishable
    if (!(grid.interval > 0) || !(std::abs((t0 - origin_) / step_) < kMaxMultiple)) return;
    const double direction = step_ < 0 ? -1 : 1, near = 1e-9 * grid.interval;
    const auto is_after_begin = [&](double k) { return (instant(k) - t0_) * direction > near; };
    const auto is_before_end = [&](std::size_t k) { return (t1_ - at(k)) * direction > near; };
    first_ = std::floor((t0 - origin_) / step_);
    while (!is_after_begin(first_)) ++first_;
    regular_ = static_cast<std::size_t>(std::min(std::abs((t1 - t0) / step_), kMaxMultiple));
    if (is_before_end(regular_ + 1)) ++regular_;
    while (regular_ > 0 && !is_before_end(regular_)) --regular_;
  }
  std::size_t size() const { return 1 + regular_ + (t1_ != t0_ ? 1 : 0); }
  double operator[](std::size_t k) const { return k == 0 ? t0_ : k <= regular_ ? at(k) : t1_; }

 private:
  double instant(double k) const { return origin_ + k * step_; }
  double at(std::size_t k) const { return instant(first_ + static_cast<double>(k) - 1); }
  double t0_ = 0, t1_ = 0, origin_ = 0, step_ = 0;
  double first_ = 1;         // index of the first grid instant after t0
  std::size_t regular_ = 0;  // grid instants between t0 and t1
};

// One phase with one stepper.
template <class Method>
class PhaseRun {
 public:
  PhaseRun(Method& stepper, PhaseDynamics& dynamics, const Tolerances& tolerances, const PhaseObservers& observers)
      : stepper_(stepper),
        dynamics_(dynamics),
        observe_(observers.observe),
        watch_(observers.watch),
        stop_(observers.stop),
        stop_on_load_(observers.stop_on_load),
        resumed_(observers.resumed),
        locator_(stepper.manifold()),
        switch_locator_(stepper.manifold()),
        relative_tolerance_(tolerances.rtol),
        y_(static_cast<std::size_t>(dynamics.size())),
        motor_(dynamics.model().joints().size()),
        friction_(motor_.size()) {
    if (dynamics.loops()) norm_.emplace(stepper.manifold(), tolerances);
  }

  // Start state, interval and output grid => outcome of the phase. Closes loops, handles stops at t0 and integrates
  // over all breaks; a ControllerError ends the phase with its message as the failure.
  PhaseOutcome run(const PhaseInterval& interval) {
    const auto& [start, t0, t1, grid] = interval;
    direction_ = t1 < t0 ? -1 : 1;
    const double begin = resumed_ ? resumed_->begin : t0;
    outputs_ = OutputTimes(begin, t1, grid);
    next_check_ = begin, between_checks_ = (t1 - begin) / std::max(watch_.checks, 1);
    if (resumed_) {
      while (next_ < outputs_.size() && (t0 - outputs_[next_]) * direction_ >= 0) ++next_;
      pass_checks(t0);
    }
    std::vector<double> y0 =
        resumed_ ? dynamics_.initial(start, t0, resumed_->integrals) : dynamics_.initial(start, t0);
    std::vector<double> ends = dynamics_.breaks(t0, t1);
    ends.push_back(t1);
    if (!resumed_) dynamics_.cross_break(t0, ends.front(), y0);
    close_loops(t0, y0, 0);
    try {
      dynamics_.begin_control(t0, t1);
      dynamics_.apply_stop_impacts(t0, y0);
      apply_contact_impacts(t0, y0);
      cross(t0, y0, ends);
      if (!stop_time_ && usable()) output(t1, stepper_.state());
    } catch (const ControllerError& error) {
      broken_off_ = error.what();
    }
    if (stepper_.status() == StepStatus::not_started) stop_time_ = t0, y_ = y0;  // a controller interrupted it
    return outcome();
  }

 private:
  // Ends of the smooth intervals => stepper at t1, or at the first stop, failure or controller error. Each smooth piece
  // chooses its modes again; edges of actuators divide intervals further.
  void cross(double t0, std::span<const double> y0, const std::vector<double>& ends) {
    double begin = t0;
    for (std::size_t next = 0; next < ends.size();) {
      bool jumps = false;
      if (begin != t0) {
        y_.assign(stepper_.state().begin(), stepper_.state().end());
        jumps = dynamics_.cross_break(begin, ends[next], y_);
      }
      const double end = dynamics_.begin_smooth_interval(begin, ends[next], begin == t0 ? y0 : y_);
      if (begin == t0) {
        stepper_.start(dynamics_, t0, y0, end);
        if constexpr (requires { stepper_.propose_step(0.0); }) {
          if (resumed_) stepper_.propose_step(resumed_->next_step);
        }
        if (const LoopSolver* solver = dynamics_.loops()) loops_.rows = solver->rows(), loops_.rank = solver->rank();
      } else {
        stepper_.set_end_time(end);
        if (jumps)
          stepper_.set_state(dynamics_, y_);
        else
          stepper_.reset_derivative(dynamics_);
      }
      fresh_ = true;
      cross_interval(begin, ends[next]);
      if (stop_time_ || !usable()) break;
      begin = stepper_.end_time();
      if (begin == ends[next]) ++next;
    }
  }

  bool usable() const {
    return broken_off_.empty() &&
           (stepper_.status() == StepStatus::running || stepper_.status() == StepStatus::finished);
  }

  // Records the loop defect of y, and closes the loops. Returns whether y changed.
  bool close_loops(double t, std::span<double> y, double negligible) {
    if (!dynamics_.loops()) return false;
    if (!dynamics_.projects()) {
      loops_.unprojected.raise(dynamics_.loop_defect(t, y));
      return false;
    }
    correction_.assign(y.begin(), y.end());
    const ProjectionResult result = dynamics_.project(t, y, negligible);
    loops_.unprojected.raise(result.before);
    if (!result.changed) return false;
    for (std::size_t i = 0; i < y.size(); ++i) correction_[i] = y[i] - correction_[i];
    loops_.correction_total += relative_tolerance_ * (*norm_)(y, correction_);
    if (result.converged) return true;
    broken_off_ =
        dynamics_.loops()->contradiction() > loop_limits::kContradiction ? contradiction(t) : unclosed(t, result);
    return true;
  }

  // Why loops could not be closed.
  std::string contradiction(double t) const {
    return fmt::format(
        "joints that move as prescribed contradict the closed loops at t = {:.9g} s: {} by {:.3g} of the "
        "velocities there (rank {} of {} rows)",
        t, dynamics_.loops()->contradicting_row(), dynamics_.loops()->contradiction(), dynamics_.loops()->rank(),
        dynamics_.loops()->rows());
  }
  std::string unclosed(double t, const ProjectionResult& result) const {
    return fmt::format(
        "the loops cannot be closed at t = {:.9g} s: {:.3g} m and {:.3g} rad remain after projection (rank {} of {} "
        "rows, least pivot {:.2g})",
        t, result.after.position, result.after.angle, dynamics_.loops()->rank(), dynamics_.loops()->rows(),
        dynamics_.loops()->min_pivot());
  }

  void step() {
    const double end = stepper_.end_time();
    if (parting_) stepper_.set_end_time(*parting_);
    stepper_.step(dynamics_);
    if (parting_ && usable()) stepper_.set_end_time(end);
    parting_.reset();
    if (!usable() || !dynamics_.loops()) return;
    std::copy(stepper_.state().begin(), stepper_.state().end(), y_.begin());
    if (close_loops(stepper_.time(), y_, loop_limits::kNegligible) && usable()) stepper_.set_state(dynamics_, y_);
  }

  void check(double t, std::span<const double> y) {
    watch_.check(t, dynamics_.state(t, y), dynamics_.integrals(y));
    pass_checks(t);
  }
  void pass_checks(double t) {
    while ((next_check_ - t) * direction_ <= 0 && between_checks_ != 0) next_check_ += between_checks_;
  }

  // The observation between two steps; the end has a separate one.
  void observe_between_steps(double t) {
    if (watch_.each_step) watch_.each_step(t);
    if (watch_.check && stepper_.status() == StepStatus::running && (t - next_check_) * direction_ >= 0)
      check(t, stepper_.state());
  }

  // Of the next step.
  double expected_step() const {
    if constexpr (requires { stepper_.proposed_step(); })
      return std::min(stepper_.proposed_step(), std::abs(stepper_.end_time() - stepper_.time()));
    else
      return std::numeric_limits<double>::infinity();
  }

  bool may_stop() const { return stop_ || stop_on_load_; }

  // The smaller of both conditions' values.
  double margin(double t, std::span<const double> y) {
    double least = std::numeric_limits<double>::infinity();
    if (stop_) least = stop_(t, dynamics_.state(t, y));
    if (stop_on_load_) least = std::min(least, stop_on_load_(sample(t, y)));
    return least;
  }

  // Integrates the smooth interval that begins at `begin`, with its samples, except the one at its end. `smooth_end`:
  // the end of the interval if no actuator switches.
  void cross_interval(double begin, double smooth_end) {
    if (!usable()) return;
    if (may_stop() && margin(begin, stepper_.state()) <= 0) return end_at(begin, stepper_.state());
    if (outputs_[next_] == begin && stepper_.status() == StepStatus::running) output(begin, stepper_.state());
    dynamics_.begin_step(begin, stepper_.state(), expected_step());
    while (stepper_.status() == StepStatus::running) {
      step();
      if (!usable()) return;
      std::optional<EventLocation> hit, switched;
      if (may_stop()) {
        const auto g = [&](double t, std::span<const double> y) { return margin(t, y); };
        hit = locator_.find(stepper_, dynamics_, g, Crossing::falling);
      }
      // Velocities inside of an accepted step do not exceed those at its ends by more than ContactSet::kFaster: it is
      // shorter than half a period of any vibration that exceeds its tolerance.
      const double duration = stepper_.time() - stepper_.previous_time();
      if (dynamics_.switches() && dynamics_.end_step(stepper_.time(), stepper_.state(), duration, expected_step())) {
        const auto g = [&](double t, std::span<const double> y) { return dynamics_.switch_margin(t, y); };
        switched = switch_locator_.find(stepper_, dynamics_, g, Crossing::falling);
      }
      if (hit && switched) ((hit->time - switched->time) * direction_ <= 0 ? switched : hit).reset();
      if (!hit && !switched) observe_between_steps(stepper_.time());
      const double reached = hit ? hit->time : switched ? switched->time : stepper_.time();
      if (watch_.probe) probe_step(reached);
      while (next_ < outputs_.size() && (reached - outputs_[next_]) * direction_ > 0) {
        stepper_.interpolate(dynamics_, outputs_[next_], std::span<double>(y_));
        output(outputs_[next_], y_);
      }
      if (hit) return end_at(hit->time, locator_.state());
      if (!switched) parting_ = next_parting();
      if (switched) switch_at(switched->time, smooth_end);
      if (!usable()) return;
      if (switched && may_stop() && margin(reached, y_) <= 0) return end_at(reached, y_);
      if (stepper_.status() == StepStatus::running && outputs_[next_] == reached) output(reached, stepper_.state());
    }
  }

  // The last step => where the next step must end, if a contact probably ends soon. Forces have a kink there, and error
  // control would reject every step across it that ends much later. The overlap is extrapolated from the last step. The
  // first step ends somewhat before its zero; from there the extrapolation is accurate, and the next one ends just
  // after it. Fixed steps are not shortened.
  std::optional<double> next_parting() {
    if constexpr (!requires { stepper_.propose_step(0.0); }) return std::nullopt;
    constexpr double kNear = 0.05, kBefore = 0.99, kAfter = 1.001, kNegligible = 1e-4;
    if (stepper_.status() != StepStatus::running) return std::nullopt;
    const double t = stepper_.time(), h = t - stepper_.previous_time();
    if (!dynamics_.may_part(std::abs(h))) return std::nullopt;
    const double left = parts_until_zero() / kParts;  // in steps
    if (!(left > kNegligible) || !(left * std::abs(h) > 1e-10 * std::abs(t))) return std::nullopt;
    const double next = t + left * h * (left > kNear ? kBefore : kAfter);
    return (stepper_.end_time() - next) * direction_ > 0 ? std::optional(next) : std::nullopt;
  }

  // Overlaps at the ends of equal parts of the last step => the number of parts until their polynomial is zero, at most
  // two steps; infinite if it is not.
  double parts_until_zero() {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const double t = stepper_.time(), part = (t - stepper_.previous_time()) / kParts;
    std::array<double, kParts + 1> g;  // backward differences
    g[0] = dynamics_.least_overlap(t, stepper_.state());
    if (!(g[0] > 0) || !std::isfinite(g[0])) return kNever;
    for (int i = 1; i <= kParts; ++i) {
      stepper_.interpolate(dynamics_, i == kParts ? stepper_.previous_time() : t - part * i, std::span<double>(y_));
      g[i] = dynamics_.least_overlap(t - part * i, y_);
      if (i == 1 && !(g[0] < 4 * kParts * (g[1] - g[0]))) return kNever;
    }
    for (int order = 1; order <= kParts; ++order) {
      for (int i = kParts; i >= order; --i) g[i] = g[i - 1] - g[i];
    }
    const auto overlap = [&](double x) {  // Newton's interpolation
      double sum = g[kParts];
      for (int i = kParts - 1; i >= 0; --i) sum = g[i] + sum * (x + i) / (i + 1);
      return sum;
    };
    for (double x = 0; x < 2 * kParts; x += 0.25) {
      if (const double after = overlap(x + 0.25); !(after > 0))
        return shrink_bracket(overlap, {x, overlap(x), x + 0.25, after}, 1e-12).end;
    }
    return kNever;
  }

  void apply_contact_impacts(double t, std::span<double> y) {
    if (std::string fault = dynamics_.apply_contact_impacts(t, y); !fault.empty()) broken_off_ = std::move(fault);
    if (watch_.impact && dynamics_.hard_impact()) watch_.impact(*dynamics_.hard_impact());
  }

  // Modes of actuators or joints change inside the last step, which ends there; the motion restarts.
  void switch_at(double t, double smooth_end) {
    constexpr long kMaxSwitches = 100'000;
    if (++switches_ > kMaxSwitches) {
      broken_off_ = fmt::format(
          "reaction wheels, thrusters, joints or contacts (at maximum rates, levels, stops, in static friction or "
          "touching) change their modes more than {} times up to t = {:.9g} s",
          kMaxSwitches, t);
      if (const std::string busiest = dynamics_.busiest_hard_contact(); !busiest.empty())
        broken_off_ += "; hard contacts: " + busiest;
      return;
    }
    y_.assign(switch_locator_.state().begin(), switch_locator_.state().end());
    apply_contact_impacts(t, y_);
    if (!broken_off_.empty()) return;
    dynamics_.apply_stop_impacts(t, y_);
    dynamics_.choose_modes(t, y_);
    const double end = dynamics_.next_edge(t, smooth_end);
    count_steps(t);
    stepper_.start(dynamics_, t, y_, end);
    dynamics_.begin_step(t, y_, expected_step());
    parting_.reset();
    fresh_ = true;
  }

  // Adds the stepper's statistics since its start; its last step is used up to t.
  void count_steps(double t) {
    const IntegrationStatistics now = stepper_.statistics();
    done_.rhs_evaluations += now.rhs_evaluations;
    done_.accepted += now.accepted;
    done_.rejected += now.rejected;
    done_.sum_of_error_estimates += now.sum_of_error_estimates;
    done_.largest_quaternion_defect = std::max(done_.largest_quaternion_defect, now.largest_quaternion_defect);
    if constexpr (requires { stepper_.implicit_spans(); }) {
      implicit_steps_ += static_cast<long>(stepper_.implicit_steps());
      for (const auto& [begin, end] : stepper_.implicit_spans()) {
        if (!implicit_spans_.empty() && implicit_spans_.back()[1] == begin)
          implicit_spans_.back()[1] = std::min(end, t);
        else
          implicit_spans_.push_back({begin, std::min(end, t)});
      }
    }
  }

  // Evaluates the last step, up to the end of the phase.
  void probe_step(double end) {
    const std::function<PhaseSample(double)> at = [&](double t) {
      probed_.assign(stepper_.state().begin(), stepper_.state().end());
      if (t != stepper_.time()) stepper_.interpolate(dynamics_, t, std::span<double>(probed_));
      return sample(t, probed_);
    };
    const std::function<const State&(double)> state_at = [&](double t) -> const State& {
      probed_.assign(stepper_.state().begin(), stepper_.state().end());
      if (t != stepper_.time()) stepper_.interpolate(dynamics_, t, std::span<double>(probed_));
      return dynamics_.state(t, probed_);
    };
    watch_.probe({stepper_.previous_time(), end, fresh_, at, state_at});
    fresh_ = false;
  }

  void end_at(double t, std::span<const double> y) {
    stop_time_ = t;
    if (y.data() != y_.data()) std::copy(y.begin(), y.end(), y_.begin());
    if (stop_on_load_) stop_on_load_(sample(t, y_));
    output(t, y_);
  }

  // The next sample.
  void output(double t, std::span<const double> y) {
    ++next_;
    if (watch_.check) check(t, y);
    if (observe_) observe_(sample(t, y));
  }

  PhaseSample sample(double t, std::span<const double> y) {
    dynamics_.efforts(t, y, motor_, friction_);
    integrals_ = dynamics_.integrals(y);
    return {t, dynamics_.evaluated_state(), integrals_, motor_, friction_, &dynamics_};
  }

  // Final status of stepper, stop and controller => state, integrals, step counts and, for a failure, its message with
  // the rank of the closures at that time.
  PhaseOutcome outcome() {
    const double t = stop_time_.value_or(stepper_.time());
    const std::span<const double> y = stop_time_ ? std::span<const double>(y_) : stepper_.state();
    count_steps(t);
    dynamics_.end_control(t);
    PhaseOutcome outcome;
    outcome.stopped = stop_time_.has_value() && broken_off_.empty();
    outcome.finished = broken_off_.empty() && (outcome.stopped || stepper_.status() == StepStatus::finished);
    if (!outcome.finished) outcome.failure = broken_off_.empty() ? stepper_.explanation() : broken_off_;
    if (!outcome.finished && !dynamics_.loop_failure().empty()) {
      outcome.failure += "; " + dynamics_.loop_failure();
    } else if (!outcome.finished && broken_off_.empty() && dynamics_.loops()) {
      outcome.failure += fmt::format(
          "; closed loops there: rank {} of {} rows ({} as the phase began), least pivot {:.2g} (small: near a "
          "singular configuration)",
          dynamics_.loops()->rank(), dynamics_.loops()->rows(), loops_.rank, dynamics_.loops()->min_pivot());
    }
    outcome.loops = loops_;
    outcome.loops.integration_error = relative_tolerance_ * done_.sum_of_error_estimates +
                                      loop_limits::kRoundingOfStep * static_cast<double>(done_.accepted + 1);
    outcome.end_time = t;
    outcome.end_state = dynamics_.state(t, y);
    outcome.integrals = dynamics_.integrals(y);
    outcome.momentum_corrected = dynamics_.momentum_corrected(y);
    outcome.rhs_evaluations = static_cast<long>(done_.rhs_evaluations);
    outcome.steps = static_cast<long>(done_.accepted);
    outcome.rejected = static_cast<long>(done_.rejected);
    outcome.implicit_steps = implicit_steps_;
    outcome.implicit_spans = implicit_spans_;
    outcome.quaternion_defect = done_.largest_quaternion_defect;
    dynamics_.leave_interval();
    return outcome;
  }

  Method& stepper_;
  PhaseDynamics& dynamics_;
  const std::function<void(const PhaseSample&)>& observe_;
  const StepWatch& watch_;
  const StopCondition& stop_;
  const LoadCondition& stop_on_load_;
  const std::optional<PhaseResumption>& resumed_;
  EventLocator<double> locator_, switch_locator_;
  IntegrationStatistics done_;  // before the stepper's last start
  long switches_ = 0;
  long implicit_steps_ = 0;
  std::vector<std::array<double, 2>> implicit_spans_;
  std::optional<ErrorNorm<double>> norm_;  // with loops
  double relative_tolerance_;
  LoopOutcome loops_;
  std::string broken_off_;  // the reason, if not in the stepper's status
  std::vector<double> correction_;
  std::vector<double> y_;       // at a sample inside a step; at the stop
  std::vector<double> probed_;  // inside an evaluated step
  std::vector<double> motor_, friction_;
  PhaseIntegrals integrals_;
  bool fresh_ = true;  // an interval's first step
  OutputTimes outputs_;
  std::size_t next_ = 0;  // index in outputs_
  double direction_ = 1;
  double next_check_ = 0, between_checks_ = 0;
  static constexpr int kParts = 4;  // of a step, to extrapolate overlaps
  std::optional<double> parting_;   // end of the next step, where a contact ends
  std::optional<double> stop_time_;
};

}  // namespace

// Dynamics, interval and settings => outcome, with the stepper of `integration`.
PhaseOutcome simulate_phase(PhaseDynamics& dynamics, const PhaseInterval& interval, const IntegrationSetup& integration,
                            const PhaseObservers& observers) {
  using Method = IntegrationSetup::Method;
  const Tolerances tolerances = dynamics.tolerances(integration.relative_tolerance, integration.absolute_tolerance);
  if (integration.method == Method::rk4) {
    RungeKutta4<double> stepper(dynamics.manifold(), integration.step);
    return PhaseRun(stepper, dynamics, tolerances, observers).run(interval);
  }
  StepControl control;
  if (integration.max_step > 0) control.max_step = integration.max_step;
  control.max_steps = integration.max_steps;
  control.predictive = integration.predictive;
  // Without contacts motion is rarely stiff, and steps are those of SIMD lanes.
  const bool may_be_stiff = dynamics.setup().contacts != nullptr;
  if (integration.method == Method::adaptive_8 || (integration.method == Method::automatic && !may_be_stiff)) {
    DormandPrince853<double> stepper(dynamics.manifold(), tolerances, control);
    return PhaseRun(stepper, dynamics, tolerances, observers).run(interval);
  }
  AutomaticStepper stepper(
      dynamics.manifold(), tolerances, control,
      integration.method == Method::radau_9 ? AutomaticStepper::Choice::implicit : AutomaticStepper::Choice::automatic);
  return PhaseRun(stepper, dynamics, tolerances, observers).run(interval);
}

}  // namespace grapnel
