/// Final straight approach under disturbances: forward simulations of the plan determine the remaining errors, and the
/// next plan compensates them.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "grapnel/approach/approach_planner.hpp"
#include "grapnel/approach/predicted_contacts.hpp"

namespace grapnel {
namespace {

// Minimum simulated error that triggers a warning [m, rad and their rates].
constexpr double kReported = 1e-7;
// Accuracy of simulations [m, rad and their rates].
constexpr double kArrivedInSimulation = 10 * kArrived;

// Functions of time over a segment, as Chebyshev series on parts of it.
class Recorded {
 public:
  Recorded(double begin, double end, std::size_t numbers) : series_(numbers) {
    for (int i = 0; i < kParts; ++i) {
      const double a = begin + i * (end - begin) / kParts,
                   b = i + 1 == kParts ? end : begin + (i + 1) * (end - begin) / kParts;
      for (int k = i == 0 ? 0 : 1; k <= kDegree; ++k) times_.push_back(chebyshev_point(a, b, k, kDegree));
    }
    values_.assign(numbers, std::vector<double>(times_.size()));
  }

  const std::vector<double>& times() const { return times_; }
  double& value(std::size_t number, std::size_t time) { return values_[number][time]; }
  void put(std::size_t first, std::size_t time, const Vector3d& v) {
    for (int k = 0; k < 3; ++k) value(first + k, time) = v[k];
  }

  void fit() {
    for (std::size_t n = 0; n < series_.size(); ++n) {
      series_[n].segments.clear();
      for (std::size_t i = 0; i < kParts; ++i) {
        const std::span<const double> samples(values_[n].data() + i * kDegree, kDegree + 1);
        series_[n].segments.push_back({times_[i * kDegree], times_[(i + 1) * kDegree], chebyshev_interpolant(samples)});
      }
    }
  }
  double at(std::size_t number, double t) const { return evaluate(series_[number], t).position; }
  Vector3d vector_at(std::size_t first, double t) const { return {at(first, t), at(first + 1, t), at(first + 2, t)}; }

 private:
  static constexpr int kParts = 8, kDegree = 16;

  std::vector<double> times_;  // increasing, of part i those from i kDegree to (i + 1) kDegree
  std::vector<std::vector<double>> values_;
  std::vector<JointTrajectory> series_;
};

// Recorded quantities of the servicer for StraightInSurroundings: centre of mass, momentum, angular velocity of the
// base.
constexpr std::size_t kCom = 0, kAngular = 3, kLinear = 6, kTurn = 9, kOfServicer = 12;
// Of each target: position, quaternion, twist.
constexpr std::size_t kPlace = 0, kQuaternion = 3, kSpin = 7, kVelocity = 10, kOfTarget = 13;

double largest_of(const std::vector<GoalGap>& gaps) {
  double largest = 0;
  for (const GoalGap& gap : gaps) largest = std::max(largest, gap.largest());
  return largest;
}

// Message: for each demanded quantity the largest error over the end-effectors.
std::string in_words(const std::vector<GoalGap>& gaps) {
  GoalGap largest;
  const auto larger = [](Vector3d& result, const Vector3d& v) {
    if (norm(v) > norm(result)) result = v;
  };
  for (const GoalGap& gap : gaps) {
    larger(largest.position, gap.position), larger(largest.turn, gap.turn);
    larger(largest.velocity, gap.velocity), larger(largest.spin, gap.spin);
  }
  std::vector<std::string> missed;
  const auto append = [&](const Vector3d& v, const char* what) {
    if (norm(v) > kReported) missed.push_back(fmt::format("{:.2g} {}", norm(v), what));
  };
  append(largest.position, "m from their grasp points");
  append(largest.turn, "rad from the demanded orientation");
  append(largest.velocity, "m/s from the demanded relative velocity");
  append(largest.spin, "rad/s from the demanded relative angular velocity");
  return fmt::format("{}", fmt::join(missed, ", "));
}

}  // namespace

// Straight approach under disturbances => plan whose simulation has final errors (6.9d) within tolerance: momentum and
// target motion of each simulation enter the next plan; remaining errors are subtracted from the demands.
void ApproachPlanner::come_in_simulated(StraightInProblem& in) {
  constexpr int kMaxCorrections = 14;
  PlannedStandOff planned = plan_stand_off(in, {});
  const ReachProblem& reach = planned.reach;
  const ReachSolution s = allow_for_disturbance(reach, std::move(planned.solution), ", stand-off");
  report(reach, s);
  in.position = s.position, in.rate_begin = s.rate;
  const Spline spline{s.knots, s.coefficients};
  const State there =
      without_inner_motion(simulated_servicer_, simulate_disturbed(reach, s.position, s.rate, spline), servicer_);
  in.X_WB = root_pose(servicer_.model, there, servicer_.base);
  auto around = std::make_shared<StraightInSurroundings>();
  const FreeMotion as_it_begins = free_motion(servicer_.model, there, in.begin, problem_.gravity);
  const Vector3d w_B = turn_beside(there);
  around->motion = [as_it_begins](double) { return as_it_begins; };
  around->w_B = [w_B](double) { return w_B; };
  if (targets_loaded() || problem_.orbit || touches_after(targets_, in.begin)) around->targets = targets_over(in);
  in.surroundings = around;
  const StraightInProblem meant = in;
  const auto plan = [&] {
    advance(in.begin, s.position, s.rate, s.knots, s.coefficients);
    StraightInPath path = plan_straight_in(base_, in);
    take_straight_in(in, path);
    return std::move(path.gaps);
  };
  const auto simulate_plan = [&] {
    around = std::make_shared<StraightInSurroundings>(*around);
    return simulate_approach(meant, *around);
  };
  double before = std::numeric_limits<double>::infinity();
  const auto correct = [&](const Gaps& gaps) {
    in.surroundings = around;
    // Corrections of the goals compensate inaccuracies of the series, for example at a sudden change of a load.
    constexpr double kNoGain = 0.9;
    const double now = largest_of(gaps);
    if (now > kNoGain * before) shift_goals(gaps, in);
    before = now;
  };
  warn_of_simulated_miss(correct_by_simulations({plan, simulate_plan, correct}, kMaxCorrections));
}

// Steps plan, simulate and correct, and their maximum number => best plan, stored in plan_, and its errors. Ends within
// tolerance or after three corrections without improvement; passes Unplannable of the first plan.
ApproachPlanner::SimulatedErrors ApproachPlanner::correct_by_simulations(const BySimulations& steps,
                                                                         int max_corrections) {
  constexpr int kPatience = 2;  // corrections without improvement; not every correction improves the plan
  const ApproachPlan before = plan_;
  const double time = time_;
  const std::vector<double> position = position_, rate = rate_;
  const Posed X_WB = X_WB_;
  struct Best {
    SimulatedErrors errors;
    ApproachPlan plan;
    std::vector<double> position, rate;
  };
  std::optional<Best> best;
  for (int i = 0, stuck = 0;; ++i) {
    Gaps planned;
    bool ends = i == max_corrections;
    try {
      planned = steps.plan();
    } catch (const Unplannable&) {
      if (!best) throw;
      ends = true;  // the correction made the plan infeasible
    }
    Gaps left;
    if (!planned.empty()) {
      const Gaps gaps = steps.simulate();
      for (std::size_t g = 0; g < gaps.size(); ++g) left.push_back(gaps[g] - planned[g]);
      const double largest = largest_of(left);
      report_gaps(gaps);
      stuck = !best || largest < 0.9 * best->errors.beside ? 0 : stuck + 1;
      if (!best || largest < best->errors.beside) best = Best{{gaps, largest}, plan_, position_, rate_};
      ends = ends || largest <= kArrivedInSimulation || stuck > kPatience;
    }
    const long evaluations = plan_.report.rhs_evaluations;
    plan_ = ends ? std::move(best->plan) : before;
    plan_.report.rhs_evaluations = evaluations;
    if (ends) {
      position_ = std::move(best->position), rate_ = std::move(best->rate);
      return std::move(best->errors);
    }
    steps.correct(left);
    time_ = time, position_ = position, rate_ = rate, X_WB_ = X_WB;
  }
}

void ApproachPlanner::shift_goals(const Gaps& gaps, StraightInProblem& in) const {
  for (std::size_t g = 0; g < gaps.size(); ++g) {
    StraightGoal& goal = in.goals[g];
    const Rotationd& R_WT = targets_.capture[static_cast<std::size_t>(goal.target)].X_WT.R;
    goal.X_TG.p = goal.X_TG.p - transposed_times(R_WT, gaps[g].position);
    goal.turn_T = goal.turn_T - transposed_times(R_WT, gaps[g].turn);
    goal.velocity_T = goal.velocity_T - transposed_times(R_WT, gaps[g].velocity);
    goal.spin_T = goal.spin_T - transposed_times(R_WT, gaps[g].spin);
  }
}

void ApproachPlanner::report_gaps(const Gaps& gaps) {
  for (std::size_t g = 0; g < gaps.size(); ++g) {
    PlannedMiss& miss = plan_.report.miss[g];
    miss.distance = norm(gaps[g].position), miss.angle = norm(gaps[g].turn);
    miss.velocity = norm(gaps[g].velocity), miss.angular_velocity = norm(gaps[g].spin);
  }
}

Vector3d ApproachPlanner::turn_beside(const State& servicer) const {
  if (!attitude_held()) return Vector3d::zero();
  const Posed X_WB = root_pose(servicer_.model, servicer, servicer_.base);
  return transposed_times(X_WB.R, root_twist(servicer_.model, servicer, servicer_.base).angular);
}

// Plan => final errors of its simulation, and in `around` the centre of mass, momentum and residual angular velocity of
// the servicer as Chebyshev series of time.
ApproachPlanner::Gaps ApproachPlanner::simulate_approach(const StraightInProblem& in, StraightInSurroundings& around) {
  auto recorded = std::make_shared<Recorded>(in.begin, in.end, kOfServicer);
  std::size_t next = 0;
  StepWatch watch;
  watch.probe = [&](const PhaseStep& step) {
    for (; next < recorded->times().size() && recorded->times()[next] <= step.end; ++next) {
      const double t = recorded->times()[next];
      if (t < step.begin) continue;
      const State state = without_inner_motion(simulated_servicer_, step.at(t).state, servicer_);
      const FreeMotion now = free_motion(servicer_.model, state, t, problem_.gravity);
      recorded->put(kCom, next, now.p_WCom);
      recorded->put(kAngular, next, now.h.angular), recorded->put(kLinear, next, now.h.linear);
      recorded->put(kTurn, next, turn_beside(state));
    }
  };
  const State end = simulate(plan_.joints, in.end, watch);
  recorded->fit();
  around.motion = [recorded, mass = motion_.mass, gravity = problem_.gravity](double t) {
    return FreeMotion{t, recorded->vector_at(kCom, t),
                      Momentumd{recorded->vector_at(kAngular, t), recorded->vector_at(kLinear, t)}, mass, gravity};
  };
  around.w_B = [recorded](double t) { return recorded->vector_at(kTurn, t); };
  return simulated_gaps(in, end);
}

// Targets at the capture => their motion during the straight approach under loads, orbital field and contacts,
// propagated backwards and stored as Chebyshev series; quaternions have the same sign from sample to sample.
std::function<std::vector<FreeBody>(double)> ApproachPlanner::targets_over(const StraightInProblem& in) const {
  const std::size_t count = problem_.targets.size();
  auto recorded = std::make_shared<Recorded>(in.begin, in.end, kOfTarget * count);
  const std::vector<double>& times = recorded->times();
  for (std::size_t i = 0; i < count; ++i) {
    TargetMotion at = targets_.capture[i];
    double from = approach_.duration;
    const bool touches = !targets_.instants.empty() && !targets_.instants[i].empty();
    Quaterniond q = quaternion_from(at.X_WT.R);
    for (std::size_t k = times.size(); k-- > 0;) {
      at = touches ? target_at(i, times[k])
                   : propagate_target(problem_, problem_.targets[i], at, from, times[k], each_step());
      from = times[k];
      Quaterniond now = quaternion_from(at.X_WT.R);
      if (now.w * q.w + now.x * q.x + now.y * q.y + now.z * q.z < 0) now = {-now.w, -now.x, -now.y, -now.z};
      q = now;
      const std::size_t first = kOfTarget * i;
      recorded->put(first + kPlace, k, at.X_WT.p);
      const std::array<double, 4> parts = {q.w, q.x, q.y, q.z};
      for (std::size_t n = 0; n < 4; ++n) recorded->value(first + kQuaternion + n, k) = parts[n];
      recorded->put(first + kSpin, k, at.V_WT.angular), recorded->put(first + kVelocity, k, at.V_WT.linear);
    }
  }
  recorded->fit();
  return [recorded, bodies = in.targets](double t) {
    std::vector<FreeBody> now = bodies;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const std::size_t first = kOfTarget * i, q = first + kQuaternion;
      const Quaterniond turned{recorded->at(q, t), recorded->at(q + 1, t), recorded->at(q + 2, t),
                               recorded->at(q + 3, t)};
      now[i].X_WT = Posed{rotation_matrix(normalized(turned)), recorded->vector_at(first + kPlace, t)};
      now[i].V_WT = Twistd{recorded->vector_at(first + kSpin, t), recorded->vector_at(first + kVelocity, t)};
    }
    return now;
  };
}

void ApproachPlanner::warn_of_simulated_miss(const SimulatedErrors& errors) {
  const std::string missed = in_words(errors.gaps);
  if (missed.empty()) return;
  plan_.warnings.push_back(
      fmt::format("approach: straight_in, simulated under {}, leaves the end-effectors up to {}, and corrections do "
                  "not reduce this: {}",
                  disturbances(), missed,
                  errors.beside > kReported ? "each correction changes the loads by more than it compensates"
                                            : "the joints cannot produce the required motion"));
}

// Straight approach of a flexible robot => plan of the rigid robot whose simulation has the demanded final values; the
// errors are subtracted from the goals in the targets' frames (22.10). Warns of the deflection on the path.
void ApproachPlanner::come_in_bending(StraightInProblem& in) {
  constexpr int kMaxCorrections = 12;
  const StraightInProblem meant = in;
  std::vector<double> guess;
  const auto plan = [&] {
    Gaps left = come_in(in, guess);
    guess = in.position;
    return left;
  };
  const auto simulate_plan = [&] { return simulated_gaps(meant, simulate(plan_.joints, in.end)); };
  const auto correct = [&](const Gaps& gaps) { shift_goals(gaps, in); };
  const std::string missed = in_words(correct_by_simulations({plan, simulate_plan, correct}, kMaxCorrections).gaps);
  plan_.warnings.push_back(fmt::format(
      "approach: straight_in brings the end-effectors of the flexible robot to {} at its end; it is planned for a "
      "rigid robot, and the path of the end-effectors differs by the deflection{}",
      missed.empty() ? "the demanded poses and velocities" : "up to " + missed,
      plan_.report.path ? "; the same holds for joint limits and other path constraints, which the run checks" : ""));
}

std::vector<Goal> ApproachPlanner::final_goals(const StraightInProblem& in) const {
  std::vector<FreeBody> targets = in.targets;
  for (std::size_t t = 0; t < targets.size(); ++t)
    targets[t].X_WT = targets_.capture[t].X_WT, targets[t].V_WT = targets_.capture[t].V_WT;
  return goals_at(in, targets, in.end);
}

ApproachPlanner::Gaps ApproachPlanner::simulated_gaps(const StraightInProblem& in, const State& end) const {
  const Kinematics k = forward_kinematics(simulated_servicer_.model, end);
  Gaps gaps;
  for (const Goal& goal : final_goals(in)) {
    const int frame = simulated_servicer_.model.frame_index(servicer_.model.frames()[goal.frame].name);
    gaps.push_back(goal_gap(goal, frame_pose(simulated_servicer_.model, k, frame),
                            frame_twist(simulated_servicer_.model, k, frame)));
  }
  return gaps;
}

}  // namespace grapnel
