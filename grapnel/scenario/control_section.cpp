#include "grapnel/scenario/sections.hpp"

namespace grapnel {

// ---- Contents of "control" ----

template <>
struct Described<ControlSetup> {
  using T = ControlSetup;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> double& { return t.timing.period; }>(
          "period", "s", "Time between samples: sensors are read at t = 0 and every period after it, in all phases.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.timing.delay; }>(
          "delay", "s",
          "Time from a sample to the command computed from it, which is then held until the next command.")
          .at_least(0),
      field<&T::plugin>("plugin", "",
                        "User-defined controller: the path of a shared library, relative to this file. It drives the "
                        "joints if approach.tracking.mode or post_impact.joints is controller.")
          .optional(),
      field<&T::fmu>("fmu", "",
                     "In place of a plugin, the path of an FMU (FMI 2.0 or 3.0, co-simulation), relative to this file.")
          .optional(),
      field<&T::external>("external", "",
                          "In place of both: the simulating program provides the controller, as "
                          "Problem.simulate(controller=...) of the Python module does."),
      field<&T::parameters>(
          "parameters", "",
          "Mapping that is passed to the controller at its creation; for an FMU parameters by their names.")
          .as("parameters")
          .optional(),
      field<&T::inputs>(
          "inputs", "",
          "For an FMU: signals of its input variables, {variable: signal}; in place of a signal a constant, or start "
          "for the variable's start value. Absent: variables with the name of a signal.")
          .as("parameters")
          .optional(),
      field<&T::outputs>("outputs", "", "For an FMU: signals of its output variables, {variable: signal}.")
          .as("parameters")
          .optional(),
      key<std::string>(
          "torques", "",
          "In place of a controller, the path of a CSV file with joint efforts over time, relative to this file: a "
          "header line time,<joint>,... and a line of numbers per row, each held until the next. Columns base.x, "
          "base.y and base.z are a torque on the base; wheel.<name>, gyro.<name> and thruster.<name> command its "
          "actuators.")
          .optional(),
      field<&T::base_torque>("base_torque", "",
                             "Whether the controller also commands a torque on the base while it drives the joints."),
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
      field<&T::end_effectors>("end_effectors", "", "Controlled end-effectors; absent: all that grasps name.")
          .items(1, 0)
          .optional(),
      field<&T::motion>("motion", "",
                        "Controlled directions. pose: position and orientation. position: the position. plane: x, y "
                        "and the rotation about z, in W, for planar robots."),
      field<&T::law>(
          "law", "",
          "operational_space: M a + D v + K x = F, exact for the model. transpose: joint efforts J*^T (K e - "
          "D v), without mass and model."),
      field<&T::mass>("mass", "kg", "M, apparent mass, along the reference's axes: a number or one for each.")
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
      field<&T::force>("force", "", "Whether the law measures contact forces; not_sensed: it assumes zero."),
      field<&T::match>("match", "",
                       "target: in an impact the apparent mass along each contact's normal is chosen so that the "
                       "target stops there."),
      field<&T::null_rate>("null_rate", "1/s", "Damping rate of joint motion that does not move the end-effectors.")
          .at_least(0),
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
