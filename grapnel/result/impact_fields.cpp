// The fields of impacts: impulses at grasps and joints, what the configuration makes of them, and margins.
#include <algorithm>
#include <array>

#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// ---- As the document has it, where that differs from the result ----

struct ImpulseAtGrasp {
  std::string end_effector;
  Vector3d impulse, angular_impulse;
};
struct ImpulseSet {
  std::vector<ImpulseAtGrasp> grasps;
};

// The vectors of each set belong to the grasps of the impact, in their order.
std::vector<ImpulseSet> with_names(const std::vector<SelfStress>& sets, const ImpactReport& impact) {
  std::vector<ImpulseSet> named;
  for (const SelfStress& set : sets) {
    ImpulseSet& all = named.emplace_back();
    const std::size_t grasps = std::min({impact.grasps.size(), set.impulse.size(), set.angular_impulse.size()});
    for (std::size_t i = 0; i < grasps; ++i)
      all.grasps.push_back({impact.grasps[i].end_effector, set.impulse[i], set.angular_impulse[i]});
  }
  return named;
}

struct MeasuresOf {
  const ImpactReport* impact = nullptr;
  const ImpactMeasures& get() const { return *impact->measures; }
};

struct BaseReaction {
  Vector3d impulse, angular_impulse;
};

struct ImpactMargin : LoadMargin {
  bool assumed_duration;
};

using Row6 = std::array<double, 6>;
std::vector<Row6> rows_of_six(const std::vector<double>& values) {
  std::vector<Row6> rows(values.size() / 6);
  for (std::size_t i = 0; i < rows.size(); ++i) std::copy_n(values.begin() + 6 * std::ptrdiff_t(i), 6, rows[i].begin());
  return rows;
}

}  // namespace

// ---- Grasps ----

template <>
const Type& type_of<ContactRebound>() {
  using R = ContactRebound;
  static constexpr Field fields[] = {
      field<&R::normal>("normal", "1", "unit, from the target to the robot, in W"),
      field<&R::normal_impulse>("normal_impulse", "N s", "along the normal"),
      field<&R::tangential_impulse>("tangential_impulse", "N s", "of friction, in W"),
      field<&R::compression>("compression", "N s", "of the normal impulse, while the bodies approach"),
      field<&R::normal_work>("normal_work", "J", "done on the bodies by the normal impulse"),
      field<&R::friction_work>("friction_work", "J", "done on them by friction"),
      field<&R::modes>("modes", "`separated`, `sticking`, `sliding`, `reversed`: in the order in which they came"),
      field<&R::spread>("spread", "1",
                        "of the normal impulse over other orders of simultaneous contacts, relative; null: not known")
          .or_null(),
  };
  static constexpr Type type =
      structure<R>("ContactRebound", "a contact that does not hold: how it rebounded.", fields);
  return type;
}

template <>
const Type& type_of<ForceProfile>() {
  using P = ForceProfile;
  static constexpr Field fields[] = {
      field<&P::peak_force>("peak_force", "N", "largest force in the impact"),
      field<&P::peak_force_time>("peak_force_time", "s", "when that is, from the impact's beginning"),
      field<&P::peak_moment>("peak_moment", "N m", "largest moment in the impact"),
      field<&P::peak_moment_time>("peak_moment_time", "s", "when that is, from the impact's beginning"),
      field<&P::largest_deformation>("largest_deformation", "m", "of the contact or the grasp's spring"),
      field<&P::duration>("duration", "s", "in touch, or until the grasp was at rest"),
      field<&P::energy_lost>("energy_lost", "J", "by damping and friction"),
      field<&P::touches>("touches", "1", "how often the bodies came together"),
  };
  static constexpr Type type = structure<P>("ForceProfile", "a contact or grasp that was resolved in time.", fields);
  return type;
}

template <>
const Type& type_of<GraspImpulse>() {
  using G = GraspImpulse;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "of the grasp or contact"),
      field<&G::target>("target", "of the grasp or contact"),
      field<&G::grasp_point>("grasp_point", "on the target"),
      field<&G::model>("model", "`rigid` (6 rows), `hinge` (5), `point` (3), `contact` (does not hold)"),
      field<&G::contact_point>("contact_point", "m", "common to end-effector and target, in W"),
      field<&G::gap>("gap", "m", "distance of end-effector and grasp point when they were joined"),
      field<&G::gap_angle>("gap_angle", "rad", "angle between their frames when they were joined"),
      field<&G::target_displacement>("target_displacement", "m",
                                     "by which `contact.gap: translate_target` moved the target, in W"),
      field<&G::impulse>("impulse", "N s", "on the robot at the contact point, in W"),
      field<&G::angular_impulse>("angular_impulse", "N m s", "on the robot about the contact point, in W"),
      field<&G::impulse_magnitude>("impulse_magnitude", "N s", "of the impulse"),
      field<&G::mean_force>("mean_force", "N", "impulse over impact.duration; law compliant: over profile.duration"),
      field<&G::determined>("determined",
                            "six, per component, angular x, y, z then linear x, y, z, in W: unique, or open to a "
                            "self-stress of closed loops"),
      field<&G::relative_velocity_before>("relative_velocity_before", "m/s",
                                          "end-effector minus target at the contact point, before, in W"),
      field<&G::relative_angular_velocity_before>("relative_angular_velocity_before", "rad/s",
                                                  "end-effector minus target, before, in W"),
      field<&G::relative_velocity_after>("relative_velocity_after", "m/s",
                                         "the same afterwards: zero in what a grasp holds"),
      field<&G::relative_angular_velocity_after>("relative_angular_velocity_after", "rad/s", "likewise"),
      field<&G::rebound>("rebound", "of a contact under `restitution` or `friction`"),
      field<&G::profile>("profile", "law `compliant`"),
  };
  static constexpr Type type = structure<G>(
      "GraspImpulse",
      "one grasp or contact of the impact. Impulses act **on the robot** at the contact point; the target gets the "
      "opposite there.",
      fields);
  return type;
}

template <>
const Type& type_of<ImpulseAtGrasp>() {
  using I = ImpulseAtGrasp;
  static constexpr Field fields[] = {
      field<&I::end_effector>("end_effector", "whose grasp it is"),
      field<&I::impulse>("impulse", "N s", "as in `GraspImpulse`"),
      field<&I::angular_impulse>("angular_impulse", "N m s", "as in `GraspImpulse`"),
  };
  static constexpr Type type = structure<I>("ImpulseAtGrasp", "a part of an `ImpulseSet`.", fields);
  return type;
}

template <>
const Type& type_of<ImpulseSet>() {
  static constexpr Field fields[] = {
      field<&ImpulseSet::grasps>("grasps", "in the order of the impact's grasps; in words of `GraspImpulse`")};
  static constexpr Type type = structure<ImpulseSet>(
      "ImpulseSet", "impulses at all grasps together, scaled so that the largest component is 1 (N s or N m s).",
      fields);
  return type;
}

template <>
const Type& type_of<LoopGap>() {
  using L = LoopGap;
  using Names = std::array<std::string, 2>;
  static constexpr Field fields[] = {
      field<&L::target>("target", "that both hold"),
      derived<[](const L& l) {
        return Names{l.end_effectors[0], l.end_effectors[1]};
      }>("end_effectors", "", "the first grasp's, the further one's"),
      derived<[](const L& l) {
        return Names{l.grasp_points[0], l.grasp_points[1]};
      }>("grasp_points", "", "likewise"),
      field<&L::end_effector_distance>("end_effector_distance", "m", "between the end-effectors when they closed"),
      field<&L::grasp_point_distance>("grasp_point_distance", "m", "between the grasp points that they are to hold"),
      derived<[](const L& l) { return l.gap(); }>(
          "gap", "m",
          "by how much these differ. No motion of the target changes either: so much remains, and is held as found"),
  };
  static constexpr Type type = structure<L>(
      "LoopGap", "a further grasp of a target against the first: whether both can be where they are meant to be.",
      fields);
  return type;
}

// ---- Bodies and joints ----

template <>
const Type& type_of<BodyImpulse>() {
  static constexpr Field fields[] = {
      field<&BodyImpulse::body>("body", "that received it"),
      field<&BodyImpulse::impulse>("impulse", "N s", "in W"),
      field<&BodyImpulse::angular_impulse>("angular_impulse", "N m s", "about the body's centre of mass, in W"),
  };
  static constexpr Type type = structure<BodyImpulse>(
      "BodyImpulse",
      "all that a body received, from joints and grasps together: unique, also where the impulses of single grasps are "
      "not.",
      fields);
  return type;
}

template <>
const Type& type_of<JointImpulse>() {
  using J = JointImpulse;
  static constexpr Field fields[] = {
      field<&J::joint>("joint", "that passes it on"),
      field<&J::body>("body", "that the joint carries"),
      field<&J::impulse>("impulse", "N s", "passed on at the joint's origin, from parent to child, in W"),
      field<&J::angular_impulse>("angular_impulse", "N m s", "about the joint's origin, likewise"),
      field<&J::along_axis>("along_axis", "N m s or N s",
                            "that the joint passes on along its axis: zero for a free "
                            "joint without rotor"),
      field<&J::peak_force>("peak_force", "N",
                            "law `compliant`: the largest of what it passes on, over the samples; else 0"),
      field<&J::peak_moment>("peak_moment", "N m", "likewise"),
      field<&J::peak_driving>("peak_driving", "N m or N", "likewise, along the axis"),
  };
  static constexpr Type type = structure<J>("JointImpulse", "what a joint passes on during the impact.", fields);
  return type;
}

template <>
const Type& type_of<HeldJoint>() {
  using H = HeldJoint;
  static constexpr Field fields[] = {
      field<&H::joint>("joint", "that was held, or was to be held"),
      field<&H::impulse>("impulse", "N m s or N s", "on it, along or about its axis"),
      field<&H::work>("work", "J", "done by it"),
      field<&H::told_rate>("told_rate", "rad/s or m/s", "that it was to hold"),
      field<&H::rate_after>("rate_after", "rad/s or m/s", "that it has after the impact"),
      field<&H::gave_way>("gave_way",
                          "the grasps did not allow all rates that drives were told, and this one had to "
                          "give way, as little as possible (docs/theory, section 7). A warning says so "
                          "too"),
  };
  static constexpr Type type = structure<H>(
      "HeldJoint",
      "a joint that a brake or a drive held during the impact, or was to hold. Law `compliant`: it gives way when the "
      "grasps become rigid; `impulse` and `work` are until then.",
      fields);
  return type;
}

template <>
const Type& type_of<BaseReaction>() {
  static constexpr Field fields[] = {
      field<&BaseReaction::impulse>("impulse", "N s", "in W"),
      field<&BaseReaction::angular_impulse>("angular_impulse", "N m s", "about the base's origin, in W"),
  };
  static constexpr Type type = structure<BaseReaction>("BaseReaction", "what the arms passed to the base.", fields);
  return type;
}

// ---- The thesis's estimate, and brakes ----

template <>
const Type& type_of<AsPublished::Grasp>() {
  using G = AsPublished::Grasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "of the grasp"),
      field<&G::impulse>("impulse", "N s", "as in `GraspImpulse`"),
      field<&G::angular_impulse>("angular_impulse", "N m s", "as in `GraspImpulse`"),
      field<&G::impulse_magnitude>("impulse_magnitude", "N s", "of the impulse"),
  };
  static constexpr Type type =
      structure<G>("PublishedImpulse", "one grasp's impulse by the thesis's formulas.", fields);
  return type;
}

template <>
const Type& type_of<AsPublished>() {
  using P = AsPublished;
  static constexpr Field fields[] = {
      field<&P::grasps>("grasps", "per grasp"),
      field<&P::joint_velocity_after>("joint_velocity_after", "rad/s or m/s",
                                      "(3.11), in the order of `joint_names` of the impact"),
      field<&P::linear_momentum_error>("linear_momentum_error", "N s", "total after minus before, its magnitude"),
      field<&P::angular_momentum_error>("angular_momentum_error", "N m s", "likewise"),
      field<&P::relative_linear_momentum_error>("relative_linear_momentum_error", "1",
                                                "over the ledger's scale; null: nothing moves")
          .or_null(),
      field<&P::relative_angular_momentum_error>("relative_angular_momentum_error", "1", "likewise").or_null(),
  };
  static constexpr Type type =
      structure<P>("AsPublished", "the thesis's own estimate, (3.8)-(3.13), for the same capture.", fields);
  return type;
}

template <>
const Type& type_of<BrakeGrasp>() {
  using G = BrakeGrasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "of the grasp"),
      field<&G::target>("target", "of the grasp"),
      field<&G::impulse>("impulse", "N s", "on the robot at the contact point, in W"),
      field<&G::angular_impulse>("angular_impulse", "N m s", "about the contact point, in W"),
      derived<[](const G& g) { return norm(g.impulse); }>("impulse_magnitude", "N s", "of the impulse"),
  };
  static constexpr Type type = structure<G>(
      "BrakeGrasp", "what a grasp passes on because of the brake, besides the impulse of the impact.", fields);
  return type;
}

template <>
const Type& type_of<BrakeReport>() {
  using B = BrakeReport;
  static constexpr Field fields[] = {
      field<&B::joints>("joints", "that are locked"),
      field<&B::impulse>("impulse", "N m s or N s", "per joint, along or about its axis"),
      field<&B::kinetic_energy_before>("kinetic_energy_before", "J", "of everything, before the brake"),
      field<&B::kinetic_energy_after>("kinetic_energy_after", "J", "after it"),
      field<&B::grasps>("grasps", "per grasp that holds"),
      field<&B::base_velocity_change>("base_velocity_change", "m/s", "of the base's origin, by the brake alone, in W"),
      field<&B::base_angular_velocity_change>("base_angular_velocity_change", "rad/s", "by the brake alone, in W"),
  };
  static constexpr Type type =
      structure<B>("BrakeReport",
                   "joints locked at once after the grasp: a second impulse with its own checks. `targets_after` and "
                   "the impact's own "
                   "changes are before the brake; the second sample of `contact` in the time series is after it.",
                   fields);
  return type;
}

template <>
const Type& type_of<ModesKept>() {
  using M = ModesKept;
  static constexpr Field fields[] = {
      field<&M::modes>("modes", "1", "that can answer, the slowest of base and joints as they are in the impact"),
      field<&M::frequency>("frequency", "Hz", "of the fastest of them; 0 without any"),
      field<&M::impulses>("impulses", "N s", "magnitudes, in the order of `grasps`"),
  };
  static constexpr Type type = structure<M>("ModesKept", "the plastic impact if nothing bent but these modes.", fields);
  return type;
}

template <>
const Type& type_of<EffectiveMass>() {
  using E = EffectiveMass;
  static constexpr Field fields[] = {
      field<&E::end_effector>("end_effector", "of the contact"),
      field<&E::target>("target", "that it meets"),
      field<&E::hand>("hand", "kg", "of the hand along the contact's normal, without control, the joints free"),
      field<&E::apparent>("apparent", "kg",
                          "of the hand by the impedance law; null where no such law acts that senses the force")
          .or_null(),
      field<&E::of_target>("of_target", "kg", "of the target along it"),
      field<&E::restitution>("restitution", "1",
                             "e of a central contact of such masses: the target is stopped where e times the hand's "
                             "mass is its own"),
      field<&E::target_speed_before>("target_speed_before", "m/s",
                                     "of the target's point along the normal towards the hand, relative to that"),
      field<&E::target_speed_after>("target_speed_after", "m/s",
                                    "of the target's point afterwards, relative to the hand's velocity before"),
  };
  static constexpr Type type = structure<E>("EffectiveMass", "hand and target as a contact meets them.", fields);
  return type;
}

template <>
const Type& type_of<CompliantReport>() {
  using C = CompliantReport;
  static constexpr Field fields[] = {
      field<&C::end>("end",
                     "`separated` (contacts only), `settled` (grasps are at rest), `time_over` (`impact.longest`)"),
      field<&C::duration>("duration", "s", "of the impact"),
      field<&C::energy_lost>("energy_lost", "J", "by dampers and friction"),
      field<&C::elastic_energy_after>(
          "elastic_energy_after", "J",
          "left in springs at the end; given up when grasps become rigid. With `time_over` the impact was cut off: "
          "this "
          "energy is missing, and the ledger's `compliant_energy_residual` fails if a contact is still compressed or "
          "grasps hold more than a thousandth of the kinetic energy before"),
      field<&C::residual_impulse>("residual_impulse", "N s",
                                  "largest impulse that then takes out what relative motion is left"),
      field<&C::energy_residual>(
          "energy_residual", "1",
          "of the balance of energy, over the kinetic energy before of the bodies that take part"),
      field<&C::motor_work>("motor_work", "J", "of joints that a law drives meanwhile (`impact.joints: impedance`)"),
      field<&C::rhs_evaluations>("rhs_evaluations", "1", "of the integration"),
      field<&C::modes>(
          "modes", "1",
          "of vibration of what bends, in the posture in which the bodies met, joints as in the impact, grasps open"),
      field<&C::slower_modes>("slower_modes", "1", "of these, whose period is longer than `duration`"),
      field<&C::slowest_period>("slowest_period", "s", "of the slowest of them; 0 where nothing bends"),
      field<&C::fastest_period>("fastest_period", "s",
                                "of the fastest. Modes with periods much shorter than the contact hardly answer it"),
  };
  static constexpr Type type = structure<C>("CompliantReport", "an impact that was resolved in time.", fields);
  return type;
}

// ---- Measures ----

template <>
const Type& type_of<EndEffectorMeasure>() {
  using M = EndEffectorMeasure;
  static constexpr Field fields[] = {
      field<&M::end_effector>("end_effector", "of the grasp or contact"),
      derived<[](const M& m) { return rows_of_six(m.inverse_inertia); }>(
          "inverse_inertia", "1/(kg m^2), 1/(kg m), 1/kg",
          "change of the end-effector's twist per impulse on it: six rows of six"),
      derived<[](const M& m) { return rows_of_six(m.pair_inverse_inertia); }>(
          "pair_inverse_inertia", "1/(kg m^2), 1/(kg m), 1/kg",
          "of its twist relative to the target, impulse on it and opposite on the target"),
      field<&M::linear_axes>("linear_axes", "1", "of the impulse ellipsoid: unit vectors in W"),
      field<&M::linear_mass>("linear_mass", "kg", "its semi-axes along them, descending"),
      field<&M::angular_axes>("angular_axes", "1", "the same of angular impulses"),
      field<&M::angular_inertia>("angular_inertia", "kg m^2", "the same of angular impulses"),
      field<&M::impulse_index>("impulse_index", "kg",
                               "impulse of a point contact that stops all of the present relative velocity, per speed; "
                               "0 where there is none")
          .or_null(),
      field<&M::robot_effective_mass>("robot_effective_mass", "kg",
                                      "of a frictionless contact along the present relative velocity: of the "
                                      "end-effector alone; null: nothing yields")
          .or_null(),
      field<&M::pair_effective_mass>("pair_effective_mass", "kg", "the same of end-effector and target").or_null(),
      field<&M::miss_of_robot_com>("miss_of_robot_com", "m",
                                   "of the line of impulse from the robot's centre of mass; 0 for no impulse, null for "
                                   "a pure couple")
          .or_null(),
      field<&M::miss_of_system_com>("miss_of_system_com", "m", "the same from that of robot and target").or_null(),
  };
  static constexpr Type type = structure<M>(
      "EndEffectorMeasure",
      "what an impulse at one grasp does, and what the present motion asks for, at the contact point.", fields);
  return type;
}

template <>
const Type& type_of<MeasuresOf>() {
  using M = MeasuresOf;
  static constexpr Field fields[] = {derived < [](const M& m) -> auto& {return m.get().end_effectors;
}
> ("end_effectors", "", "per grasp"),
    derived<[](const M& m) { return m.get().largest_impulse; }>(
        "largest_impulse", "1",
        "of all grasps together: impulse that a relative motion brings at worst; 1: as against an immovable robot")
        .or_null(),
    derived<[](const M& m) { return m.get().smallest_impulse; }>("smallest_impulse", "1", "likewise, at best")
        .or_null(),
    derived<[](const M& m) { return m.get().coupled_index; }>("coupled_index", "1", "likewise, of the present motion")
        .or_null(),
    derived<[](const M& m) { return m.get().miss_of_robot_com; }>(
        "miss_of_robot_com", "m", "of the resultant of all impulses, from the robot's centre of mass")
        .or_null(),
    derived<[](const M& m) { return m.get().miss_of_system_com; }>("miss_of_system_com", "m",
                                                                   "the same from that of robot and targets")
        .or_null(),
    derived<[](const M& m) {
      std::vector<std::vector<Row6>> all;
      for (const std::vector<double>& one : m.get().base_response) all.push_back(rows_of_six(one));
      return all;
    }>("base_response", "1/(kg m^2), 1/(kg m), 1/kg",
       "per grasp: change of the base's twist per impulse there; zero in directions that the grasp leaves free"),
    derived<[](const M& m) { return with_names(m.get().zero_disturbance, *m.impact); }>(
        "zero_disturbance", "", "a basis of the impulses that leave the base's twist alone"),
    derived<[](const M& m) { return with_names(m.get().zero_base_angular_velocity, *m.impact); }>(
        "zero_base_angular_velocity", "", "a basis of those that leave its angular velocity alone"),
};  // namespace grapnel
static constexpr Type type = structure<M>(
    "ImpactMeasures",
    "what the configuration makes of impulses, at the contact points, everything free but joints that are held. "
    "Twists and impulses are [angular; linear] in W; matrices are six rows of six.",
    fields);
return type;
}

template <>
const Type& type_of<ImpactSensitivity>() {
  using S = ImpactSensitivity;
  constexpr auto is_defined = [](const S& s) { return s.undefined.empty(); };
  static constexpr Field fields[] = {
      field<&S::parameter>("parameter", "such as `target mass`"),
      field<&S::unit>("unit", "of the parameter"),
      field<&S::end_effector>("end_effector", "whose parameter it is"),
      field<&S::target>("target", "likewise"),
      field<&S::undefined>("undefined", "instead of what follows: why there is none")
          .when<[](const S& s) { return !s.undefined.empty(); }>(),
      field<&S::impulse>("impulse", "N s per unit", "per grasp, in W").when<is_defined>(),
      field<&S::angular_impulse>("angular_impulse", "N m s per unit", "per grasp, in W").when<is_defined>(),
      field<&S::impulse_magnitude>("impulse_magnitude", "N s per unit", "per grasp").when<is_defined>(),
      field<&S::base_velocity_change>("base_velocity_change", "m/s per unit", "in W").when<is_defined>(),
      field<&S::base_angular_velocity_change>("base_angular_velocity_change", "rad/s per unit", "in W")
          .when<is_defined>(),
  };
  static constexpr Type type = structure<S>(
      "ImpactSensitivity", "derivatives of the impact with respect to something that is uncertain.", fields);
  return type;
}

// ---- Margins ----

template <>
const Type& type_of<ImpactMargin>() {
  using M = ImpactMargin;
  static constexpr Field fields[] = {
      field<&LoadMargin::of>("of", "joint or end-effector"),
      field<&LoadMargin::quantity>("quantity",
                                   "`force`, `moment`, `impulse`, `angular_impulse`, `driving` or `driving_impulse`"),
      field<&LoadMargin::load>(
          "load", "N, N m, N s or N m s",
          "forces and moments are peaks of an impact resolved in time, else impulses over `duration`"),
      field<&LoadMargin::rating>("rating", "as `load`", "of the robot file"),
      derived<[](const M& m) { return m.margin(); }>("margin", "1", "1 - load over rating; negative: exceeded"),
      field<&M::assumed_duration>("assumed_duration",
                                  "the load is a mean over `duration`, which is an assumption; the peak may be larger"),
  };
  static constexpr Type type =
      structure<M>("ImpactMargin", "a load of the impact for which the robot file has a rating.", fields);
  return type;
}

template <>
const Type& type_of<SpeedLimit>() {
  using S = SpeedLimit;
  static constexpr Field fields[] = {
      field<&S::end_effector>("end_effector", "of the arm"),
      field<&S::factor>("factor", "1", "by which relative velocities may grow until a rating of the arm is reached")
          .or_null(),
      field<&S::largest_speed>("largest_speed", "m/s", "relative speed at which a rating of the arm is reached")
          .or_null(),
      field<&S::of>("of", "joint or end-effector whose rating is reached first"),
      field<&S::quantity>("quantity", "which of its ratings"),
  };
  static constexpr Type type = structure<S>("SpeedLimit",
                                            "by how much all relative motion of the impact may grow, scaled alike, "
                                            "until the first rating of an arm (gripper, "
                                            "and joints down to the base) is reached. null: nothing bears a load.",
                                            fields);
  return type;
}

// ---- The impact ----

template <>
const Type& type_of<ImpactReport>() {
  using I = ImpactReport;
  static constexpr Field fields[] = {
      field<&I::law>("law",
                     "as in the scenario. `as_published`: the velocities after it are the thesis's, and momentum is "
                     "not conserved"),
      field<&I::time>("time", "s", "when it begins"),
      field<&I::duration>(
          "duration", "s",
          "over which mean forces are taken: `impact.duration` of the scenario, while the impact itself "
          "takes no time. Law `compliant`: how long it took"),
      field<&I::grasps>("grasps", "grasps that closed, and contacts that touched"),
      field<&I::rank>("rank", "1", "independent ones among the rows"),
      field<&I::rows>("rows", "1", "conditions that the grasps pose"),
      derived<[](const I& i) { return with_names(i.null_space, i); }>(
          "null_space", "",
          "`rows` - `rank` self-stresses: impulses that change no velocity and may be added to the grasps'"),
      field<&I::loops>("loops", "per further grasp of a target, against its first"),
      field<&I::body_impulses>("body_impulses", "per body"),
      field<&I::kinetic_energy_before>("kinetic_energy_before", "J", "of robot and targets, just before the impact"),
      field<&I::kinetic_energy_after>("kinetic_energy_after", "J", "just after it"),
      field<&I::base_velocity_change>("base_velocity_change", "m/s", "of the base's origin, in the impact, in W"),
      field<&I::base_angular_velocity_change>("base_angular_velocity_change", "rad/s",
                                              "of the base, in the impact, in W"),
      field<&I::joint_names>("joint_names", "of `joint_velocity_change`"),
      field<&I::joint_velocity_change>("joint_velocity_change", "rad/s or m/s", "of the joints, in the impact"),
      field<&I::joints>("joints", "what they pass on"),
      derived<[](const I& i) {
        return BaseReaction{i.base_impulse, i.base_angular_impulse};
      }>("base_reaction", "", "what the arms passed to the base"),
      field<&I::targets_before>("targets_before", "just before the impact"),
      field<&I::targets_after>("targets_after", "just after it"),
      field<&I::as_published>("as_published", "the thesis's (3.8)-(3.13) for the same capture"),
      field<&I::as_published_absent>("as_published_absent", "instead of `as_published`: why it is not defined here")
          .when<[](const I& i) { return !i.as_published; }>(),
      field<&I::show_as_published>("show_as_published",
                                   "whether the scenario asks for `as_published` (`output.as_published`, or its own "
                                   "law): only then the terminal, the report and figures show it"),
      field<&I::brake>("brake", "where joints are locked after the grasp"),
      field<&I::joints_during>("joints_during", "`free`, `braked` or `driven`: what `impact.joints` asked for"),
      field<&I::held_joints>("held_joints", "that brakes or drives held, or were to hold"),
      field<&I::unique>("unique",
                        "whether simultaneous contacts share the impulse in one way only (if not: `spread` of "
                        "`ContactRebound`)"),
      field<&I::energy_created>("energy_created",
                                "true: the result has more energy than there was (Newton's hypothesis with friction); "
                                "it is not altered, and a warning says so"),
      field<&I::hypothesis>("hypothesis", "of contacts: `stronge`, `poisson` or `newton`; absent where there were none")
          .when<[](const I& i) { return !i.hypothesis.empty(); }>(),
      field<&I::inconsistent>("inconsistent",
                              "law `bilateral_restitution`: the rows in which no motion has the "
                              "restitution asked for; absent if there are none")
          .when<[](const I& i) { return !i.inconsistent.empty(); }>(),
      field<&I::compliant>("compliant", "law `compliant`"),
      field<&I::effective_masses>("effective_masses", "of contacts, law `compliant`; absent without them")
          .when<[](const I& i) { return !i.effective_masses.empty(); }>(),
      field<&I::by_modes>("by_modes",
                          "impulses over the modes that can answer; absent where nothing bends, and with "
                          "other laws than `plastic`")
          .when<[](const I& i) { return !i.by_modes.empty(); }>(),
      derived<[](const I& i) { return i.measures ? std::optional(MeasuresOf{&i}) : std::nullopt; }>(
          "measures", "", "of the configuration; absent with law `compliant`"),
      field<&I::sensitivities>("sensitivities", "with law `plastic`, else empty"),
      derived<[](const I& i) {
        std::vector<ImpactMargin> margins;
        for (const LoadMargin& margin : i.margins) margins.push_back({margin, rests_on_duration(i, margin)});
        return margins;
      }>("margins", "", "against the robot's ratings; empty where the robot file has none"),
      field<&I::speed_limits>("speed_limits", "per grasp whose arm has ratings"),
  };
  static constexpr Type type =
      structure<I>("ImpactReport", "an impact: what changes at once when grasps close and contacts touch.", fields);
  return type;
}

}  // namespace grapnel
