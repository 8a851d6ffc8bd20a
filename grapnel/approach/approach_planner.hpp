#pragma once

/// @file
/// Plans one approach, segment by segment: what approach_plan.cpp (waypoints, the final segment, stated motion),
/// flown_plan.cpp (what the momentum integral does not know) and straight_in_plan.cpp (the last piece straight in)
/// share.

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/flown_solution.hpp"
#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/approach/planned_base.hpp"
#include "grapnel/approach/way_setup.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/straight_way.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Of the joints' motion on a segment, as PathSegment::fly() takes it.
struct Spline {
  int knots = 0;
  std::vector<double> coefficients = {};
};

/// Ends planning; becomes ApproachPlan::failure.
struct Unplannable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One plan, segment by segment. Joints are those of the servicer alone, which are the robot's in the same order. All
/// that is given must outlive the object.
class ApproachPlanner {
 public:
  ApproachPlanner(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
                  const CaptureProgress& progress, double begin, ApproachPlan& plan);

  void run();

  // Why it was given up, and what would help.
  std::string given_up() const;

  // What was reached, also where planning failed.
  void close();

 private:
  long most_evaluations() const { return approach_.plan.value_or(PlanSetup{}).max_evaluations; }
  static WorkWatch::Look look_of(const CaptureProgress& progress, long most) {
    if (!progress) return {};
    return [&progress, most](long done) { progress(kPlanning, static_cast<double>(done), static_cast<double>(most)); };
  }

  // Where attitude control does, the base is at the attitude that it is to have from the first, about the same centre
  // of mass.
  void keep_attitude();
  bool attitude_kept() const { return base_.floats() && !base_.turns(); }

  // How long the joints take at least from rest to rest: the shortest of the approach's parts, all of them also where
  // the rest is planned anew.
  double shortest_motion() const;

  // Joints that move no end-effector that grasps.
  void hold_idle_joints();

  // --- Segments

  SegmentStart segment_to(double end) const { return {time_, end, approach_.profile, position_, rate_, X_WB_}; }

  // Flies a segment to final values and goes on from there.
  void advance(double end, const std::vector<double>& position, const std::vector<double>& rate, int knots = 0,
               const std::vector<double>& coefficients = {});
  ReachProblem reach_to(double end, std::vector<Goal> goals, RateDemand demand) const;

  // The settings of approach.plan.
  void set_search(ReachProblem& reach);
  void set_wheels(WaySetup& way);

  // Bodies nearer to each other than approach.plan.clearance where the segment begins, where no motion can part them.
  // The rest of an approach that is planned again goes on with the clearance that there is.
  void check_start_clearance(ReachProblem& reach);

  // What makes no sense of a base that is planned for as one that keeps its attitude.
  static void refuse_turning(const PlanSetup& plan);
  ReachSolution solve(const ReachProblem& reach, const std::string& what);
  [[noreturn]] void refuse_unreachable(const ReachProblem& reach, const ReachSolution& solution,
                                       const std::string& what);
  /// The same where a flight corrects the solution afterwards: goals out of the reach of a base that momentum alone
  /// moves are searched for from where loads and an orbit's field bring it.
  ReachSolution solve_where_loads_lead(const ReachProblem& reach, const std::string& what);

  // What loads and an orbit's field do to the servicer until the segment's end, its joints kept where they are: its
  // base by momentum alone, and with them.
  struct Drift {
    Posed X_WB_free = Posed::identity(), X_WB = Posed::identity();
    Twistd V_WB_free = Twistd::zero(), V_WB = Twistd::zero();  // at the base's origin, in W
    double distance() const { return norm(X_WB.p - X_WB_free.p); }
    double turn() const { return rotation_angle(transpose(X_WB_free.R) * X_WB.R); }
  };
  std::optional<Drift> drift(const ReachProblem& reach);
  std::string explain_base(const ReachProblem& reach);
  void report(const ReachProblem& reach, const ReachSolution& solution);
  PlannedWay planned_way(const ReachProblem& reach, const ReachSolution& solution) const;

  // --- Waypoints

  void pass(const Waypoint& w);
  TargetMotion target_at(std::size_t target, double time) const;

  // For integrations of the whole dynamics.
  std::function<void(double)> each_step() const;

  // --- The final segment

  void final_segment(double end);

  // Rates that meet the demand at given final values.
  std::vector<double> settled_rates(const ReachProblem& reach, const std::vector<double>& position);
  void warn_of_unmet(double unmet, const std::vector<double>& rates);
  void warn_of_approximation(const ReachProblem& reach, const ReachSolution& s);

  // Rates that no joint can have, or that make it swing on its way. Before the final segment is added to the plan.
  void warn_of_rates(const std::vector<double>& rates, double end);

  // --- What the momentum integral does not know

  // Loads on the servicer, an orbit's field, attitude control, rotors or what bends: the motion is then not that of
  // joints and a constant momentum.
  bool disturbed() const;
  bool bends() const { return !flown_.elastic_joints.empty(); }
  bool has_rotors() const { return !flown_.wheels.empty() || !flown_.gyros.empty(); }
  bool loaded() const { return !loads_on(servicer_.model, problem_.loads).empty(); }

  // The robot that is planned for, where it is not the one that flies: it ...
  std::string planned_robot() const;

  // Where another robot flies than is planned for; once, not again with every rest that is planned anew.
  bool is_to_be_said_what_flies() const { return begin_ == 0 && !planned_robot().empty(); }

  // Flights that correct plans know what attitude control asks, and wheels, but no thrusters.
  void warn_of_thrusters();

  // Of them, those that there are.
  std::string disturbances() const;

  // Loads on a target that is to be grasped.
  bool targets_loaded() const;

  // Goals for the servicer taken for rigid, whose end-effectors are where it wants them when those that its bending has
  // moved are where they are to be, and likewise their velocities.
  std::vector<Goal> less_bending(std::vector<Goal> goals, const State& flown, const State& rigid) const;

  // Where joints that follow these final values exactly bring the servicer, with everything that acts on it.
  State fly_disturbed(const ReachProblem& reach, const std::vector<double>& position, const std::vector<double>& rate,
                      const Spline& spline, const StepWatch& watch = {});
  State fly(const std::vector<JointTrajectory>& joints, double end, StepWatch watch = {});

  // What the base and its wheels do in such a flight, in words.
  std::string what_it_does(const ReachProblem& reach, const std::vector<double>& position,
                           const std::vector<double>& rate, const Spline& spline);

  // A disturbed motion's end, against the goals and the demand.
  FlownEnd disturbed_end(const ReachProblem& reach, const std::vector<double>& position,
                         const std::vector<double>& rate, const Spline& spline);

  // From the solution without disturbance to the one with it. A spline's coefficients stay, so that what was asked of
  // the way is kept but for what the final values change.
  ReachSolution allow_for_disturbance(const ReachProblem& reach, ReachSolution solution, const std::string& what);

  // Rates that meet the demand at given final values at the end of the disturbed motion that they lead to; the
  // undisturbed ones, with a warning, where none are found.
  std::vector<double> disturbed_rates(const ReachProblem& reach, const std::vector<double>& position,
                                      const std::vector<double>& undisturbed);

  // --- Straight in

  void stand_off_and_in(double begin);

  // The stand-off, and what was asked of the way there. `guess`: where the search begins; empty: as approach.plan says.
  struct PlannedStandOff {
    ReachProblem reach;
    ReachSolution solution;
  };
  PlannedStandOff plan_stand_off(StraightInProblem& in, const std::vector<double>& guess);

  // To the stand-off and straight in; what that leaves in the end. `guess`: where the search for the stand-off begins;
  // empty: as approach.plan says.
  std::vector<GoalGap> come_in(StraightInProblem& in, const std::vector<double>& guess);

  // A configuration at the stand-off, and the piece from there.
  struct StandOff {
    ReachSolution solution;
    StraightWay piece;
  };
  StandOff try_stand_off(StraightInProblem in, const ReachProblem& reach, ReachSolution solution);

  // From the stand-off that the search found, or else from another one, to a piece that keeps what `reach` asks of the
  // way: from near it, where the piece itself says that it would be kept, then from others.
  StandOff keep_on_the_way(StraightInProblem in, const ReachProblem& reach, ReachSolution solution);
  std::optional<StandOff> begin_where_it_keeps(StraightInProblem in, const ReachProblem& reach, const StandOff& from);
  std::optional<StandOff> stand_off_near(StraightInProblem in, const ReachProblem& reach,
                                         const std::vector<double>& guess, int starts);

  // What the objective asked for is at a solution that another one chose.
  void take_objective(const ReachProblem& reach, ReachSolution& solution);
  [[noreturn]] void refuse_straight_in(const StraightInProblem& in, const ReachProblem& reach, const StandOff& best,
                                       int tried);

  // What the rigid robot is to do at the grasp points is changed, in their targets, by what a flight of the one that
  // bends is off, until that one's end-effectors are and move as they are meant to.
  void come_in_bending(StraightInProblem& in);

  // How end-effectors stand and move in the end against what they come in for.
  using Gaps = std::vector<GoalGap>;
  std::vector<Goal> final_goals(const StraightInProblem& in) const;
  Gaps gaps_in_flight(const StraightInProblem& in, const State& end) const;
  void report_gaps(const Gaps& gaps);

  // What is asked of the end-effectors, in their targets, less what they were off.
  void shift_goals(const Gaps& gaps, StraightInProblem& in) const;

  // Plans, flies and corrects the plan, which begins from what there is now, by what the flight shows, `most` times or
  // until it arrives or corrections do not help any more. The best of the plans stays. `plan` says what the plan itself
  // leaves, which no flight can better, `correct` gets what a flight misses beside.
  struct ByFlights {
    std::function<Gaps()> plan, fly;
    std::function<void(const Gaps&)> correct;
  };
  struct Flown {
    Gaps gaps;
    double beside = 0;  // the largest of what the plan does not leave itself [m, rad, m/s, rad/s]
  };
  Flown correct_by_flights(const ByFlights& steps, int most);

  // To the stand-off as flights correct it, and from there straight in with the momentum, the centre of mass and the
  // targets' motion that a flight of the plan shows, until the plan arrives in flight.
  void come_in_flown(StraightInProblem& in);

  // With which a base that is planned for as one that keeps its attitude turns all the same, in B [rad/s].
  Vector3d turn_beside(const State& servicer) const;

  // A flight of the plan: what moves the servicer over the piece, and what it misses in the end.
  Gaps fly_over(const StraightInProblem& in, StraightInSurroundings& around);
  std::function<std::vector<FreeBody>(double time)> targets_over(const StraightInProblem& in) const;
  void warn_of_flown_miss(const Flown& flown);

  // A singularity on the way may be passed and made up for; one at the end may not.
  void require_arrival(const StraightInPath& path);
  void take_straight_in(const StraightInProblem& in, const StraightInPath& path);

  // --- Stated motion

  JointTrajectory stated(std::size_t joint) const;
  void follow_stated();

  const CaptureProblem& problem_;
  const ApproachSetup& approach_;
  const TargetPlan& targets_;
  const CaptureDetail detail_;
  ApproachPlan& plan_;
  const double begin_;
  CaptureSystem servicer_;  // for what plans by momentum: its wheels are parts of the base
  CaptureSystem flown_;     // with wheels that turn
  State flown_start_;
  State start_state_;  // of servicer_
  FloatingBase base_;
  FreeMotion motion_;
  mutable WorkWatch watch_;
  double time_;
  std::vector<double> position_, rate_, lower_, upper_, rate_limit_, effort_limit_;
  Posed X_WB_;
};

}  // namespace grapnel
