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
      field<&T::gap>(
          "gap", "",
          "Treatment of a miss of the grasp point. weld_as_found: the grasp keeps the relative pose. translate_target: "
          "the target is moved until its grasp point is at the tip, the thesis's implicit choice; with several grasps "
          "by the mean of their gaps, and each grasp then holds as found. refuse: the run fails beyond `limit`."),
      field<&T::refuse_beyond>("limit", "m", "Maximum distance for `refuse`; others ignore it.").above(0).optional(),
      field<&T::largest_gap>(
          "largest_gap", "m",
          "Maximum distance, after `gap`, across which an end-effector without envelope.position is assumed to hold; "
          "beyond it the run fails and names the grasp. `any`: no maximum. With translate_target it is also the "
          "maximum displacement of a target, by default the arm's reach. `refuse` ignores it. A grasp without an "
          "envelope is `captured: assumed`. Absent: a tenth of the arm's reach.")
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
      field<&T::after>("after", "s", "Time since the beginning of the phase; increasing, less than its duration.")
          .above(0)
          .required(),
      field<&T::end_effectors>("end_effectors", "",
                               "End-effectors whose grasps release. Each grasps a target, has closed before, and "
                               "releases once. Absent: all that hold a target then.")
          .items(1, 0)
          .optional(),
  });
  static constexpr Type type = structure<T>("release", "Grasps are released; momenta are conserved.", fields);
};

template <>
struct Described<TendonCommand> {
  using T = TendonCommand;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::tendon>("tendon", "", "Name of the tendon.").required(),
      field<&T::tension>("tension", "N", "Its tension; with `speed` the maximum tension.").at_least(0).required(),
      field<&T::speed>("speed", "m/s",
                       "Speed at which the drive winds the tendon up, from the start of the phase, where the tendon is "
                       "taut without tension. The tension is `stiffness` times the wound-up length less what the "
                       "joints have taken up, from 0 to `tension`. Absent: the tension is constant.")
          .above(0)
          .optional(),
  });
  static constexpr Type type =
      structure<T>("tendon_command", "The command of a tendon, which drives its joints in this phase.", fields);
};

template <>
struct Described<PostureMove> {
  using T = PostureMove;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::joints>("joints", "rad or m", "The posture: every moving joint.").as("joint values").required(),
      field<&T::duration>("duration", "s", "Duration of the motion, which ends within the phase.").above(0).required(),
      field<&T::after>("after", "s", "Start of the motion, since the beginning of the phase.").at_least(0),
      field<&T::profile>("profile", "", "Joint motion over time, from rest to rest; as for the approach."),
  });
  static constexpr Type type =
      structure<T>("move",
                   "For pd, computed_torque and controller: the joints move to a posture and are held there, instead "
                   "of their values at the impact. The reference starts from these values, at rest.",
                   fields);
};

template <>
struct Described<DetumbleSetup> {
  using T = DetumbleSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::torque>(
          "torque", "N m",
          "Maximum torque on the target, about its centre of mass. Limits of joints and grippers may allow less.")
          .above(0)
          .required(),
      field<&T::target>("target", "", "Which target. Absent: the only one that is grasped.").optional(),
  });
  static constexpr Type type =
      structure<T>("detumble",
                   "Brings a held target to rest, in the minimum time that the torque, the effort limits of the joints "
                   "and the `rating` of the grippers (force and moment at the grasp) allow.",
                   fields);
};

template <>
struct Described<KeepBaseSetup> {
  using T = KeepBaseSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::rate>("rate", "1/s", "Rate at which the base returns to its attitude, critically damped.").above(0),
      field<&T::posture>("posture", "rad or m",
                         "Joint values towards which every moving joint moves as far as that does not rotate the base. "
                         "Absent: none; the joints come to rest as far as the momentum allows.")
          .as("joint values")
          .optional(),
      field<&T::posture_rate>("posture_rate", "1/s", "Rate of that motion, critically damped.").above(0),
  });
  static constexpr Type type =
      structure<T>("keep_base_attitude",
                   "With joints keep_base_attitude: the arms keep the base's attitude at the beginning of the phase. "
                   "Not in closed loops, with a fixed base, or with base_control. Absent: defaults.",
                   fields);
};

template <>
struct Described<GraspForceSetup::Pair> {
  using T = GraspForceSetup::Pair;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::between>("between", "", "Two end-effectors.").items(2, 2).required(),
      field<&T::force>("force", "N",
                       "Squeezing force on the target along the line between the two grasps; negative: pulling.")
          .required(),
      field<&T::after>("after", "s", "Start of its rise, since the beginning of the phase.").at_least(0),
      field<&T::ramp>("ramp", "s", "Duration of its smooth rise; 0: immediately.").at_least(0),
  });
  static constexpr Type type = structure<T>("squeeze", "The internal force between two grasps.", fields);
};

template <>
struct Described<GraspForceSetup> {
  using T = GraspForceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::target>("target", "", "Which target. Absent: the only one that is grasped.").optional(),
      field<&T::pairs>("pairs", "", "Internal forces between pairs of grasps. Absent: none.").items(0, 100),
      field<&T::motion>("motion", "",
                        "hold: the target keeps its pose relative to the base from the start of the law. brake: it "
                        "comes to rest, as with `detumble`."),
      field<&T::rate>("rate", "1/s",
                      "Rate at which deviations from `hold` decay, critically damped; with `brake` the decay rate of "
                      "the remaining motion at the end.")
          .above(0),
      field<&T::torque>("torque", "N m", "Maximum torque on the target.").above(0).optional(),
      field<&T::moment_length>("moment_length", "m",
                               "l of the metric |force|^2 + |moment|^2/l^2 by which the grasps share the load.")
          .above(0),
  });
  static constexpr auto rules = std::to_array<Rule>({when("motion", "brake").require("torque")});
  static constexpr Type type = structure<T>("grasp_force",
                                            "Several grasps hold one target: the law controls its motion and its "
                                            "internal forces separately. At least two grasps of it.",
                                            fields, rules);
};

template <>
struct Described<RestSetup> {
  using T = RestSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::angular_velocity>("angular_velocity", "rad/s", "Maximum angular velocity of the base, in W.")
          .above(0)
          .required(),
      field<&T::joint_rate>("joint_rate", "rad/s or m/s",
                            "Maximum rate of every joint of the arms. Absent: joints are not evaluated.")
          .above(0)
          .as("number or infinity")
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "rest",
      "Goal of the motion: base and joints stay below these rates from some time to the end. The summary and the "
      "terminal report this time, or the rates at the end. A result that does not reach the goal has a warning.",
      fields);
};

template <>
struct Described<PhaseUntil> {
  using T = PhaseUntil;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::base_rate>("base_rate", "rad/s", "The magnitude of the base's angular velocity is at most this.")
          .above(0)
          .optional(),
      field<&T::target_rate>("target_rate", "rad/s", "The same of every target.").above(0).optional(),
      field<&T::relative_rate>("relative_rate", "rad/s", "The same of every target relative to the base.")
          .above(0)
          .optional(),
      field<&T::joint_rate>("joint_rate", "rad/s or m/s", "The rate of every driven joint is at most this.")
          .above(0)
          .optional(),
      field<&T::wheel_momentum_below>("wheel_momentum_below", "1",
                                      "Every wheel holds at most this share of its largest momentum, its inertia times "
                                      "its `rate` in the robot file.")
          .above(0)
          .at_most(1)
          .optional(),
      field<&T::wheel_momentum_above>("wheel_momentum_above", "1", "At least one wheel holds this share of it.")
          .above(0)
          .at_most(1)
          .optional(),
      field<&T::event>("event", "",
                       "law_ended: the law that moves all joints together (detumble, keep_base_attitude, impedance, "
                       "grasp_force) has ended. latched: a grasp with closes_when_settled has closed.")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type = structure<T>(
      "until", "Ends the phase before its duration, at the first instant at which all given conditions hold.", fields,
      rules);
};

template <>
struct Described<PostImpactSetup> {
  using T = PostImpactSetup;
  static constexpr auto with_gains = [](const T& t) { return has_gains(t.joints); };
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "",
                      "Name of the phase in results. Names differ, and none is `approach`, `contact`, `brake` or "
                      "`planning`. Absent: post_impact or `motion`; in a list `phase_1`, `phase_2` and so on.")
          .optional(),
      field<&T::duration>("duration", "s", "Duration of the phase; with `until` its maximum.").above(0).required(),
      field<&T::until>("until", "", "").optional(),
      field<&T::joints>(
          "joints", "",
          "free: no torques. pd: holds the joint values found at the impact, by the law (4.1); with `kp: 0` it damps. "
          "computed_torque: the same by torques of the model of servicer and held targets, not in closed loops. "
          "braked: a second impulse locks the joints. controller: torques of `control`, which receives the same "
          "reference. detumble: brings a held target to rest. keep_base_attitude: the arms control the base's "
          "attitude. impedance: the law of `impedance`, about the initial poses of the end-effectors. grasp_force: "
          "controls motion and internal force of a target that several arms hold."),
      field<&T::kp>("kp", "N m/rad or N/m; for computed_torque 1/s^2",
                    "Proportional gains; free, braked and controller ignore them. With detumble, keep_base_attitude, "
                    "impedance and grasp_force: gains of pd, which holds the joints after these laws end.")
          .at_least(0)
          .as("gains of post_impact")
          .optional()
          .when<with_gains>(),
      field<&T::kd>("kd", "N m s/rad or N s/m; for computed_torque 1/s",
                    "Derivative gains, likewise. With detumble they are above 0; with detumble and grasp_force they "
                    "also define the distribution of the efforts among the joints.")
          .at_least(0)
          .as("gains of post_impact")
          .optional()
          .when<with_gains>(),
      field<&T::move>("move", "", "").optional(),
      field<&T::tendons>("tendons", "",
                         "Commands of tendons. Their joints move under the tension alone, whatever `joints` states; "
                         "tendons without a command are slack. With joints free, pd, computed_torque and braked.")
          .items(0, 1000),
      field<&T::detumble>("detumble", "", "").optional(),
      field<&T::keep_base_attitude>("keep_base_attitude", "", "").optional(),
      field<&T::grasp_force>("grasp_force", "", "").optional(),
      field<&T::base_control>(&base_control_description, "base_control", "").optional(),
      field<&T::at_rest>("at_rest", "", "").optional(),
      field<&T::assumed>(&assumed_description, "assumed", "").optional(),
      field<&T::identify>(&identify_description, "identify", "").optional(),
      field<&T::model>(
          "model", "",
          "Inertia of the held target used by computed_torque, detumble and keep_base_attitude, and passed to a "
          "plugin. estimated: the assumed or true one until the identification has ended with all ten numbers. Absent: "
          "estimated with `identify`, else assumed where that is given, else truth.")
          .optional(),
      field<&T::releases>("release", "",
                          "Released grasps, in the order of time. Momenta are continuous; there is no other effect.")
          .items(0, 1000),
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
