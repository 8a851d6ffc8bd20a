#pragma once

/// @file
/// Integrates the cases of one structure in lanes: DormandPrince853 (integrate/dormand_prince_853.hpp: tableau, initial
/// step, error estimate, controller and constants are its) with a time, a step, a verdict and an interval of its own in
/// every lane. A lane that has finished takes the next case, so that lanes stay full; a case's numbers depend on
/// nothing but the case.

#include "grapnel/integrate/dormand_prince_853_tableau.hpp"
#include "grapnel/lanes/lane_dynamics.hpp"
#include "grapnel/lanes/lane_dynamics_books.hpp"
#include "grapnel/lanes/lane_stepper_norm.hpp"

namespace grapnel::lanes {

/// Where one lane's case stands; the tag keeps names of different instruction sets apart.
template <class S>
struct LaneState {
  bool active = false;
  bool rejected = false;  // since the last accepted step
  bool finite = true;     // the last rejected step
  bool last = false;      // the step under way ends the interval
  bool broken = false;    // the derivative at its start is not finite
  CaseRecord record{};
  const double* block = nullptr;  // the interval's
  double time = 0;
  double step = 0;      // under way
  double end = 0;       // of the step under way
  double wanted = 0;    // its size before it was fitted to the interval's end
  double proposed = 0;  // size of the next
  double longest = 0;   // that any may have
  double defect = 0;    // largest of a quaternion's norm
  std::int64_t accepted = 0, rejections = 0, evaluations = 0;
};

template <class S>
class LaneStepper {
 public:
  static constexpr int kWidth = S::kWidth;
  using Mask = typename S::Mask;

  LaneStepper(const PhaseTables& tables, CaseExchange& exchange);
  /// Until no case is left.
  void run();

 private:
  static constexpr double kEpsilon = 0x1p-52;
  static constexpr double kSafety = 0.9, kSmallestFactor = 1.0 / 3.0, kLargestFactor = 6.0, kNonFiniteFactor = 0.1,
                          kStretch = 1.01;

  static double absolute(double x) { return __builtin_fabs(x); }
  static double smaller(double a, double b) { return b < a ? b : a; }
  static double larger(double a, double b) { return a < b ? b : a; }
  /// x^(-1/8), exactly rounded operations only: the same everywhere.
  static double inverse_eighth_root(double x) { return 1.0 / __builtin_sqrt(__builtin_sqrt(__builtin_sqrt(x))); }

  S* stage(int number) { return stages_.data() + (number - 1) * size_; }
  bool take(int lane);
  void keep_as_model(int lane);
  void rest(int lane);
  void begin(unsigned starting);
  void choose_first_steps(unsigned starting);
  void finish(int lane, LaneStatus status);
  bool plan();
  bool plan_lane(LaneState<S>& lane, LaneStatus& status) const;
  void attempt();
  void evaluate_stages(const S& t, const S& h);
  template <const auto& kRow>
  GRAPNEL_INLINE S weighted_sum(int i) const;
  template <int kNumber, const auto& kRow>
  void evaluate_stage(const S& t, const S& h);
  S normalize(S* y) const;
  Mask finite(const S* y) const;
  void judge(unsigned accepted, unsigned good, const S& error, const S& defect);
  S enter_intervals(unsigned accepted);
  void check_books();
  void show(unsigned lanes, const S* y);

  const PhaseTables& tables_;
  CaseExchange& exchange_;
  LaneDynamics<S> dynamics_;
  LaneBookkeeper<S> bookkeeper_;
  int size_;
  LaneNorm<S> norm_;
  LaneState<S> lanes_[kWidth];
  LaneArray<S> y_, trial_, end_, stages_, error3_, error5_;
  LaneArray<S, double> result_q_, result_v_, result_motor_;
  // A case that could be evaluated, for lanes without one: numbers that are not finite would be slow.
  bool has_model_ = false;
  double model_time_ = 0;
  LaneArray<S, double> model_links_, model_noise_, model_block_, model_y_;
  LaneArray<S, PackTree<S>> start_books_, books_, fresh_books_;  // per tree
  LaneArray<S, PackDeviation<S>> deviations_;
  LaneArray<S, LaneTreeBooks> result_trees_;
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
      bookkeeper_(tables),
      size_(dynamics_.size()),
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
      model_links_(tables.link_count * kLinkNumbers),
      model_noise_(tables.noise_numbers),
      model_block_(1 + tables.piece_numbers),
      model_y_(size_),
      start_books_(tables.tree_count),
      books_(tables.tree_count),
      fresh_books_(tables.tree_count),
      deviations_(tables.tree_count),
      result_trees_(tables.tree_count) {}

}  // namespace grapnel::lanes

#include "grapnel/lanes/lane_stepper_cases.hpp"
#include "grapnel/lanes/lane_stepper_step.hpp"
