#include "grapnel/approach/straight_in_simulations.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <optional>

#include "grapnel/approach/plan_report.hpp"
#include "grapnel/approach/plan_simulation.hpp"

namespace grapnel {
namespace {

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

std::vector<Goal> final_goals(const PlanningTask& task, const StraightInProblem& in) {
  std::vector<FreeBody> targets = in.targets;
  for (std::size_t t = 0; t < targets.size(); ++t)
    targets[t].X_WT = task.targets.capture[t].X_WT, targets[t].V_WT = task.targets.capture[t].V_WT;
  return goals_at(in, targets, in.end);
}

}  // namespace

double largest_of(const Gaps& gaps) {
  double largest = 0;
  for (const GoalGap& gap : gaps) largest = std::max(largest, gap.largest());
  return largest;
}

Gaps simulated_gaps(const PlanningTask& task, const StraightInProblem& in, const State& end) {
  const Kinematics k = forward_kinematics(task.simulated_servicer.model, end);
  Gaps gaps;
  for (const Goal& goal : final_goals(task, in)) {
    const int frame = task.simulated_servicer.model.frame_index(task.servicer.model.frames()[goal.frame].name);
    gaps.push_back(goal_gap(goal, frame_pose(task.simulated_servicer.model, k, frame),
                            frame_twist(task.simulated_servicer.model, k, frame)));
  }
  return gaps;
}

Gaps simulate_approach(PlanningTask& task, const PlanDraft& draft, const StraightInProblem& in,
                       StraightInSurroundings& around) {
  auto recorded = std::make_shared<Recorded>(in.begin, in.end, kOfServicer);
  std::size_t next = 0;
  StepWatch watch;
  watch.probe = [&](const PhaseStep& step) {
    for (; next < recorded->times().size() && recorded->times()[next] <= step.end; ++next) {
      const double t = recorded->times()[next];
      if (t < step.begin) continue;
      const State state = planned_state(task, step.at(t).state);
      const FreeMotion now = free_motion(task.servicer.model, state, t, task.problem.gravity);
      recorded->put(kCom, next, now.p_WCom);
      recorded->put(kAngular, next, now.h.angular), recorded->put(kLinear, next, now.h.linear);
      recorded->put(kTurn, next, turn_beside(task, state));
    }
  };
  const State end = simulate(task, draft.plan.joints, in.end, watch);
  recorded->fit();
  around.motion = [recorded, mass = task.motion.mass, gravity = task.problem.gravity](double t) {
    return FreeMotion{t, recorded->vector_at(kCom, t),
                      Momentumd{recorded->vector_at(kAngular, t), recorded->vector_at(kLinear, t)}, mass, gravity};
  };
  around.w_B = [recorded](double t) { return recorded->vector_at(kTurn, t); };
  return simulated_gaps(task, in, end);
}

std::function<std::vector<FreeBody>(double)> targets_over(const PlanningTask& task, const StraightInProblem& in) {
  const std::size_t count = task.problem.targets.size();
  auto recorded = std::make_shared<Recorded>(in.begin, in.end, kOfTarget * count);
  const std::vector<double>& times = recorded->times();
  for (std::size_t i = 0; i < count; ++i) {
    TargetMotion at = task.targets.capture[i];
    double from = task.approach.duration;
    const bool touches = !task.targets.instants.empty() && !task.targets.instants[i].empty();
    Quaterniond q = quaternion_from(at.X_WT.R);
    for (std::size_t k = times.size(); k-- > 0;) {
      at = touches ? task.target_at(i, times[k])
                   : propagate_target(task.problem, task.problem.targets[i], at, from, times[k], task.each_step());
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

SimulatedErrors correct_by_simulations(PlanDraft& draft, const BySimulations& steps, int max_corrections) {
  constexpr int kPatience = 2;  // corrections without improvement; not every correction improves the plan
  const PlanDraft before = draft;
  struct Best {
    SimulatedErrors errors;
    PlanDraft draft;
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
      report_gaps(gaps, draft.plan.report);
      stuck = !best || largest < 0.9 * best->errors.beside ? 0 : stuck + 1;
      if (!best || largest < best->errors.beside) best = Best{{gaps, largest}, draft};
      ends = ends || largest <= kArrivedInSimulation || stuck > kPatience;
    }
    draft = ends ? std::move(best->draft) : before;
    if (ends) return std::move(best->errors);
    steps.correct(left);
  }
}

}  // namespace grapnel
