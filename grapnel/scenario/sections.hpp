#pragma once

/// @file
/// Contents of robot and scenario files, by section. Each *_section.cpp describes its section: every key with its
/// member of RobotSetup or CaptureProblem, its unit, range, default and meaning. It also reads names and checks
/// combinations of keys. The published schemas, the structure check, the reader and the setters of campaigns are
/// generated from the descriptions; tests compare the tables of docs/formats with them.

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

// ---- Descriptions ----

// Values with special forms in files (forms.hpp).
template <>
struct Described<Rotationd> {
  static constexpr Type type = structure<Rotationd>("rotation", "", {});
};
template <>
struct Described<Symmetric3d> {
  static constexpr Type type = structure<Symmetric3d>("inertia", "", {});
};
template <>
struct Described<Wrenchd> {
  static constexpr Type type = structure<Wrenchd>("wrench", "", {});
};
template <>
struct Described<std::pair<BodyName, BodyName>> {
  static constexpr Type type = structure<std::pair<BodyName, BodyName>>("names", "", {});
};

/// Keys common to all files.
constexpr Field version_key(std::string_view constant) {
  return key<std::string>("schema", "",
                          "Kind of the file and version of its format. Write it, so that later versions recognize the "
                          "file. Absent: this version.")
      .as(constant)
      .optional();
}
constexpr Field description_key() {
  return key<std::string>("description", "", "A comment for readers of the file.").as("any text").optional();
}

inline constexpr double kLargestWhole = 9007199254740991;  // every whole number up to it is a double
inline constexpr std::string_view kSeedText = "Seed of the random numbers; the same seed gives the same results.";
/// Rates of wheels and rotors above this are implausible [rad/s]: 60,000 turns per minute.
inline constexpr double kFastestRotor = 6300;

inline constexpr std::string_view kComText = "Centre of mass in the body's frame.";
inline constexpr std::string_view kInertiaText =
    "Inertia about the centre of mass, in the body's axes. Ixy is the tensor's component: minus the integral of x y "
    "dm.";

inline constexpr std::string_view kShapesText = "For visualization and clearance; a body may have several shapes.";
inline constexpr std::string_view kShapesTitles = "a mapping of one shape; a list of shapes";

/// The orientation of a member that is a pose.
template <auto Pose>
constexpr Field quaternion_of() {
  using Owner = typename detail::MemberOf<decltype(Pose)>::owner;
  return found<[](Owner& owner) -> Rotationd& { return (owner.*Pose).R; }>(
             "quaternion_wxyz", "",
             "Unit quaternion w, x, y, z; normalised if its length is within 1e-6 of 1, rejected otherwise.")
      .as("quaternion")
      .optional();
}
template <auto Pose>
constexpr Field rpy_of() {
  using Owner = typename detail::MemberOf<decltype(Pose)>::owner;
  return found<[](Owner& owner) -> Rotationd& { return (owner.*Pose).R; }>(
             "rpy", "rad", "Roll, pitch, yaw about fixed axes: Rz(yaw) Ry(pitch) Rx(roll), as in URDF.")
      .as("rpy")
      .optional();
}

const Type& robot_description();  ///< of a RobotSetup
const Type& joint_description();
const Type& tendon_arm_description();
const Type& joint_friction_description();
const Type& wheel_array_description();   ///< of a WheelArraySetup (actuator_arrays.hpp), which files hold
const Type& gyro_array_description();    ///< of a GyroArraySetup
const Type& scenario_description();      ///< of a CaptureProblem, its robot included
const Type& shapes_description();        ///< of a std::vector<Geometry>
const Type& beam_description();          ///< of a std::optional<BeamDescription>
const Type& spring_description();        ///< of a std::optional<JointSpring>
const Type& vibrations_description();    ///< of a std::vector<VibrationMode>
const Type& import_description();        ///< of the options of an imported robot
const Type& robot_on_bus_description();  ///< of a robot assembled from files
template <>
const Type& type_of<JointType>();
template <>
const Type& type_of<BeamDescription>();
template <>
const Type& type_of<VibrationMode>();
// Descriptions of members of CaptureProblem, by the names of their keys.
const Type& targets_description();
const Type& grasps_description();
const Type& approach_description();
const Type& contact_description();
const Type& impact_description();
const Type& phases_description();  ///< of CaptureProblem::post_impact, as a list
const Type& external_wrenches_description();
const Type& orbit_description();
const Type& clearance_description();
const Type& materials_description();
const Type& obstacles_description();
const Type& contacts_description();
const Type& stages_description();
const Type& control_description();
const Type& impedance_description();
const Type& sensors_description();
const Type& target_estimate_description();  // of targets
const Type& replan_description();           // of approach
const Type& assumed_description();          // of post_impact
const Type& identify_description();         // of post_impact
const Type& base_control_description();     // of approach and of post_impact

// ---- Robots ----

/// Properties of the robot that a scenario requires, as far as errors allow.
struct ReadRobot {
  RobotSetup setup;
  NameTable links{"link"};
  NameTable end_effectors{"end-effector"};
  NameTable joint_names{"joint"};
  std::set<std::string, std::less<>> fixed_joints;
  std::vector<JointDescription> joints;  // moving; in the order of Model::joints() if `order_known`
  std::map<std::string, std::size_t, std::less<>> joint_index;
  bool order_known = false;
  bool types_known = true;  // of all joints

  /// Whether `joints` is the complete list of moving joints.
  bool count_known() const { return joint_names.complete() && types_known; }
};

/// `path` is "robot" for an inline robot and empty for a file; `meshes` are the meshes named in its geometry.
ReadRobot read_robot(const Node& node, const std::string& path, const Meshes& meshes, FaultList& faults);

/// Model of the described robot. @throws ModelError
Model build_model(const RobotSetup& setup);
/// Its moving joints, in the order of Model::joints(). @throws ModelError
std::vector<JointDescription> moving_joints(const RobotSetup& setup);

// ---- Scenarios ----

/// A file of joint motion whose text has been read and checked.
struct TrajectoryFile {
  std::shared_ptr<const std::string> source;  // its path
  std::string text;
};

/// A header line time,JOINT,... and a line of numbers per sample; docs/formats/scenario.md describes it. Empty if
/// errors make the motion uncertain.
std::optional<SampledMotion> read_trajectory(const TrajectoryFile& file, const ReadRobot& robot, FaultList& faults);
/// The same for joint efforts, with columns base.x, base.y and base.z of a torque on the base, all or none, or in their
/// place wheel.NAME, gyro.NAME and thruster.NAME of its actuators.
std::optional<EffortLog> read_efforts(const TrajectoryFile& file, const ReadRobot& robot, FaultList& faults);

/// A capture problem from a Node tree. `robot` may be empty if its file could not be read; names and joints are then
/// not checked. `trajectory` is the file that approach.trajectory names and `torques` that of control.torques, null if
/// there is none or it could not be read. `meshes` are the meshes named in the targets' geometry.
CaptureProblem read_scenario(const Node& node, ReadRobot robot, const TrajectoryFile* trajectory,
                             const TrajectoryFile* torques, const Meshes& meshes, FaultList& faults);

/// A scenario whose values have been read, while its sections check names and combinations of keys.
struct Reading {
  Reading(const Node& tree, ReadRobot read_robot, const Meshes& meshes, FaultList& list)
      : root(tree), robot(std::move(read_robot)), scope{list, meshes, &robot}, faults(list) {}

  const Node& root;
  ReadRobot robot;
  ReadScope scope;
  FaultList& faults;
  CaptureProblem problem;
  NameTable targets{"target"};
  std::map<std::string, NameTable, std::less<>> points;  // by target
  NameTable obstacles{"obstacle"};
  NameTable materials{"material"};

  /// What a name of the scenario refers to; null if there is none.
  const EndEffectorSetup* end_effector(const std::string& name) const;
  const GraspPoint* grasp_point(const GraspSetup& grasp) const;
};

// What sections add to the values read, in this order: names looked up, further checks, and what follows from both.
void finish_targets(Reading& reading);
void finish_grasps(Reading& reading);
void finish_approach(const TrajectoryFile* file, Reading& reading);
void finish_impact(Reading& reading);
void finish_post_impact(Reading& reading);
void finish_external_wrenches(Reading& reading);
void finish_contacts(Reading& reading);
/// In a capture, a target without a grasp is an error unless `contacts` select it. After finish_contacts().
void check_all_targets_used(Reading& reading);
void finish_stages(Reading& reading);
void finish_clearance(Reading& reading);
void finish_control(const TrajectoryFile* torques, Reading& reading);
void finish_sensors(Reading& reading);

/// A link, the base, a target, a panel or, if allowed, an obstacle; an error at `path` if there is none.
std::optional<BodyName> named_body(const Node& node, const std::string& path, Reading& reading, bool with_obstacles);

/// Adds conflicts at their places in the tree, except those of absent keys and those that depend on values that are
/// faulty.
void add_conflicts(std::vector<ProblemFault> conflicts, const Node& root, FaultList& faults);

}  // namespace grapnel
