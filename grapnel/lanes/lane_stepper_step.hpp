#pragma once

/// @file
/// One step of all lanes, in lockstep. Included by lane_stepper.hpp alone.

#include <utility>

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

template <class S>
template <const auto& kRow>
GRAPNEL_INLINE S LaneStepper<S>::weighted_sum(int i) const {
  const S* k = stages_.data() + i;
  const int n = size_;
  return [&]<std::size_t... J>(std::index_sequence<J...>) __attribute__((always_inline)) {
    return S(((S(kRow[J].weight) * k[(kRow[J].stage - 1) * n]) + ...));
  }
  (std::make_index_sequence<kRow.size()>{});
}

template <class S>
template <int kNumber, const auto& kRow>
void LaneStepper<S>::evaluate_stage(const S& t, const S& h) {
  for (int i = 0; i < size_; ++i) trial_[i] = h * weighted_sum<kRow>(i) + y_[i];
  dynamics_(S(S(dop853::kNodes[kNumber - 1]) * h + t), trial_.data(), stage(kNumber));
}

// Stages 2 to 12, the state of order 8 in end_, and the two error estimates per unit of step.
template <class S>
void LaneStepper<S>::evaluate_stages(const S& t, const S& h) {
  evaluate_stage<2, dop853::kStage2>(t, h);
  evaluate_stage<3, dop853::kStage3>(t, h);
  evaluate_stage<4, dop853::kStage4>(t, h);
  evaluate_stage<5, dop853::kStage5>(t, h);
  evaluate_stage<6, dop853::kStage6>(t, h);
  evaluate_stage<7, dop853::kStage7>(t, h);
  evaluate_stage<8, dop853::kStage8>(t, h);
  evaluate_stage<9, dop853::kStage9>(t, h);
  evaluate_stage<10, dop853::kStage10>(t, h);
  evaluate_stage<11, dop853::kStage11>(t, h);
  evaluate_stage<12, dop853::kStage12>(t, h);
  for (int i = 0; i < size_; ++i) {
    const S slope = weighted_sum<dop853::kSolution>(i);
    end_[i] = h * slope + y_[i];
    error3_[i] = slope - weighted_sum<dop853::kThirdOrder>(i);
    error5_[i] = weighted_sum<dop853::kError5>(i);
  }
}

// Scales quaternions to unit norm; the largest | |q| - 1 | before.
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
  evaluate_stages(t, h);
  // err = h e5^2 / sqrt(e5^2 + 0.01 e3^2) in the root-mean-square norm; the smallest normal number keeps 0/0 away.
  S sum5, sum3;
  norm_.sums(y_.data(), end_.data(), error5_.data(), error3_.data(), sum5, sum3);
  const S denominator = S(tables_.dimension) * S(S(0.01) * sum3 + sum5) + S(0x1p-1022);
  const S error = S(h * sum5) / sqrt(denominator);
  const unsigned accepted = active & (error <= S(1.0)).bits();
  unsigned good = 0;
  S defect(0.0);
  if (accepted != 0) {
    defect = normalize(end_.data());
    const S t_new = enter_intervals(accepted);
    dynamics_.settle(t_new, end_.data());
    dynamics_(t_new, end_.data(), stage(13));
    good = accepted & finite(stage(13)).bits();
    show(good, end_.data());
    const Mask lanes = Mask::from_bits(good);
    for (int i = 0; i < size_; ++i) {
      y_[i] = select(lanes, end_[i], y_[i]);
      stage(1)[i] = select(lanes, stage(13)[i], stage(1)[i]);
    }
    check_books();
  }
  judge(accepted, good, error, defect);
}

// Where an accepted step ends at a break, what follows speaks there: its derivative is the next step's first.
template <class S>
S LaneStepper<S>::enter_intervals(unsigned accepted) {
  S t;
  for (int l = 0; l < kWidth; ++l) {
    LaneState<S>& lane = lanes_[l];
    t.set(l, lane.active ? lane.end : lane.time);
    if (((accepted >> l) & 1U) == 0 || !lane.last || lane.end == lane.record.end_time) continue;
    dynamics_.load_interval(l, lane.block + 1 + tables_.piece_numbers);
  }
  return t;
}

// The controller, see DormandPrince853::step.
template <class S>
void LaneStepper<S>::judge(unsigned accepted, unsigned good, const S& error, const S& defect) {
  for (int l = 0; l < kWidth; ++l) {
    LaneState<S>& lane = lanes_[l];
    if (!lane.active) continue;
    const bool fits = ((accepted >> l) & 1U) != 0;
    const bool enters = fits && lane.last && lane.end != lane.record.end_time;
    lane.evaluations += 11 + (fits ? 1 : 0);
    const double e = error.get(l);
    if (((good >> l) & 1U) != 0) {
      const double factor = smaller(kSafety * inverse_eighth_root(e), lane.rejected ? 1.0 : kLargestFactor);
      lane.proposed = lane.step * larger(factor, kSmallestFactor);
      if (lane.last) lane.proposed = larger(lane.proposed, lane.wanted);  // cut short by the end: says nothing more
      lane.time = lane.end;
      ++lane.accepted;
      lane.defect = larger(lane.defect, defect.get(l));
      lane.rejected = false;
      lane.finite = true;
      if (enters) lane.block += 1 + tables_.piece_numbers;
    } else {
      if (enters) dynamics_.load_interval(l, lane.block);
      lane.rejected = true;
      lane.finite = !fits && __builtin_isfinite(e);
      ++lane.rejections;
      lane.proposed =
          lane.step * (lane.finite ? larger(kSafety * inverse_eighth_root(e), kSmallestFactor) : kNonFiniteFactor);
    }
  }
}

// Books of the states at hand. A lane that has not moved finds what it found before.
template <class S>
void LaneStepper<S>::check_books() {
  bookkeeper_(dynamics_.tree(), dynamics_.coordinates(y_.data()), dynamics_.velocities(y_.data()), books_.data());
  const S work = y_[size_ - 2] + y_[size_ - 1], none(0.0);
  for (int i = 0; i < tables_.tree_count; ++i)
    deviations_[i].look(start_books_[i], books_[i], i == tables_.driven_tree ? work : none);
}

}  // namespace grapnel::lanes
