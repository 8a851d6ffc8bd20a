#pragma once

/// @file
/// How lanes take cases, begin them and hand back what became of them. Included by lane_stepper.hpp alone.

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

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

// Takes the next case into a lane; false: there is none.
template <class S>
bool LaneStepper<S>::take(int l) {
  LaneState<S>& lane = lanes_[l];
  lane = {};
  if (!exchange_.next(exchange_.context, l, lane.record)) return false;
  lane.active = true;
  lane.block = lane.record.intervals;
  lane.time = lane.end = lane.record.start_time;
  lane.longest =
      smaller(smaller(tables_.max_step, lane.record.max_step), LaneDynamics<S>::longest_step(tables_, lane.record));
  dynamics_.load_case(l, lane.record);
  dynamics_.load_interval(l, lane.block);
  for (int i = 0; i < tables_.coordinates; ++i) y_[i].set(l, lane.record.q[i]);
  for (int i = 0; i < tables_.velocities; ++i) y_[tables_.coordinates + i].set(l, lane.record.v[i]);
  y_[size_ - 2].set(l, 0.0);
  y_[size_ - 1].set(l, 0.0);
  return true;
}

template <class S>
void LaneStepper<S>::keep_as_model(int l) {
  const CaseRecord& record = lanes_[l].record;
  for (int i = 0; i < model_links_.size(); ++i) model_links_[i] = record.links[i];
  for (int i = 0; i < model_noise_.size(); ++i) model_noise_[i] = record.noise[i];
  for (int i = 0; i < model_block_.size(); ++i) model_block_[i] = record.intervals[i];
  for (int i = 0; i < size_; ++i) model_y_[i] = y_[i].get(l);
  model_time_ = record.start_time;
  has_model_ = true;
}

// Gives a lane without a case numbers that can be evaluated.
template <class S>
void LaneStepper<S>::rest(int l) {
  lanes_[l] = {};
  if (!has_model_) return;
  CaseRecord record{};
  record.links = model_links_.data();
  record.noise = model_noise_.data();
  dynamics_.load_case(l, record);
  dynamics_.load_interval(l, model_block_.data());
  for (int i = 0; i < size_; ++i) {
    y_[i].set(l, model_y_[i]);
    stage(1)[i].set(l, 0.0);
  }
  lanes_[l].time = lanes_[l].end = model_time_;
}

// The start of cases: conserved momenta, derivative, books, first step.
template <class S>
void LaneStepper<S>::begin(unsigned starting) {
  const Mask lanes = Mask::from_bits(starting);
  S t;
  for (int l = 0; l < kWidth; ++l) t.set(l, lanes_[l].time);
  for (int i = 0; i < size_; ++i) trial_[i] = y_[i];
  normalize(trial_.data());
  dynamics_.enter_step(t, S(0.0));
  dynamics_.remember_momenta(lanes, t, trial_.data());
  dynamics_.settle(t, trial_.data());
  for (int i = 0; i < size_; ++i) trial_[i] = y_[i] = select(lanes, trial_[i], y_[i]);
  dynamics_(t, trial_.data(), stage(13));
  for (int i = 0; i < size_; ++i) stage(1)[i] = select(lanes, stage(13)[i], stage(1)[i]);
  const unsigned sound = finite(stage(1)).bits();
  show(starting & sound, trial_.data());
  for (int l = 0; l < kWidth; ++l) {
    if (((starting >> l) & 1U) == 0) continue;
    lanes_[l].evaluations = 1;
    lanes_[l].broken = ((sound >> l) & 1U) == 0;
    if (!has_model_ && !lanes_[l].broken) keep_as_model(l);
  }
  bookkeeper_(dynamics_.tree(), dynamics_.coordinates(y_.data()), dynamics_.velocities(y_.data()), fresh_books_.data());
  for (int i = 0; i < tables_.tree_count; ++i) {
    start_books_[i].take(lanes, fresh_books_[i]);
    books_[i].take(lanes, fresh_books_[i]);
    deviations_[i].begin(lanes, fresh_books_[i].size);
  }
  choose_first_steps(starting);
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
    longest[l] = smaller(absolute(lane.block[0] - lane.time), lane.longest);
    const double y = size_y.get(l), f = size_f.get(l);
    euler[l] = smaller(y < 1e-5 || f < 1e-5 ? 1e-6 : 0.01 * y / f, longest[l]);
    increment.set(l, euler[l]);
  }
  for (int i = 0; i < size_; ++i) trial_[i] = increment * stage(1)[i] + y_[i];
  dynamics_.enter_step(t, increment);
  dynamics_(S(t + increment), trial_.data(), stage(13));
  for (int i = 0; i < size_; ++i) error5_[i] = stage(13)[i] - stage(1)[i];
  const S change = norm_.of(y_.data(), error5_.data());
  for (int l = 0; l < kWidth; ++l) {
    if (((starting >> l) & 1U) == 0) continue;
    LaneState<S>& lane = lanes_[l];
    ++lane.evaluations;
    const double second = change.get(l) / euler[l];
    if (!__builtin_isfinite(second)) {
      lane.proposed = smaller(1e-6, longest[l]);
      continue;
    }
    const double largest = larger(size_f.get(l), second);
    const double step = largest <= 1e-15 ? larger(1e-6, euler[l] * 1e-3) : inverse_eighth_root(100.0 * largest);
    lane.proposed = smaller(smaller(100.0 * euler[l], step), longest[l]);
  }
}

// The cases of these lanes as they are in y, which has been evaluated last; a step that has led there still counts as
// under way.
template <class S>
void LaneStepper<S>::show(unsigned lanes, const S* y) {
  if (exchange_.look == nullptr) return;
  for (int l = 0; l < kWidth; ++l) {
    if (((lanes >> l) & 1U) == 0) continue;
    for (int i = 0; i < tables_.coordinates; ++i) result_q_[i] = y[i].get(l);
    for (int i = 0; i < tables_.velocities; ++i) result_v_[i] = y[tables_.coordinates + i].get(l);
    for (int i = 0; i < tables_.link_count; ++i) result_motor_[i] = dynamics_.motor_effort(i).get(l);
    const CaseLook look{lanes_[l].end, result_q_.data(), result_v_.data(), result_motor_.data()};
    exchange_.look(exchange_.context, l, look);
  }
}

template <class S>
void LaneStepper<S>::finish(int l, LaneStatus status) {
  const LaneState<S>& lane = lanes_[l];
  for (int i = 0; i < tables_.coordinates; ++i) result_q_[i] = y_[i].get(l);
  for (int i = 0; i < tables_.velocities; ++i) result_v_[i] = y_[tables_.coordinates + i].get(l);
  CaseResult result{};
  result.status = status;
  result.time = lane.time;
  result.q = result_q_.data();
  result.v = result_v_.data();
  result.motor_work = y_[size_ - 2].get(l);
  result.friction_work = y_[size_ - 1].get(l);
  result.steps = lane.accepted;
  result.rejected = lane.rejections;
  result.evaluations = lane.evaluations;
  result.quaternion_defect = lane.defect;
  for (int i = 0; i < tables_.tree_count; ++i) result_trees_[i] = deviations_[i].get(l, start_books_[i], books_[i]);
  result.trees = result_trees_.data();
  exchange_.done(exchange_.context, l, result);
}

// Fits the next step of every lane; cases that end here make room for others. False: none is left.
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

// See DormandPrince853::step. False: the case ends here.
template <class S>
bool LaneStepper<S>::plan_lane(LaneState<S>& lane, LaneStatus& status) const {
  if (lane.broken) return status = LaneStatus::non_finite, false;
  if (lane.time == lane.record.end_time) return status = LaneStatus::finished, false;
  if (lane.accepted + lane.rejections >= tables_.max_steps) return status = LaneStatus::too_many_steps, false;
  const double interval_end = lane.block[0];
  const double remaining = interval_end - lane.time;
  lane.wanted = smaller(lane.proposed, lane.longest);
  lane.last = remaining <= smaller(kStretch * lane.wanted, (1.0 + 1e-10) * lane.longest);
  if (!lane.last && lane.wanted <= 10.0 * kEpsilon * absolute(lane.time)) {
    return status = lane.finite ? LaneStatus::step_too_small : LaneStatus::non_finite, false;
  }
  lane.end = lane.last ? interval_end : lane.time + lane.wanted;
  lane.step = lane.end - lane.time;  // as the rounded times have it, so that time does not drift
  return true;
}

}  // namespace grapnel::lanes
