// The fields of summary.json that say what drove the robot and what that asked of it: loads of grasps, joints and
// loops, control laws, reaction wheels.
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

// ---- Loads ----

template <>
const Type& type_of<LoopReport>() {
  using L = LoopReport;
  static constexpr Field fields[] = {
      field<&L::phase>("phase", "with closed loops"),
      field<&L::closures>("closures", "`end-effector - target`: the grasps that close loops of the tree"),
      field<&L::rows>("rows", "1", "of all closures"),
      field<&L::rank>("rank", "1",
                      "as the phase began; smaller than `rows`: some say the same, and internal loads are not all "
                      "determined"),
      field<&L::unprojected_position>("unprojected_position", "m",
                                      "largest defect that one step left before projection"),
      field<&L::unprojected_angle>("unprojected_angle", "rad", "likewise"),
      field<&L::unprojected_velocity>("unprojected_velocity", "m/s", "the same of its rate"),
      field<&L::unprojected_angular_velocity>("unprojected_angular_velocity", "rad/s", "likewise"),
      field<&L::correction_total>("correction_total", "1",
                                  "sum of all corrections, in the norm that judges steps, times the tolerance"),
      field<&L::integration_error>("integration_error", "1",
                                   "sum of the steps' error estimates in the same measure: larger, or projection would "
                                   "hide faults"),
  };
  static constexpr Type type = structure<L>(
      "LoopReport",
      "how loops were kept closed in one phase, also of the approach where a grasp closed before its end. What remains "
      "after projection is in the ledger (`loop_closure_...`).",
      fields);
  return type;
}

template <>
const Type& type_of<GraspLoad>() {
  using G = GraspLoad;
  static constexpr Field fields[] = {
      field<&G::phase>("phase", "in which the grasp held"),
      field<&G::end_effector>("end_effector", "of the grasp"),
      field<&G::target>("target", "of the grasp"),
      field<&G::largest_force>("largest_force", "N", "on the robot, at the grasp"),
      field<&G::force_time>("force_time", "s", "when that was"),
      field<&G::largest_moment>("largest_moment", "N m", "about the grasp"),
      field<&G::moment_time>("moment_time", "s", "when that was"),
      field<&G::determined>(
          "determined",
          "six, per component, angular x, y, z then linear x, y, z, in W, as the phase began; where a "
          "self-stress leaves components open, the least in the metric of the impact is given"),
  };
  static constexpr Type type = structure<G>("GraspLoad",
                                            "the load on one grasp while it holds, in one phase. Its course is in the "
                                            "time series `grasps/END_EFFECTOR/force` "
                                            "and `moment`.",
                                            fields);
  return type;
}

template <>
const Type& type_of<PeakLoad>() {
  using L = PeakLoad;
  static constexpr Field fields[] = {
      field<&L::of>("of", "joint, end-effector, or `base control`"),
      field<&L::quantity>(
          "quantity",
          "in motion: `force` and `moment`, the magnitudes of what a joint passes on at its origin, or a grasp at the "
          "grasp; `driving`, the effort of a joint's drive or brake along its axis; of base control `driving/x`, "
          "`driving/y`, `driving/z`, the torque about the base's axes. In impacts: `impulse`, `angular_impulse`, "
          "`driving_impulse`, and `force`, `moment`, `driving`: the peaks of an impact in time, else means over "
          "`impact.duration`"),
      field<&L::phase>("phase", "impacts are phases too: `contact`, `contact_2`, and brakes: `brake`"),
      field<&L::peak>("peak", "N, N m, N s or N m s", "largest magnitude"),
      field<&L::time>("time", "s", "when that is"),
      derived<[](const L& l) { return std::isfinite(l.rating) ? std::optional(l.rating) : std::nullopt; }>(
          "rating", "as `peak`",
          "of the robot file; null: none. Of a drive in motion the smaller of `rating.driving` and `limits.effort`")
          .or_null(),
      derived<[](const L& l) { return std::isfinite(l.rating) ? std::optional(l.margin()) : std::nullopt; }>(
          "margin", "1",
          "1 - peak over rating; negative: exceeded; 0 of a drive: saturated at its effort limit; null: no rating")
          .or_null(),
      field<&L::assumed_duration>("assumed_duration",
                                  "a mean over `impact.duration`, which is an assumption; the peak may be larger"),
  };
  static constexpr Type type = structure<L>("PeakLoad", "the largest of one load in one phase.", fields);
  return type;
}

template <>
const Type& type_of<ReleaseReport>() {
  using R = ReleaseReport;
  static constexpr Field fields[] = {
      field<&R::time>("time", "s", "when they were released"),
      field<&R::end_effectors>("end_effectors", "that released their targets"),
      field<&R::targets>("targets", "that each of them held"),
  };
  static constexpr Type type = structure<R>("ReleaseReport", "grasps that are released together.", fields);
  return type;
}

// ---- Laws and actuators ----

template <>
const Type& type_of<LawEnd>() {
  static constexpr Choice choices[] = {
      choice(LawEnd::running, "running"), choice(LawEnd::at_rest, "at_rest"), choice(LawEnd::rank_lost, "rank_lost"),
      choice(LawEnd::joint_limit, "joint_limit"), choice(LawEnd::released, "released")};
  static constexpr Type type = enumeration<LawEnd>("LawEnd", choices);
  return type;
}

template <>
const Type& type_of<DetumblingReport>() {
  using D = DetumblingReport;
  static constexpr Field fields[] = {
      field<&D::target>("target", "that is brought to rest"),
      field<&D::begin>("begin", "s", "when the law begins"),
      field<&D::end>("end", "s", "when it ends; from then on the joints hold"),
      field<&D::ended>("ended",
                       "`at_rest`: a millionth of the angular momentum is left. `joint_limit`: a joint reached the end "
                       "of its range. `released`: the target was let go. `running`: the run ended before. Near "
                       "configurations in which the arms cannot move the target in all directions (`least_condition`) "
                       "the law goes on with the others"),
      field<&D::joint>("joint", "whose range ended it; empty otherwise"),
      field<&D::torque_bound>("torque_bound", "N m", "on the torque about the target's centre of mass"),
      field<&D::largest_torque>("largest_torque", "N m",
                                "of the grasps about the target's centre of mass, by the target's motion: at the ends "
                                "and in the middle of every step"),
      field<&D::angular_momentum_before>("angular_momentum_before", "N m s",
                                         "of the target about its centre of mass, at the begin"),
      field<&D::angular_momentum_after>("angular_momentum_after", "N m s", "at the end"),
      field<&D::speed_before>("speed_before", "m/s",
                              "of the target's centre of mass, relative to that of servicer and held targets"),
      field<&D::speed_after>("speed_after", "m/s", "at the end"),
      field<&D::expected_duration>("expected_duration", "s",
                                   "angular_momentum_before over torque_bound: what it takes where efforts suffice"),
      field<&D::first_scale>("first_scale", "1",
                             "part of the torque bound that effort limits and ratings of grasps allow as the law "
                             "begins; expected_duration over it is what the detumbling takes at that pace"),
      field<&D::least_scale>("least_scale", "1",
                             "minimum part of the torque bound that these limits allow; 1: they always sufficed"),
      field<&D::least_scale_time>("least_scale_time", "s", "when that was"),
      field<&D::within_limits>(
          "within_limits",
          "whether a smaller torque kept all efforts and grasps within their limits; if not, efforts were scaled down "
          "and the target did not move as asked for"),
      field<&D::largest_demand>("largest_demand", "1",
                                "largest share of an effort limit or of a grasp's rating that the law asked for before "
                                "efforts were scaled down; above 1: by how much the limits are too small"),
      field<&D::largest_demand_time>("largest_demand_time", "s", "when that was"),
      field<&D::limiting>("limiting", "which limit that was; empty: nothing has a limit"),
      field<&D::least_condition>("least_condition", "1",
                                 "of the target's accelerations by the efforts: least singular value over the largest, "
                                 "its least"),
      field<&D::least_condition_time>("least_condition_time", "s", "when that was"),
  };
  static constexpr Type type = structure<D>("DetumblingReport", "a held target that the arms bring to rest.", fields);
  return type;
}

template <>
const Type& type_of<ImpedanceReport>() {
  using I = ImpedanceReport;
  static constexpr Field fields[] = {
      field<&I::begin>("begin", "s", "when the law begins"),
      field<&I::end>("end", "s", "when it ends"),
      field<&I::ended>(
          "ended",
          "`rank_lost`: the arms came near a configuration in which they cannot move the hands in all "
          "directions that are controlled, a dynamic singularity. `joint_limit`: a joint reached the end of "
          "its range. `released`: a target was let go. `running`: the phase ended before"),
      field<&I::joint>("joint", "whose range ended it; empty otherwise"),
      field<&I::largest_distance>("largest_distance", "m", "of a hand from its reference"),
      field<&I::largest_distance_time>("largest_distance_time", "s", "when that was"),
      field<&I::distance_after>("distance_after", "m", "the largest of the hands' at the end"),
      field<&I::largest_angle>("largest_angle", "rad", "of a hand from its reference; 0 where it is not controlled"),
      field<&I::largest_angle_time>("largest_angle_time", "s", "when that was"),
      field<&I::angle_after>("angle_after", "rad", "the largest of the hands' at the end"),
      field<&I::least_share>("least_share", "1",
                             "least part of an effort that moves the hands that its joint's limit lets pass"),
      field<&I::least_share_time>("least_share_time", "s", "when that was"),
      field<&I::within_limits>(
          "within_limits",
          "whether these efforts stayed within the limits; if not, they were cut and the hands did "
          "not move as asked for"),
      field<&I::least_condition>("least_condition", "1",
                                 "of the hands' motion by the joint rates, through the generalized Jacobian: least "
                                 "singular value over the largest, its least"),
      field<&I::least_condition_time>("least_condition_time", "s", "when that was"),
  };
  static constexpr Type type = structure<I>("ImpedanceReport", "hands under impedance control, in a phase.", fields);
  return type;
}

template <>
const Type& type_of<GraspForceReport::Pair>() {
  using P = GraspForceReport::Pair;
  static constexpr Field fields[] = {
      field<&P::between>("between", "the two end-effectors"),
      field<&P::reference>("reference", "N", "of the force with which they squeeze the target, at the end"),
      field<&P::force>("force", "N", "with which they do, by the multipliers of the closed loops"),
      field<&P::largest_error>("largest_error", "N", "largest difference of the two"),
      field<&P::largest_error_time>("largest_error_time", "s", "when that was"),
  };
  static constexpr Type type = structure<P>("Squeeze", "the internal force between two grasps.", fields);
  return type;
}

template <>
const Type& type_of<GraspForceReport>() {
  using G = GraspForceReport;
  static constexpr Field fields[] = {
      field<&G::target>("target", "that is held"),
      field<&G::begin>("begin", "s", "when the law begins"),
      field<&G::end>("end", "s", "when it ends; from then on the joints hold"),
      field<&G::ended>("ended",
                       "`rank_lost`: the arms came near a configuration in which they cannot move the target in all "
                       "directions. `joint_limit`: a joint reached the end of its range. `released`: fewer than two "
                       "grasps hold the target. `running`: the run ended before"),
      field<&G::joint>("joint", "whose range ended it; empty otherwise"),
      field<&G::pairs>("pairs", "of grasps that squeeze"),
      field<&G::internal_rank>("internal_rank", "1",
                               "internal directions that the efforts reach beside the target's motion, at the begin"),
      field<&G::other_internal_force>(
          "other_internal_force", "N",
          "largest difference of the grasps' internal wrenches from the reference, of all components, moments over the "
          "metric's length"),
      field<&G::largest_distance>("largest_distance", "m", "of the target from where it is held; 0 with brake"),
      field<&G::largest_angle>("largest_angle", "rad", "likewise"),
      field<&G::least_scale>("least_scale", "1",
                             "least part of the internal force that the joints' effort limits let pass"),
      field<&G::least_scale_time>("least_scale_time", "s", "when that was"),
      field<&G::within_limits>("within_limits",
                               "whether what moves the target stayed within the joints' effort limits; if not, efforts "
                               "were cut and it did not move as asked for"),
      field<&G::least_condition>("least_condition", "1",
                                 "of the target's accelerations by the efforts: least singular value over the largest, "
                                 "its least"),
      field<&G::least_condition_time>("least_condition_time", "s", "when that was"),
  };
  static constexpr Type type =
      structure<G>("GraspForceReport", "a target that several grasps hold and squeeze.", fields);
  return type;
}

template <>
const Type& type_of<BaseKeepingReport>() {
  using B = BaseKeepingReport;
  static constexpr Field fields[] = {
      field<&B::begin>("begin", "s", "when the law begins"),
      field<&B::end>("end", "s", "when it ends; from then on the joints hold"),
      field<&B::ended>("ended",
                       "`rank_lost`: the joints came near a configuration in which they cannot turn the base about all "
                       "the axes that they could. `joint_limit`: a joint reached the end of its range. `running`: the "
                       "run ended before"),
      field<&B::joint>("joint", "whose range ended it; empty otherwise"),
      field<&B::largest_angle>("largest_angle", "rad", "largest turn of the base away from its attitude"),
      field<&B::largest_angle_time>("largest_angle_time", "s", "when that was"),
      field<&B::angle_after>("angle_after", "rad", "at the end"),
      field<&B::angular_velocity_after>("angular_velocity_after", "rad/s", "of the base, at the end"),
      field<&B::rank>("rank", "1", "axes about which the joints could turn the base, at the begin"),
      field<&B::least_share>("least_share", "1",
                             "least part of the motion that does not turn the base that the joints' effort limits "
                             "let pass"),
      field<&B::least_share_time>("least_share_time", "s", "when that was"),
      field<&B::within_limits>("within_limits",
                               "whether what keeps the base stayed within the joints' effort limits; if not, efforts "
                               "were cut and the base was not kept"),
      field<&B::least_condition>("least_condition", "1",
                                 "of the base's turning by the joint rates: the singular value of that rank over the "
                                 "largest, its least"),
      field<&B::least_condition_time>("least_condition_time", "s", "when that was"),
  };
  static constexpr Type type = structure<B>("BaseKeepingReport", "a base whose attitude the joints keep.", fields);
  return type;
}

template <>
const Type& type_of<ControlReport>() {
  using C = ControlReport;
  static constexpr Field fields[] = {
      field<&C::period>("period", "s", "between samples"),
      field<&C::delay>("delay", "s", "from a sample to the command that follows from it"),
      field<&C::plugin>("plugin",
                        "the controller: a library or an FMU as the scenario names it, or the name of a class in "
                        "Python; empty without one"),
      field<&C::plugin_sha256>("plugin_sha256", "of its bytes, of a class in Python of its source; empty without one"),
  };
  static constexpr Type type = structure<C>("ControlReport", "the on-board computer that samples the control.", fields);
  return type;
}

template <>
const Type& type_of<WheelReport>() {
  using W = WheelReport;
  static constexpr Field fields[] = {
      field<&W::name>("name", "of the wheel"),
      field<&W::inertia>("inertia", "kg m^2", "about its axis"),
      field<&W::rate_before>("rate_before", "rad/s", "relative to the base, as the run began"),
      field<&W::rate_after>("rate_after", "rad/s", "as it ended"),
      derived<[](const W& w) { return w.momentum_after(); }>("momentum_after", "N m s",
                                                             "inertia times rate relative to the base, as it ended"),
      field<&W::largest_rate>("largest_rate", "rad/s", "of either sign, at the instants that were looked at"),
      field<&W::rate_limit>("rate_limit", "rad/s", "null: none").or_null(),
      field<&W::largest_torque>("largest_torque", "N m", "of its motor, likewise; null: nobody looked").or_null(),
      field<&W::torque_limit>("torque_limit", "N m", "null: none").or_null(),
  };
  static constexpr Type type = structure<W>("WheelReport", "a reaction wheel of the base.", fields);
  return type;
}

template <>
const Type& type_of<GyroReport>() {
  using G = GyroReport;
  static constexpr Field fields[] = {
      field<&G::name>("name", "of the gyro"),
      field<&G::momentum>("momentum", "N m s", "of its rotor relative to the gimbal"),
      field<&G::angle_before>("angle_before", "rad", "of its gimbal, as the run began"),
      field<&G::angle_after>("angle_after", "rad", "as it ended"),
      field<&G::largest_rate>("largest_rate", "rad/s",
                              "of the gimbal, of either sign, at the instants that were looked at"),
      field<&G::rate_limit>("rate_limit", "rad/s", "largest that is commanded; null: none").or_null(),
      field<&G::largest_torque>("largest_torque", "N m", "of the gimbal's motor, likewise; null: nobody looked")
          .or_null(),
      field<&G::torque_limit>("torque_limit", "N m", "null: none").or_null(),
      field<&G::largest_spin_torque>("largest_spin_torque", "N m",
                                     "of the motor that keeps the rotor's rate, likewise; null: nobody looked")
          .or_null(),
  };
  static constexpr Type type = structure<G>("GyroReport", "a control moment gyro of the base.", fields);
  return type;
}

template <>
const Type& type_of<SingularityHazard>() {
  using H = SingularityHazard;
  static constexpr Field fields[] = {
      field<&H::begin>("begin", "s", "when it began"),
      derived<[](const H& h) { return h.duration(); }>(
          "duration", "s", "how long it lasted; each integration step counts as its middle is"),
      field<&H::least_measure>("least_measure", "1", "of singularity, in these middles"),
      field<&H::largest_torque_lacking>("largest_torque_lacking", "N m", "part of the torque asked for, likewise"),
  };
  static constexpr Type type = structure<H>(
      "SingularityHazard", "a time in which gyros that are steered are near a singular configuration.", fields);
  return type;
}

template <>
const Type& type_of<GyrosReport>() {
  using G = GyrosReport;
  static constexpr Field fields[] = {
      field<&G::each>("each", "in the robot's order"),
      field<&G::least_singularity_measure>(
          "least_singularity_measure", "1",
          "least root of det(A Aᵀ), A the momenta's derivatives by the gimbal angles over the largest momentum, at the "
          "instants that were looked at; 0: about one axis no torque can be given"),
      field<&G::steered>("steered", "whether a torque was asked of them"),
      field<&G::near>("near", "1", "measure below which they are near a singularity; null: never steered").or_null(),
      field<&G::largest_torque_lacking>(
          "largest_torque_lacking", "N m",
          "largest part of the torque asked for that the commanded gimbal rates leave out, near singularities or at "
          "largest rates; null: never steered, or nobody looked")
          .or_null(),
      field<&G::hazards>("hazards", "times near a singularity while a torque is asked of them"),
  };
  static constexpr Type type = structure<G>("GyrosReport", "the control moment gyros of the base.", fields);
  return type;
}

template <>
const Type& type_of<JointReport::Mode>() {
  using M = JointReport::Mode;
  static constexpr Choice choices[] = {choice(M::moving, "moving"), choice(M::stuck, "stuck"),
                                       choice(M::at_lower_stop, "at_lower_stop"),
                                       choice(M::at_upper_stop, "at_upper_stop"), choice(M::prescribed, "prescribed")};
  static constexpr Type type = enumeration<M>("JointMode", choices);
  return type;
}

template <>
const Type& type_of<JointReport>() {
  using J = JointReport;
  static constexpr Field fields[] = {
      field<&J::phase>("phase", "in motion"),
      field<&J::joint>("joint", "of the robot"),
      field<&J::mode>("mode",
                      "at the phase's end. `moving`: it is free to. `stuck`: friction holds it. `at_lower_stop`, "
                      "`at_upper_stop`: it rests there. `prescribed`: it moves as prescribed, and neither sticks nor "
                      "meets its stops"),
      field<&J::sticks>("sticks", "1", "times that it came to rest"),
      field<&J::breakaways>("breakaways", "1", "times that it left it"),
      field<&J::friction_share>("friction_share", "1",
                                "largest friction while it was held, at any sample or time step, over its breakaway "
                                "effort `static`; null: its friction does not stick")
          .or_null(),
      field<&J::friction_determined>(
          "friction_determined",
          "false: closed loops left the friction of this joint undetermined while it was held. The values reported "
          "are the admissible set with the minimum sum of squared shares of breakaway"),
      field<&J::friction_heat>("friction_heat", "J", "that its friction made, stops apart"),
      field<&J::stop_impacts>("stop_impacts", "1", "times that it met a stop"),
      field<&J::stop_energy_lost>("stop_energy_lost", "J", "in these impacts, by the whole system"),
      field<&J::motor_work>("motor_work", "J", "mechanical work of its motor on the joint"),
      field<&J::copper_loss>("copper_loss", "J",
                             "current squared times resistance, over time; null: its motor's torque constant is not "
                             "known")
          .or_null(),
      derived<[](const J& j) { return j.electrical_energy(); }>(
          "electrical_energy", "J",
          "copper_loss + motor_work: what the motor took, less what it gave back while it braked; null likewise")
          .or_null(),
  };
  static constexpr Type type = structure<J>(
      "JointReport",
      "what a joint with sticking friction, stops, or a motor whose electricity is known did in one phase.", fields);
  return type;
}

template <>
const Type& type_of<ThrusterReport>() {
  using T = ThrusterReport;
  static constexpr Field fields[] = {
      field<&T::name>("name", "of the thruster"),
      field<&T::firings>("firings", "1", "how often its valve opened"),
      field<&T::on_time>("on_time", "s", "how long it was open"),
      field<&T::duty>("duty", "1", "on_time over the time of the phases in which thrusters are at work"),
      field<&T::impulse>("impulse", "N s", "of its force, ramps included"),
      field<&T::propellant>("propellant", "kg", "impulse over specific impulse and 9.80665 m/s^2"),
  };
  static constexpr Type type = structure<T>("ThrusterReport", "a thruster of the base.", fields);
  return type;
}

template <>
const Type& type_of<StopImpact>() {
  using S = StopImpact;
  static constexpr Field fields[] = {
      field<&S::time>("time", "s", "when it happened"),
      field<&S::joint>("joint", "of the robot"),
      field<&S::upper>("upper", "whether it was the upper end of its range"),
      field<&S::rate_before>("rate_before", "rad/s or m/s", "of the joint"),
      field<&S::rate_after>("rate_after", "rad/s or m/s", "of the joint"),
      field<&S::impulse>("impulse", "N m s or N s", "of the stop on the joint, along its axis"),
      field<&S::energy_lost>("energy_lost", "J", "by the whole system"),
  };
  static constexpr Type type = structure<S>("StopImpact", "a joint that met a stop at the end of its range.", fields);
  return type;
}

template <>
const Type& type_of<PlumeHazard>() {
  using P = PlumeHazard;
  static constexpr Field fields[] = {
      field<&P::thruster>("thruster", "that fires"),
      field<&P::body>("body", "a link or a target, as the clearance names it"),
      field<&P::first_time>("first_time", "s", "when it was first so"),
      field<&P::duration>("duration", "s",
                          "of firing with one of the body's points in the cone: corners, middles of edges and faces of "
                          "boxes, ends of cylinders and capsules, centres of all shapes, else its centre of mass; each "
                          "integration step counts as its middle is"),
  };
  static constexpr Type type = structure<P>("PlumeHazard", "a body in the plume of a thruster that fires.", fields);
  return type;
}

template <>
const Type& type_of<DumpingReport>() {
  using D = DumpingReport;
  static constexpr Field fields[] = {
      field<&D::begun>("begun", "1", "how often it began"),
      field<&D::first_begin>("first_begin", "s", "when it did first; 0 if never"),
      field<&D::duration>("duration", "s", "how long it went on in all"),
      field<&D::active>("active", "whether it went on as the run ended"),
      field<&D::largest_momentum>("largest_momentum", "N m s",
                                  "largest size of the wheels' momentum at the instants at which pulses may begin"),
  };
  static constexpr Type type = structure<D>("DumpingReport", "thrusters take out the wheels' momentum.", fields);
  return type;
}

template <>
const Type& type_of<ThrustersReport>() {
  using T = ThrustersReport;
  static constexpr Field fields[] = {
      field<&T::each>("each", "in the robot's order"),
      field<&T::propellant>("propellant", "kg", "used by all"),
      field<&T::at_hand>("at_hand", "kg", "of the robot file; null: nobody says").or_null(),
      derived<[](const T& t) { return t.excess(); }>("excess", "kg", "used beyond what is at hand; 0: none"),
      derived<[](const T& t) { return t.dumping; }>("dumping", "", "absent without it"),
      field<&T::hazards>("hazards", "plumes that met something"),
  };
  static constexpr Type type =
      structure<T>("ThrustersReport", "the thrusters of the base. The robot's mass stays what it is.", fields);
  return type;
}

}  // namespace grapnel
