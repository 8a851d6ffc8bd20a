#include "grapnel/approach/capture_window.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/navigation.hpp"
#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/approach/predicted_contacts.hpp"
#include "grapnel/approach/reach_bound.hpp"
#include "grapnel/plan/arm_starts.hpp"
#include "grapnel/plan/path_segment.hpp"
#include "grapnel/problem/captured_model.hpp"

namespace grapnel {
namespace {

using Choose = CaptureWindow::Choose;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kRefined = 1e-3;  // of the step: tolerance of the chosen time
constexpr int kFewStarts = 4;      // initial guesses of a first attempt after a time without a plan
// Part of the message if only the search itself failed (explain_failure); then other initial guesses may succeed.
constexpr std::string_view kUnexplained = "each arm alone reaches its grasp point";
constexpr int kBetweenTries = 8;  // number of times without a plan between two such attempts

// Position of an undisturbed servicer: its moving centre of mass, or the fixed base; and the maximum reach of each
// grasp's end-effector from there.
class Servicer {
 public:
  // Problem => servicer at the start of the approach: motion of its centre of mass and, per grasp, the maximum reach
  // (6.18), the point it is measured from and the arm's first joint, in W.
  explicit Servicer(const CaptureProblem& problem) : system_(make_servicer(problem)) {
    const Model& model = system_.model;
    const CaptureSystem simulated = make_moving_servicer(problem);
    const State state = without_inner_motion(simulated, initial_servicer_state(problem, simulated), system_);
    floats_ = problem.robot.base_mode == RobotSetup::Base::free;
    motion_ = free_motion(model, state, 0, problem.gravity);
    const Kinematics kinematics = forward_kinematics(model, state);
    const Posed& X_WB = kinematics.X_WB[system_.base];
    for (const GraspSetup& grasp : problem.grasps) {
      const int frame = model.frame_index(grasp.end_effector);
      const ReachBound bound = reach_bound(model, system_.base, frame, floats_);
      const int first = arm_reach(model, frame).first_body;
      arms_.push_back({bound.length, X_WB * bound.from, kinematics.X_WB[first < 0 ? system_.base : first].p});
    }
  }

  bool floats() const { return floats_; }
  const Model& model() const { return system_.model; }
  /// Point from which a grasp's reach is measured.
  Vector3d origin(std::size_t grasp, double t) const { return floats_ ? motion_.com_at(t) : arms_[grasp].from; }
  double reach(std::size_t grasp) const { return arms_[grasp].reach; }
  /// Position of its arm's first joint for a base without reaction to the joints.
  Vector3d first_joint(std::size_t grasp, double t) const {
    return floats_ ? arms_[grasp].first_joint + motion_.com_at(t) - motion_.com_at(0) : arms_[grasp].first_joint;
  }
  Vector3d velocity(double t) const {
    if (!floats_) return Vector3d::zero();
    return (1 / motion_.mass) * motion_.h.linear + t * motion_.gravity;
  }

 private:
  struct Arm {
    double reach;          // [m]
    Vector3d from;         // for a fixed base, in W
    Vector3d first_joint;  // at the start, in W
  };
  CaptureSystem system_;
  bool floats_ = true;
  FreeMotion motion_;
  std::vector<Arm> arms_;  // per grasp
};

// Whether contacts, or external forces other than gravity, may move servicer or target; then distances are unknown
// without simulation.
bool is_pushed(const CaptureProblem& problem) {
  const auto& control = problem.approach->base_control;
  const bool fires = control && (control->actuators == BaseControlSetup::Actuators::thrusters || control->dumping);
  return problem.orbit.has_value() || !problem.loads.empty() || fires || !problem.contacts.empty();
}

// One search, with the data of the planner: in W, with targets at their estimated states.
class WindowSearch {
 public:
  WindowSearch(const CaptureProblem& problem, const CaptureProgress& progress)
      : problem_(problem),
        window_(*problem.approach->window),
        seen_(navigates(problem) ? estimated_problem(problem) : problem),
        frame_(moving_frame(problem)),
        servicer_(seen_),
        progress_(progress),
        max_evaluations_(problem.approach->plan->max_evaluations),
        step_(window_.step > 0 ? window_.step : (window_.latest - window_.earliest) / 50) {
    problem_.approach->window.reset();
    seen_.approach->window.reset();
    predict();
    if (is_pushed(seen_)) return;
    for (const GraspSetup& grasp : seen_.grasps) fastest_.push_back(fastest_change(grasp));
  }

  // Window => capture time and the problem with that duration: times that (6.19) does not exclude are planned, then the
  // choice is refined between them. Without a plan, `failure` names the cause.
  CaptureTime run() {
    report_.time = kNone;
    if (!fastest_.empty()) report_.not_before = first_within_reach();
    for (const double t : times()) evaluate(t);
    std::optional<std::size_t> best = chosen();
    if (best) {
      if (window_.choose == Choose::soonest)
        bisect(*best);
      else
        refine(*best);
      best = chosen();
      report_.time = report_.points[*best].time;
    }
    CaptureTime result{problem_, {}, "", closest_plan_, evaluations_};
    if (!best) result.failure = why_not();
    result.problem.approach->duration = best ? report_.time : nearest().time;
    result.window = std::move(report_);
    return result;
  }

 private:
  // --- Times ---

  std::vector<double> times() const {
    std::vector<double> all;
    // A multiple of the step that equals the latest time up to rounding error is the latest time.
    const double length = window_.latest - window_.earliest;
    for (long k = 0; static_cast<double>(k) * step_ < length * (1 - 1e-9); ++k)
      all.push_back(window_.earliest + static_cast<double>(k) * step_);
    all.push_back(window_.latest);
    return all;
  }

  // The best point evaluated so far; the first one among equals.
  std::optional<std::size_t> chosen() const {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < report_.points.size(); ++i) {
      if (report_.points[i].reachable && (!best || value(report_.points[i]) < value(report_.points[*best]))) best = i;
    }
    return best;
  }

  double value(const WindowPoint& point) const {
    if (!point.reachable) return kInfinite;
    switch (window_.choose) {
      case Choose::soonest:
        return point.time;
      case Choose::slowest:
        return point.speed;
      case Choose::objective:
        break;
    }
    return point.objective;
  }

  // Bisection between the first feasible time and the infeasible one before it.
  void bisect(std::size_t first) {
    if (first == 0) return;
    double out = report_.points[first - 1].time, in = report_.points[first].time;
    while (in - out > kRefined * step_) {
      failures_ = kBetweenTries;  // a few initial guesses at each of these times
      const double middle = 0.5 * (out + in);
      (evaluate(middle).reachable ? in : out) = middle;
    }
  }

  // Golden section search around the best sample, whose neighbours are worse or absent.
  void refine(std::size_t best) {
    constexpr double kGolden = 0.3819660112501051;  // (3 - sqrt 5)/2
    double middle = report_.points[best].time, smallest = value(report_.points[best]);
    double begin = best > 0 ? report_.points[best - 1].time : middle;
    double end = best + 1 < report_.points.size() ? report_.points[best + 1].time : middle;
    while (end - begin > 2 * kRefined * step_) {
      const bool above = end - middle > middle - begin;
      const double t = middle + kGolden * (above ? end - middle : begin - middle);
      const double there = value(evaluate(t));
      if (there < smallest) {
        (above ? begin : end) = middle;
        middle = t, smallest = there;
      } else {
        (above ? end : begin) = t;
      }
    }
  }

  // --- One time ---

  const WindowPoint& evaluate(double t) {
    WindowPoint point = where_things_are(t);
    if (point.reason.empty())
      plan(point);
    else
      failed_from_.clear();
    found_before_ = point.reachable;
    const auto place = std::upper_bound(report_.points.begin(), report_.points.end(), t,
                                        [](double time, const WindowPoint& p) { return time < p.time; });
    return *report_.points.insert(place, std::move(point));
  }

  // The targets' motion up to the latest time, with contacts, if it does not depend on the capture time.
  void predict() {
    if (seen_.contacts.empty()) return;
    const auto depends = [](const TargetSetup& t) { return t.given_at == TargetSetup::Instant::capture; };
    if (std::ranges::any_of(seen_.targets, depends)) return;
    CaptureProblem until_latest = seen_;
    until_latest.approach->duration = window_.latest;
    const auto each_step = [this](double) { report_progress(0); };
    predicted_ = predict_contacts(until_latest, plan_targets(until_latest, each_step), 0, window_.latest, each_step);
  }

  TargetMotion target_at(const TargetSetup& target, double t) const {
    const TargetMotion given{target.X_WT, target.V_WT};
    if (target.given_at == TargetSetup::Instant::capture) return given;
    if (const auto index = static_cast<std::size_t>(&target - seen_.targets.data());
        predicted_ && !predicted_->instants.empty() && !predicted_->instants[index].empty())
      return motion_in_plan(seen_, *predicted_, index, window_.latest, t, [this](double) { report_progress(0); });
    return propagate_target(seen_, target, given, 0, t, [this](double) { report_progress(0); });
  }

  // Goals of a run with this duration.
  std::vector<Goal> goals_at(double t) const {
    TargetPlan targets;
    for (const TargetSetup& target : seen_.targets) targets.capture.push_back(target_at(target, t));
    targets.start = targets.capture;
    std::vector<Goal> goals = capture_goals(seen_, servicer_.model(), targets);
    for (std::size_t g = 0; g < goals.size(); ++g) {
      // The motion is that of the grasp point; the relative velocity of the end-effector is excluded.
      goals[g].V_WG.linear -= seen_.grasps[g].relative_velocity;
      goals[g].V_WG.angular -= seen_.grasps[g].relative_angular_velocity;
    }
    return goals;
  }

  double reach(std::size_t grasp, const Goal& goal) const { return servicer_.reach(grasp) + goal.accepted_distance; }

  // Checks that need no plan; gives a reason if one of them rules out the time.
  WindowPoint where_things_are(double t) const {
    constexpr double kRounding = 1e-12;  // relative; a point at the limit counts as within reach
    WindowPoint point;
    point.time = t;
    point.objective = point.direction_angle = kNone;
    const std::vector<Goal> goals = goals_at(t);
    for (std::size_t g = 0; g < goals.size(); ++g) {
      const GraspSetup& grasp = seen_.grasps[g];
      const Goal& goal = goals[g];
      const double away = norm(goal.X_WG.p - servicer_.origin(g, t)), reach = this->reach(g, goal);
      const double share = std::isfinite(reach) ? away / reach : 0;
      point.speed = std::max(point.speed, norm(goal.V_WG.linear - servicer_.velocity(t)));
      if (share > 1 + kRounding && share > point.reach_share && !fastest_.empty()) {
        point.reason =
            fmt::format("grasp point '{}' of '{}' is {:.4g} m from the {}; end-effector '{}' reaches {:.4g} m",
                        goal.point, goal.target, away, origin_name(), goal.name, reach);
      }
      point.reach_share = std::max(point.reach_share, share);
      const GraspPoint& grasp_point = grasp_point_of(seen_, grasp);
      if (!grasp_point.approach_direction) continue;
      const double angle = angle_between(goal.direction_W, goal.X_WG.p - servicer_.first_joint(g, t));
      const bool is_constrained = seen_.approach->straight_in || grasp.orientation != GraspSetup::Orientation::free;
      if (is_constrained && angle > 0.5 * std::numbers::pi && point.reason.empty()) {
        point.reason = fmt::format(
            "the approach direction of grasp point '{}' of '{}' points towards the servicer: it is {:.3g} deg off the "
            "line from the arm's first joint to the grasp point",
            goal.point, goal.target, angle * 180 / std::numbers::pi);
      }
      if (!(angle <= point.direction_angle)) point.direction_angle = angle;
    }
    return point;
  }

  const char* origin_name() const {
    return servicer_.floats() ? "servicer's centre of mass" : "point at which the base carries the arm";
  }

  static double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(norm(cross(a, b)), dot(a, b)); }

  // Time of the point => reachability, reason and objective of the point; remembers the closest failed plan and its
  // final iterate. Throws std::runtime_error at the evaluation limit.
  void plan(WindowPoint& point) {
    if (evaluations_ >= max_evaluations_) {
      throw std::runtime_error(
          fmt::format("choosing the capture time: evaluation limit reached after {} evaluations of the servicer's "
                      "motion, at t = {:.6g} s of a window from {:.6g} to {:.6g} s; increase approach.window.step, "
                      "reduce approach.plan.starts, or increase approach.plan.max_evaluations",
                      evaluations_, point.time, window_.earliest, window_.latest));
    }
    ApproachPlan plan = first_try(point.time);
    if (plan.failure.empty() && !is_whole_try_) plan = plan_at(point.time, *problem_.approach->plan);
    point.reachable = plan.failure.empty();
    point.reason = plan.failure;
    failed_from_ = point.reachable ? std::vector<double>{} : plan.report.final_position;
    failures_ = point.reachable ? 0 : failures_ + 1;
    if (point.reachable) {
      point.objective = plan.report.objective_value;
    } else if (!closest_ || point.reach_share < closest_->reach_share) {
      closest_ = point;
      closest_plan_ = std::move(plan.report);
    }
  }

  // First attempt at a time. If the previous time has a plan, this is the full plan. Otherwise the search starts from
  // the final iterate of the failed one, at a tenth of the cost. If it names a cause for an arm, other initial guesses
  // rarely succeed; a few are tried periodically nevertheless.
  ApproachPlan first_try(double t) {
    PlanSetup setup = *problem_.approach->plan;
    is_whole_try_ = found_before_;
    if (is_whole_try_) return plan_at(t, setup);
    setup.objective = PlanSetup::Objective::as_found;
    setup.weights.reset();
    PlanSetup few = setup;
    few.starts = std::min(setup.starts, kFewStarts);
    if (failures_ % kBetweenTries == 0 || failed_from_.empty()) return plan_at(t, few);
    setup.guess = failed_from_;
    setup.starts = 1;
    ApproachPlan plan = plan_at(t, setup);
    return plan.failure.find(kUnexplained) == std::string::npos ? plan : plan_at(t, few);
  }

  // Capture time and search settings => plan, in the frame of the runs and with estimated targets; errors of planning
  // become its `failure`. Adds the evaluations made.
  ApproachPlan plan_at(double t, const PlanSetup& setup) {
    CaptureProblem at = problem_;
    at.approach->duration = t;
    at.approach->plan = setup;
    // In the frame of the runs: rounding errors in another frame would change where searches end within their
    // tolerance.
    if (!frame_.is_world()) at = seen_from(frame_, std::move(at));
    if (navigates(at)) at = estimated_problem(at);
    long done = 0;
    const auto progress = [&](const std::string&, double evaluations, double) {
      done = static_cast<long>(evaluations);
      report_progress(done);
    };
    ApproachPlan plan;
    try {
      plan = plan_approach(at, plan_targets(at), CaptureDetail::columns, progress);
    } catch (const std::runtime_error& error) {
      if (stopped_) throw;
      plan.failure = error.what();
    }
    evaluations_ += std::max(done, plan.report.rhs_evaluations);
    return plan;
  }

  void report_progress(long done) const {
    if (!progress_) return;
    try {
      progress_(kPlanning, static_cast<double>(std::min(evaluations_ + done, max_evaluations_)),
                static_cast<double>(max_evaluations_));
    } catch (...) {
      stopped_ = true;
      throw;
    }
  }

  // --- By distance alone ---

  // Upper bound of the rate at which the distance between a grasp point and the origin of its arm's reach changes, as a
  // function of T [m/s].
  double fastest_change(const GraspSetup& grasp) const {
    const TargetSetup& target = target_of(seen_, grasp);
    const double falls = servicer_.floats() ? 0 : 10 * window_.latest * norm(seen_.gravity);
    if (target.given_at == TargetSetup::Instant::capture)  // the same at all times
      return norm(servicer_.velocity(0)) + (servicer_.floats() ? 10 * window_.latest * norm(seen_.gravity) : 0);
    const Vector3d to_com = target.X_WT.R * target.com;
    const Vector3d velocity = target.V_WT.linear + cross(target.V_WT.angular, to_com);
    const Vector3d w_T = transposed_times(target.X_WT.R, target.V_WT.angular);
    const double momentum = norm(target.inertia * w_T);
    const Symmetric3d& I = target.inertia;
    const Eigen::Matrix3d inertia{{I.xx, I.xy, I.xz}, {I.xy, I.yy, I.yz}, {I.xz, I.yz, I.zz}};
    const double min_inertia =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues()[0];
    // |w| <= |L| / J_min, and L is constant.
    return norm(velocity - servicer_.velocity(0)) + falls +
           momentum / min_inertia * norm(grasp_point_of(seen_, grasp).X_TG.p - target.com);
  }

  // The time before which distances rule out every capture; absent if they do not at the window's begin. From any time
  // on, a capture is ruled out for at least the time that the farthest grasp point needs to come within reach. Times
  // beyond the window are included, to report how long to wait.
  std::optional<double> first_within_reach() const {
    constexpr int kMaxSteps = 20'000;
    const double horizon = 10 * window_.latest;
    double t = window_.earliest;
    for (int i = 0; i < kMaxSteps; ++i) {
      const std::vector<Goal> goals = goals_at(t);
      double wait = 0;
      for (std::size_t g = 0; g < goals.size(); ++g) {
        const double gap = norm(goals[g].X_WG.p - servicer_.origin(g, t)) - reach(g, goals[g]);
        if (gap > 0) wait = std::max(wait, gap / fastest_[g]);
      }
      if (!(wait > 0)) break;
      if (t + wait >= horizon) return horizon;
      t += wait;
      if (wait < 1e-6 * step_) break;
    }
    return t > window_.earliest ? std::optional(t) : std::nullopt;
  }

  // --- No capture is feasible ---

  // Among the times at which a plan was attempted, the one best within reach; otherwise among all times.
  const WindowPoint& nearest() const {
    const auto nearer = [](const WindowPoint& a, const WindowPoint& b) { return a.reach_share < b.reach_share; };
    return closest_ ? *closest_ : *std::min_element(report_.points.begin(), report_.points.end(), nearer);
  }

  std::string why_not() const {
    std::string text =
        fmt::format("no capture can be planned between t = {:.6g} and {:.6g} s", window_.earliest, window_.latest);
    if (report_.not_before) {
      text += fmt::format("; the distance rules out any capture before t = {:.6g} s{}", *report_.not_before,
                          *report_.not_before >= 10 * window_.latest ? ", the latest time checked" : "");
    }
    const WindowPoint& at = nearest();
    return text + fmt::format("; at t = {:.6g} s, the closest attempt: {}", at.time, at.reason);
  }

  CaptureProblem problem_;  // as given
  const CaptureWindow window_;
  CaptureProblem seen_;  // as the planner sees it
  const MovingFrame frame_;
  const Servicer servicer_;
  const CaptureProgress& progress_;
  const long max_evaluations_;
  const double step_;
  std::optional<TargetPlan> predicted_;
  std::vector<double> fastest_;  // per grasp; empty: distances rule nothing out
  WindowReport report_;
  std::optional<WindowPoint> closest_;  // failed plan with the closest grasp points
  PlanReport closest_plan_;             // its report
  bool found_before_ = false;           // at the time evaluated last
  bool is_whole_try_ = false;           // whether the last first_try() was the full plan
  std::vector<double> failed_from_;     // final iterate of the last failed search; empty: it succeeded
  int failures_ = 0;                    // number of consecutive failures
  long evaluations_ = 0;
  mutable bool stopped_ = false;
};

}  // namespace

CaptureTime choose_capture_time(const CaptureProblem& problem, const CaptureProgress& progress) {
  // Checked at both ends of the window: events before the capture must precede the earliest time.
  CaptureProblem checked = problem;
  for (const double duration : {problem.approach->window->latest, problem.approach->window->earliest}) {
    checked.approach->duration = duration;
    make_capture_system(checked);
  }
  return WindowSearch(problem, progress).run();
}

}  // namespace grapnel
