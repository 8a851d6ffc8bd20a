#include <fmt/format.h>

#include "grapnel/scenario/sections.hpp"

namespace grapnel {

// ---- Contents of "sensors", and the estimates of targets ----

namespace {

constexpr std::string_view kSampleTime = "Time between readings, a multiple of control.period; absent: control.period.";
constexpr std::string_view kNoise = "Standard deviation of a reading.";
constexpr std::string_view kQuantum = "Quantum: readings are multiples of it; 0: no quantization.";

}  // namespace

template <>
struct Described<JointSensors> {
  using T = JointSensors;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::noise>("noise", "rad or m", kNoise).at_least(0),
      field<&T::bias>("bias", "rad or m", "Bias of the joints; those left out of a mapping have none. Absent: none.")
          .as("offsets of joints")
          .optional(),
      field<&T::quantum>("quantum", "rad or m", kQuantum).at_least(0).optional(),
      field<&T::counts_per_turn>("counts_per_turn", "", "In place of `quantum`: 2 pi over it. Not for sliding joints.")
          .at_least(1)
          .optional(),
      field<&T::sample_time>("sample_time", "s", kSampleTime).above(0).optional(),
      field<&T::rate>("rate", "",
                      "difference: of the last two position readings, over the time between them, 0 at the first "
                      "reading. sensor: a separate sensor. exact: the true value."),
      field<&T::rate_noise>("rate_noise", "rad/s or m/s", "Noise of `rate: sensor`.").at_least(0),
      field<&T::rate_bias>("rate_bias", "rad/s or m/s", "Bias of `rate: sensor`, of all joints."),
      field<&T::rate_quantum>("rate_quantum", "rad/s or m/s", "Quantum of `rate: sensor`.").at_least(0),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quantum, counts_per_turn"),
      when("rate", "difference, exact").forbid("rate_noise, rate_bias, rate_quantum", "they are of rate: sensor"),
      needs("rate_noise", "rate"),
      needs("rate_bias", "rate"),
      needs("rate_quantum", "rate"),
  });
  static constexpr Type type = structure<T>("joint_sensors", "Encoders of all moving joints.", fields, rules);
};

template <>
struct Described<GyroSensor> {
  using T = GyroSensor;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::noise>("noise", "rad/s", kNoise).at_least(0).optional(),
      field<&T::angle_random_walk>(
          "angle_random_walk", "",
          "In place of `noise`, in rad/sqrt(s): noise is this over the root of the sample time.")
          .above(0)
          .optional(),
      field<&T::bias>("bias", "rad/s", "Bias in the base's axes."),
      field<&T::quantum>("quantum", "rad/s", kQuantum).at_least(0),
      field<&T::sample_time>("sample_time", "s", kSampleTime).above(0).optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("noise, angle_random_walk")});
  static constexpr Type type =
      structure<T>("gyro", "The base's angular velocity, in its axes. Not of a base with mode fixed.", fields, rules);
};

template <>
struct Described<AttitudeSensor> {
  using T = AttitudeSensor;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::noise>("noise", "rad", "Standard deviation of a reading, about each axis of the base.").at_least(0),
      field<&T::bias>("bias", "rad", "Rotation vector in the base's axes."),
      field<&T::quantum>("quantum", "rad", "Quantum of the components of the reading's rotation vector; 0: none.")
          .at_least(0),
      field<&T::sample_time>("sample_time", "s", kSampleTime).above(0).optional(),
  });
  static constexpr Type type =
      structure<T>("attitude_sensor", "The base's attitude. Not of a base with mode fixed.", fields);
};

template <>
struct Described<WheelSensors> {
  using T = WheelSensors;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::noise>("noise", "rad/s", kNoise).at_least(0).plausible_to(kFastestRotor),
      field<&T::bias>("bias", "rad/s", "Bias of all wheels.").plausible_to(kFastestRotor),
      field<&T::quantum>("quantum", "rad/s", kQuantum).at_least(0).plausible_to(kFastestRotor),
      field<&T::sample_time>("sample_time", "s", kSampleTime).above(0).optional(),
  });
  static constexpr Type type = structure<T>("wheel_sensors", "Tachometers of all reaction wheels.", fields);
};

template <>
struct Described<WristSensor> {
  using T = WristSensor;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::end_effector>("end_effector", "", "Its end-effector; at most one sensor each.").required(),
      field<&T::force_noise>("force_noise", "N", kNoise).at_least(0),
      field<&T::torque_noise>("torque_noise", "N m", kNoise).at_least(0),
      field<&T::force_bias>("force_bias", "N", "Bias in the end-effector's axes."),
      field<&T::torque_bias>("torque_bias", "N m", "Bias in the end-effector's axes."),
      field<&T::force_quantum>("force_quantum", "N", kQuantum).at_least(0),
      field<&T::torque_quantum>("torque_quantum", "N m", kQuantum).at_least(0),
      field<&T::sample_time>("sample_time", "s", kSampleTime).above(0).optional(),
  });
  static constexpr Type type = structure<T>(
      "wrist_sensor", "Force and torque that a grasp transmits to the end-effector, about its origin.", fields);
};

template <>
struct Described<RelativePoseSensor> {
  using T = RelativePoseSensor;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::target>("target", "", "Its target; at most one sensor each.").required(),
      field<&T::position_noise>("position_noise", "m", kNoise).at_least(0),
      field<&T::orientation_noise>("orientation_noise", "rad",
                                   "Standard deviation of a reading, about each axis of the target.")
          .at_least(0),
      field<&T::velocity_noise>("velocity_noise", "m/s", kNoise).at_least(0),
      field<&T::angular_velocity_noise>("angular_velocity_noise", "rad/s", kNoise).at_least(0),
      field<&T::position_bias>("position_bias", "m", "Bias in the base's axes."),
      field<&T::orientation_bias>("orientation_bias", "rad", "Rotation vector in the target's axes."),
      field<&T::sample_time>("sample_time", "s", kSampleTime).above(0).optional(),
      field<&T::delay>("delay", "s", "Time from a reading until it is available.").at_least(0),
  });
  static constexpr Type type =
      structure<T>("relative_pose", "Pose and motion of a target relative to the base.", fields);
};

template <>
struct Described<SensorSetup> {
  using T = SensorSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::seed>("seed", "", kSeedText).at_least(0).at_most(kLargestWhole),
      field<&T::joints>("joints", "", "").optional(),
      field<&T::gyro>("gyro", "", "").optional(),
      field<&T::attitude>("attitude", "", "").optional(),
      field<&T::wheels>("wheels", "", "").optional(),
      field<&T::wrists>("force_torque", "",
                        "Sensors between an end-effector and its held target: force and torque on the robot, in the "
                        "end-effector's axes, about its origin; zero while nothing is held.")
          .items(0, 100),
      field<&T::relative_poses>("relative_pose", "",
                                "Pose and motion of targets relative to the base, for approach.replan and plugins.")
          .items(0, 100),
  });
  static constexpr Type type = structure<T>("sensors",
                                            "Sensor readings at the sample times of the on-board computer. Control "
                                            "laws receive true values for quantities without a sensor.",
                                            fields);
};

template <>
struct Described<TargetEstimate> {
  using T = TargetEstimate;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::position_error>("position_error", "m", "Estimate minus true value, in W."),
      field<&T::orientation_error>("orientation_error", "rad",
                                   "Rotation vector in W from the true target to the estimated one."),
      field<&T::velocity_error>("velocity_error", "m/s", "Error of the velocity of the target frame's origin, in W."),
      field<&T::angular_velocity_error>("angular_velocity_error", "rad/s", "Error of the angular velocity, in W."),
  });
  static constexpr Type type =
      structure<T>("target_estimate",
                   "State of the target assumed by the approach, relative to the true `state` at the same instant. The "
                   "approach is planned on it and simulated with the true target. Absent: the truth.",
                   fields);
};

template <>
struct Described<ReplanSetup> {
  using T = ReplanSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::every>("every", "s",
                       "Interval between replannings; the first one after this time. Less than the duration.")
          .above(0)
          .required(),
      field<&T::until>("until", "s",
                       "Time of the last replanning, from the start. Absent: the approach's end, or straight_in.")
          .above(0)
          .optional(),
  });
  static constexpr Type type =
      structure<T>("replan",
                   "The remaining approach is planned again during the approach, with the latest readings of relative "
                   "pose sensors. Needs `plan`, and a `profile` that can begin with rates, cycloidal or quintic. Not "
                   "while a target is held, nor in the segment straight_in.",
                   fields);
};

template <>
struct Described<AssumedTarget> {
  using T = AssumedTarget;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::target>("target", "", "Which target. Absent: the only one that is grasped.").optional(),
      field<&T::mass>("mass", "kg", "Assumed mass. Absent: the true one.").above(0).optional(),
      field<&T::com>("com", "m", "Centre of mass in the target's frame. Absent: the true one.").optional(),
      field<&T::inertia>("inertia", "kg m^2",
                         "Inertia about the assumed centre of mass, in the target's axes. Absent: the true one.")
          .as("inertia")
          .optional(),
  });
  static constexpr Type type =
      structure<T>("assumed",
                   "Properties of a held target that model-based laws assume until it has been identified. Omitted "
                   "properties have their true values. Absent: the truth.",
                   fields);
};

template <>
struct Described<ExcitationSetup> {
  using T = ExcitationSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::amplitude>("amplitude", "rad or m",
                           "Amplitude to both sides of the held value; joints left out of a mapping stay.")
          .as("offsets of joints")
          .required(),
      field<&T::swings>("swings", "",
                        "Periods of the first joint; the second makes one more, the third two more, the fourth as many "
                        "as the first, and so on.")
          .at_least(1)
          .at_most(1000),
  });
  static constexpr Type type = structure<T>(
      "excitation",
      "Joints oscillate during sampling (20.7). For pd, computed_torque and controller; `move` begins after it.",
      fields);
};

template <>
struct Described<IdentifySetup> {
  using T = IdentifySetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::target>("target", "", "Which target. Absent: the only one that is grasped.").optional(),
      field<&T::from>("from", "s", "Start of sampling, since the beginning of the phase.").at_least(0),
      field<&T::duration>("duration", "s", "Duration of sampling, which ends within the phase.").above(0).required(),
      field<&T::sample_time>("sample_time", "s",
                             "Time between samples, a multiple of control.period. Absent: every sample.")
          .above(0)
          .optional(),
      field<&T::base>("base", "",
                      "Measured motion of the base. twist: position and velocity too. rotation: attitude and angular "
                      "velocity alone; then no external force may act."),
      field<&T::momentum_known>("momentum_known", "",
                                "Whether the total momentum at the first sample is known, exactly."),
      field<&T::excitation>("excitation", "", "").optional(),
  });
  static constexpr Type type = structure<T>("identify",
                                            "Mass, centre of mass and inertia of a held target are identified from "
                                            "sensor readings at the sample instants. Needs `control`.",
                                            fields);
};

const Type& sensors_description() { return type_of<std::optional<SensorSetup>>(); }
const Type& target_estimate_description() { return type_of<std::optional<TargetEstimate>>(); }
const Type& replan_description() { return type_of<std::optional<ReplanSetup>>(); }
const Type& assumed_description() { return type_of<std::optional<AssumedTarget>>(); }
const Type& identify_description() { return type_of<std::optional<IdentifySetup>>(); }

// ---- Reading ----

void finish_sensors(Reading& reading) {
  const Node& node = part(reading.root, "sensors");
  const auto resolve = [&](const char* list, const char* key, auto& names) {
    const Node& all = part(node, list);
    for (std::size_t i = 0; i < all.items.size() && !reading.faults.full(); ++i)
      names.expect(text_at(all.items[i], key), part(all.items[i], key).mark, item(below("sensors", list), i),
                   reading.faults);
  };
  resolve("force_torque", "end_effector", reading.robot.end_effectors);
  resolve("relative_pose", "target", reading.targets);
}

}  // namespace grapnel
