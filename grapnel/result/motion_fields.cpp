// The fields of summary.json about motion of bodies and joints, plans, and closed or missed grasps.
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {

template <>
const Type& type_of<BodyMotion>() {
  static constexpr Field fields[] = {
      field<&BodyMotion::name>("name", "name of the body"),
      field<&BodyMotion::position>("position", "m", "origin of the body's frame, in W"),
      field<&BodyMotion::quaternion_wxyz>("quaternion_wxyz", "1", "rotation from the body's axes to those of W"),
      field<&BodyMotion::angular_velocity>("angular_velocity", "rad/s", "angular velocity of the body, in W"),
      field<&BodyMotion::velocity>("velocity", "m/s", "velocity of the origin of the body's frame, in W"),
  };
  static constexpr Type type =
      structure<BodyMotion>("BodyMotion", "motion of a free body's frame at one instant.", fields);
  return type;
}

template <>
const Type& type_of<JointMotion>() {
  static constexpr Field fields[] = {
      field<&JointMotion::names>("names", "names of the joints"),
      field<&JointMotion::position>("position", "rad or m",
                                    "joint positions in the order of `names`; m for prismatic joints"),
      field<&JointMotion::velocity>("velocity", "rad/s or m/s",
                                    "joint velocities in the order of `names`; m/s for prismatic joints"),
  };
  static constexpr Type type = structure<JointMotion>("JointMotion", "the robot's joints at one instant.", fields);
  return type;
}

template <>
const Type& type_of<EndEffectorMotion>() {
  using E = EndEffectorMotion;
  constexpr auto grasps = [](const E& e) { return !e.target.empty(); };
  static constexpr Field fields[] = {
      field<&E::name>("name", "name of the end-effector"),
      field<&E::position>("position", "m", "origin of the end-effector's frame, in W"),
      field<&E::velocity>("velocity", "m/s", "velocity of that origin, in W"),
      field<&E::angular_velocity>("angular_velocity", "rad/s", "angular velocity of the end-effector, in W"),
      field<&E::target>("target",
                        "target to grasp; this key and the keys below are absent if the end-effector grasps nothing")
          .when<grasps>(),
      field<&E::grasp_point>("grasp_point", "grasp point on the target").when<grasps>(),
      field<&E::miss_distance>("miss_distance", "m", "distance from the end-effector's origin to the grasp point")
          .when<grasps>(),
      field<&E::relative_velocity>("relative_velocity", "m/s",
                                   "velocity of the end-effector minus that of the grasp point, in W")
          .when<grasps>(),
      field<&E::relative_angular_velocity>("relative_angular_velocity", "rad/s",
                                           "angular velocity of the end-effector minus that of the target, in W")
          .when<grasps>(),
  };
  static constexpr Type type =
      structure<E>("EndEffectorMotion", "an end-effector and its motion relative to its grasp point.", fields);
  return type;
}

template <>
const Type& type_of<PhaseEnd>() {
  static constexpr Field fields[] = {
      field<&PhaseEnd::time>("time", "s", "time of this state"),
      field<&PhaseEnd::base>("base", "motion of the robot's base"),
      field<&PhaseEnd::joints>("joints", "motion of the robot's joints"),
      field<&PhaseEnd::end_effectors>("end_effectors", "motion of the robot's end-effectors"),
      field<&PhaseEnd::targets>("targets", "motion of the free bodies that may be grasped"),
  };
  static constexpr Type type =
      structure<PhaseEnd>("PhaseEnd", "the system's state at the beginning or the end of a phase.", fields);
  return type;
}

template <>
const Type& type_of<MotionPhaseReport::End>() {
  using End = MotionPhaseReport::End;
  static constexpr Choice choices[] = {choice(End::duration, "duration"), choice(End::condition, "condition")};
  static constexpr Type type = enumeration<End>("MotionPhaseEnd", choices);
  return type;
}

template <>
const Type& type_of<MotionPhaseReport>() {
  using P = MotionPhaseReport;
  static constexpr Field fields[] = {
      field<&P::name>(
          "name",
          "name of the phase and of its samples in the time series; after an event these continue as NAME_2, ..."),
      field<&P::begin>("begin", "s", "start of the phase"),
      field<&P::end>("end", "s", "end of the phase"),
      field<&P::ended>(
          "ended", "`duration`: the phase lasted for its duration. `condition`: its `until` condition was met earlier"),
      field<&P::at_end>("state", "state at the end of the phase"),
  };
  static constexpr Type type =
      structure<P>("MotionPhaseReport", "a completed phase of the motion after the approach.", fields);
  return type;
}

template <>
const Type& type_of<PlannedMiss>() {
  static constexpr Field fields[] = {
      field<&PlannedMiss::end_effector>("end_effector", "end-effector that misses"),
      field<&PlannedMiss::distance>("distance", "m", "distance from its goal; null: unknown").or_null(),
      field<&PlannedMiss::angle>("angle", "rad", "angle from the required grasp orientation; null: unknown").or_null(),
      field<&PlannedMiss::velocity>("velocity", "m/s",
                                    "deviation of the final relative velocity from final_speed along the approach "
                                    "direction, at the end of a final straight approach"),
      field<&PlannedMiss::angular_velocity>("angular_velocity", "rad/s",
                                            "deviation of the final relative angular velocity from zero, in the "
                                            "components that the grasp's orientation and `roll` constrain"),
  };
  static constexpr Type type =
      structure<PlannedMiss>("PlannedMiss",
                             "deviation of an end-effector from its goal when the joints follow the plan exactly. It "
                             "comes from a forward simulation with all forces where the planner corrects by "
                             "simulation. If no plan was found, it belongs to the closest attempt.",
                             fields);
  return type;
}

template <>
const Type& type_of<StraightInReport>() {
  using S = StraightInReport;
  static constexpr Field fields[] = {
      field<&S::begin>("begin", "s", "start of the final straight approach"),
      field<&S::stand_off>("stand_off", "m", "distance from the grasp point at the start"),
      field<&S::final_speed>("final_speed", "m/s", "speed at which the end-effector meets the grasp point"),
      field<&S::smallest_singular_value>(
          "smallest_singular_value", "m/rad",
          "minimum over the segment of the smallest singular value of the generalized Jacobian's rows in use")
          .or_null(),
      field<&S::damped>("damped", "whether joint rates were damped near a singularity"),
      derived<[](const S& s) {
        return std::array{s.damped_begin, s.damped_end};
      }>("damped_interval", "s", "interval in which rates were damped"),
      field<&S::unmet>("unmet", "m/s or rad/s",
                       "largest component of the required motion that the joints do not produce, because of damping or "
                       "a lack of freedom"),
      field<&S::unmet_time>("unmet_time", "s", "time of the largest unmet component"),
      field<&S::fit_error>("fit_error", "rad or m", "error of the series that store the joint motion"),
      field<&S::self_motion>("self_motion", "rad/s or m/s",
                             "self-motion added to the minimum-norm rates to keep limits, which moves no end-effector: "
                             "root mean square over the segment of all joint rates together"),
  };
  static constexpr Type type =
      structure<S>("StraightInReport", "the final straight approach to the grasp point.", fields);
  return type;
}

template <>
const Type& type_of<PlanTerm>() {
  static constexpr Field fields[] = {
      field<&PlanTerm::name>("name", "name of the term, as in approach.plan.weights"),
      field<&PlanTerm::weight>("weight", "1", "weight, in the reciprocal of the value's unit"),
      field<&PlanTerm::value>("value", "1",
                              "value of the term [rad^2; effort: (N m)^2; impulse: J; clearance: m; limits, "
                              "manipulability, impulse_index, wheel_momentum: 1]")
          .or_null(),
  };
  static constexpr Type type =
      structure<PlanTerm>("PlanTerm", "one term of the sum that is a plan's objective.", fields);
  return type;
}

template <>
const Type& type_of<WheelShare>() {
  static constexpr Field fields[] = {
      field<&WheelShare::wheel>("wheel", "name of the wheel"),
      field<&WheelShare::share>("share", "1",
                                "largest momentum along the trajectory over the wheel's capacity, while the wheels "
                                "keep the base's attitude exactly"),
  };
  static constexpr Type type =
      structure<WheelShare>("WheelShare", "predicted load of a reaction wheel on the planned trajectory.", fields);
  return type;
}

template <>
const Type& type_of<PlannedPath>() {
  using P = PlannedPath;
  static constexpr Field fields[] = {
      field<&P::knots>("knots", "1", "inner knots of the joint splines; 0: one polynomial"),
      field<&P::position_margin>("position_margin", "rad or m",
                                 "minimum distance of a joint from a position limit; negative: beyond it"),
      field<&P::rate_share>("rate_share", "1", "largest joint rate over its limit"),
      field<&P::effort_share>("effort_share", "1",
                              "largest joint effort over its limit; present only if it was evaluated"),
      field<&P::clearance>("clearance", "m",
                           "minimum distance of two bodies, without an end-effector near its grasp point and its "
                           "target; present only if it was evaluated"),
      field<&P::body_a>("body_a", "first body of the closest pair"),
      field<&P::body_b>("body_b", "second body of the closest pair"),
      field<&P::clearance_time>("clearance_time", "s", "time of the minimum clearance"),
      field<&P::attitude_held>("attitude_held",
                               "whether the trajectory is planned for a base that keeps its attitude exactly, as "
                               "assumed under attitude control"),
      field<&P::base_turn>("base_turn", "rad",
                           "largest rotation of the base from its initial attitude, or from its commanded attitude if "
                           "the attitude is kept"),
      field<&P::wheels>("wheels", "predicted loads of the reaction wheels; empty: not evaluated"),
  };
  static constexpr Type type =
      structure<P>("PlannedPath", "properties of the last planned segment when the joints follow it exactly.", fields);
  return type;
}

template <>
const Type& type_of<WindowPoint>() {
  using P = WindowPoint;
  static constexpr Field fields[] = {
      field<&P::time>("time", "s", "capture time"),
      field<&P::reachable>("reachable", "whether a plan was found for this time"),
      field<&P::reason>("reason", "cause if no plan was found; empty otherwise"),
      field<&P::objective>("objective", "1", "objective of the plan; null: no plan").or_null(),
      field<&P::speed>("speed", "m/s", "speed of the fastest grasp point relative to the servicer's centre of mass"),
      field<&P::direction_angle>("direction_angle", "rad",
                                 "largest angle between an approach direction and the line from the arm's first joint "
                                 "to the grasp point; null: no grasp point has a direction")
          .or_null(),
      field<&P::reach_share>("reach_share", "1",
                             "largest distance of a grasp point that arm and base must cover, over their reach; above "
                             "1 the grasp point is unreachable"),
  };
  static constexpr Type type = structure<P>("WindowPoint", "a capture time that the planner evaluated.", fields);
  return type;
}

template <>
const Type& type_of<WindowReport>() {
  using P = WindowReport;
  static constexpr Field fields[] = {
      field<&P::time>("time", "s", "selected capture time; null: none is reachable").or_null(),
      field<&P::not_before>("not_before", "s", "no grasp is reachable before this time, by distance alone"),
      field<&P::points>("points", "all evaluated times, in ascending order"),
      derived<[](const P& p) { return window_sentence(p); }>("sentence", "",
                                                             "the selection, as printed on the terminal"),
  };
  static constexpr Type type =
      structure<P>("WindowReport", "capture times within the window, and the selected time.", fields);
  return type;
}

template <>
const Type& type_of<PlannedContact>() {
  using P = PlannedContact;
  static constexpr Field fields[] = {
      field<&P::body_a>("body_a", "first body"),
      field<&P::body_b>("body_b", "second body"),
      field<&P::predicted>("predicted", "s", "first contact in the planner's prediction; absent: none"),
      field<&P::simulated>("simulated", "s", "first contact in the simulation, before the approach ends; absent: none"),
      field<&P::disturbs>("disturbs",
                          "whether a link or a grasped target touches in the simulation but not in the prediction"),
  };
  static constexpr Type type =
      structure<P>("PlannedContact", "a pair of bodies that touches before the planned capture.", fields);
  return type;
}

template <>
const Type& type_of<PlanReport>() {
  using P = PlanReport;
  constexpr auto searched = [](const P& p) { return p.searched; };
  constexpr auto touching = [](const P& p) { return !p.assumes.empty(); };
  static constexpr Field fields[] = {
      field<&P::joints>("joints", "joint names"),
      field<&P::final_position>("final_position", "rad or m",
                                "joint reference at the capture; of the closest attempt if planning failed"),
      field<&P::final_rates>("final_rates", "rad/s or m/s",
                             "joint rate reference at the capture; of the closest attempt if planning failed"),
      field<&P::unmet_rate>("unmet_rate", "m/s or rad/s",
                            "largest component of the required final motion that no joint rates produce"),
      field<&P::rhs_evaluations>("rhs_evaluations", "1", "evaluations of the base's motion while planning"),
      field<&P::found>("found",
                       "whether a solution was found; this key and the keys down to `smallest_singular_value` are "
                       "present only if final values were searched")
          .when<searched>(),
      field<&P::objective>("objective", "name of the minimized objective").when<searched>(),
      field<&P::objective_value>("objective_value", "1", "minimum value of the objective").when<searched>().or_null(),
      field<&P::terms>("terms", "terms of the weighted sum").when<searched>(),
      field<&P::miss>("miss", "deviation from the goal, per end-effector").when<searched>(),
      field<&P::starts>("starts", "1", "number of initial guesses").when<searched>(),
      field<&P::solutions>("solutions", "1", "number of initial guesses that led to a solution").when<searched>(),
      field<&P::distinct_solutions>("distinct_solutions", "1",
                                    "number of solutions that differ by more than 1e-3 rad or m")
          .when<searched>(),
      field<&P::iterations>("iterations", "1", "Newton steps, summed over all initial guesses").when<searched>(),
      field<&P::smallest_singular_value>("smallest_singular_value", "m/rad",
                                         "smallest singular value of the derivative of the goal errors with respect to "
                                         "the final joint values; small: near a singularity")
          .when<searched>()
          .or_null(),
      field<&P::straight_in>("straight_in", "the final straight approach, if the scenario requests one"),
      field<&P::path>("path", "properties of the last planned segment, if the trajectory was evaluated"),
      field<&P::window>("window", "evaluated capture times, if the scenario gives a window"),
      field<&P::assumes>("assumes",
                         "what the plan assumes of contacts before the capture; this key and `contacts` are present if "
                         "bodies may touch")
          .when<touching>(),
      field<&P::contacts>("contacts", "pairs of bodies that touch before the planned capture").when<touching>(),
  };
  static constexpr Type type =
      structure<P>("PlanReport", "the planned joint motion and the record of the search for it.", fields);
  return type;
}

template <>
const Type& type_of<Captured>() {
  static constexpr Choice choices[] = {
      choice(Captured::yes, "yes", "closed, and checked against an envelope with a position tolerance."),
      choice(Captured::assumed, "assumed",
             "closed, but not evaluated: no envelope states the admissible distance of the end-effector."),
      choice(Captured::no, "no")};
  static constexpr Type type = enumeration<Captured>("Captured", choices);
  return type;
}

template <>
const Type& type_of<GraspOutcome>() {
  using G = GraspOutcome;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "end-effector of the grasp"),
      field<&G::target>("target", "target of the grasp"),
      field<&G::grasp_point>("grasp_point", "grasp point on the target"),
      derived<[](const G& g) { return g.verdict(); }>("captured", "", "whether this grasp closed and was not lost."),
      field<&G::judged>("judged",
                        "whether an envelope with a position tolerance was evaluated, or the target was settled"),
      field<&G::reason>(
          "reason",
          "which tolerance of the envelope was met or exceeded. A contact is never a capture: the text states its "
          "separation speed, or its compression and energy if `impact.longest` ended the contact"),
      field<&G::limiting>("limiting",
                          "key of the envelope (`position`, `angle`, `velocity`, `angular_velocity`) that was exceeded "
                          "by the largest factor; empty: none"),
      field<&G::distance>("distance", "m", "distance from the grasp point at the instant at which it was to close")
          .or_null(),
      field<&G::angle>("angle", "rad", "angle from the required grasp orientation, at that instant").or_null(),
      field<&G::velocity>("velocity", "m/s", "velocity relative to the grasp point, at that instant").or_null(),
      field<&G::angular_velocity>("angular_velocity", "rad/s",
                                  "angular velocity relative to the target, at that instant")
          .or_null(),
      field<&G::time>(
          "time", "s",
          "instant at which this grasp closed, or was to close. The deviations above apply to this instant; for a "
          "grasp that the run did not reach they apply to the run's end, and are null after a failure")
          .or_null(),
      field<&G::target_moved>(
          "target_moved", "m",
          "displacement of the target by `contact.gap: translate_target`, which lets the grasp close"),
      field<&G::released>("released", "s", "time of release; absent if the grasp was not released"),
      field<&G::lost>("lost", "s",
                      "time at which the grasp opened, since the load exceeded the limits in `holds` or the slip those "
                      "of the slip; "
                      "absent if it did not, or closed again"),
      field<&G::slipped>("slipped", "s", "first onset of slip since the grasp closed; absent: it did not slip"),
      field<&G::slips>("slips", "whether it slips at the end").when<[](const G& g) { return g.slipped.has_value(); }>(),
      field<&G::slip_distance>("slip_distance", "m", "displacement of the gripper relative to the target since closing")
          .when<[](const G& g) { return g.slipped.has_value(); }>(),
      field<&G::slip_angle>("slip_angle", "rad", "rotation likewise")
          .when<[](const G& g) { return g.slipped.has_value(); }>(),
      field<&G::closings>("closings", "1", "number of times the grasp closed"),
      field<&G::largest_load>("largest_load", "1",
                              "largest load relative to the limits in `holds`, which is 1 at the limit; absent without "
                              "limits"),
      field<&G::largest_load_time>("largest_load_time", "s", "time of the largest load"),
  };
  static constexpr Type type =
      structure<G>("GraspOutcome",
                   "whether one grasp closes at the instant of capture, the criterion of success. The angle is 0 if "
                   "the grasp leaves it free (that between the frames is `gap_angle` of `GraspImpulse`).",
                   fields);
  return type;
}

}  // namespace grapnel
