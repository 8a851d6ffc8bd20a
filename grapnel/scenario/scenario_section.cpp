#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/sections.hpp"

namespace grapnel {
namespace {

// Mappings of files for a subset of a structure's members.
struct InitialBaseKeys;
struct InitialKeys;
struct OutputKeys;

constexpr Field import_key_of_scenarios() {
  Field f = key<std::string>("import", "", "Choices for a robot in URDF or MJCF.").as("import").optional();
  f.type = &import_description;
  return f;
}

}  // namespace

// ---- Contents of scenarios, except for the sections in separate files ----

template <>
struct Described<Momentumd> {
  using T = Momentumd;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::linear>("linear", "kg m/s", "Linear momentum, in W."),
      field<&T::angular>("angular", "kg m^2/s", "Angular momentum about the robot's centre of mass, in W."),
  });
  static constexpr Type type = structure<T>(
      "momentum",
      "The robot's total momentum, in place of both velocities. The base's motion follows from it and the joint rates.",
      fields);
};

template <>
struct Described<InitialBaseKeys> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> Vector3d& { return t.X_WB.p; }>("position", "m", "Position of the base frame's origin, in W.")
          .up_to(1e+09),
      quaternion_of<&T::X_WB>(),
      rpy_of<&T::X_WB>(),
      found_if<[](T& t) { return t.V_WB ? &t.V_WB->angular : nullptr; }>(
          "angular_velocity", "rad/s", "Angular velocity of the base, in W. Absent: zero.")
          .optional(),
      found_if<[](T& t) { return t.V_WB ? &t.V_WB->linear : nullptr; }>(
          "velocity", "m/s", "Velocity of the base frame's origin, in W. Absent: zero.")
          .optional(),
      field<&T::momentum>("momentum", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quaternion_wxyz, rpy"),
      not_both("momentum, angular_velocity"),
      not_both("momentum, velocity"),
  });
  static constexpr Type type = structure<T>("initial_base", "Pose and velocity of the base.", fields, rules);
};

template <>
struct Described<InitialKeys> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      group<T, InitialBaseKeys>("base", ""),
      field<&T::joint_position>("joints", "rad or m",
                                "Values of all moving joints except those with a `spring`, which begin unstressed. "
                                "Absent: those of approach.trajectory or approach.pieces; required without these.")
          .as("joint values")
          .optional(),
      field<&T::joint_rate>("joint_rates", "rad/s or m/s",
                            "Rates of the joints; those left out of a mapping are at rest. Absent: those of "
                            "approach.trajectory or approach.pieces, else zero.")
          .as("joint values")
          .optional(),
      field<&T::wheel_rate>("wheel_rates", "rad/s",
                            "Rates of the robot's wheels, in its order, relative to the base, within their maximum "
                            "rates. base.momentum includes them. Absent: zero.")
          .plausible_to(kFastestRotor)
          .optional(),
      field<&T::gimbal_angle>("gimbal_angles", "rad",
                              "Angles of the robot's gyros, in its order. Gimbals start at rest, rotors at their "
                              "rates; base.momentum includes them. Absent: zero.")
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "initial", "The state at t = 0. With no approach it is the state at the instant of capture.", fields);
};

template <>
struct Described<IntegrationSetup> {
  using T = IntegrationSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::method>("method", "",
                        "automatic: adaptive_8, and radau_9 where a motion with contacts is stiff. adaptive_8: "
                        "explicit, Dormand-Prince of order 8. radau_9: implicit, Radau IIA of order 9. rk4: explicit, "
                        "with fixed steps. All but rk4 control the error."),
      field<&T::root_velocity>("root_velocity", "",
                               "recovered: without external loads, velocity and position of base and targets follow "
                               "from the momentum and the centre of mass at the phase's start, so that momentum cannot "
                               "drift. integrated: they are integrated with the other states."),
      field<&T::loops>(
          "loops", "",
          "Method for closed loops. projection: after every step, and at every output, positions and velocities are "
          "projected onto the closures in the mass metric. baumgarte: acts on accelerations and feeds defects back. "
          "acceleration: acts on accelerations alone (2.10), as in the thesis: defects stay and grow. open: the loops "
          "are cut, so further grasps of a target do not hold it."),
      field<&T::baumgarte_time>("baumgarte_time", "s", "Time within which defects decay. Absent: 0.1.")
          .above(0)
          .optional(),
      field<&T::relative_tolerance>("relative_tolerance", "", "Relative tolerance of a step's error. Not for rk4.")
          .at_least(1e-14)
          .at_most(0.1),
      field<&T::absolute_tolerance>("absolute_tolerance", "", "Absolute tolerance of a step's error. Not for rk4.")
          .at_least(1e-18)
          .at_most(0.1),
      field<&T::step>("step", "s", "Step of rk4.").above(0),
      field<&T::max_step>("max_step", "s",
                          "Maximum step. Not for rk4. Absent: a hundredth of a phase with driven joints, else none.")
          .above(0)
          .optional(),
      field<&T::max_steps>("max_steps", "", "Maximum number of steps of a phase; a phase that needs more fails.")
          .at_least(1)
          .at_most(1000000000),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("baumgarte_time", "loops"),
      when("loops", "projection, acceleration").forbid("baumgarte_time", "it is for baumgarte"),
  });
  static constexpr Type type = structure<T>("integration", "Integration method.", fields, rules);
};

template <>
struct Described<OutputKeys> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::output_interval>(
          "interval", "s",
          "Interval between samples, which are at its multiples since t = 0; at most 10 million samples.")
          .above(0),
      field<&T::output_links>("links", "",
                              "Record the velocities of all links too, and the angular momentum inside the base."),
      field<&T::output_as_published>(
          "as_published", "",
          "Also show the results of the thesis's formulas (3.8)-(3.13) beside the impact that conserves momentum; with "
          "law as_published they are always shown. summary.json always has them, where they are defined."),
  });
  static constexpr Type type = structure<T>("output", "Recorded data.", fields);
};

// The phases after the approach, one or a list of them.
constexpr Field phases_key(std::string_view name, std::string_view text) {
  Field f;
  f.key = name, f.text = text, f.type = &phases_description;
  f.show = [](const void* owner, ValueVisitor visitor) {
    const std::vector<PostImpactSetup>& phases = static_cast<const CaptureProblem*>(owner)->post_impact;
    visitor(&phases);
  };
  f.place = [](void* owner) -> void* {
    std::vector<PostImpactSetup>& phases = static_cast<CaptureProblem*>(owner)->post_impact;
    return &phases;
  };
  return f.one_or_list("a mapping of one phase; a list of phases").optional();
}

template <>
struct Described<CaptureProblem> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-scenario/1"),
      field<&T::name>("name", "", "Name in results.").required(),
      description_key(),
      field<&T::robot>(
          &robot_description, "robot",
          "The robot: the name of a ready-made one; a robot file or a model in URDF or MJCF, its path relative to "
          "this file; the content of a robot file; or a bus with arms from files.")
          .as("robot")
          .required(),
      import_key_of_scenarios(),
      field<&T::gravity>("gravity", "m/s^2", "Uniform gravity in W, for ground test beds."),
      field<&T::orbit>(&orbit_description, "orbit", "").optional(),
      group<T, InitialKeys>("initial", ""),
      field<&T::targets>(&targets_description, "targets", "The free bodies to be captured."),
      field<&T::grasps>(&grasps_description, "grasps",
                        "Grasps of end-effectors on targets; all at one instant unless stated otherwise.")
          .items(1, 0)
          .optional(),
      field<&T::approach>(&approach_description, "approach", "").optional(),
      field<&T::contact>(&contact_description, "contact", ""),
      field<&T::impact>(&impact_description, "impact", "").optional(),
      phases_key("post_impact", "Motion after the impact: one phase, or consecutive phases.")
          .when<[](const T& t) { return t.impact.has_value(); }>(),
      phases_key(
          "motion",
          "Motion of a scenario without a capture: one phase, or consecutive phases, from t = 0 or the approach's end.")
          .when<[](const T& t) { return !t.impact; }>(),
      field<&T::loads>(&external_wrenches_description, "external_wrenches",
                       "Wrenches on bodies as given functions of time, in all phases.")
          .items(0, 1000),
      field<&T::control>(&control_description, "control", "").optional(),
      field<&T::sensors>(&sensors_description, "sensors", "").optional(),
      field<&T::impedance>(&impedance_description, "impedance", "").optional(),
      field<&T::clearance>(&clearance_description, "clearance", ""),
      field<&T::materials>(&materials_description, "materials", "Surface materials of `contacts`.").items(0, 1000),
      field<&T::obstacles>(&obstacles_description, "obstacles",
                           "Bodies fixed in W that others may touch. Not with `orbit`.")
          .items(0, 1000),
      field<&T::contacts>(
          &contacts_description, "contacts",
          "Bodies that may touch, and their materials. A later rule overrides earlier ones for the same "
          "pair.")
          .one_or_list("a mapping of one rule; a list of rules")
          .optional(),
      field<&T::stages>(
          &stages_description, "stages",
          "Stages of a capture by contacts that are reported: of one target, or a list with one entry per "
          "target.")
          .one_or_list("a mapping for one target; a list of them")
          .optional(),
      field<&T::integration>("integration", "", ""),
      group<T, OutputKeys>("output", ""),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("impact", "grasps"),
      needs("post_impact", "impact"),
      not_both("motion, impact"),
      not_both("motion, post_impact"),
      needs("grasps", "targets"),
  });
  static constexpr Type type =
      structure<T>("scenario",
                   "One simulation: a robot, its targets, the grasps, and the phases to simulate. SI units, radians; "
                   "vectors in the world frame unless stated otherwise.",
                   fields, rules);
};

const Type& scenario_description() { return type_of<CaptureProblem>(); }

// ---- How they are read ----

namespace {

// The location of a path, or of its longest existing part.
struct Found {
  const Node* node;
  const NodeEntry* entry = nullptr;  // if it is the value of a key
  bool is_whole = true;              // the whole path exists
};
Found find_path(const Node& root, std::string_view path) {
  Found found{&root};
  while (!path.empty()) {
    const NodeEntry* entry = nullptr;
    const Node* below = nullptr;
    if (path[0] == '[') {
      const std::size_t close = path.find(']');
      std::size_t index = 0;
      std::from_chars(path.data() + 1, path.data() + close, index);
      below = index < found.node->items.size() ? &found.node->items[index] : nullptr;
      path.remove_prefix(close + 1);
    } else {
      const std::size_t end = std::min(path.find_first_of(".["), path.size());
      entry = found.node->entry(path.substr(0, end));
      below = entry ? &entry->value : nullptr;
      path.remove_prefix(end);
    }
    if (path.starts_with('.')) path.remove_prefix(1);
    if (!below) return found.is_whole = false, found;
    found.node = below, found.entry = entry;
  }
  return found;
}

// Whether an error was reported in a value or below it.
bool is_faulty(const Node& node, const FaultList& faults) {
  const auto is_here = [&](const Fault& f) {
    return node.mark.source && f.file == *node.mark.source && f.line == node.mark.line && f.column == node.mark.column;
  };
  return std::any_of(faults.all().begin(), faults.all().end(), is_here) ||
         std::any_of(node.items.begin(), node.items.end(), [&](const Node& n) { return is_faulty(n, faults); }) ||
         std::any_of(node.entries.begin(), node.entries.end(),
                     [&](const NodeEntry& e) { return is_faulty(e.value, faults); });
}

template <class Named>
const Named* find_named(const std::vector<Named>& list, const std::string& name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const Named& one) { return one.name == name; });
  return found == list.end() ? nullptr : &*found;
}

class ScenarioReader {
 public:
  ScenarioReader(const Node& root, ReadRobot robot, const TrajectoryFile* trajectory, const TrajectoryFile* torques,
                 const Meshes& meshes, FaultList& faults)
      : reading_(root, std::move(robot), meshes, faults), trajectory_(trajectory), torques_(torques) {}

  CaptureProblem read() {
    problem_.V_WB = Twistd::zero();
    read_members(root_, scenario_description(), {}, &problem_, reading_.scope);
    problem_.robot = reading_.robot.setup;
    finish_initial();
    finish_targets(reading_);
    finish_grasps(reading_);
    finish_approach(trajectory_, reading_);
    finish_impact(reading_);
    finish_post_impact(reading_);
    finish_external_wrenches(reading_);
    finish_contacts(reading_);
    check_all_targets_used(reading_);
    finish_stages(reading_);
    finish_clearance(reading_);
    finish_control(torques_, reading_);
    finish_sensors(reading_);
    check_conflicts();
    doubt_shared_points(part(root_, "grasps"), problem_, faults_);
    return std::move(problem_);
  }

 private:
  void finish_initial() {
    if (problem_.robot.base_mode == RobotSetup::Base::fixed) problem_.robot.bodies[0].X_PF = problem_.X_WB;
    if (problem_.momentum) problem_.V_WB.reset();
    const Node &initial = part(root_, "initial"), &approach = part(root_, "approach");
    if (initial.find("joints") || approach.entry("trajectory") || approach.entry("pieces") ||
        reading_.robot.joints.empty() || !(initial.is_mapping() || initial.kind == Node::Kind::null))
      return;
    faults_.add(initial.is_mapping() ? initial.mark : root_.mark,
                "missing key 'joints' in initial: every moving joint needs a value");
  }

  void check_conflicts() {
    const Node& approach = part(root_, "approach");
    const bool is_stated = approach.find("trajectory") || approach.find("pieces");  // possibly with errors
    std::vector<ProblemFault> conflicts = problem_conflicts(problem_);
    // An unreadable file has been reported.
    const bool is_lost = part(root_, "control").find("torques") && !(problem_.control && problem_.control->log);
    if (is_lost) std::erase_if(conflicts, [](const ProblemFault& f) { return f.relies_on == "control"; });
    if (is_stated) std::erase_if(conflicts, [](const ProblemFault& f) { return f.path == "approach.profile"; });
    if (root_.is_mapping()) add_conflicts(std::move(conflicts), root_, faults_);
  }

  Reading reading_;
  const TrajectoryFile *trajectory_, *torques_;
  const Node& root_ = reading_.root;
  FaultList& faults_ = reading_.faults;
  CaptureProblem& problem_ = reading_.problem;
};

}  // namespace

const EndEffectorSetup* Reading::end_effector(const std::string& name) const {
  return find_named(robot.setup.end_effectors, name);
}
const GraspPoint* Reading::grasp_point(const GraspSetup& grasp) const {
  const TargetSetup* target = find_named(problem.targets, grasp.target);
  return target ? find_named(target->grasp_points, grasp.grasp_point) : nullptr;
}

void add_conflicts(std::vector<ProblemFault> conflicts, const Node& root, FaultList& faults) {
  std::erase_if(conflicts, [&](const ProblemFault& conflict) {
    const Found cause = find_path(root, conflict.relies_on);
    const bool is_doubtful = !conflict.relies_on.empty() && cause.is_whole && is_faulty(*cause.node, faults);
    return is_doubtful || (conflict.of_key && !find_path(root, conflict.path).is_whole);
  });
  for (const ProblemFault& conflict : conflicts) {
    const Found place = find_path(root, conflict.path);
    faults.add(conflict.of_key ? place.entry->mark : place.node->mark, conflict.message);
  }
}

CaptureProblem read_scenario(const Node& node, ReadRobot robot, const TrajectoryFile* trajectory,
                             const TrajectoryFile* torques, const Meshes& meshes, FaultList& faults) {
  return ScenarioReader(node, std::move(robot), trajectory, torques, meshes, faults).read();
}

}  // namespace grapnel
