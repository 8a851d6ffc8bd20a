#include "grapnel/scenario/sections.hpp"

namespace grapnel {

// ---- Contents of "control" ----

template <>
struct Described<ControlSetup> {
  using T = ControlSetup;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> double& { return t.timing.period; }>(
          "period", "s",
          "Time between samples: sensors are read at t = 0 and every period after it, in all phases. Shorter than the "
          "run, and at most ten million samples in it.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.timing.delay; }>(
          "delay", "s",
          "Time from a sample to the command computed from it, which is then held until the next command; not "
          "necessarily a multiple of the period. Shorter than the run.")
          .at_least(0),
      field<&T::plugin>(
          "plugin", "",
          "A custom controller: the path of a shared library, relative to this file. It is opened when the scenario is "
          "read, by `grapnel check` too, and runs with all rights of the program: use only trusted scenarios.")
          .optional(),
      field<&T::fmu>("fmu", "",
                     "In place of `plugin`: the path of an FMU for co-simulation (FMI 2.0 or 3.0), with a binary for "
                     "this system, relative to this file. It is unpacked and loaded when the scenario is read; it must "
                     "be as trusted as a plugin.")
          .optional(),
      field<&T::external>(
          "external", "",
          "In place of `plugin`: the simulating program provides the controller, as `Problem.simulate(controller=...)` "
          "of the Python module does. The program `grapnel` has none and rejects the scenario at `run`."),
      field<&T::parameters>("parameters", "",
                            "Mapping for the controller, which defines its meaning; a plugin gets JSON, a controller "
                            "in Python a dictionary, of an FMU it is {parameter: value}. Units in it are not "
                            "converted. Needs `plugin`, `fmu` or `external`.")
          .as("parameters")
          .optional(),
      field<&T::inputs>("inputs", "",
                        "Signals of the FMU's input variables, {variable: signal}. A constant may replace a signal; "
                        "`start` keeps the variable's start value. Other real inputs must have the name of a signal, "
                        "and further variables keep their start values.")
          .as("parameters")
          .optional(),
      field<&T::outputs>("outputs", "",
                         "Signals of the FMU's output variables, {variable: signal}. Every joint's effort must be an "
                         "output, and with base_torque the base's three.")
          .as("parameters")
          .optional(),
      key<std::string>(
          "torques", "",
          "In place of a controller, the path of a CSV file with joint efforts over time, relative to this file: a "
          "header line time,<joint>,... and a line of numbers per row, each held until the next. Columns base.x, "
          "base.y and base.z are a torque on the base; wheel.<name>, gyro.<name> and thruster.<name> command its "
          "actuators.")
          .optional(),
      field<&T::base_torque>(
          "base_torque", "",
          "Whether the controller also commands a torque on the base, where it drives the joints, in place of a "
          "base_control. The robot's wheels provide it, if it has any, else its gyros, which must be able to rotate "
          "the base about every axis; else it is external. Not with a base of mode fixed; a held base does not rotate "
          "before the impact. Needs `plugin`, `fmu` or `external`."),
      field<&T::base_actuators>("base_actuators", "",
                                "In place of base_torque: whether the controller commands the torque of each wheel, "
                                "the gimbal rate of each gyro and the valve of each thruster, where it drives the "
                                "joints, in place of a base_control. Limits saturate the commands. Needs one of these "
                                "actuators, and `plugin`, `fmu` or `external`; not with a base of mode fixed."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("plugin, torques"),
      not_both("plugin, fmu"),
      not_both("fmu, torques"),
      needs("inputs", "fmu"),
      needs("outputs", "fmu"),
  });
  static constexpr Type type =
      structure<T>("control",
                   "The on-board computer: controllers of joints and base are updated at the sample times of one "
                   "clock, and their commands are held. Absent: continuous control.",
                   fields, rules);
};

// ---- Contents of "impedance" ----

template <>
struct Described<ImpedanceSetup> {
  using T = ImpedanceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::end_effectors>("end_effectors", "", "Controlled end-effectors. Absent: those of all grasps.")
          .items(1, 0)
          .optional(),
      field<&T::motion>("motion", "",
                        "Controlled motion. pose: position and orientation, which needs six moving joints in an arm; "
                        "the others need three. position: the position. plane: x, y and the rotation about z, in W."),
      field<&T::law>(
          "law", "",
          "operational_space: M a + D v + K x = F, exact for the model. transpose: joint efforts J*^T (K e - "
          "D v), without mass and model."),
      field<&T::mass>("mass", "kg",
                      "M, apparent, along the axes of the end-effector's reference: for all axes, or each.")
          .above(0)
          .as("axis gains"),
      field<&T::damping>("damping", "N s/m", "D, along the same axes.").at_least(0).as("axis gains"),
      field<&T::stiffness>("stiffness", "N/m", "K, along the same axes.").at_least(0).as("axis gains"),
      field<&T::inertia>("inertia", "kg m^2", "Apparent inertia of rotation, along the same axes.")
          .above(0)
          .as("axis gains"),
      field<&T::angular_damping>("angular_damping", "N m s/rad", "Damping of rotation, along the same axes.")
          .at_least(0)
          .as("axis gains"),
      field<&T::angular_stiffness>("angular_stiffness", "N m/rad", "Stiffness of rotation, along the same axes.")
          .at_least(0)
          .as("axis gains"),
      field<&T::force>("force", "", "Whether the law knows the contact forces. not_sensed: it assumes zero."),
      field<&T::match>(
          "match", "",
          "target: in an impact the apparent mass along each contact's normal is the one that stops the target."),
      field<&T::null_rate>("null_rate", "1/s", "Rate at which self-motion of the joints is damped.").at_least(0),
  });
  static constexpr Type type =
      structure<T>("impedance",
                   "Impedance at end-effectors, if approach.tracking.mode, impact.joints or post_impact.joints select "
                   "impedance.",
                   fields);
};

const Type& impedance_description() { return type_of<std::optional<ImpedanceSetup>>(); }

const Type& control_description() { return type_of<std::optional<ControlSetup>>(); }

void finish_control(const TrajectoryFile* torques, Reading& reading) {
  if (!torques || !reading.problem.control) return;
  auto log = read_efforts(*torques, reading.robot, reading.faults);
  if (!log) return;
  ControlSetup& control = *reading.problem.control;
  control.base_torque = !log->base_torque.empty();
  control.log = std::make_shared<const EffortLog>(*std::move(log));
}

}  // namespace grapnel
