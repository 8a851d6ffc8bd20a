// The fields of summary.json about impacts: impulses at grasps and joints, measures of the configuration, and margins.
#include <algorithm>
#include <array>

#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// ---- Structures of the document that differ from the result ----

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
      field<&R::normal>("normal", "1", "unit normal from the target to the robot, in W"),
      field<&R::normal_impulse>("normal_impulse", "N s", "impulse along the normal"),
      field<&R::tangential_impulse>("tangential_impulse", "N s", "friction impulse, in W"),
      field<&R::compression>("compression", "N s",
                             "part of the normal impulse during compression, while the bodies approach"),
      field<&R::normal_work>("normal_work", "J", "work of the normal impulse on the bodies"),
      field<&R::friction_work>("friction_work", "J", "work of friction on the bodies"),
      field<&R::modes>("modes", "`separated`, `sticking`, `sliding`, `reversed`, in the order of occurrence"),
      field<&R::spread>(
          "spread", "1",
          "relative spread of the normal impulse over other orders of simultaneous contacts; null: unknown")
          .or_null(),
  };
  static constexpr Type type = structure<R>("ContactRebound", "the rebound of a contact, which does not hold.", fields);
  return type;
}

template <>
const Type& type_of<ForceProfile>() {
  using P = ForceProfile;
  static constexpr Field fields[] = {
      field<&P::peak_force>("peak_force", "N", "largest force in the impact"),
      field<&P::peak_force_time>("peak_force_time", "s", "time of the largest force, from the start of the impact"),
      field<&P::peak_moment>("peak_moment", "N m", "largest moment in the impact"),
      field<&P::peak_moment_time>("peak_moment_time", "s", "time of the largest moment, from the start of the impact"),
      field<&P::largest_deformation>("largest_deformation", "m",
                                     "largest deformation of the contact or of the grasp's spring"),
      field<&P::duration>("duration", "s", "duration of contact, or time until the grasp was at rest"),
      field<&P::energy_lost>("energy_lost", "J", "energy dissipated by damping and friction"),
      field<&P::touches>("touches", "1", "number of times that the bodies came into contact"),
  };
  static constexpr Type type =
      structure<P>("ForceProfile", "force history of a contact or grasp in a compliant impact.", fields);
  return type;
}

template <>
const Type& type_of<GraspImpulse>() {
  using G = GraspImpulse;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "end-effector of the grasp or contact"),
      field<&G::target>("target", "target of the grasp or contact"),
      field<&G::grasp_point>("grasp_point", "grasp point on the target"),
      field<&G::model>("model", "`rigid` (6 rows), `hinge` (5), `point` (3), `contact` (does not hold)"),
      field<&G::contact_point>("contact_point", "m", "contact point of end-effector and target, in W"),
      field<&G::gap>("gap", "m", "distance of end-effector and grasp point when they were joined"),
      field<&G::gap_angle>("gap_angle", "rad", "angle between their frames when they were joined"),
      field<&G::target_displacement>("target_displacement", "m",
                                     "by which `contact.gap: translate_target` moved the target, in W"),
      field<&G::impulse>("impulse", "N s", "impulse on the robot at the contact point, in W"),
      field<&G::angular_impulse>("angular_impulse", "N m s",
                                 "angular impulse on the robot about the contact point, in W"),
      field<&G::impulse_magnitude>("impulse_magnitude", "N s", "magnitude of the impulse"),
      field<&G::mean_force>("mean_force", "N", "impulse over impact.duration; law compliant: over profile.duration"),
      field<&G::determined>("determined",
                            "six values, one per component, angular x, y, z then linear x, y, z, in W; true: unique; "
                            "false: open to a self-stress of closed loops"),
      field<&G::relative_velocity_before>(
          "relative_velocity_before", "m/s",
          "velocity of the end-effector minus that of the target at the contact point, before the impact, in W"),
      field<&G::relative_angular_velocity_before>(
          "relative_angular_velocity_before", "rad/s",
          "angular velocity of the end-effector minus that of the target, before the impact, in W"),
      field<&G::relative_velocity_after>(
          "relative_velocity_after", "m/s",
          "the same velocity after the impact: zero in the constrained directions of a grasp"),
      field<&G::relative_angular_velocity_after>("relative_angular_velocity_after", "rad/s",
                                                 "the same angular velocity after the impact"),
      field<&G::rebound>("rebound", "rebound of a contact under `restitution` or `friction`"),
      field<&G::profile>("profile", "force history under the law `compliant`"),
  };
  static constexpr Type type = structure<G>("GraspImpulse",
                                            "one grasp or contact of the impact. Impulses act **on the robot** at the "
                                            "contact point; the opposite impulses act on the target.",
                                            fields);
  return type;
}

template <>
const Type& type_of<ImpulseAtGrasp>() {
  using I = ImpulseAtGrasp;
  static constexpr Field fields[] = {
      field<&I::end_effector>("end_effector", "end-effector of the grasp"),
      field<&I::impulse>("impulse", "N s", "as in `GraspImpulse`"),
      field<&I::angular_impulse>("angular_impulse", "N m s", "as in `GraspImpulse`"),
  };
  static constexpr Type type = structure<I>("ImpulseAtGrasp", "the part of an `ImpulseSet` at one grasp.", fields);
  return type;
}

template <>
const Type& type_of<ImpulseSet>() {
  static constexpr Field fields[] = {
      field<&ImpulseSet::grasps>("grasps", "impulses in the order of the impact's grasps; keys as in `GraspImpulse`")};
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
      field<&L::target>("target", "target that both grasps hold"),
      derived<[](const L& l) {
        return Names{l.end_effectors[0], l.end_effectors[1]};
      }>("end_effectors", "", "end-effector of the first grasp, then that of the further grasp"),
      derived<[](const L& l) {
        return Names{l.grasp_points[0], l.grasp_points[1]};
      }>("grasp_points", "", "likewise"),
      field<&L::end_effector_distance>("end_effector_distance", "m",
                                       "distance between the end-effectors when they closed"),
      field<&L::grasp_point_distance>("grasp_point_distance", "m", "distance between their grasp points"),
      derived<[](const L& l) { return l.gap(); }>("gap", "m",
                                                  "difference of these distances. No motion of the target changes "
                                                  "either, so this gap remains in the closed loop"),
  };
  static constexpr Type type =
      structure<L>("LoopGap", "geometric consistency of a further grasp of a target with its first grasp.", fields);
  return type;
}

// ---- Bodies and joints ----

template <>
const Type& type_of<BodyImpulse>() {
  static constexpr Field fields[] = {
      field<&BodyImpulse::body>("body", "body that received the impulse"),
      field<&BodyImpulse::impulse>("impulse", "N s", "impulse, in W"),
      field<&BodyImpulse::angular_impulse>("angular_impulse", "N m s",
                                           "angular impulse about the body's centre of mass, in W"),
  };
  static constexpr Type type = structure<BodyImpulse>("BodyImpulse",
                                                      "total impulse on a body, from joints and grasps together: "
                                                      "unique, even if the impulses of single grasps are not.",
                                                      fields);
  return type;
}

template <>
const Type& type_of<JointImpulse>() {
  using J = JointImpulse;
  static constexpr Field fields[] = {
      field<&J::joint>("joint", "name of the joint"),
      field<&J::body>("body", "body that the joint carries"),
      field<&J::impulse>("impulse", "N s", "impulse at the joint's origin, from parent to child, in W"),
      field<&J::angular_impulse>("angular_impulse", "N m s",
                                 "angular impulse about the joint's origin, from parent to child, in W"),
      field<&J::along_axis>("along_axis", "N m s or N s",
                            "component along the joint axis: zero for a free joint without rotor"),
      field<&J::peak_force>("peak_force", "N",
                            "law `compliant`: the largest transmitted force, over the samples; else 0"),
      field<&J::peak_moment>("peak_moment", "N m",
                             "law `compliant`: the largest transmitted moment, over the samples; else 0"),
      field<&J::peak_driving>("peak_driving", "N m or N",
                              "law `compliant`: the largest effort along the axis, over the samples; else 0"),
  };
  static constexpr Type type =
      structure<J>("JointImpulse", "impulse that a joint transmits during the impact.", fields);
  return type;
}

template <>
const Type& type_of<HeldJoint>() {
  using H = HeldJoint;
  static constexpr Field fields[] = {
      field<&H::joint>("joint", "name of the joint"),
      field<&H::impulse>("impulse", "N m s or N s", "impulse on the joint, along or about its axis"),
      field<&H::work>("work", "J", "work of this impulse"),
      field<&H::commanded_rate>("commanded_rate", "rad/s or m/s", "commanded rate"),
      field<&H::rate_after>("rate_after", "rad/s or m/s", "rate after the impact"),
      field<&H::was_overpowered>(
          "was_overpowered",
          "true: the drive was overpowered by the constraint. The grasps did not admit all commanded rates, and this "
          "one deviates by the minimum amount (docs/theory, section 7). A warning reports it"),
  };
  static constexpr Type type = structure<H>(
      "HeldJoint",
      "a joint that a brake or a drive held during the impact, or was commanded to hold. Under the law `compliant` it "
      "is released when the grasps become rigid; `impulse` and `work` are integrated until then.",
      fields);
  return type;
}

template <>
const Type& type_of<BaseReaction>() {
  static constexpr Field fields[] = {
      field<&BaseReaction::impulse>("impulse", "N s", "impulse, in W"),
      field<&BaseReaction::angular_impulse>("angular_impulse", "N m s",
                                            "angular impulse about the base's origin, in W"),
  };
  static constexpr Type type =
      structure<BaseReaction>("BaseReaction", "impulse that the arms transmit to the base.", fields);
  return type;
}

// ---- The thesis's estimate, and brakes ----

template <>
const Type& type_of<AsPublished::Grasp>() {
  using G = AsPublished::Grasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "end-effector of the grasp"),
      field<&G::impulse>("impulse", "N s", "as in `GraspImpulse`"),
      field<&G::angular_impulse>("angular_impulse", "N m s", "as in `GraspImpulse`"),
      field<&G::impulse_magnitude>("impulse_magnitude", "N s", "magnitude of the impulse"),
  };
  static constexpr Type type =
      structure<G>("PublishedImpulse", "one grasp's impulse by the thesis's formulas.", fields);
  return type;
}

template <>
const Type& type_of<AsPublished>() {
  using P = AsPublished;
  static constexpr Field fields[] = {
      field<&P::grasps>("grasps", "impulses, one entry per grasp"),
      field<&P::joint_velocity_after>(
          "joint_velocity_after", "rad/s or m/s",
          "joint rates after the impact, (3.11), in the order of `joint_names` of the impact"),
      field<&P::linear_momentum_error>("linear_momentum_error", "N s",
                                       "magnitude of the change of total linear momentum"),
      field<&P::angular_momentum_error>("angular_momentum_error", "N m s",
                                        "magnitude of the change of total angular momentum"),
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
      field<&G::end_effector>("end_effector", "end-effector of the grasp"),
      field<&G::target>("target", "target of the grasp"),
      field<&G::impulse>("impulse", "N s", "impulse on the robot at the contact point, in W"),
      field<&G::angular_impulse>("angular_impulse", "N m s",
                                 "angular impulse on the robot about the contact point, in W"),
      derived<[](const G& g) { return norm(g.impulse); }>("impulse_magnitude", "N s", "magnitude of the impulse"),
  };
  static constexpr Type type = structure<G>(
      "BrakeGrasp", "the impulse on a grasp because of the brake, in addition to the impulse of the impact.", fields);
  return type;
}

template <>
const Type& type_of<BrakeReport>() {
  using B = BrakeReport;
  static constexpr Field fields[] = {
      field<&B::joints>("joints", "joints that are locked"),
      field<&B::impulse>("impulse", "N m s or N s", "impulse per joint, along or about its axis"),
      field<&B::kinetic_energy_before>("kinetic_energy_before", "J", "kinetic energy of all bodies before the brake"),
      field<&B::kinetic_energy_after>("kinetic_energy_after", "J", "kinetic energy of all bodies after the brake"),
      field<&B::grasps>("grasps", "impulses, one entry per grasp that holds"),
      field<&B::base_velocity_change>("base_velocity_change", "m/s",
                                      "change of the velocity of the base's origin by the brake alone, in W"),
      field<&B::base_angular_velocity_change>("base_angular_velocity_change", "rad/s",
                                              "change of the base's angular velocity by the brake alone, in W"),
  };
  static constexpr Type type = structure<B>(
      "BrakeReport",
      "joints that lock immediately after the grasp: a second impulse with separate checks. `targets_after` and the "
      "changes of the impact are before the brake; the second sample of `contact` in the time series is after it.",
      fields);
  return type;
}

template <>
const Type& type_of<HardContactImpulse>() {
  using H = HardContactImpulse;
  static constexpr Field fields[] = {
      field<&H::body_a>("body_a", "name of the first body"),
      field<&H::body_b>("body_b", "name of the second body"),
      field<&H::points>("points", "1", "number of points at which both touch"),
      field<&H::normal_impulse>("normal_impulse", "N s", "sum of the normal impulses"),
      field<&H::impulse>("impulse", "N s", "impulse on the second body, in W"),
      field<&H::approach_speed>("approach_speed", "m/s",
                                "largest approach speed of a point before the impact; negative: both separate"),
      field<&H::restitution_loss>("restitution_loss", "J", "energy lost by the normal impulses"),
      field<&H::friction_loss>("friction_loss", "J", "energy lost by the tangential impulses"),
  };
  static constexpr Type type = structure<H>(
      "HardContactImpulse", "two hard bodies that touch at the instant of the impact and take part in it.", fields);
  return type;
}

template <>
const Type& type_of<RetainedModes>() {
  using M = RetainedModes;
  static constexpr Field fields[] = {
      field<&M::modes>(
          "modes", "1",
          "number of flexible modes that respond, the slowest first, with base and joints as in the impact"),
      field<&M::frequency>("frequency", "Hz", "frequency of the fastest of these modes; 0 without modes"),
      field<&M::impulses>("impulses", "N s", "magnitudes of the impulses, in the order of `grasps`"),
  };
  static constexpr Type type =
      structure<M>("RetainedModes", "the plastic impact if only the slowest flexible modes deform.", fields);
  return type;
}

template <>
const Type& type_of<EffectiveMass>() {
  using E = EffectiveMass;
  static constexpr Field fields[] = {
      field<&E::end_effector>("end_effector", "end-effector of the contact"),
      field<&E::target>("target", "target of the contact"),
      field<&E::of_end_effector>(
          "of_end_effector", "kg",
          "effective mass of the end-effector along the contact's normal, without control, joints free"),
      field<&E::apparent>("apparent", "kg",
                          "apparent mass of the end-effector under the impedance law; null: no impedance law with a "
                          "force sensor is active")
          .or_null(),
      field<&E::of_target>("of_target", "kg", "effective mass of the target along the normal"),
      field<&E::restitution>("restitution", "1",
                             "coefficient of restitution e of a central contact of such masses: the target stops if e "
                             "times the end-effector's mass equals its own mass"),
      field<&E::target_speed_before>("target_speed_before", "m/s",
                                     "speed of the target's contact point along the normal towards the end-effector, "
                                     "relative to the end-effector"),
      field<&E::target_speed_after>(
          "target_speed_after", "m/s",
          "speed of the target's contact point afterwards, relative to the end-effector's velocity before"),
  };
  static constexpr Type type =
      structure<E>("EffectiveMass", "effective masses of end-effector and target in a contact.", fields);
  return type;
}

template <>
const Type& type_of<CompliantReport>() {
  using C = CompliantReport;
  static constexpr Field fields[] = {
      field<&C::end>("end",
                     "`separated` (contacts only), `settled` (grasps are at rest), `time_over` (`impact.longest`)"),
      field<&C::duration>("duration", "s", "duration of the impact"),
      field<&C::energy_lost>("energy_lost", "J", "energy dissipated by dampers and friction"),
      field<&C::elastic_energy_after>(
          "elastic_energy_after", "J",
          "energy in springs at the end, which is lost when grasps become rigid. With `time_over` the impact was cut "
          "off and this energy is missing; the ledger's `compliant_energy_residual` fails if a contact is still "
          "compressed or grasps hold more than a thousandth of the initial kinetic energy"),
      field<&C::residual_impulse>("residual_impulse", "N s",
                                  "largest final impulse that stops the remaining relative motion"),
      field<&C::energy_residual>(
          "energy_residual", "1",
          "residual of the energy balance over the initial kinetic energy of the bodies that take part"),
      field<&C::motor_work>(
          "motor_work", "J",
          "work of the joints that a control law drives during the impact (`impact.joints: impedance`)"),
      field<&C::rhs_evaluations>("rhs_evaluations", "1", "evaluations of the equations of motion"),
      field<&C::modes>(
          "modes", "1",
          "number of flexible modes in the posture of first contact, joints as in the impact, grasps open"),
      field<&C::slower_modes>("slower_modes", "1", "number of these modes with a period longer than `duration`"),
      field<&C::slowest_period>("slowest_period", "s", "period of the slowest mode; 0 without flexible bodies"),
      field<&C::fastest_period>(
          "fastest_period", "s",
          "period of the fastest mode. Modes with periods much shorter than the contact barely respond to it"),
  };
  static constexpr Type type = structure<C>("CompliantReport", "an impact that was integrated over time.", fields);
  return type;
}

// ---- Measures ----

template <>
const Type& type_of<EndEffectorMeasure>() {
  using M = EndEffectorMeasure;
  static constexpr Field fields[] = {
      field<&M::end_effector>("end_effector", "end-effector of the grasp or contact"),
      derived<[](const M& m) { return rows_of_six(m.inverse_inertia); }>(
          "inverse_inertia", "1/(kg m^2), 1/(kg m), 1/kg",
          "change of the end-effector's twist per impulse on it: 6 x 6, by rows"),
      derived<[](const M& m) { return rows_of_six(m.pair_inverse_inertia); }>(
          "pair_inverse_inertia", "1/(kg m^2), 1/(kg m), 1/kg",
          "change of its twist relative to the target, with the impulse on it and the opposite impulse on the target: "
          "6 x 6, by rows"),
      field<&M::linear_axes>("linear_axes", "1", "axes of the impulse ellipsoid: unit vectors in W"),
      field<&M::linear_mass>("linear_mass", "kg", "semi-axes of the impulse ellipsoid along these axes, descending"),
      field<&M::angular_axes>("angular_axes", "1", "axes of the ellipsoid of angular impulses: unit vectors in W"),
      field<&M::angular_inertia>("angular_inertia", "kg m^2", "semi-axes of that ellipsoid, descending"),
      field<&M::impulse_index>(
          "impulse_index", "kg",
          "impulse per speed of a point contact that stops the whole present relative velocity; 0 if there is none")
          .or_null(),
      field<&M::robot_effective_mass>("robot_effective_mass", "kg",
                                      "effective mass of the end-effector alone for a frictionless contact along the "
                                      "present relative velocity; null: immovable")
          .or_null(),
      field<&M::pair_effective_mass>("pair_effective_mass", "kg", "effective mass of end-effector and target, likewise")
          .or_null(),
      field<&M::miss_of_robot_com>(
          "miss_of_robot_com", "m",
          "distance of the line of impulse from the robot's centre of mass; 0 for no impulse, null for a pure couple")
          .or_null(),
      field<&M::miss_of_system_com>("miss_of_system_com", "m",
                                    "distance of the line of impulse from the centre of mass of robot and target; 0 "
                                    "for no impulse, null for a pure couple")
          .or_null(),
  };
  static constexpr Type type = structure<M>(
      "EndEffectorMeasure",
      "effect of an impulse at one grasp, and the impulse that the present motion requires, at the contact point.",
      fields);
  return type;
}

template <>
const Type& type_of<MeasuresOf>() {
  using M = MeasuresOf;
  static constexpr Field fields[] = {derived < [](const M& m) -> auto& {return m.get().end_effectors;
}
> ("end_effectors", "", "measures, one entry per grasp"),
    derived<[](const M& m) { return m.get().largest_impulse; }>(
        "largest_impulse", "1",
        "largest impulse over all relative motions, all grasps together; 1: as against an immovable robot")
        .or_null(),
    derived<[](const M& m) { return m.get().smallest_impulse; }>("smallest_impulse", "1",
                                                                 "smallest impulse over all relative motions")
        .or_null(),
    derived<[](const M& m) { return m.get().coupled_index; }>("coupled_index", "1",
                                                              "impulse of the present relative motion")
        .or_null(),
    derived<[](const M& m) { return m.get().miss_of_robot_com; }>(
        "miss_of_robot_com", "m", "distance of the resultant of all impulses from the robot's centre of mass")
        .or_null(),
    derived<[](const M& m) { return m.get().miss_of_system_com; }>(
        "miss_of_system_com", "m",
        "distance of the resultant of all impulses from the centre of mass of robot and targets")
        .or_null(),
    derived<[](const M& m) {
      std::vector<std::vector<Row6>> all;
      for (const std::vector<double>& one : m.get().base_response) all.push_back(rows_of_six(one));
      return all;
    }>("base_response", "1/(kg m^2), 1/(kg m), 1/kg",
       "change of the base's twist per impulse at each grasp; zero in directions that the grasp leaves free"),
    derived<[](const M& m) { return with_names(m.get().zero_disturbance, *m.impact); }>(
        "zero_disturbance", "", "basis of the impulses that do not change the base's twist"),
    derived<[](const M& m) { return with_names(m.get().zero_base_angular_velocity, *m.impact); }>(
        "zero_base_angular_velocity", "", "basis of the impulses that do not change the base's angular velocity"),
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
      field<&S::parameter>("parameter", "parameter, such as `target mass`"),
      field<&S::unit>("unit", "unit of the parameter"),
      field<&S::end_effector>("end_effector", "end-effector of the grasp that the parameter belongs to"),
      field<&S::target>("target", "likewise"),
      field<&S::undefined>("undefined", "reason for which the derivatives are undefined; replaces the keys below")
          .when<[](const S& s) { return !s.undefined.empty(); }>(),
      field<&S::impulse>("impulse", "N s per unit", "derivative of the impulse, per grasp, in W").when<is_defined>(),
      field<&S::angular_impulse>("angular_impulse", "N m s per unit",
                                 "derivative of the angular impulse, per grasp, in W")
          .when<is_defined>(),
      field<&S::impulse_magnitude>("impulse_magnitude", "N s per unit",
                                   "derivative of the magnitude of the impulse, per grasp")
          .when<is_defined>(),
      field<&S::base_velocity_change>("base_velocity_change", "m/s per unit",
                                      "derivative of the change of base velocity, in W")
          .when<is_defined>(),
      field<&S::base_angular_velocity_change>("base_angular_velocity_change", "rad/s per unit",
                                              "derivative of the change of base angular velocity, in W")
          .when<is_defined>(),
  };
  static constexpr Type type =
      structure<S>("ImpactSensitivity", "derivatives of the impact with respect to an uncertain parameter.", fields);
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
      field<&LoadMargin::load>("load", "N, N m, N s or N m s",
                               "peak forces and moments of a compliant impact, else impulses over `duration`"),
      field<&LoadMargin::rating>("rating", "as `load`", "rating in the robot file"),
      derived<[](const M& m) { return m.margin(); }>("margin", "1", "1 - load over rating; negative: exceeded"),
      field<&M::assumed_duration>("assumed_duration",
                                  "whether the load is a mean over the assumed `duration`; the peak may be larger"),
  };
  static constexpr Type type =
      structure<M>("ImpactMargin", "a load of the impact for which the robot file has a rating.", fields);
  return type;
}

template <>
const Type& type_of<SpeedLimit>() {
  using S = SpeedLimit;
  static constexpr Field fields[] = {
      field<&S::end_effector>("end_effector", "end-effector of the arm"),
      field<&S::factor>("factor", "1", "factor on the relative velocities at which a rating of the arm is reached")
          .or_null(),
      field<&S::largest_speed>("largest_speed", "m/s", "relative speed at which a rating of the arm is reached")
          .or_null(),
      field<&S::of>("of", "joint or end-effector whose rating is reached first"),
      field<&S::quantity>("quantity", "quantity whose rating is reached first"),
  };
  static constexpr Type type =
      structure<S>("SpeedLimit",
                   "largest factor by which all relative motion of the impact may be scaled before a rating of an arm "
                   "(gripper, and joints down to the base) is reached. null: no loads.",
                   fields);
  return type;
}

// ---- The impact ----

template <>
const Type& type_of<ImpactReport>() {
  using I = ImpactReport;
  static constexpr Field fields[] = {
      field<&I::law>("law",
                     "as in the scenario. `as_published`: the velocities after the impact follow the thesis, and "
                     "momentum is not conserved"),
      field<&I::time>("time", "s", "start of the impact"),
      field<&I::duration>("duration", "s",
                          "time over which mean forces are taken: `impact.duration` of the scenario for an "
                          "instantaneous impact. Law `compliant`: duration of the impact"),
      field<&I::grasps>("grasps", "grasps that closed, and contacts that touched"),
      field<&I::rank>("rank", "1", "number of independent rows"),
      field<&I::rows>("rows", "1", "number of constraint rows of the grasps"),
      derived<[](const I& i) { return with_names(i.null_space, i); }>(
          "null_space", "",
          "`rows` - `rank` self-stresses: impulses that change no velocity and may be added to those of the grasps"),
      field<&I::loops>("loops", "one entry per further grasp of a target, relative to its first grasp"),
      field<&I::body_impulses>("body_impulses", "total impulses, one entry per body"),
      field<&I::kinetic_energy_before>("kinetic_energy_before", "J",
                                       "kinetic energy of robot and targets just before the impact"),
      field<&I::kinetic_energy_after>("kinetic_energy_after", "J",
                                      "kinetic energy of robot and targets just after the impact"),
      field<&I::base_velocity_change>("base_velocity_change", "m/s",
                                      "change of the velocity of the base's origin, in W"),
      field<&I::base_angular_velocity_change>("base_angular_velocity_change", "rad/s",
                                              "change of the base's angular velocity, in W"),
      field<&I::joint_names>("joint_names", "joint names for `joint_velocity_change`"),
      field<&I::joint_velocity_change>("joint_velocity_change", "rad/s or m/s", "changes of the joint rates"),
      field<&I::joints>("joints", "impulses that the joints transmit"),
      derived<[](const I& i) {
        return BaseReaction{i.base_impulse, i.base_angular_impulse};
      }>("base_reaction", "", "impulse that the arms transmit to the base"),
      field<&I::targets_before>("targets_before", "motion of the targets just before the impact"),
      field<&I::targets_after>("targets_after", "motion of the targets just after the impact"),
      field<&I::as_published>("as_published", "the thesis's estimate, (3.8)-(3.13), for the same capture"),
      field<&I::as_published_absent>("as_published_absent",
                                     "reason for which `as_published` is undefined here; replaces that key")
          .when<[](const I& i) { return !i.as_published; }>(),
      field<&I::show_as_published>("show_as_published",
                                   "whether the scenario requests `as_published` (`output.as_published`, or the law of "
                                   "that name): only then the terminal, the report and figures show it"),
      field<&I::brake>("brake", "present if joints lock after the grasp"),
      field<&I::joints_during>("joints_during", "`free`, `braked` or `driven`, as in `impact.joints`"),
      field<&I::held_joints>("held_joints", "joints that brakes or drives held, or were commanded to hold"),
      field<&I::unique>("unique",
                        "whether the distribution of the impulse over simultaneous contacts is unique (if not: "
                        "`spread` of `ContactRebound`)"),
      field<&I::energy_created>("energy_created",
                                "true: the result has more energy than the initial state (Newton's hypothesis with "
                                "friction); the result is not corrected, and a warning reports it"),
      field<&I::hypothesis>("hypothesis",
                            "contact hypothesis: `stronge`, `poisson` or `newton`; absent without contacts")
          .when<[](const I& i) { return !i.hypothesis.empty(); }>(),
      field<&I::inconsistent>("inconsistent",
                              "law `bilateral_restitution`: rows for which no motion has the specified restitution; "
                              "absent if there are none")
          .when<[](const I& i) { return !i.inconsistent.empty(); }>(),
      field<&I::compliant>("compliant", "present with the law `compliant`"),
      field<&I::effective_masses>("effective_masses",
                                  "effective masses in contacts, law `compliant`; absent without contacts")
          .when<[](const I& i) { return !i.effective_masses.empty(); }>(),
      field<&I::hard_contacts>("hard_contacts",
                               "pairs of hard bodies that touch and take part in the impact; absent if there are none")
          .when<[](const I& i) { return !i.hard_contacts.empty(); }>(),
      field<&I::by_modes>("by_modes",
                          "impulses against the number of flexible modes; absent without flexible bodies, and with "
                          "laws other than `plastic`")
          .when<[](const I& i) { return !i.by_modes.empty(); }>(),
      derived<[](const I& i) { return i.measures ? std::optional(MeasuresOf{&i}) : std::nullopt; }>(
          "measures", "", "measures of the configuration; absent with law `compliant`"),
      field<&I::sensitivities>("sensitivities", "derivatives with law `plastic`; else empty"),
      derived<[](const I& i) {
        std::vector<ImpactMargin> margins;
        for (const LoadMargin& margin : i.margins) margins.push_back({margin, rests_on_duration(i, margin)});
        return margins;
      }>("margins", "", "margins to the robot's ratings; empty without ratings in the robot file"),
      field<&I::speed_limits>("speed_limits", "one entry per grasp whose arm has ratings"),
  };
  static constexpr Type type = structure<I>(
      "ImpactReport", "an impact: instantaneous changes when grasps close and contacts touch, or a compliant impact.",
      fields);
  return type;
}

}  // namespace grapnel
