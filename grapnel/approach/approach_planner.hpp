#pragma once

/// @file
/// Plans one approach, segment by segment. Shared by approach_plan.cpp (waypoints, the final segment, stated
/// motion), simulated_plan.cpp (corrections by forward simulation) and straight_in_plan.cpp (the final straight
/// approach).

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/approach/planned_base.hpp"
#include "grapnel/approach/planning_setup.hpp"
#include "grapnel/approach/simulated_solution.hpp"
#include "grapnel/plan/constrained_straight_in.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Spline of the joints' motion on a segment, as PathSegment::integrate() takes it.
struct Spline {
  int knots = 0;
  std::vector<double> coefficients = {};
};

/// Ends planning; its message becomes ApproachPlan::failure.
struct Unplannable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One plan, segment by segment. Joints are those of the servicer alone, in the order of the robot's joints. All
/// arguments must outlive the object.
class ApproachPlanner {
 public:
  ApproachPlanner(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
                  const CaptureProgress& progress, double begin, ApproachPlan& plan);

  void run();

  // Message if the evaluation limit is reached, with possible remedies.
  std::string given_up() const;

  // Records the result, also if planning failed.
  void close();

 private:
  long max_evaluations() const { return approach_.plan.value_or(PlanSetup{}).max_evaluations; }
  static WorkWatch::Callback progress_callback(const CaptureProgress& progress, long limit) {
    if (!progress) return {};
    return
        [&progress, limit](long done) { progress(kPlanning, static_cast<double>(done), static_cast<double>(limit)); };
  }

  static std::function<void(double)> shown_on(const CaptureProgress& progress) {
    if (!progress) return {};
    return [&progress](double) { progress(kPlanning, 0, 0); };
  }

  // For an attitude-controlled base: sets the base to its desired attitude from the start, about the same centre of
  // mass.
  void hold_attitude();
  bool attitude_held() const { return base_.floats() && !base_.turns(); }

  // Duration of the shortest part of the approach, for motions from rest to rest. Includes all parts even if only the
  // remaining approach is replanned.
  double shortest_motion() const;

  // Holds joints that move no grasping end-effector.
  void hold_idle_joints();

  // --- Segments

  SegmentStart segment_to(double end) const { return {time_, end, approach_.profile, position_, rate_, X_WB_}; }

  // Adds a segment to the given final values and continues from its end.
  void advance(double end, const std::vector<double>& position, const std::vector<double>& rate, int knots = 0,
               const std::vector<double>& coefficients = {});
  ReachProblem reach_to(double end, std::vector<Goal> goals, RateDemand demand) const;

  // Applies the settings of approach.plan.
  void set_search(ReachProblem& reach);
  void set_wheels(PathConstraints& constraints);

  // Checks the clearance at the segment's begin. Bodies closer than approach.plan.clearance that no motion can separate
  // are an error. A replanned approach continues with the clearance that exists at its begin.
  void check_start_clearance(ReachProblem& reach);

  // Rejects settings that contradict an attitude-controlled base.
  static void refuse_turning(const PlanSetup& plan);
  ReachSolution solve(const ReachProblem& reach, const std::string& what);
  [[noreturn]] void refuse_unreachable(const ReachProblem& reach, const ReachSolution& solution,
                                       const std::string& what);
  /// As above, for solutions that a forward simulation corrects afterwards. Goals beyond the reach of a
  /// momentum-conserving base are searched for from the base pose that loads and the orbital field produce.
  ReachSolution solve_where_loads_lead(const ReachProblem& reach, const std::string& what);

  // Base motion until the segment's end with fixed joints: with conserved momentum, and with loads and the orbital
  // field.
  struct Drift {
    Posed X_WB_free = Posed::identity(), X_WB = Posed::identity();
    Twistd V_WB_free = Twistd::zero(), V_WB = Twistd::zero();  // at the base's origin, in W
    double distance() const { return norm(X_WB.p - X_WB_free.p); }
    double turn() const { return rotation_angle(transpose(X_WB_free.R) * X_WB.R); }
  };
  std::optional<Drift> drift(const ReachProblem& reach);
  std::string explain_base(const ReachProblem& reach);
  void report(const ReachProblem& reach, const ReachSolution& solution);
  PlannedPath planned_path(const ReachProblem& reach, const ReachSolution& solution) const;

  // --- Waypoints

  void pass(const Waypoint& w);
  TargetMotion target_at(std::size_t target, double time) const;

  // Progress callback for integrations of the full dynamics.
  std::function<void(double)> each_step() const;

  // --- The final segment

  void final_segment(double end);

  // Rates that meet the demand at given final values.
  std::vector<double> settled_rates(const ReachProblem& reach, const std::vector<double>& position);
  void warn_of_unmet(double unmet, const std::vector<double>& rates);
  void warn_of_approximation(const ReachProblem& reach, const ReachSolution& s);

  // Warns of rates beyond joint limits or rates that cause overshoot. Call before the final segment is added to the
  // plan.
  void warn_of_rates(const std::vector<double>& rates, double end);

  // --- Effects outside the momentum integral

  // Whether loads on the servicer, an orbital field, attitude control, rotors or flexible links act. Then joint motion
  // and constant momentum do not determine the base motion.
  bool disturbed() const;
  bool bends() const { return !simulated_servicer_.elastic_joints.empty(); }
  bool has_rotors() const { return !simulated_servicer_.wheels.empty() || !simulated_servicer_.gyros.empty(); }
  bool loaded() const { return !loads_on(servicer_, problem_.loads).empty(); }

  // Description of the planned robot if it differs from the simulated one: "it ..."
  std::string planned_robot() const;

  // Whether to report the difference between planned and simulated robot: at the first plan only, not when replanning.
  bool reports_model_difference() const { return begin_ == 0 && !planned_robot().empty(); }

  // Warns that simulations for plan corrections apply the attitude control's demand and the wheels, but no thrusters.
  void warn_of_thrusters();

  // Names of the active disturbances.
  std::string disturbances() const;

  // Whether loads act on a target that is to be grasped.
  bool targets_loaded() const;

  // Reports the contacts that the prediction contains and what the plan assumes of others.
  void report_contacts();

  // Goals for a rigid model of the servicer. With them the end-effectors of the flexible servicer, displaced by its
  // deflection, have the intended poses and velocities.
  std::vector<Goal> less_bending(std::vector<Goal> goals, const State& simulated, const State& rigid) const;

  // Final state of the servicer in a simulation with exact joint tracking to these final values and all loads.
  State simulate_disturbed(const ReachProblem& reach, const std::vector<double>& position,
                           const std::vector<double>& rate, const Spline& spline, const StepWatch& watch = {});
  State simulate(const std::vector<JointTrajectory>& joints, double end, StepWatch watch = {});

  // Description of the motion of the base and its wheels in such a simulation.
  std::string what_it_does(const ReachProblem& reach, const std::vector<double>& position,
                           const std::vector<double>& rate, const Spline& spline);

  // Errors at the end of a disturbed motion, relative to the goals and the demand.
  SimulatedEnd disturbed_end(const ReachProblem& reach, const std::vector<double>& position,
                             const std::vector<double>& rate, const Spline& spline);

  // Corrects the undisturbed solution for disturbances. The spline coefficients are unchanged; path constraints hold
  // except for the effect of the changed final values.
  ReachSolution allow_for_disturbance(const ReachProblem& reach, ReachSolution solution, const std::string& what);

  // Rates that meet the demand at given final values, at the end of the disturbed motion. If none are found: the
  // undisturbed rates, with a warning.
  std::vector<double> disturbed_rates(const ReachProblem& reach, const std::vector<double>& position,
                                      const std::vector<double>& undisturbed);

  // --- Final straight approach

  void stand_off_and_in(double begin);

  // The stand-off and the path constraints up to it. `guess`: first guess of the search; empty: that of approach.plan.
  struct PlannedStandOff {
    ReachProblem reach;
    ReachSolution solution;
  };
  PlannedStandOff plan_stand_off(StraightInProblem& in, const std::vector<double>& guess);

  // Plans the motion to the stand-off and the final straight approach; returns its final errors. `guess`: first guess
  // of the search for the stand-off; empty: that of approach.plan.
  std::vector<GoalGap> come_in(StraightInProblem& in, const std::vector<double>& guess);

  // A stand-off configuration and the final straight approach from it.
  struct StandOff {
    ReachSolution solution;
    ConstrainedStraightIn straight_in;
  };
  StandOff try_stand_off(StraightInProblem in, const ReachProblem& reach, ReachSolution solution);

  // Finds a final straight approach that satisfies the path constraints of `reach`, starting from the stand-off of the
  // search. Otherwise tries other stand-offs: first those that satisfy the constraints to first order, then further
  // ones.
  StandOff enforce_path_constraints(StraightInProblem in, const ReachProblem& reach, ReachSolution solution);
  std::optional<StandOff> constrained_stand_off(StraightInProblem in, const ReachProblem& reach, const StandOff& from);
  std::optional<StandOff> stand_off_near(StraightInProblem in, const ReachProblem& reach,
                                         const std::vector<double>& guess, int starts);

  // Evaluates the objective at a solution that another objective selected.
  void take_objective(const ReachProblem& reach, ReachSolution& solution);
  [[noreturn]] void refuse_straight_in(const StraightInProblem& in, const ReachProblem& reach, const StandOff& best,
                                       int tried);

  // Corrects the goals of the rigid robot, in the frames of their targets, by the errors of a simulation of the
  // flexible robot, until the simulated end-effectors have the intended poses and velocities.
  void come_in_bending(StraightInProblem& in);

  // Final errors of the end-effectors relative to their goals of the straight approach.
  using Gaps = std::vector<GoalGap>;
  std::vector<Goal> final_goals(const StraightInProblem& in) const;
  Gaps simulated_gaps(const StraightInProblem& in, const State& end) const;
  void report_gaps(const Gaps& gaps);

  // Subtracts the errors from the goals, in the targets' frames.
  void shift_goals(const Gaps& gaps, StraightInProblem& in) const;

  // Plans, simulates and corrects the plan by the simulated errors, at most `max_corrections` times, until the plan is
  // accurate or corrections no longer improve it. Starts from the present plan and keeps the best one. `plan` returns
  // the errors of the plan itself, which no correction removes; `correct` receives the additional errors of the
  // simulation.
  struct BySimulations {
    std::function<Gaps()> plan, simulate;
    std::function<void(const Gaps&)> correct;
  };
  struct SimulatedErrors {
    Gaps gaps;
    double beside = 0;  // largest error beyond that of the plan [m, rad, m/s, rad/s]
  };
  SimulatedErrors correct_by_simulations(const BySimulations& steps, int max_corrections);

  // Plans the stand-off with corrections by simulation. The final straight approach uses the momentum, the centre of
  // mass and the target motion of a simulation of the plan. Repeats until the simulated errors are within tolerance.
  void come_in_simulated(StraightInProblem& in);

  // Residual angular velocity of an attitude-controlled base, in B [rad/s].
  Vector3d turn_beside(const State& servicer) const;

  // Simulates the plan: records the motion of servicer and targets during the approach and returns the final errors.
  Gaps simulate_approach(const StraightInProblem& in, StraightInSurroundings& around);
  std::function<std::vector<FreeBody>(double time)> targets_over(const StraightInProblem& in) const;
  void warn_of_simulated_miss(const SimulatedErrors& errors);

  // Rejects a singularity at the end of the approach. One before the end is acceptable if the error decays.
  void require_arrival(const StraightInPath& path);
  void take_straight_in(const StraightInProblem& in, const StraightInPath& path);

  // --- Stated motion

  JointTrajectory stated(std::size_t joint) const;
  void follow_stated();

  const CaptureProblem& problem_;
  const ApproachSetup& approach_;
  const TargetPlan targets_;  // with contacts
  const CaptureDetail detail_;
  ApproachPlan& plan_;
  const double begin_;
  CaptureSystem servicer_;            // for planning by momentum: wheels are fixed to the base
  CaptureSystem simulated_servicer_;  // with rotating wheels
  State simulated_start_;
  State start_state_;  // of servicer_
  FloatingBase base_;
  FreeMotion motion_;
  mutable WorkWatch watch_;
  double time_;
  std::vector<double> position_, rate_, lower_, upper_, rate_limit_, effort_limit_;
  Posed X_WB_;
};

}  // namespace grapnel
