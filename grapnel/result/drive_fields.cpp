// The fields of summary.json about loads and actuation: loads of grasps, joints and loops, control laws, reaction
// wheels.
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

// ---- Loads ----

template <>
const Type& type_of<LoopReport>() {
  using L = LoopReport;
  static constexpr Field fields[] = {
      field<&L::phase>("phase", "phase with closed loops"),
      field<&L::closures>(
          "closures",
          "`end-effector - target`: the grasps that close loops of the tree; then the joints that follow others"),
      field<&L::rows>("rows", "1", "constraint rows of all closures and couplings of joints"),
      field<&L::rank>("rank", "1",
                      "rank of these rows at the start of the phase; less than `rows`: some rows are redundant, and "
                      "internal loads are not all determined"),
      field<&L::unprojected_position>("unprojected_position", "m",
                                      "largest position defect of one step before projection"),
      field<&L::unprojected_angle>("unprojected_angle", "rad", "largest angle defect of one step before projection"),
      field<&L::unprojected_velocity>("unprojected_velocity", "m/s",
                                      "largest velocity defect of one step before projection"),
      field<&L::unprojected_angular_velocity>("unprojected_angular_velocity", "rad/s",
                                              "largest angular velocity defect of one step before projection"),
      field<&L::correction_total>("correction_total", "1",
                                  "sum of all corrections, in the error norm of the integrator, times the tolerance"),
      field<&L::integration_error>("integration_error", "1",
                                   "sum of the error estimates of all steps in the same measure; if it is smaller than "
                                   "`correction_total`, projection may hide errors"),
  };
  static constexpr Type type =
      structure<L>("LoopReport",
                   "closure of the kinematic loops in one phase, including an approach in which a grasp closed before "
                   "its end. The ledger has the defect that remains after projection (`loop_closure_...`).",
                   fields);
  return type;
}

template <>
const Type& type_of<GraspLoad>() {
  using G = GraspLoad;
  static constexpr Field fields[] = {
      field<&G::phase>("phase", "phase in which the grasp held"),
      field<&G::end_effector>("end_effector", "end-effector of the grasp"),
      field<&G::target>("target", "target of the grasp"),
      field<&G::largest_force>("largest_force", "N", "largest force on the robot at the grasp"),
      field<&G::force_time>("force_time", "s", "time of the largest force"),
      field<&G::largest_moment>("largest_moment", "N m", "largest moment about the grasp"),
      field<&G::moment_time>("moment_time", "s", "time of the largest moment"),
      field<&G::determined>(
          "determined",
          "six values, one per component, angular x, y, z then linear x, y, z, in W, at the start of the phase; false: "
          "a self-stress leaves the component undetermined, and the minimum in the metric of the impact is reported"),
  };
  static constexpr Type type = structure<G>("GraspLoad",
                                            "the load on one grasp in one phase while it holds. The time series "
                                            "`grasps/END_EFFECTOR/force` and `moment` have its history.",
                                            fields);
  return type;
}

template <>
const Type& type_of<PeakLoad>() {
  using L = PeakLoad;
  static constexpr Field fields[] = {
      field<&L::of>("of", "joint, end-effector, or `base control`"),
      field<&L::quantity>("quantity",
                          "in motion: `force` and `moment`, the magnitudes that a joint transmits at its origin, or a "
                          "grasp at the grasp; `driving`, the effort of a joint's drive or brake along its axis; for "
                          "base control `driving/x`, `driving/y`, `driving/z`, the torque about the base's axes; of "
                          "impacts of hard contacts `impulse`, `angular_impulse`, `driving_impulse`. In impacts of "
                          "grasps: `impulse`, `angular_impulse`, `driving_impulse`, and `force`, `moment`, `driving`: "
                          "the peaks of a compliant impact, else means over `impact.duration`"),
      field<&L::phase>("phase",
                       "phase of the load; impacts are phases too: `contact`, `contact_2`, and brakes: `brake`"),
      field<&L::peak>("peak", "N, N m, N s or N m s", "largest magnitude"),
      field<&L::time>("time", "s", "time of the peak"),
      derived<[](const L& l) { return std::isfinite(l.rating) ? std::optional(l.rating) : std::nullopt; }>(
          "rating", "as `peak`",
          "rating in the robot file; null: none. For a drive in motion the smaller of `rating.driving` and "
          "`limits.effort`")
          .or_null(),
      derived<[](const L& l) { return std::isfinite(l.rating) ? std::optional(l.margin()) : std::nullopt; }>(
          "margin", "1",
          "1 - peak over rating; negative: exceeded; 0 for a drive: saturated at its effort limit; null: no rating")
          .or_null(),
      field<&L::assumed_duration>(
          "assumed_duration", "whether the load is a mean over the assumed `impact.duration`; the peak may be larger"),
  };
  static constexpr Type type = structure<L>("PeakLoad", "the largest value of one load in one phase.", fields);
  return type;
}

template <>
const Type& type_of<ReleaseReport>() {
  using R = ReleaseReport;
  static constexpr Field fields[] = {
      field<&R::time>("time", "s", "time of the release"),
      field<&R::end_effectors>("end_effectors", "end-effectors that released their targets"),
      field<&R::targets>("targets", "targets that these end-effectors held, in their order"),
  };
  static constexpr Type type = structure<R>("ReleaseReport", "grasps that are released together.", fields);
  return type;
}

template <>
const Type& type_of<LossReport>() {
  using L = LossReport;
  static constexpr Field fields[] = {
      field<&L::time>("time", "s", "time at which the grasp opened"),
      field<&L::end_effector>("end_effector", "end-effector that lost its target"),
      field<&L::target>("target", "target that it held"),
      field<&L::force>("force", "N", "force between gripper and target"),
      field<&L::moment>("moment", "N m", "moment between them, about the grasp point"),
      field<&L::load>("load", "1", "load relative to the limits in `holds`, which is 1 at the limit"),
      field<&L::in_impact>("in_impact",
                           "whether an impact exceeded the limits: force and moment are then means over "
                           "`impact.duration`, or the peaks of a compliant impact"),
      field<&L::by_slip>("by_slip", "whether the grasp slipped farther than its limits permit"),
  };
  static constexpr Type type = structure<L>(
      "LossReport", "a grasp that opened because its load exceeded its limits, or that slipped too far.", fields);
  return type;
}

template <>
const Type& type_of<SlipEnd>() {
  using E = SlipEnd;
  static constexpr Choice choices[] = {choice(E::slips, "slips"), choice(E::sticks, "sticks"), choice(E::lost, "lost"),
                                       choice(E::released, "released")};
  static constexpr Type type = enumeration<E>("SlipEnd", choices);
  return type;
}

template <>
const Type& type_of<SlipReport>() {
  using S = SlipReport;
  static constexpr Field fields[] = {
      field<&S::time>("time", "s", "onset of the slip"),
      field<&S::end_effector>("end_effector", "end-effector of the grasp"),
      field<&S::target>("target", "target that it holds"),
      field<&S::force>("force", "N", "force between gripper and target at the onset"),
      field<&S::moment>("moment", "N m", "moment between them at the onset, about the grasp point"),
      field<&S::ended>("ended",
                       "`sticks`: gripper and target came to rest relative to each other. `lost`: the slip exceeded "
                       "`lost_distance` or `lost_angle`, or an impact the limit of the part that did not slip. "
                       "`released`: the grasp was released. `slips`: the run ended"),
      field<&S::until>("until", "s", "end of the slip, or of the run"),
      field<&S::distance>("distance", "m", "path of the gripper relative to the target"),
      field<&S::angle>("angle", "rad", "the same for its rotation"),
      field<&S::energy>("energy", "J", "energy dissipated by friction"),
  };
  static constexpr Type type = structure<S>("SlipReport", "slip of a grasp whose load exceeded its limits.", fields);
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
const Type& type_of<LawReport::Law>() {
  using L = LawReport::Law;
  static constexpr Choice choices[] = {choice(L::detumbling, "detumbling"), choice(L::base_keeping, "base_keeping"),
                                       choice(L::impedance, "impedance"), choice(L::grasp_force, "grasp_force")};
  static constexpr Type type = enumeration<L>("ControlLaw", choices);
  return type;
}

template <>
const Type& type_of<LawReport::Squeeze>() {
  using S = LawReport::Squeeze;
  static constexpr Field fields[] = {
      field<&S::between>("between", "the two end-effectors"),
      field<&S::reference>("reference", "N", "commanded squeezing force on the target, at the end"),
      field<&S::force>("force", "N", "squeezing force at the end, from the multipliers of the closed loops"),
      field<&S::largest_error>("largest_error", "N", "largest difference of the two"),
      field<&S::largest_error_time>("largest_error_time", "s", "time of that difference"),
  };
  static constexpr Type type = structure<S>("Squeeze", "the internal force between two grasps.", fields);
  return type;
}

namespace {
// A member that these laws report.
template <auto Member, LawReport::Law... laws>
constexpr Field law_field(std::string_view key, std::string_view unit, std::string_view text) {
  Field f = field<Member>(key, unit, text);
  f.is_present = [](const void* report) { return ((static_cast<const LawReport*>(report)->law == laws) || ...); };
  return f;
}
}  // namespace

template <>
const Type& type_of<LawReport>() {
  using L = LawReport;
  using enum LawReport::Law;
  static constexpr Field fields[] = {
      law_field<&L::target, detumbling, grasp_force>("target", "", "target that is detumbled or squeezed"),
      field<&L::begin>("begin", "s", "start of the control law"),
      field<&L::end>("end", "s", "end of the control law; after the impact the joints then hold"),
      field<&L::ended>(
          "ended",
          "`running`: the run or the phase ended first. `at_rest`: the angular momentum of the target fell to a "
          "millionth. `rank_lost`: the joints came near a configuration in which they cannot move the target or the "
          "end-effectors in all controlled directions, or cannot turn the base about all initially controllable axes; "
          "detumbling continues in the other directions (`least_condition`). `joint_limit`: a joint reached the end of "
          "its range. `released`: the target was released, or fewer than two grasps hold a squeezed target"),
      field<&L::joint>("joint", "joint whose range ended the law; empty otherwise"),
      law_field<&L::torque_bound, detumbling>("torque_bound", "N m",
                                              "bound on the torque about the target's centre of mass"),
      law_field<&L::largest_torque, detumbling>(
          "largest_torque", "N m",
          "largest torque of the grasps about the target's centre of mass, from the target's "
          "motion: at the ends and in the middle of every step"),
      law_field<&L::angular_momentum_before, detumbling>(
          "angular_momentum_before", "N m s", "angular momentum of the target about its centre of mass, at the start"),
      law_field<&L::angular_momentum_after, detumbling>(
          "angular_momentum_after", "N m s", "angular momentum of the target about its centre of mass, at the end"),
      law_field<&L::speed_before, detumbling>(
          "speed_before", "m/s",
          "speed of the target's centre of mass relative to that of servicer and held targets, at the start"),
      law_field<&L::speed_after, detumbling>("speed_after", "m/s", "the same speed at the end"),
      law_field<&L::expected_duration, detumbling>(
          "expected_duration", "s", "angular_momentum_before over torque_bound: the duration with sufficient efforts"),
      law_field<&L::first_share, detumbling>(
          "first_scale", "1",
          "fraction of the torque bound that effort limits and grasp ratings admit at the start; "
          "expected_duration over this fraction estimates the duration"),
      law_field<&L::pairs, grasp_force>("pairs", "", "pairs of grasps that squeeze the target"),
      law_field<&L::rank, grasp_force>(
          "internal_rank", "1",
          "number of internal directions that the efforts control besides the target's motion, at the start"),
      law_field<&L::other_internal_force, grasp_force>(
          "other_internal_force", "N",
          "largest difference of the grasps' internal wrenches from the reference, over "
          "all components; moments are divided by the metric's length"),
      law_field<&L::largest_distance, impedance, grasp_force>(
          "largest_distance", "m",
          "largest distance of an end-effector, or of the squeezed target, from its reference; 0 with brake"),
      law_field<&L::largest_distance_time, impedance>("largest_distance_time", "s", "time of that distance"),
      law_field<&L::distance_after, impedance>("distance_after", "m",
                                               "largest distance of the end-effectors at the end"),
      law_field<&L::largest_angle, base_keeping, impedance, grasp_force>(
          "largest_angle", "rad",
          "largest angle of an end-effector, of the squeezed target or of the base from its "
          "reference; 0 if orientation is not controlled, and with brake"),
      law_field<&L::largest_angle_time, base_keeping, impedance>("largest_angle_time", "s", "time of that angle"),
      law_field<&L::angle_after, base_keeping, impedance>(
          "angle_after", "rad", "largest angle of the end-effectors, or of the base, at the end"),
      law_field<&L::angular_velocity_after, base_keeping>("angular_velocity_after", "rad/s",
                                                          "angular velocity of the base, at the end"),
      law_field<&L::rank, base_keeping>("rank", "1",
                                        "number of axes about which the joints could turn the base, at the start"),
      law_field<&L::least_share, detumbling, grasp_force>(
          "least_scale", "1",
          "minimum fraction of the torque bound that effort limits and grasp ratings admit, or of "
          "the internal force that effort limits admit; 1: they were always sufficient"),
      law_field<&L::least_share_time, detumbling, grasp_force>("least_scale_time", "s", "time of that minimum"),
      law_field<&L::least_share, base_keeping, impedance>(
          "least_share", "1",
          "minimum fraction that the effort limits admit: of the commanded efforts of impedance; of "
          "the self-motion that does not turn the base"),
      law_field<&L::least_share_time, base_keeping, impedance>("least_share_time", "s", "time of that minimum"),
      field<&L::within_limits>(
          "within_limits",
          "whether the efforts of the commanded motion stayed within the limits, in detumbling with a reduced torque; "
          "if not, they were reduced, and target, end-effectors or base deviated from this motion"),
      law_field<&L::largest_demand, detumbling>(
          "largest_demand", "1",
          "largest share of an effort limit or of a grasp rating that the law demanded before "
          "efforts were scaled down; above 1: factor by which the limits are too small"),
      law_field<&L::largest_demand_time, detumbling>("largest_demand_time", "s", "time of that demand"),
      law_field<&L::limiting, detumbling>("limiting", "", "limit with the largest demand; empty: no limits are stated"),
      field<&L::least_condition>("least_condition", "1",
                                 "minimum ratio of the smallest to the largest singular value of the map from efforts "
                                 "to the target's accelerations, from joint rates to the end-effectors' motion, or, "
                                 "within `rank`, from joint rates to the base's rotation"),
      field<&L::least_condition_time>("least_condition_time", "s", "time of that minimum"),
  };
  static constexpr Type type = structure<L>(
      "LawReport", "a control law that moves all joints together; which keys it has depends on the law.", fields);
  return type;
}

template <>
const Type& type_of<ControlReport>() {
  using C = ControlReport;
  static constexpr Field fields[] = {
      field<&C::period>("period", "s", "time between samples"),
      field<&C::delay>("delay", "s", "time from a sample to the command computed from it"),
      field<&C::plugin>("plugin",
                        "the controller: a library or an FMU as named in the scenario, or the name of a Python class; "
                        "empty without one"),
      field<&C::plugin_sha256>(
          "plugin_sha256",
          "SHA-256 of the library's bytes, or of the source of a Python class; empty without a controller"),
  };
  static constexpr Type type = structure<C>("ControlReport", "the on-board computer that samples the control.", fields);
  return type;
}

template <>
const Type& type_of<WheelReport>() {
  using W = WheelReport;
  static constexpr Field fields[] = {
      field<&W::name>("name", "name of the wheel"),
      field<&W::inertia>("inertia", "kg m^2", "moment of inertia about its axis"),
      field<&W::rate_before>("rate_before", "rad/s", "rate relative to the base at the start of the run"),
      field<&W::rate_after>("rate_after", "rad/s", "rate relative to the base at the end of the run"),
      derived<[](const W& w) { return w.momentum_after(); }>(
          "momentum_after", "N m s", "inertia times rate relative to the base, at the end of the run"),
      field<&W::largest_rate>("largest_rate", "rad/s", "largest magnitude of the rate at the evaluated instants"),
      field<&W::rate_limit>("rate_limit", "rad/s", "limit of the rate; null: none").or_null(),
      field<&W::largest_torque>("largest_torque", "N m",
                                "largest magnitude of the motor torque at the evaluated instants; null: not evaluated")
          .or_null(),
      field<&W::torque_limit>("torque_limit", "N m", "limit of the motor torque; null: none").or_null(),
  };
  static constexpr Type type = structure<W>("WheelReport", "a reaction wheel of the base.", fields);
  return type;
}

template <>
const Type& type_of<GyroReport>() {
  using G = GyroReport;
  static constexpr Field fields[] = {
      field<&G::name>("name", "name of the gyro"),
      field<&G::momentum>("momentum", "N m s", "momentum of its rotor relative to the gimbal"),
      field<&G::angle_before>("angle_before", "rad", "gimbal angle at the start of the run"),
      field<&G::angle_after>("angle_after", "rad", "gimbal angle at the end of the run"),
      field<&G::largest_rate>("largest_rate", "rad/s",
                              "largest magnitude of the gimbal rate at the evaluated instants"),
      field<&G::rate_limit>("rate_limit", "rad/s", "largest rate that is commanded; null: none").or_null(),
      field<&G::largest_torque>(
          "largest_torque", "N m",
          "largest magnitude of the gimbal motor's torque at the evaluated instants; null: not evaluated")
          .or_null(),
      field<&G::torque_limit>("torque_limit", "N m", "limit of the gimbal motor's torque; null: none").or_null(),
      field<&G::largest_spin_torque>(
          "largest_spin_torque", "N m",
          "largest magnitude of the torque of the rotor's motor, which keeps the rotor's rate; null: not evaluated")
          .or_null(),
  };
  static constexpr Type type = structure<G>("GyroReport", "a control moment gyro of the base.", fields);
  return type;
}

template <>
const Type& type_of<SingularityHazard>() {
  using H = SingularityHazard;
  static constexpr Field fields[] = {
      field<&H::begin>("begin", "s", "start of the interval"),
      derived<[](const H& h) { return h.duration(); }>(
          "duration", "s", "duration of the interval; each integration step counts by the state at its middle"),
      field<&H::least_measure>("least_measure", "1", "minimum singularity measure at these middles"),
      field<&H::largest_torque_lacking>("largest_torque_lacking", "N m",
                                        "largest missing part of the commanded torque at these middles"),
  };
  static constexpr Type type = structure<H>(
      "SingularityHazard", "an interval in which steered gyros are near a singular configuration.", fields);
  return type;
}

template <>
const Type& type_of<GyrosReport>() {
  using G = GyrosReport;
  static constexpr Field fields[] = {
      field<&G::each>("each", "gyros in the robot's order"),
      field<&G::least_singularity_measure>(
          "least_singularity_measure", "1",
          "minimum of the root of det(A Aᵀ) at the evaluated instants, A the derivatives of the momenta with respect "
          "to the gimbal angles over the largest momentum; 0: no torque is available about one axis"),
      field<&G::steered>("steered", "whether the gyros were commanded a torque"),
      field<&G::near>("near", "1", "measure below which the gyros are near a singularity; null: never steered")
          .or_null(),
      field<&G::largest_torque_lacking>(
          "largest_torque_lacking", "N m",
          "largest part of the commanded torque that the commanded gimbal rates do not produce, near singularities or "
          "at rate limits; null: never steered, or not evaluated")
          .or_null(),
      field<&G::hazards>("hazards", "intervals near a singularity while a torque is commanded"),
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
      field<&J::phase>("phase", "phase of motion"),
      field<&J::joint>("joint", "name of the joint"),
      field<&J::mode>("mode",
                      "state at the end of the phase. `moving`: free to move. `stuck`: held by friction. "
                      "`at_lower_stop`, `at_upper_stop`: resting on a stop. `prescribed`: on a prescribed motion, "
                      "which neither sticks nor meets stops"),
      field<&J::sticks>("sticks", "1", "number of transitions to sticking"),
      field<&J::breakaways>("breakaways", "1", "number of breakaways"),
      field<&J::friction_share>("friction_share", "1",
                                "largest friction while held, at any sample or time step, over its breakaway effort "
                                "`static`; null: its friction does not stick")
          .or_null(),
      field<&J::friction_determined>(
          "friction_determined",
          "false: closed loops left the friction of this joint undetermined while it was held. The reported values are "
          "the admissible set with the minimum sum of squared shares of breakaway"),
      field<&J::friction_heat>("friction_heat", "J", "heat from joint friction, without stops"),
      field<&J::stop_impacts>("stop_impacts", "1", "number of impacts on a stop"),
      field<&J::stop_energy_lost>("stop_energy_lost", "J", "energy that the whole system lost in these impacts"),
      field<&J::motor_work>("motor_work", "J", "mechanical work of its motor on the joint"),
      field<&J::copper_loss>(
          "copper_loss", "J",
          "current squared times resistance, over time; null: the motor's torque constant is not given")
          .or_null(),
      derived<[](const J& j) { return j.electrical_energy(); }>(
          "electrical_energy", "J",
          "copper_loss + motor_work: energy drawn by the motor minus energy returned while braking; null: the motor's "
          "torque constant is not given")
          .or_null(),
  };
  static constexpr Type type = structure<J>(
      "JointReport", "motion in one phase of a joint with sticking friction, stops, or an electrically modelled motor.",
      fields);
  return type;
}

template <>
const Type& type_of<ThrusterReport>() {
  using T = ThrusterReport;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the thruster"),
      field<&T::firings>("firings", "1", "number of valve openings"),
      field<&T::on_time>("on_time", "s", "total time with an open valve"),
      field<&T::duty>("duty", "1", "on_time over the time of the phases in which thrusters are active"),
      field<&T::impulse>("impulse", "N s", "impulse of its force, including ramps"),
      field<&T::propellant>("propellant", "kg", "propellant mass: impulse over specific impulse and 9.80665 m/s^2"),
  };
  static constexpr Type type = structure<T>("ThrusterReport", "a thruster of the base.", fields);
  return type;
}

template <>
const Type& type_of<StopImpact>() {
  using S = StopImpact;
  static constexpr Field fields[] = {
      field<&S::time>("time", "s", "time of the impact"),
      field<&S::joint>("joint", "name of the joint"),
      field<&S::upper>("upper", "true: upper end of the range; false: lower end"),
      field<&S::rate_before>("rate_before", "rad/s or m/s", "joint rate before the impact"),
      field<&S::rate_after>("rate_after", "rad/s or m/s", "joint rate after the impact"),
      field<&S::impulse>("impulse", "N m s or N s", "impulse of the stop on the joint, along its axis"),
      field<&S::energy_lost>("energy_lost", "J", "energy that the whole system lost"),
  };
  static constexpr Type type =
      structure<S>("StopImpact", "impact of a joint on a stop at the end of its range.", fields);
  return type;
}

template <>
const Type& type_of<PlumeHazard>() {
  using P = PlumeHazard;
  static constexpr Field fields[] = {
      field<&P::thruster>("thruster", "name of the thruster"),
      field<&P::body>("body", "link or target, named as in the clearance report"),
      field<&P::first_time>("first_time", "s", "start of the first interval in the plume"),
      field<&P::duration>("duration", "s",
                          "duration of firing with one of the body's points in the plume cone: corners, midpoints of "
                          "edges and faces of boxes, ends of cylinders and capsules, centres of all shapes, else its "
                          "centre of mass; each integration step counts by the state at its middle"),
  };
  static constexpr Type type = structure<P>("PlumeHazard", "a body in the plume of a firing thruster.", fields);
  return type;
}

template <>
const Type& type_of<DumpingReport>() {
  using D = DumpingReport;
  static constexpr Field fields[] = {
      field<&D::begun>("begun", "1", "number of times that unloading began"),
      field<&D::first_begin>("first_begin", "s", "first start of unloading; 0: never"),
      field<&D::duration>("duration", "s", "total duration of unloading"),
      field<&D::active>("active", "whether unloading was active at the end of the run"),
      field<&D::largest_momentum>(
          "largest_momentum", "N m s",
          "largest magnitude of the wheels' momentum at the instants at which pulses may begin"),
  };
  static constexpr Type type = structure<D>("DumpingReport", "unloading of the wheels' momentum by thrusters.", fields);
  return type;
}

template <>
const Type& type_of<ThrustersReport>() {
  using T = ThrustersReport;
  static constexpr Field fields[] = {
      field<&T::each>("each", "thrusters in the robot's order"),
      field<&T::propellant>("propellant", "kg", "propellant used by all thrusters"),
      field<&T::available>("available", "kg", "available propellant of the robot file; null: not given").or_null(),
      derived<[](const T& t) { return t.excess(); }>("excess", "kg",
                                                     "propellant used beyond the available mass; 0: none"),
      derived<[](const T& t) { return t.dumping; }>("dumping", "",
                                                    "unloading of the wheels; absent if it is not requested"),
      field<&T::hazards>("hazards", "plumes that met a body"),
  };
  static constexpr Type type =
      structure<T>("ThrustersReport", "the thrusters of the base. The robot's mass remains constant.", fields);
  return type;
}

}  // namespace grapnel
