#pragma once

/// @file
/// Integrates the cases of one structure in lanes, with the steps of integrate/dormand_prince_853_kernel.hpp. Every
/// lane has its own time, step size, error estimate and interval, of which DormandPrince853 has one each. A lane takes
/// the next case as soon as its case ends, so lanes stay occupied. The result of a case depends on this case alone.

#include "grapnel/integrate/dormand_prince_853_kernel.hpp"
#include "grapnel/lanes/lane_conservation.hpp"
#include "grapnel/lanes/lane_dynamics.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

// The error norm of integrate/dormand_prince_853.hpp in packs; its definition and derivation are given there.
// Implemented separately, since with one tolerance for all numbers both error estimates share their divisions.

/// Sums of (difference/scale)^2 over a state.
template <class S>
class LaneErrorNorm {
 public:
  LaneErrorNorm(const PhaseTables& tables, int size)
      : tables_(tables),
        size_(size),
        is_ordinary_(size),
        inverse_angle_(1.0 / (tables.absolute_tolerance + tables.relative_tolerance)) {
    for (int i = 0; i < size; ++i) is_ordinary_[i] = 1;
    for (int k = 0; k < tables.quaternion_count; ++k) {
      for (int i = 0; i < 4; ++i) is_ordinary_[tables.quaternions[k] + i] = 0;
    }
  }

  /// Sums for two differences of the states y0 and y1 simultaneously.
  void sums(const S* y0, const S* y1, const S* a, const S* b, S& sum_a, S& sum_b) const {
    const S rtol(tables_.relative_tolerance), atol(tables_.absolute_tolerance);
    sum_a = sum_b = S(0.0);
    for (int i = 0; i < size_; ++i) {
      if (is_ordinary_[i] == 0) continue;
      const S inverse = S(1.0) / S(rtol * max(abs(y0[i]), abs(y1[i])) + atol);
      const S ratio_a = a[i] * inverse, ratio_b = b[i] * inverse;
      sum_a += ratio_a * ratio_a;
      sum_b += ratio_b * ratio_b;
    }
    for (int k = 0; k < tables_.quaternion_count; ++k) {
      const int offset = tables_.quaternions[k];
      add_rotation(y1 + offset, a + offset, sum_a);
      add_rotation(y1 + offset, b + offset, sum_b);
    }
  }

  /// Root mean squares of a difference at y and of y itself.
  S of(const S* y, const S* difference) const {
    S sum, same;
    sums(y, y, difference, difference, sum, same);
    return root_mean(sum);
  }
  S magnitude(const S* y) const {
    S sum(0.0);
    for (int i = 0; i < size_; ++i) {
      if (is_ordinary_[i] == 0) continue;
      const S ratio = y[i] / S(S(tables_.relative_tolerance) * abs(y[i]) + S(tables_.absolute_tolerance));
      sum += ratio * ratio;
    }
    return root_mean(sum + S(3.0 * tables_.quaternion_count * inverse_angle_ * inverse_angle_));
  }

 private:
  GRAPNEL_INLINE S root_mean(const S& sum) const {
    return tables_.dimension == 0 ? S(0.0) : sqrt(S(sum * S(1.0 / tables_.dimension)));
  }
  // Contribution of a quaternion: its difference as the rotation vector 2 Im(conj(q) d).
  GRAPNEL_INLINE void add_rotation(const S* q, const S* d, S& sum) const {
    const S twice(2.0 * inverse_angle_);
    const S x = (q[0] * d[1] - d[0] * q[1]) - (q[2] * d[3] - q[3] * d[2]);
    const S y = (q[0] * d[2] - d[0] * q[2]) - (q[3] * d[1] - q[1] * d[3]);
    const S z = (q[0] * d[3] - d[0] * q[3]) - (q[1] * d[2] - q[2] * d[1]);
    const S rx = twice * x, ry = twice * y, rz = twice * z;
    sum += rx * rx;
    sum += ry * ry;
    sum += rz * rz;
  }

  const PhaseTables& tables_;
  int size_;
  LaneArray<S, std::uint8_t> is_ordinary_;
  double inverse_angle_;
};

/// State of one lane's case; the tag separates the symbol names of different instruction sets.
template <class S>
struct LaneState {
  bool active = false;
  bool rejected = false;    // since the last accepted step
  bool finite = true;       // whether the last rejected step was finite
  bool last = false;        // the present step ends the interval, or at an edge inside it
  bool broken = false;      // the derivative at its start is not finite
  bool runs_away = false;   // sampled control is unstable
  bool broken_off = false;  // by an exception of the case's control
  bool refused = false;     // the present step is not accepted, or the case may not begin
  bool leaves = false;      // refused because a wheel approaches its maximum rate
  bool in_doubt = false;    // closed loops are near a change of rank, or cannot be closed
  CaseRecord record{};
  const LaneInterval* interval = nullptr;
  double time = 0;
  double step = 0;      // present step size
  double until = 0;     // next change of the active command
  double end = 0;       // end time of the present step
  double wanted = 0;    // its size before it was fitted to the interval's end
  double proposed = 0;  // size of the next step
  dop853::AcceptedStep before{};
  double first = 0;    // first size tried for the present step
  double longest = 0;  // maximum step
  double defect = 0;   // maximum norm error of a quaternion
  std::int64_t accepted = 0, rejections = 0, evaluations = 0;
};

template <class S>
class LaneStepper {
 public:
  static constexpr int kWidth = S::kWidth;
  using Mask = typename S::Mask;

  LaneStepper(const PhaseTables& tables, CaseExchange& exchange);
  /// Integrates until no case remains.
  void run();

 private:
  /// x^(-1/8) from exactly rounded operations only: identical on all machines.
  static double inverse_eighth_root(double x) { return 1.0 / __builtin_sqrt(__builtin_sqrt(__builtin_sqrt(x))); }

  S* stage(int number) { return stages_.data() + (number - 1) * size_; }
  bool take(int lane);
  void store_as_model(int lane);
  void rest(int lane);
  void begin(unsigned starting);
  void choose_first_steps(unsigned starting);
  void finish(int lane, LaneStatus status);
  bool plan();
  bool plan_lane(LaneState<S>& lane, LaneStatus& status) const;
  void attempt();
  S normalize(S* y) const;
  Mask finite(const S* y) const;
  void judge(unsigned accepted, unsigned good, const S& error, const S& defect);
  const double* block_of(const LaneState<S>& lane, const LaneInterval& interval) const {
    return lane.record.blocks + static_cast<long>(interval.block) * tables_.block_size;
  }
  // Whether the present step ends at a break followed by another interval, or at an edge inside one.
  static bool enters(const LaneState<S>& lane) { return lane.last && lane.end != lane.record.end_time; }
  // The interval that follows.
  static const LaneInterval& following(const LaneState<S>& lane) {
    return lane.end == lane.interval->end ? lane.interval[1] : *lane.interval;
  }
  S enter_intervals(unsigned accepted);
  unsigned mark_refused(unsigned lanes, const S* y);
  unsigned near_largest_rate(unsigned lanes, const S* y, const S* y_end, const S* dydt, const S* dydt_end, const S& h);
  void take_commands(unsigned beginning, unsigned entering, const S& t, S* y);
  void request_command(int lane, bool is_first, const LaneInterval& interval, const S* y);
  bool has_loops() { return dynamics_.loops().any(); }
  void settle(unsigned lanes, const S& t, S* y, double negligible);
  void leave_in_doubt(unsigned lanes);
  void note_loops(unsigned accepted, const Mask& good, const S& error);
  void check_conservation(const S& h);
  // Momentum and energy of the present states, per tree.
  void measure(PackTree<S>* trees) {
    const std::span<const S> q = dynamics_.coordinates(y_.data());
    conservation_(
        dynamics_.tree(), q, dynamics_.velocities(y_.data()),
        [&](int link) { return dynamics_.spring_energy(link, q); }, trees);
  }
  LaneDefect<S> loop_defects() {
    return conservation_.loop_defects([&](int k) -> const LaneClosure<S>& { return dynamics_.loops().closure(k); });
  }
  PackIntegrals<S> since_start(int tree) const;
  void show(unsigned lanes, const S* y);
  // Copies a lane's coordinates and velocities to result_q_ and result_v_.
  void take_out(int l, const S* y) {
    for (int i = 0; i < tables_.coordinates; ++i) result_q_[i] = y[i].get(l);
    for (int i = 0; i < tables_.velocities; ++i) result_v_[i] = y[tables_.coordinates + i].get(l);
  }

  const PhaseTables& tables_;
  CaseExchange& exchange_;
  LaneDynamics<S> dynamics_;
  LaneConservation<S> conservation_;
  int size_;
  int integrals_;  // their offset in y
  LaneErrorNorm<S> norm_;
  LaneState<S> lanes_[kWidth];
  LaneArray<S> y_, trial_, end_, stages_, error3_, error5_;
  LaneArray<S, double> result_q_, result_v_, result_motor_, result_integrals_, result_commands_;
  // A valid case for idle lanes: non-finite numbers would slow down the arithmetic.
  bool has_model_ = false;
  double model_time_ = 0;
  LaneArray<S, double> model_links_, model_noise_, model_outside_, model_loops_, model_block_, model_y_;
  LaneArray<S, PackTree<S>> start_trees_, now_trees_, fresh_trees_;  // per tree
  LaneArray<S, PackDeviation<S>> deviations_;
  LaneArray<S, LaneTreeRecord> result_trees_;
  LaneArray<S> exchange_rates_;  // phase_integral::kExchangeCount per tree
  // Loop closure statistics; see LaneLoopRecord.
  LaneProjection<S> projection_;  // of the last step
  S correction_ = S(0.0);         // its size
  LaneDefect<S> unprojected_ = LaneDefect<S>::none(), open_ = LaneDefect<S>::none();
  S rank_ = S(0.0), corrections_ = S(0.0), error_estimates_ = S(0.0);
};

/// The entry point of an instruction set.
template <class S>
void run_lane_phase(const PhaseTables& tables, CaseExchange& exchange) {
  LaneStepper<S> stepper(tables, exchange);
  stepper.run();
}

template <class S>
LaneStepper<S>::LaneStepper(const PhaseTables& tables, CaseExchange& exchange)
    : tables_(tables),
      exchange_(exchange),
      dynamics_(tables),
      conservation_(tables),
      size_(dynamics_.size()),
      integrals_(tables.coordinates + tables.velocities),
      norm_(tables, size_),
      y_(size_),
      trial_(size_),
      end_(size_),
      stages_(13 * size_),
      error3_(size_),
      error5_(size_),
      result_q_(tables.coordinates),
      result_v_(tables.velocities),
      result_motor_(tables.link_count),
      result_integrals_(tables.integral_count),
      result_commands_(tables.control.command_numbers() * (1 + tables.control.max_delayed_count)),
      model_links_(tables.link_count * kLinkNumbers),
      model_noise_(tables.noise_numbers),
      model_outside_(tables.outside_numbers),
      model_loops_(tables.loop_count * kLoopNumbers),
      model_block_(tables.block_size),
      model_y_(size_),
      start_trees_(tables.tree_count),
      now_trees_(tables.tree_count),
      fresh_trees_(tables.tree_count),
      deviations_(tables.tree_count),
      result_trees_(tables.tree_count),
      exchange_rates_(phase_integral::kExchangeCount * tables.tree_count) {}

// --- Start and end of cases in lanes. --------------------------------------------------------------------------------

template <class S>
void LaneStepper<S>::run() {
  unsigned starting = 0;
  for (int l = 0; l < kWidth; ++l) {
    if (take(l)) starting |= 1U << l;
  }
  if (starting == 0) return;
  begin(starting);
  for (int l = 0; l < kWidth; ++l) {
    if (!lanes_[l].active) rest(l);
  }
  while (plan()) attempt();
}

// Loads the next case into a lane; false if there is none.
template <class S>
bool LaneStepper<S>::take(int l) {
  LaneState<S>& lane = lanes_[l];
  lane = {};
  if (!exchange_.next(exchange_.context, l, lane.record)) return false;
  lane.active = true;
  lane.interval = lane.record.intervals;
  lane.time = lane.end = lane.record.start_time;
  lane.until = lane.interval->end;
  lane.longest = dop853::smaller(dop853::smaller(tables_.max_step, lane.record.max_step),
                                 LaneDynamics<S>::longest_step(tables_, lane.record));
  dynamics_.load_case(l, lane.record);
  dynamics_.load_block(l, block_of(lane, *lane.interval));
  for (int i = 0; i < tables_.coordinates; ++i) y_[i].set(l, lane.record.q[i]);
  for (int i = 0; i < tables_.velocities; ++i) y_[tables_.coordinates + i].set(l, lane.record.v[i]);
  for (int i = integrals_; i < size_; ++i) y_[i].set(l, 0.0);
  return true;
}

template <class S>
void LaneStepper<S>::store_as_model(int l) {
  const CaseRecord& record = lanes_[l].record;
  for (int i = 0; i < model_links_.size(); ++i) model_links_[i] = record.links[i];
  for (int i = 0; i < model_noise_.size(); ++i) model_noise_[i] = record.noise[i];
  for (int i = 0; i < model_outside_.size(); ++i) model_outside_[i] = record.outside[i];
  for (int i = 0; i < tables_.loop_count * kLoopNumbers; ++i) model_loops_[i] = record.loops[i];
  for (int i = 0; i < model_block_.size(); ++i) model_block_[i] = block_of(lanes_[l], *record.intervals)[i];
  for (int i = 0; i < size_; ++i) model_y_[i] = y_[i].get(l);
  model_time_ = record.start_time;
  has_model_ = true;
}

// Loads valid numbers into an idle lane.
template <class S>
void LaneStepper<S>::rest(int l) {
  lanes_[l] = {};
  if (!has_model_) return;
  CaseRecord record{};
  record.links = model_links_.data();
  record.noise = model_noise_.data();
  record.outside = model_outside_.data();
  record.loops = model_loops_.data();
  dynamics_.load_case(l, record);
  dynamics_.load_block(l, model_block_.data());
  for (int i = 0; i < size_; ++i) {
    y_[i].set(l, model_y_[i]);
    stage(1)[i].set(l, 0.0);
  }
  lanes_[l].time = lanes_[l].end = model_time_;
}

// The start of cases: conserved momenta, derivative, conservation checks, first step.
template <class S>
void LaneStepper<S>::begin(unsigned starting) {
  const Mask lanes = Mask::from_bits(starting);
  S t;
  for (int l = 0; l < kWidth; ++l) t.set(l, lanes_[l].time);
  for (int i = 0; i < size_; ++i) trial_[i] = y_[i];
  normalize(trial_.data());
  dynamics_.enter_step(t, S(0.0));
  dynamics_.remember_momenta(lanes, t, trial_.data());
  dynamics_.loops().take_doubts();
  settle(starting, t, trial_.data(), 0);
  for (int i = 0; i < size_; ++i) trial_[i] = y_[i] = select(lanes, trial_[i], y_[i]);
  take_commands(starting, 0, t, trial_.data());
  dynamics_(t, trial_.data(), stage(13));
  if (has_loops()) {
    leave_in_doubt(starting);
    rank_ = select(lanes, dynamics_.loops().rank(), rank_);
    unprojected_.take(lanes, projection_.before);
    corrections_ = select(lanes, correction_, corrections_);
    error_estimates_ = select(lanes, S(0.0), error_estimates_);
  }
  for (int i = 0; i < size_; ++i) stage(1)[i] = select(lanes, stage(13)[i], stage(1)[i]);
  const unsigned sound = finite(stage(1)).bits();
  mark_refused(starting & sound, trial_.data());
  show(starting & sound, trial_.data());
  for (int l = 0; l < kWidth; ++l) {
    if (((starting >> l) & 1U) == 0) continue;
    lanes_[l].evaluations = 1;
    lanes_[l].broken = ((sound >> l) & 1U) == 0;
    if (!has_model_ && !lanes_[l].broken) store_as_model(l);
  }
  measure(fresh_trees_.data());
  for (int i = 0; i < tables_.tree_count; ++i) {
    start_trees_[i].take(lanes, fresh_trees_[i]);
    now_trees_[i].take(lanes, fresh_trees_[i]);
    deviations_[i].begin(lanes, fresh_trees_[i].size);
  }
  if (has_loops()) open_.take(lanes, loop_defects());
  near_largest_rate(starting, y_.data(), y_.data(), stage(1), stage(1), S(0.0));
  choose_first_steps(starting);
}

// The lanes, among these, whose step to the state y is refused, so that their cases end before it.
template <class S>
unsigned LaneStepper<S>::mark_refused(unsigned lanes, const S* y) {
  if (exchange_.counts == nullptr) return 0;
  unsigned refused = 0;
  for (int l = 0; l < kWidth; ++l) {
    if (((lanes >> l) & 1U) == 0) continue;
    take_out(l, y);
    lanes_[l].refused = !exchange_.counts(exchange_.context, l, lanes_[l].end, result_q_.data(), result_v_.data());
    if (lanes_[l].refused) refused |= 1U << l;
  }
  return refused;
}

// The lanes, among these, in which a wheel may have reached its maximum rate between two states.
template <class S>
unsigned LaneStepper<S>::near_largest_rate(unsigned lanes, const S* y, const S* y_end, const S* dydt, const S* dydt_end,
                                           const S& h) {
  if (!dynamics_.wheels().any()) return 0;
  const int nq = tables_.coordinates;
  const unsigned near =
      lanes & dynamics_.wheels().near_largest_rate(y + nq, y_end + nq, dydt + nq, dydt_end + nq, h).bits();
  for (int l = 0; l < kWidth; ++l) {
    if (((near >> l) & 1U) != 0) lanes_[l].refused = lanes_[l].leaves = true;
  }
  return near;
}

// Sets prescribed joints, closes the loops of these lanes, and recomputes roots from conserved momenta.
template <class S>
void LaneStepper<S>::settle(unsigned lanes, const S& t, S* y, double negligible) {
  dynamics_.put_prescribed(t, y);
  if (has_loops()) {
    for (int i = 0; i < size_; ++i) error5_[i] = y[i];
    projection_ = dynamics_.close_loops(Mask::from_bits(lanes), y, negligible);
    for (int i = 0; i < size_; ++i) error5_[i] = y[i] - error5_[i];
    correction_ = select(Mask::from_bits(projection_.changed), norm_.of(y, error5_.data()), S(0.0));
    for (int l = 0; l < kWidth; ++l) {
      if (((projection_.failed >> l) & 1U) != 0) lanes_[l].in_doubt = true;
    }
  }
  dynamics_.recover(t, y);
}

// The lanes, among these, with a doubtful rank.
template <class S>
void LaneStepper<S>::leave_in_doubt(unsigned lanes) {
  const unsigned doubts = lanes & dynamics_.loops().take_doubts();
  for (int l = 0; l < kWidth; ++l) {
    if (((doubts >> l) & 1U) != 0) lanes_[l].in_doubt = true;
  }
}

// See DormandPrince853::choose_initial_step.
template <class S>
void LaneStepper<S>::choose_first_steps(unsigned starting) {
  const S size_y = norm_.magnitude(y_.data()), size_f = norm_.of(y_.data(), stage(1));
  S t, increment(0.0);
  double euler[kWidth] = {}, longest[kWidth] = {};
  for (int l = 0; l < kWidth; ++l) {
    const LaneState<S>& lane = lanes_[l];
    t.set(l, lane.time);
    if (((starting >> l) & 1U) == 0) continue;
    longest[l] = dop853::smaller(__builtin_fabs(lane.until - lane.time), lane.longest);
    euler[l] = dop853::first_euler_step(size_y.get(l), size_f.get(l), longest[l]);
    increment.set(l, euler[l]);
  }
  for (int i = 0; i < size_; ++i) trial_[i] = increment * stage(1)[i] + y_[i];
  dynamics_.enter_step(t, increment);
  dynamics_(S(t + increment), trial_.data(), stage(13));
  if (has_loops()) leave_in_doubt(starting);
  for (int i = 0; i < size_; ++i) error5_[i] = stage(13)[i] - stage(1)[i];
  const S change = norm_.of(y_.data(), error5_.data());
  for (int l = 0; l < kWidth; ++l) {
    if (((starting >> l) & 1U) == 0) continue;
    LaneState<S>& lane = lanes_[l];
    ++lane.evaluations;
    lane.proposed = dop853::first_step(euler[l], size_f.get(l), change.get(l) / euler[l], longest[l],
                                       [](double x) { return inverse_eighth_root(100.0 * x); });
    lane.first = lane.proposed;
  }
}

// Reports the cases of these lanes in the state y, which was evaluated last; the step that led there still counts as in
// progress.
template <class S>
void LaneStepper<S>::show(unsigned lanes, const S* y) {
  if (exchange_.observe == nullptr) return;
  for (int l = 0; l < kWidth; ++l) {
    if (((lanes >> l) & 1U) == 0) continue;
    take_out(l, y);
    for (int i = 0; i < tables_.link_count; ++i) result_motor_[i] = dynamics_.motor_effort(i).get(l);
    const CaseView view{lanes_[l].end, result_q_.data(), result_v_.data(), result_motor_.data()};
    exchange_.observe(exchange_.context, l, view);
  }
}

template <class S>
void LaneStepper<S>::finish(int l, LaneStatus status) {
  const LaneState<S>& lane = lanes_[l];
  take_out(l, y_.data());
  CaseResult result{};
  result.status = status;
  result.time = lane.time;
  result.q = result_q_.data();
  result.v = result_v_.data();
  for (int i = 0; i < tables_.integral_count; ++i) result_integrals_[i] = y_[integrals_ + i].get(l);
  result.integrals = result_integrals_.data();
  result.steps = lane.accepted;
  result.rejected = lane.rejections;
  result.evaluations = lane.evaluations;
  result.next_step = lane.first;
  result.quaternion_defect = lane.defect;
  for (int i = 0; i < tables_.tree_count; ++i) result_trees_[i] = deviations_[i].get(l, start_trees_[i], now_trees_[i]);
  result.trees = result_trees_.data();
  if (has_loops()) {
    result.loops = {rank_.get(l), unprojected_.get(l), open_.get(l), corrections_.get(l), error_estimates_.get(l)};
  }
  if (tables_.control.is_sampled && !tables_.control.by_case) dynamics_.commands().write(l, result_commands_.data());
  result.commands = result_commands_.data();
  result.delayed_count = dynamics_.commands().delayed_count(l);
  exchange_.done(exchange_.context, l, result);
}

// Fits the next step of every lane; ended cases are replaced. False if none is left.
template <class S>
bool LaneStepper<S>::plan() {
  for (;;) {
    unsigned starting = 0;
    bool any_left = false;
    for (int l = 0; l < kWidth; ++l) {
      if (!lanes_[l].active) continue;
      LaneStatus status = LaneStatus::finished;
      if (plan_lane(lanes_[l], status)) {
        any_left = true;
        continue;
      }
      finish(l, status);
      if (take(l)) {
        starting |= 1U << l;
      } else {
        rest(l);
      }
    }
    if (starting == 0) return any_left;
    begin(starting);
  }
}

// See DormandPrince853::step. False if the case ends here.
template <class S>
bool LaneStepper<S>::plan_lane(LaneState<S>& lane, LaneStatus& status) const {
  // Checks after a rejected step are void.
  if (lane.refused) return status = lane.leaves ? LaneStatus::at_largest_rate : LaneStatus::step_refused, false;
  if (lane.broken_off) return status = LaneStatus::broken_off, false;
  if (lane.runs_away) return status = LaneStatus::unstable_control, false;
  if (lane.in_doubt) return status = LaneStatus::loops_in_doubt, false;
  if (lane.broken) return status = LaneStatus::non_finite, false;
  if (lane.time == lane.record.end_time) return status = LaneStatus::finished, false;
  if (lane.accepted + lane.rejections >= tables_.max_steps) return status = LaneStatus::too_many_steps, false;
  const dop853::FittedStep fitted = dop853::fit_step(lane.proposed, lane.longest, lane.until - lane.time, lane.time);
  if (fitted.too_small) return status = lane.finite ? LaneStatus::step_too_small : LaneStatus::non_finite, false;
  lane.wanted = fitted.wanted, lane.last = fitted.last;
  lane.end = lane.last ? lane.until : lane.time + lane.wanted;
  lane.step = lane.end - lane.time;  // consistent with the rounded times, so that time does not drift
  return true;
}

// --- One step of all lanes, in lockstep. -----------------------------------------------------------------------------

// Normalizes quaternions; returns the maximum of | |q| - 1 | before. The sum is in pairs, which fuse;
// integrate/manifold.hpp adds the squares sequentially.
template <class S>
S LaneStepper<S>::normalize(S* y) const {
  S largest(0.0);
  for (int k = 0; k < tables_.quaternion_count; ++k) {
    S* q = y + tables_.quaternions[k];
    const S norm = sqrt(S((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3])));
    const S inverse = S(1.0) / norm;
    for (int i = 0; i < 4; ++i) q[i] = q[i] * inverse;
    largest = max(largest, abs(S(norm - S(1.0))));
  }
  return largest;
}

// Lanes in which all numbers of a state are finite.
template <class S>
typename LaneStepper<S>::Mask LaneStepper<S>::finite(const S* y) const {
  S sum(0.0);
  for (int i = 0; i < size_; ++i) sum += y[i] * S(0.0);
  return sum == S(0.0);
}

template <class S>
void LaneStepper<S>::attempt() {
  S t, h(0.0);
  unsigned active = 0;
  for (int l = 0; l < kWidth; ++l) {
    t.set(l, lanes_[l].time);
    if (!lanes_[l].active) continue;
    h.set(l, lanes_[l].step);
    active |= 1U << l;
  }
  dynamics_.enter_step(t, h);
  const dop853::StepStages<S> step{t, h, size_, y_.data(), trial_.data(), stages_.data()};
  dop853::evaluate_stages([&](const S& at, S* y, S* dydt) { dynamics_(at, y, dydt); }, step, end_.data(),
                          error5_.data(), error3_.data());
  S sum5, sum3;
  norm_.sums(y_.data(), end_.data(), error5_.data(), error3_.data(), sum5, sum3);
  const S error = dop853::combined_error(h, sum5, sum3, tables_.dimension);
  unsigned accepted = active & (error <= S(1.0)).bits();
  if (has_loops()) leave_in_doubt(active);
  unsigned good = 0;
  S defect(0.0);
  if (accepted != 0) {
    defect = normalize(end_.data());
    const S t_new = enter_intervals(accepted);
    settle(accepted, t_new, end_.data(), loop_limits::kNegligible);
    accepted &= ~mark_refused(accepted, end_.data());
    unsigned entering = 0;
    for (int l = 0; l < kWidth; ++l) {
      if (((accepted >> l) & 1U) != 0 && enters(lanes_[l])) entering |= 1U << l;
    }
    take_commands(0, entering, t_new, end_.data());
    dynamics_(t_new, end_.data(), stage(13));
    good = accepted & finite(stage(13)).bits() & (defect <= S(dop853::kLargestDefect)).bits();
    const unsigned near = near_largest_rate(good, y_.data(), end_.data(), stage(1), stage(13), h);
    for (int l = 0; l < kWidth; ++l) {
      if (((near & entering) >> l & 1U) != 0) dynamics_.commands().take_back(l);
    }
    good &= ~near;
    show(good, end_.data());
    const Mask lanes = Mask::from_bits(good);
    if (has_loops()) note_loops(accepted, lanes, error);
    for (int i = 0; i < size_; ++i) {
      y_[i] = select(lanes, end_[i], y_[i]);
      stage(1)[i] = select(lanes, stage(13)[i], stage(1)[i]);
    }
    dynamics_.exchange_rates(end_.data(), exchange_rates_.data());
    check_conservation(select(lanes, h, S(0.0)));
  }
  judge(accepted, good, error, defect);
}

// Size of the loop corrections in the last step.
template <class S>
void LaneStepper<S>::note_loops(unsigned accepted, const Mask& good, const S& error) {
  leave_in_doubt(accepted);
  LaneDefect<S> largest = unprojected_;
  largest.raise(projection_.before);
  unprojected_.take(good, largest);
  corrections_ = select(good, S(corrections_ + correction_), corrections_);
  error_estimates_ = select(good, S(error_estimates_ + error), error_estimates_);
}

// After an accepted step that ends at a break, evaluates the derivative with the following interval; it is the first
// stage of the next step.
template <class S>
S LaneStepper<S>::enter_intervals(unsigned accepted) {
  S t;
  for (int l = 0; l < kWidth; ++l) {
    LaneState<S>& lane = lanes_[l];
    t.set(l, lane.active ? lane.end : lane.time);
    if (((accepted >> l) & 1U) == 0 || !enters(lane) || following(lane).block == lane.interval->block) continue;
    dynamics_.load_block(l, block_of(lane, following(lane)));
  }
  return t;
}

// At the begin of an interval of a lane's case: obtains the case's command and its end.
template <class S>
void LaneStepper<S>::request_command(int l, bool is_first, const LaneInterval& interval, const S* y) {
  LaneState<S>& lane = lanes_[l];
  take_out(l, y);
  for (int i = 0; i < tables_.integral_count; ++i) result_integrals_[i] = y[integrals_ + i].get(l);
  const CaseTurn turn{is_first,
                      lane.end,
                      interval.end,
                      lane.record.end_time,
                      result_q_.data(),
                      result_v_.data(),
                      result_integrals_.data()};
  const double until = exchange_.turn(exchange_.context, l, turn, result_commands_.data());
  lane.broken_off = __builtin_isnan(until);
  if (lane.broken_off) return;
  lane.until = until;
  dynamics_.commands().hold(l, result_commands_.data());
}

// Sampled control in lanes that begin their first interval or enter the next one: laws are evaluated once for all lanes
// in which sensors are read, or by every case itself.
template <class S>
void LaneStepper<S>::take_commands(unsigned beginning, unsigned entering, const S& t, S* y) {
  if (!tables_.control.is_sampled) return;
  const auto interval_of = [&](int l) -> const LaneInterval& {
    return ((entering >> l) & 1U) != 0 ? following(lanes_[l]) : *lanes_[l].interval;
  };
  const unsigned changing = beginning | entering;
  if (tables_.control.by_case) {
    for (int l = 0; l < kWidth; ++l) {
      if (((changing >> l) & 1U) != 0) request_command(l, ((beginning >> l) & 1U) != 0, interval_of(l), y);
    }
    return;
  }
  unsigned sampling = 0;
  for (int l = 0; l < kWidth; ++l) {
    if (((changing >> l) & 1U) != 0 && interval_of(l).samples) sampling |= 1U << l;
  }
  if (sampling != 0) {
    S fastest(0.0);
    for (int i = 0; i < tables_.velocities; ++i) {
      if (!dynamics_.is_wheel(i))
        fastest = max(fastest, abs(y[tables_.coordinates + i]));  // wheels may rotate fast indefinitely
    }
    for (int l = 0; l < kWidth; ++l) {
      if (((sampling >> l) & 1U) != 0 && fastest.get(l) > tables_.runaway) lanes_[l].runs_away = true;
    }
    dynamics_.sample(t, y);
  }
  for (int l = 0; l < kWidth; ++l) {
    if (((changing >> l) & 1U) != 0) dynamics_.commands().enter(l, interval_of(l));
  }
}

// The step size controller, see DormandPrince853::step.
template <class S>
void LaneStepper<S>::judge(unsigned accepted, unsigned good, const S& error, const S& defect) {
  for (int l = 0; l < kWidth; ++l) {
    LaneState<S>& lane = lanes_[l];
    if (!lane.active) continue;
    const bool fits = ((accepted >> l) & 1U) != 0;
    const bool is_next = fits && enters(lane);
    lane.evaluations += 11 + (fits ? 1 : 0);
    if (lane.refused) continue;
    const double e = error.get(l);
    if (((good >> l) & 1U) != 0) {
      const double root = inverse_eighth_root(e);
      const double next = tables_.predictive ? dop853::predicted_root(lane.step, root, lane.before) : root;
      lane.proposed = dop853::size_after_accepted(lane.step, next, lane.rejected);
      lane.before = {lane.step, root};
      // A step shortened by the interval's end does not limit the next one.
      if (lane.last) lane.proposed = dop853::larger(lane.proposed, lane.wanted);
      lane.first = lane.proposed;
      lane.time = lane.end;
      ++lane.accepted;
      lane.defect = dop853::larger(lane.defect, defect.get(l));
      lane.rejected = false;
      lane.finite = true;
      if (is_next) lane.interval = &following(lane);
      if (is_next && !tables_.control.by_case) lane.until = lane.interval->end;
    } else {
      if (is_next) {
        dynamics_.load_block(l, block_of(lane, *lane.interval));
        lane.broken = tables_.control.is_sampled;  // commands cannot be revoked
      }
      lane.rejected = true;
      lane.finite = !fits && __builtin_isfinite(e);
      ++lane.rejections;
      lane.proposed = dop853::size_after_rejected(lane.step, inverse_eighth_root(e), lane.finite);
    }
  }
}

// External exchange of a tree in the present states.
template <class S>
PackIntegrals<S> LaneStepper<S>::since_start(int tree) const {
  using namespace phase_integral;
  PackIntegrals<S> since{Vector3<S>::zero(), Vector3<S>::zero(), S(0.0)};
  const S* whole = y_.data() + integrals_;
  if (tree == tables_.driven_tree) since.work = whole[kMotorWork] + whole[kFrictionWork];
  if (!tables_.outside.acts()) return since;
  const S* own = whole + kWholeCount + kTreeCount * tree;
  for (int k = 0; k < 3; ++k) since.linear[k] = own[kTreeForce + k], since.angular[k] = own[kTreeMoment + k];
  since.work += own[kTreeWork];
  return since;
}

// Momentum and energy of the present states, after steps of size h; h is zero in lanes that have not moved, whose
// result is unchanged. Exchange rates are those at the steps' ends.
template <class S>
void LaneStepper<S>::check_conservation(const S& h) {
  measure(now_trees_.data());
  for (int i = 0; i < tables_.tree_count; ++i) {
    deviations_[i].update(start_trees_[i], now_trees_[i], since_start(i));
    for (int k = 0; k < phase_integral::kExchangeCount; ++k) {
      // Lanes whose step is not accepted may hold arbitrary values.
      S& rate = exchange_rates_[phase_integral::kExchangeCount * i + k];
      rate = select(h > S(0.0), rate, S(0.0));
    }
    deviations_[i].exchange(exchange_rates_.data() + phase_integral::kExchangeCount * i, h);
  }
  if (has_loops()) open_.raise(loop_defects());
}

}  // namespace grapnel::lanes
