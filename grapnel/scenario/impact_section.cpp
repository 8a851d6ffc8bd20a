#include <fmt/format.h>

#include <algorithm>

#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

// ---- Contents of "contact" and "post_impact"; impact/impact_law.cpp describes "impact" ----

template <>
struct Described<ContactSetup> {
  using T = ContactSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::gap>("gap", "",
                     "weld_as_found: the grasp keeps the relative pose. translate_target: the target is moved until "
                     "its grasp point is at the tip; with several grasps by the mean of their gaps, and the grasps "
                     "keep the remaining gaps. refuse: the simulation fails beyond the limit."),
      field<&T::refuse_beyond>("limit", "m", "Largest accepted distance, for gap refuse; ignored otherwise.")
          .above(0)
          .optional(),
      field<&T::largest_gap>("largest_gap", "m",
                             "Largest distance, after gap, at which an end-effector without an envelope is assumed to "
                             "hold; beyond it the run fails. Absent: a tenth of its arm's reach. any: no limit.")
          .above(0)
          .as("number or any")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({when("gap", "refuse").require("limit")});
  static constexpr Type type = structure<T>(
      "contact", "How to handle the distance between an end-effector and its grasp point at the instant of capture.",
      fields, rules);
};

template <>
struct Described<PostImpactSetup::Release> {
  using T = PostImpactSetup::Release;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::after>("after", "s", "Time since post_impact began; before its end.").above(0).required(),
      field<&T::end_effectors>("end_effectors", "", "End-effectors of the grasps; absent: all that hold at that time.")
          .items(1, 0)
          .optional(),
  });
  static constexpr Type type = structure<T>("release", "Grasps are released; momenta are conserved.", fields);
};

template <>
struct Described<PostureMove> {
  using T = PostureMove;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::joints>("joints", "rad or m", "Final value of every moving joint.").as("joint values").required(),
      field<&T::duration>("duration", "s", "").above(0).required(),
      field<&T::after>("after", "s", "Start of the motion, since post_impact began.").at_least(0),
      field<&T::profile>("profile", "", "Joint motion over time, from rest to rest; as for the approach."),
  });
  static constexpr Type type =
      structure<T>("move", "The joints move from their values at the impact to a posture, and hold it.", fields);
};

template <>
struct Described<DetumbleSetup> {
  using T = DetumbleSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::torque>("torque", "N m", "Largest torque on the target, about its centre of mass.").above(0).required(),
      field<&T::target>("target", "", "Name of the target; absent: the only grasped target.").optional(),
  });
  static constexpr Type type = structure<T>(
      "detumble", "The held target is brought to rest in the minimum time that the torque allows.", fields);
};

template <>
struct Described<KeepBaseSetup> {
  using T = KeepBaseSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::rate>("rate", "1/s", "Rate at which the base returns to its attitude, critically damped.").above(0),
      field<&T::posture>("posture", "rad or m",
                         "Joint values towards which every moving joint moves by motion that does not turn the base; "
                         "absent: the joints come to rest as far as the momentum allows.")
          .as("joint values")
          .optional(),
      field<&T::posture_rate>("posture_rate", "1/s", "Rate of that motion, critically damped.").above(0),
  });
  static constexpr Type type =
      structure<T>("keep_base_attitude", "The joints keep the base's attitude from the start of post_impact.", fields);
};

template <>
struct Described<GraspForceSetup::Pair> {
  using T = GraspForceSetup::Pair;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::between>("between", "", "Two end-effectors.").items(2, 2).required(),
      field<&T::force>("force", "N",
                       "Squeezing force on the target along the line between the two grasps; negative: pulling.")
          .required(),
      field<&T::after>("after", "s", "Start of the force, since post_impact began.").at_least(0),
      field<&T::ramp>("ramp", "s", "Duration over which the force rises smoothly; 0: immediately.").at_least(0),
  });
  static constexpr Type type = structure<T>("squeeze", "The internal force between two grasps.", fields);
};

template <>
struct Described<GraspForceSetup> {
  using T = GraspForceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::target>("target", "", "Name of the target; absent: the only grasped target.").optional(),
      field<&T::pairs>("pairs", "", "Pairs of grasps; absent: no internal force.").items(0, 100),
      field<&T::motion>("motion", "",
                        "hold: the target keeps its pose relative to the base at the start of the law. brake: it comes "
                        "to rest, as with detumble."),
      field<&T::rate>("rate", "1/s",
                      "Rate at which deviations from hold decay, critically damped; with brake the final decay rate of "
                      "the remaining motion.")
          .above(0),
      field<&T::torque>("torque", "N m", "With brake: largest torque on the target.").above(0).optional(),
      field<&T::moment_length>("moment_length", "m",
                               "l of the metric |force|^2 + |moment|^2/l^2 by which the grasps share the load.")
          .above(0),
  });
  static constexpr auto rules = std::to_array<Rule>({when("motion", "brake").require("torque")});
  static constexpr Type type = structure<T>(
      "grasp_force", "Several grasps hold one target: the law controls its motion and its internal forces separately.",
      fields, rules);
};

template <>
struct Described<RestSetup> {
  using T = RestSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::angular_velocity>("angular_velocity", "rad/s", "Largest angular velocity of the base, in W.")
          .above(0)
          .required(),
      field<&T::joint_rate>("joint_rate", "rad/s or m/s",
                            "Largest rate of every joint of the arms; absent: joints are not evaluated.")
          .above(0)
          .as("number or infinity")
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "rest", "Goal of the motion: the base and the joints stay below these rates from some time to the end.", fields);
};

template <>
struct Described<PhaseUntil> {
  using T = PhaseUntil;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::base_rate>("base_rate", "rad/s", "The base's angular velocity is at most this.").above(0).optional(),
      field<&T::target_rate>("target_rate", "rad/s", "The angular velocity of every target is at most this.")
          .above(0)
          .optional(),
      field<&T::relative_rate>("relative_rate", "rad/s",
                               "The angular velocity of every target relative to the base is at most this.")
          .above(0)
          .optional(),
      field<&T::joint_rate>("joint_rate", "rad/s or m/s", "The rate of every driven joint is at most this.")
          .above(0)
          .optional(),
      field<&T::wheel_momentum_below>("wheel_momentum_below", "1",
                                      "Every wheel holds at most this share of its largest momentum.")
          .above(0)
          .at_most(1)
          .optional(),
      field<&T::wheel_momentum_above>("wheel_momentum_above", "1",
                                      "At least one wheel holds this share of its largest momentum.")
          .above(0)
          .at_most(1)
          .optional(),
      field<&T::event>("event", "", "law_ended: the control law that moves all joints together has ended.").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type = structure<T>(
      "until", "What ends the phase before its duration: the first instant at which all given conditions hold.", fields,
      rules);
};

template <>
struct Described<PostImpactSetup> {
  using T = PostImpactSetup;
  static constexpr auto with_gains = [](const T& t) { return has_gains(t.joints); };
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>(
          "name", "",
          "Name of the phase in results; absent: the key of a single phase, in a list phase_1, phase_2, ...")
          .optional(),
      field<&T::duration>("duration", "s", "Duration of the phase; with `until` the largest duration.")
          .above(0)
          .required(),
      field<&T::until>("until", "", "").optional(),
      field<&T::joints>(
          "joints", "",
          "free: no torques. pd: hold the joint values at the impact, by the law (4.1). computed_torque: hold them by "
          "torques of the inverse model of servicer and held targets. braked: locked by a second impulse. controller: "
          "by torques of control.plugin. detumble: bring a held target to rest. keep_base_attitude: the arms control "
          "the base's attitude. impedance: impedance law about the pose of the end-effectors at the impact. "
          "grasp_force: control the motion and the internal force of a target that several arms hold."),
      field<&T::kp>("kp", "N m/rad or N/m; for computed_torque 1/s^2",
                    "Proportional gain, for control laws other than free, braked and controller; ignored otherwise. "
                    "With detumble, keep_base_attitude, impedance and grasp_force: gain of pd, which holds the joints "
                    "after these laws end.")
          .at_least(0)
          .as("gains of post_impact")
          .optional()
          .when<with_gains>(),
      field<&T::kd>("kd", "N m s/rad or N s/m; for computed_torque 1/s",
                    "Derivative gain, likewise. With detumble and grasp_force it also determines how the joints share "
                    "the efforts.")
          .at_least(0)
          .as("gains of post_impact")
          .optional()
          .when<with_gains>(),
      field<&T::move>("move", "", "").optional(),
      field<&T::detumble>("detumble", "", "").optional(),
      field<&T::keep_base_attitude>("keep_base_attitude", "", "").optional(),
      field<&T::grasp_force>("grasp_force", "", "").optional(),
      field<&T::base_control>(&base_control_description, "base_control", "").optional(),
      field<&T::at_rest>("at_rest", "", "").optional(),
      field<&T::assumed>(&assumed_description, "assumed", "").optional(),
      field<&T::identify>(&identify_description, "identify", "").optional(),
      field<&T::model>("model", "",
                       "Inertia of the held target for computed_torque, detumble, keep_base_attitude and plugins; "
                       "absent: estimated with identify, else assumed if that is given, else truth. Before the first "
                       "estimate it is the assumed inertia, or the true one.")
          .optional(),
      field<&T::releases>("release", "", "Grasps that are released, in the order of time.").items(0, 1000),
  });
  static constexpr auto rules = std::to_array<Rule>(
      {when("joints", "pd, computed_torque, detumble, keep_base_attitude, impedance, grasp_force").require("kp, kd"),
       when("joints", "detumble").require("detumble"), when("joints", "grasp_force").require("grasp_force")});
  static constexpr Type type =
      structure<T>("post_impact", "A phase of motion: after the impact that of the joined system.", fields, rules);
};

const Type& contact_description() { return type_of<ContactSetup>(); }
const Type& impact_description() { return type_of<std::optional<ImpactSetup>>(); }
const Type& phases_description() { return type_of<std::vector<PostImpactSetup>>(); }

// ---- Reading ----

namespace {

// A misspelt key has been reported, and may have another meaning.
bool is_reported(const Mark& mark, const FaultList& faults) {
  return std::any_of(faults.all().begin(), faults.all().end(), [&](const Fault& f) {
    return mark.source && f.file == *mark.source && f.line == mark.line && f.column == mark.column;
  });
}

// Keys that only some laws use are errors with another law.
void check_uses(const Node& node, const ImpactLaw& law, FaultList& faults) {
  for (const Field& field : type_of<ImpactSetup>().fields) {
    std::string laws;
    for (const ImpactLaw& other : impact_laws()) {
      if (other.uses(field.key)) laws += fmt::format("{}{}", laws.empty() ? "" : ", ", other.name);
    }
    const NodeEntry* entry = node.entry(field.key);
    if (laws.empty() || !entry || law.uses(field.key) || is_reported(entry->mark, faults)) continue;
    faults.add(entry->mark,
               fmt::format("impact.{} has no meaning with law {}; it belongs to {}", field.key, law.name, laws));
  }
}

// Checks that releasing end-effectors exist and grasp.
class ReleaseNames {
 public:
  explicit ReleaseNames(Reading& reading) : reading_(reading) {
    const NameTable& known = reading.robot.end_effectors;
    for (const GraspSetup& grasp : reading.problem.grasps) {
      doubtful_ = doubtful_ || !known.contains(grasp.end_effector);
      if (known.contains(grasp.end_effector)) grasping_.push_back(grasp.end_effector);
    }
    doubtful_ = doubtful_ || grasping_.empty();  // grasps are missing or not a list, which is a separate error
  }

  void check(const Node& name, const std::string& path) {
    if (!is_text(name) || name.text.empty()) return;
    if (!reading_.robot.end_effectors.expect(name.text, name.mark, path, reading_.faults)) return;
    const auto& grasps = reading_.problem.grasps;
    const auto is_its = [&](const GraspSetup& grasp) { return grasp.end_effector == name.text; };
    if (doubtful_ || std::any_of(grasps.begin(), grasps.end(), is_its) || !checked_.insert(name.text).second) return;
    reading_.faults.add(name.mark, fmt::format("end-effector {} in {} grasps nothing{}", in_quotes(name.text), path,
                                               suggestion(name.text, grasping_, "grasps")));
  }

 private:
  Reading& reading_;
  std::vector<std::string> grasping_;
  std::set<std::string, std::less<>> checked_;
  bool doubtful_ = false;
};

// The units of stiffness and damping depend on the model; `wanted` is the index, from 1, among the units of the key.
void check_contact_unit(const Node& contact, const char* key, unsigned wanted, const std::string& model,
                        FaultList& faults) {
  const Node& value = part(contact, key);
  if (value.unit == 0 || value.unit == Node::kRefusedUnit || value.unit == wanted) return;
  const auto units = units_of_place(field_named(type_of<ContactComplianceSetup>(), key)->unit);
  faults.add(value.mark, fmt::format("impact.contact.{} is in {}; of model {} it is in {}", key,
                                     units.at(value.unit - 1u), model, units.at(wanted - 1)));
}
void check_contact_units(const Node& node, const ContactComplianceSetup& contact, FaultList& faults) {
  const std::string model = name_of(contact.model);
  const bool depends = model == "hunt_crossley";
  const bool linear = model == "kelvin_voigt" || (depends && contact.exponent == 1);
  const bool hertz = model == "hertz" || (depends && contact.exponent == 1.5);
  check_contact_unit(node, "stiffness", linear ? 1 : hertz ? 2 : 3, model, faults);
  check_contact_unit(node, "damping", depends ? 2 : 1, model, faults);
}

}  // namespace

void finish_impact(Reading& reading) {
  if (!reading.problem.impact) return;
  const ImpactSetup& impact = *reading.problem.impact;
  const Node& node = part(reading.root, "impact");
  check_contact_units(part(node, "contact"), impact.contact, reading.faults);
  const NodeEntry* angular = part(node, "restitution").entry("angular");
  const ImpactLaw& law = impact_law(impact);
  if (angular && (law.of_contacts || law.published)) {
    reading.faults.add(
        angular->mark,
        "impact.restitution.angular belongs to law bilateral_restitution: a contact transmits no moment");
  }
  // An unknown law has been reported; the other keys cannot be checked.
  if (!node.entry("law") || text_at(node, "law") == law.name) check_uses(node, law, reading.faults);
}

namespace {

// The phases of a sequence with their paths; a single phase is not a list.
std::vector<std::pair<const Node*, std::string>> phase_nodes(const Node& root, const std::string& key) {
  const Node& phases = part(root, key);
  std::vector<std::pair<const Node*, std::string>> nodes;
  if (phases.is_mapping()) nodes.emplace_back(&phases, key);
  for (std::size_t i = 0; i < phases.items.size(); ++i) nodes.emplace_back(&phases.items[i], item(key, i));
  return nodes;
}

}  // namespace

void finish_post_impact(Reading& reading) {
  ReleaseNames names(reading);
  for (const char* key : {"post_impact", "motion"}) {
    for (const auto& [node, path] : phase_nodes(reading.root, key)) {
      const Node& list = part(*node, "release");
      for (std::size_t i = 0; i < list.items.size() && !reading.faults.full(); ++i) {
        for (const Node& name : part(list.items[i], "end_effectors").items)
          names.check(name, below(item(below(path, "release"), i), "end_effectors"));
      }
      for (const char* knowledge : {"assumed", "identify"}) {
        const Node& name = part(part(*node, knowledge), "target");
        reading.targets.expect(name.text, name.mark, below(path, knowledge), reading.faults);
      }
      if (const std::string name = text_at(*node, "name"); !name.empty())
        check_name(name, part(*node, "name").mark, below(path, "name"), reading.faults);
    }
  }
}

}  // namespace grapnel
