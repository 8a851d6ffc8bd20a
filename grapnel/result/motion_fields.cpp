// The fields of bodies and joints in motion, of plans, and of grasps that close or miss.
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<BodyMotion>() {
  static constexpr Field fields[] = {
      field<&BodyMotion::name>("name", "of the body"),
      field<&BodyMotion::position>("position", "m", "of the origin of the body's frame, in W"),
      field<&BodyMotion::quaternion_wxyz>("quaternion_wxyz", "1", "turns the body's axes into W's"),
      field<&BodyMotion::angular_velocity>("angular_velocity", "rad/s", "in W"),
      field<&BodyMotion::velocity>("velocity", "m/s", "of the origin of the body's frame, in W"),
  };
  static constexpr Type type =
      structure<BodyMotion>("BodyMotion", "motion of a free body's frame at one instant.", fields);
  return type;
}

template <>
const Type& type_of<JointMotion>() {
  static constexpr Field fields[] = {
      field<&JointMotion::names>("names", "of the joints"),
      field<&JointMotion::position>("position", "rad or m", "in the order of `names`; m of prismatic joints"),
      field<&JointMotion::velocity>("velocity", "rad/s or m/s", "likewise"),
  };
  static constexpr Type type = structure<JointMotion>("JointMotion", "the robot's joints at one instant.", fields);
  return type;
}

template <>
const Type& type_of<EndEffectorMotion>() {
  using E = EndEffectorMotion;
  constexpr auto grasps = [](const E& e) { return !e.target.empty(); };
  static constexpr Field fields[] = {
      field<&E::name>("name", "of the end-effector"),
      field<&E::position>("position", "m", "of the origin of the end-effector's frame, in W"),
      field<&E::velocity>("velocity", "m/s", "of that origin, in W"),
      field<&E::angular_velocity>("angular_velocity", "rad/s", "in W"),
      field<&E::target>("target", "what it is to grasp; this and what follows are absent if it grasps nothing")
          .when<grasps>(),
      field<&E::grasp_point>("grasp_point", "on the target").when<grasps>(),
      field<&E::miss_distance>("miss_distance", "m", "from the end-effector's origin to the grasp point")
          .when<grasps>(),
      field<&E::relative_velocity>("relative_velocity", "m/s", "end-effector minus grasp point, in W").when<grasps>(),
      field<&E::relative_angular_velocity>("relative_angular_velocity", "rad/s", "end-effector minus target, in W")
          .when<grasps>(),
  };
  static constexpr Type type =
      structure<E>("EndEffectorMotion", "an end-effector, and how it stands to the grasp point it is to meet.", fields);
  return type;
}

template <>
const Type& type_of<PhaseEnd>() {
  static constexpr Field fields[] = {
      field<&PhaseEnd::time>("time", "s", "of this state"),
      field<&PhaseEnd::base>("base", "of the robot"),
      field<&PhaseEnd::joints>("joints", "of the robot"),
      field<&PhaseEnd::end_effectors>("end_effectors", "of the robot"),
      field<&PhaseEnd::targets>("targets", "the free bodies that may be grasped"),
  };
  static constexpr Type type =
      structure<PhaseEnd>("PhaseEnd", "the system's state where a phase begins or ends.", fields);
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
      field<&P::name>("name",
                      "of the phase; its samples in the time series have it, pieces after an event NAME_2, ..."),
      field<&P::begin>("begin", "s", "of the phase"),
      field<&P::end>("end", "s", "of the phase"),
      field<&P::ended>("ended", "`duration`: after its duration. `condition`: what it is `until` held before"),
      field<&P::at_end>("state", "at its end"),
  };
  static constexpr Type type =
      structure<P>("MotionPhaseReport", "a phase of the motion after the approach that has ended.", fields);
  return type;
}

template <>
const Type& type_of<PlannedMiss>() {
  static constexpr Field fields[] = {
      field<&PlannedMiss::end_effector>("end_effector", "whose miss it is"),
      field<&PlannedMiss::distance>("distance", "m", "from its goal; null: unknown").or_null(),
      field<&PlannedMiss::angle>("angle", "rad", "from what the grasp's orientation asks for; null: unknown").or_null(),
      field<&PlannedMiss::velocity>(
          "velocity", "m/s",
          "of a piece straight in: how far the relative velocity in the end is from final_speed "
          "along the approach direction"),
      field<&PlannedMiss::angular_velocity>(
          "angular_velocity", "rad/s",
          "likewise the relative angular velocity from zero, of what the grasp's orientation and `roll` ask for"),
  };
  static constexpr Type type = structure<PlannedMiss>(
      "PlannedMiss",
      "how far an end-effector stays from its goal when the plan is followed exactly, in flight with everything that "
      "acts where planning corrects by flights; where nothing was found, in the closest attempt.",
      fields);
  return type;
}

template <>
const Type& type_of<StraightInReport>() {
  using S = StraightInReport;
  static constexpr Field fields[] = {
      field<&S::begin>("begin", "s", "of the piece straight in"),
      field<&S::stand_off>("stand_off", "m", "distance from the grasp point at which it begins"),
      field<&S::final_speed>("final_speed", "m/s", "at which it meets the grasp point"),
      field<&S::smallest_singular_value>("smallest_singular_value", "m/rad",
                                         "of the generalized Jacobian's rows in use, over the piece")
          .or_null(),
      field<&S::damped>("damped", "whether it came so near a singularity that rates were damped"),
      derived<[](const S& s) {
        return std::array{s.damped_begin, s.damped_end};
      }>("damped_interval", "s", "when rates were damped"),
      field<&S::unmet>("unmet", "m/s or rad/s",
                       "largest component of the demanded motion that was missed, where it was damped or impossible"),
      field<&S::unmet_time>("unmet_time", "s", "when that was"),
      field<&S::fit_error>("fit_error", "rad or m", "of the series that keep the joint motion"),
      field<&S::self_motion>("self_motion", "rad/s or m/s",
                             "added to the rates of least norm to keep limits on the way, moving no end-effector: root "
                             "mean square over the piece of the joints' rates together"),
  };
  static constexpr Type type =
      structure<S>("StraightInReport", "the last piece of an approach, on a straight line to the grasp point.", fields);
  return type;
}

template <>
const Type& type_of<PlanTerm>() {
  static constexpr Field fields[] = {
      field<&PlanTerm::name>("name", "as in approach.plan.weights"),
      field<&PlanTerm::weight>("weight", "1", "in the reciprocal of the value's unit"),
      field<&PlanTerm::value>("value", "1",
                              "[rad^2; effort: (N m)^2; impulse: J; clearance: m; limits, manipulability, "
                              "impulse_index, wheel_momentum: 1]")
          .or_null(),
  };
  static constexpr Type type =
      structure<PlanTerm>("PlanTerm", "one of the terms that a plan's objective is the sum of.", fields);
  return type;
}

template <>
const Type& type_of<WheelShare>() {
  static constexpr Field fields[] = {
      field<&WheelShare::wheel>("wheel", "of the robot"),
      field<&WheelShare::share>(
          "share", "1",
          "largest momentum on the way, over the most that it can hold, while the wheels keep the "
          "base's attitude exactly"),
  };
  static constexpr Type type = structure<WheelShare>("WheelShare", "what a wheel is to hold on a planned way.", fields);
  return type;
}

template <>
const Type& type_of<PlannedWay>() {
  using P = PlannedWay;
  static constexpr Field fields[] = {
      field<&P::knots>("knots", "1", "inner knots of the joints' splines; 0: one polynomial"),
      field<&P::position_margin>("position_margin", "rad or m",
                                 "least distance of a joint from a limit of its position; negative: beyond it"),
      field<&P::rate_share>("rate_share", "1", "largest joint rate over its limit"),
      field<&P::effort_share>("effort_share", "1", "largest joint effort over its limit; only where it was looked at"),
      field<&P::clearance>("clearance", "m",
                           "least distance of two bodies, a hand near its grasp point and its target left out; "
                           "only where it was looked at"),
      field<&P::body_a>("body_a", "they are this one"),
      field<&P::body_b>("body_b", "and this one"),
      field<&P::clearance_time>("clearance_time", "s", "when they are so near"),
      field<&P::attitude_kept>(
          "attitude_kept",
          "whether it is the way of a base that keeps its attitude exactly, as attitude control is "
          "taken to have it"),
      field<&P::base_turn>("base_turn", "rad",
                           "largest turn of the base from its initial attitude; where the attitude is kept, of the "
                           "attitude that it is to have"),
      field<&P::wheels>("wheels", "what wheels are to hold; empty: it was not looked at"),
  };
  static constexpr Type type = structure<P>(
      "PlannedWay", "what the last segment that was planned does on its way, the joints following it exactly.", fields);
  return type;
}

template <>
const Type& type_of<WindowPoint>() {
  using P = WindowPoint;
  static constexpr Field fields[] = {
      field<&P::time>("time", "s", "of the capture"),
      field<&P::reachable>("reachable", "whether a plan was found for it"),
      field<&P::reason>("reason", "why not; empty: there is one"),
      field<&P::objective>("objective", "1", "of the plan; null: there is none").or_null(),
      field<&P::speed>("speed", "m/s", "of the fastest grasp point against the servicer's centre of mass"),
      field<&P::direction_angle>("direction_angle", "rad",
                                 "largest angle between an approach direction and the way from the arm's first joint "
                                 "to the grasp point; null: no grasp point has a direction")
          .or_null(),
      field<&P::reach_share>("reach_share", "1",
                             "largest distance of a grasp point from what its arm and the base can bring there, over "
                             "their reach; above 1 it cannot be reached"),
  };
  static constexpr Type type = structure<P>("WindowPoint", "a time of capture that was looked at.", fields);
  return type;
}

template <>
const Type& type_of<WindowReport>() {
  using P = WindowReport;
  static constexpr Field fields[] = {
      field<&P::time>("time", "s", "of the capture that was chosen; null: none can be reached").or_null(),
      field<&P::not_before>("not_before", "s", "before which no grasp can be reached, by distance alone"),
      field<&P::points>("points", "all that were looked at, in the order of time"),
  };
  static constexpr Type type =
      structure<P>("WindowReport", "times of capture within the window, and the one that was chosen.", fields);
  return type;
}

template <>
const Type& type_of<PlanReport>() {
  using P = PlanReport;
  constexpr auto searched = [](const P& p) { return p.searched; };
  static constexpr Field fields[] = {
      field<&P::joints>("joints", "names"),
      field<&P::final_position>("final_position", "rad or m",
                                "the reference at the capture; of the closest attempt if planning failed"),
      field<&P::final_rates>("final_rates", "rad/s or m/s", "likewise"),
      field<&P::unmet_rate>("unmet_rate", "m/s or rad/s",
                            "largest component of the demanded final motion that no joint rates give"),
      field<&P::rhs_evaluations>("rhs_evaluations", "1", "of the base's motion, while planning"),
      field<&P::found>("found",
                       "whether there is a solution; this and what follows down to `smallest_singular_value` "
                       "only where final values were looked for")
          .when<searched>(),
      field<&P::objective>("objective", "what was made least").when<searched>(),
      field<&P::objective_value>("objective_value", "1", "how small that became").when<searched>().or_null(),
      field<&P::terms>("terms", "of which it is the weighted sum").when<searched>(),
      field<&P::miss>("miss", "per end-effector").when<searched>(),
      field<&P::starts>("starts", "1", "initial guesses tried").when<searched>(),
      field<&P::solutions>("solutions", "1", "how many of them led to a solution").when<searched>(),
      field<&P::distinct_solutions>("distinct_solutions", "1", "how many of these differ by more than 1e-3 rad or m")
          .when<searched>(),
      field<&P::iterations>("iterations", "1", "Newton steps over all of them").when<searched>(),
      field<&P::smallest_singular_value>("smallest_singular_value", "m/rad",
                                         "of the goals' error against final joint values; small: near a singularity")
          .when<searched>()
          .or_null(),
      field<&P::straight_in>("straight_in", "the last piece, where the scenario asks for one"),
      field<&P::way>("way", "of the last segment that was planned, where its way is looked at"),
      field<&P::window>("window", "times of capture, where the scenario has one looked for"),
  };
  static constexpr Type type =
      structure<P>("PlanReport", "where the joints were to go, and how that was found.", fields);
  return type;
}

template <>
const Type& type_of<Captured>() {
  static constexpr Choice choices[] = {
      choice(Captured::yes, "yes", "closed, within an envelope that has a position."),
      choice(Captured::assumed, "assumed",
             "closed, but nothing says how far the end-effector may be: nobody judged it."),
      choice(Captured::no, "no")};
  static constexpr Type type = enumeration<Captured>("Captured", choices);
  return type;
}

template <>
const Type& type_of<GraspOutcome>() {
  using G = GraspOutcome;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "that is to grasp"),
      field<&G::target>("target", "that is to be grasped"),
      field<&G::grasp_point>("grasp_point", "on the target"),
      derived<[](const G& g) { return g.verdict(); }>("captured", "", "whether this grasp closed."),
      field<&G::judged>("judged", "whether an envelope with a position judged it"),
      field<&G::reason>("reason",
                        "in words: which tolerance of the envelope was kept or missed. A contact is never captured: "
                        "how fast it parted, or that it was still compressed, by how much and with what energy, when "
                        "`impact.longest` ended it"),
      field<&G::limiting>("limiting",
                          "the key of the envelope (`position`, `angle`, `velocity`, `angular_velocity`) that was "
                          "missed by the largest factor; empty if none was"),
      field<&G::distance>("distance", "m", "distance from the grasp point when it was to close").or_null(),
      field<&G::angle>("angle", "rad", "angle from what the grasp's orientation asks for, at that instant").or_null(),
      field<&G::velocity>("velocity", "m/s", "relative to the grasp point, at that instant").or_null(),
      field<&G::angular_velocity>("angular_velocity", "rad/s", "relative to the target, at that instant").or_null(),
      field<&G::time>("time", "s",
                      "when this grasp closed, or was to close. The deviations above are those of this instant; of a "
                      "grasp that never came so far those of the run's end, null after a failure")
          .or_null(),
      field<&G::target_moved>("target_moved", "m",
                              "by which `contact.gap: translate_target` moved its target so that it closes"),
      field<&G::released>("released", "s", "when it was released; absent if it was not"),
  };
  static constexpr Type type = structure<G>(
      "GraspOutcome",
      "whether one grasp closes at the instant of capture: what success means. The angle is 0 if the grasp leaves it "
      "free (that between the frames is `gap_angle` of `GraspImpulse`).",
      fields);
  return type;
}

}  // namespace grapnel
