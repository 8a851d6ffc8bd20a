/// Straight in where the momentum integral does not know all: flights of the plan say what is left, and what of it the
/// next plan has to allow for.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "grapnel/approach/approach_planner.hpp"

namespace grapnel {
namespace {

// Flights are good to about this [m, rad and their rates].
constexpr double kArrivedInFlight = 10 * kArrived;

// Numbers over a piece of way, as Chebyshev series on parts of it.
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
      series_[n].pieces.clear();
      for (std::size_t i = 0; i < kParts; ++i) {
        const std::span<const double> samples(values_[n].data() + i * kDegree, kDegree + 1);
        series_[n].pieces.push_back({times_[i * kDegree], times_[(i + 1) * kDegree], chebyshev_interpolant(samples)});
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

// What of a flight StraightInSurroundings says of the servicer: centre of mass, momentum, angular velocity of the base.
constexpr std::size_t kCom = 0, kAngular = 3, kLinear = 6, kTurn = 9, kOfServicer = 12;
// Of each target: position, quaternion, twist.
constexpr std::size_t kPlace = 0, kQuaternion = 3, kSpin = 7, kVelocity = 10, kOfTarget = 13;

}  // namespace

void ApproachPlanner::come_in_flown(StraightInProblem& in) {
  constexpr int kMost = 12;
  auto [reach, s] = plan_stand_off(in, {});
  s = allow_for_disturbance(reach, s, ", stand-off");
  report(reach, s);
  in.position = s.position, in.rate_begin = s.rate;
  const Spline spline{s.knots, s.coefficients};
  const State there = without_inner_motion(flown_, fly_disturbed(reach, s.position, s.rate, spline), servicer_);
  in.X_WB = root_pose(servicer_.model, there, servicer_.base);
  auto around = std::make_shared<StraightInSurroundings>();
  const FreeMotion as_it_begins = free_motion(servicer_.model, there, in.begin, problem_.gravity);
  const Vector3d w_B = turn_beside(there);
  around->motion = [as_it_begins](double) { return as_it_begins; };
  around->w_B = [w_B](double) { return w_B; };
  if (targets_loaded() || problem_.orbit) around->targets = targets_over(in);
  in.surroundings = around;
  const ApproachPlan before = plan_;
  const SegmentStart start = segment_to(in.begin);
  constexpr int kPatience = 2;  // corrections without gain; they need not come nearer every time
  struct Best {
    double largest = std::numeric_limits<double>::infinity();
    ApproachPlan plan;
    std::vector<double> position, rate;
  } best;
  for (int i = 0, stuck = 0;; ++i) {
    advance(in.begin, s.position, s.rate, s.knots, s.coefficients);
    take_straight_in(in, plan_straight_in(base_, in));
    around = std::make_shared<StraightInSurroundings>(*around);
    const double largest = fly_over(in, *around);
    stuck = largest < 0.9 * best.largest ? 0 : stuck + 1;
    if (largest < best.largest) best = {largest, plan_, position_, rate_};
    if (largest <= kArrivedInFlight || i == kMost || stuck > kPatience) {
      const long spent = plan_.report.rhs_evaluations;
      plan_ = std::move(best.plan), position_ = std::move(best.position), rate_ = std::move(best.rate);
      plan_.report.rhs_evaluations = spent;
      constexpr double kWorthSaying = 1e-7;  // [m]
      if (best.largest > kWorthSaying) warn_of_flown_miss(best.largest);
      return;
    }
    in.surroundings = around;
    const long evaluations = plan_.report.rhs_evaluations;
    plan_ = before;
    plan_.report.rhs_evaluations = evaluations;
    time_ = start.begin, position_ = start.position, rate_ = start.rate, X_WB_ = start.X_WB;
  }
}

Vector3d ApproachPlanner::turn_beside(const State& servicer) const {
  if (!attitude_kept()) return Vector3d::zero();
  const Posed X_WB = root_pose(servicer_.model, servicer, servicer_.base);
  return transposed_times(X_WB.R, root_twist(servicer_.model, servicer, servicer_.base).angular);
}

double ApproachPlanner::fly_over(const StraightInProblem& in, StraightInSurroundings& around) {
  auto recorded = std::make_shared<Recorded>(in.begin, in.end, kOfServicer);
  std::size_t next = 0;
  StepWatch watch;
  watch.probe = [&](const PhaseStep& step) {
    for (; next < recorded->times().size() && recorded->times()[next] <= step.end; ++next) {
      const double t = recorded->times()[next];
      if (t < step.begin) continue;
      const State state = without_inner_motion(flown_, step.at(t).state, servicer_);
      const FreeMotion now = free_motion(servicer_.model, state, t, problem_.gravity);
      recorded->put(kCom, next, now.p_WCom);
      recorded->put(kAngular, next, now.h.angular), recorded->put(kLinear, next, now.h.linear);
      recorded->put(kTurn, next, turn_beside(state));
    }
  };
  const State end = fly(plan_.joints, in.end, watch);
  recorded->fit();
  around.motion = [recorded, mass = motion_.mass, gravity = problem_.gravity](double t) {
    return FreeMotion{t, recorded->vector_at(kCom, t),
                      Momentumd{recorded->vector_at(kAngular, t), recorded->vector_at(kLinear, t)}, mass, gravity};
  };
  around.w_B = [recorded](double t) { return recorded->vector_at(kTurn, t); };
  const std::vector<Vector3d> missed = missed_in_flight(in.goals, end);
  double largest = 0;
  for (std::size_t g = 0; g < missed.size(); ++g) {
    plan_.report.miss[g].distance = norm(missed[g]);
    largest = std::max(largest, norm(missed[g]));
  }
  return largest;
}

std::function<std::vector<FreeBody>(double)> ApproachPlanner::targets_over(const StraightInProblem& in) const {
  const std::size_t count = problem_.targets.size();
  auto recorded = std::make_shared<Recorded>(in.begin, in.end, kOfTarget * count);
  const std::vector<double>& times = recorded->times();
  for (std::size_t i = 0; i < count; ++i) {
    TargetMotion at = targets_.capture[i];
    double from = approach_.duration;
    Quaterniond q = quaternion_from(at.X_WT.R);
    for (std::size_t k = times.size(); k-- > 0;) {
      at = propagate_target(problem_, problem_.targets[i], at, from, times[k], each_step());
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

void ApproachPlanner::warn_of_flown_miss(double largest) {
  plan_.warnings.push_back(
      fmt::format("approach: straight_in brings the end-effectors to within {:.2g} m of their points, no nearer: under "
                  "{} the plan changes what acts by more than corrections make up for",
                  largest, disturbances()));
}

void ApproachPlanner::come_in_bending(StraightInProblem& in) {
  constexpr int kMost = 8;
  const std::vector<StraightGoal> meant = in.goals;
  const ApproachPlan before = plan_;
  const double time = time_;
  const std::vector<double> position = position_, rate = rate_;
  const Posed X_WB = X_WB_;
  std::vector<double> guess;
  for (int i = 0;; ++i) {
    come_in(in, guess);
    guess = in.position;
    const std::vector<Vector3d> missed = missed_in_flight(meant, fly(plan_.joints, in.end));  // in the targets
    double largest = 0;
    for (std::size_t g = 0; g < meant.size(); ++g) {
      plan_.report.miss[g].distance = norm(missed[g]);
      largest = std::max(largest, norm(missed[g]));
    }
    if (largest <= kArrivedInFlight || i == kMost) {
      plan_.warnings.push_back(fmt::format(
          "approach: straight_in brings the end-effectors of the robot that bends to within {:.2g} m of their "
          "points; it is planned for the one that does not bend, from whose velocities and turns there they differ "
          "by what bends{}",
          largest, plan_.report.way ? "; so are limits and what else is asked of the way, which the run watches" : ""));
      return;
    }
    for (std::size_t g = 0; g < meant.size(); ++g) in.goals[g].X_TG.p = in.goals[g].X_TG.p - missed[g];
    const long evaluations = plan_.report.rhs_evaluations;
    plan_ = before;
    plan_.report.rhs_evaluations = evaluations;
    time_ = time, position_ = position, rate_ = rate, X_WB_ = X_WB;
  }
}

std::vector<Vector3d> ApproachPlanner::missed_in_flight(const std::vector<StraightGoal>& goals,
                                                        const State& end) const {
  const Kinematics k = forward_kinematics(flown_.model, end);
  std::vector<Vector3d> missed;
  for (const StraightGoal& goal : goals) {
    const int frame = flown_.model.frame_index(servicer_.model.frames()[goal.frame].name);
    const Posed& X_WT = targets_.capture[static_cast<std::size_t>(goal.target)].X_WT;
    missed.push_back(inverse(X_WT) * frame_pose(flown_.model, k, frame).p - goal.X_TG.p);
  }
  return missed;
}

}  // namespace grapnel
