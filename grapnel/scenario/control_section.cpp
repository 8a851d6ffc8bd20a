#include "grapnel/scenario/sections.hpp"

namespace grapnel {

// ---- What "control" holds ----

template <>
struct Described<ControlSetup> {
  using T = ControlSetup;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> double& { return t.timing.period; }>(
          "period", "s", "Between samples: sensors are read at t = 0 and every period after it, in all phases.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.timing.delay; }>(
          "delay", "s", "From a sample to the command that follows from it, which is then held until the next acts.")
          .at_least(0),
      field<&T::plugin>("plugin", "",
                        "A controller of one's own: the path of a shared library, relative to this file. It drives the "
                        "joints where approach.tracking.mode or post_impact.joints is controller.")
          .optional(),
      field<&T::fmu>("fmu", "",
                     "In place of a plugin, the path of an FMU (FMI 2.0 or 3.0, co-simulation), relative to this file.")
          .optional(),
      field<&T::external>("external", "",
                          "In place of both: the program that simulates gives the controller, as "
                          "Problem.simulate(controller=...) of the Python module does."),
      field<&T::parameters>("parameters", "",
                            "What the controller is given when it is made: a mapping that it understands; of an FMU "
                            "parameters by their names.")
          .as("parameters")
          .optional(),
      field<&T::inputs>(
          "inputs", "",
          "Of an FMU: what its input variables are, {variable: signal}; in place of a signal a constant, or "
          "start for the value that the variable starts with. Absent: variables that are called like a "
          "signal.")
          .as("parameters")
          .optional(),
      field<&T::outputs>("outputs", "", "Of an FMU: the signals that its output variables are, {variable: signal}.")
          .as("parameters")
          .optional(),
      key<std::string>(
          "torques", "",
          "In place of a controller, the path of a CSV file with joint efforts over time, relative to this file: a "
          "header line time,<joint>,... and a line of numbers per row, each held until the next. Columns base.x, "
          "base.y "
          "and base.z are a torque on the base; wheel.<name>, gyro.<name> and thruster.<name> tell its actuators.")
          .optional(),
      field<&T::base_torque>("base_torque", "",
                             "Whether the controller says a torque on the base too, wherever it drives the joints."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("plugin, torques"),
      not_both("plugin, fmu"),
      not_both("fmu, torques"),
      needs("inputs", "fmu"),
      needs("outputs", "fmu"),
  });
  static constexpr Type type = structure<T>("control",
                                            "The on-board computer: laws of joints and of the base speak at the ticks "
                                            "of one clock, and what they say is held. "
                                            "Absent: they act continuously.",
                                            fields, rules);
};

// ---- What "impedance" holds ----

template <>
struct Described<ImpedanceSetup> {
  using T = ImpedanceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::end_effectors>("end_effectors", "", "Absent: all that grasps name.").items(1, 0).optional(),
      field<&T::motion>("motion", "",
                        "What is controlled. pose: position and orientation. position: the position. plane: x, y and "
                        "the turn about z, in W, of robots that move in a plane."),
      field<&T::law>(
          "law", "",
          "operational_space: M a + D v + K x = F, exact for the model. transpose: joint efforts J*^T (K e - "
          "D v), without mass and model."),
      field<&T::mass>("mass", "kg", "M, apparent, along the reference's axes: a number or one for each.")
          .above(0)
          .as("axis gains"),
      field<&T::damping>("damping", "N s/m", "D, likewise.").at_least(0).as("axis gains"),
      field<&T::stiffness>("stiffness", "N/m", "K, likewise.").at_least(0).as("axis gains"),
      field<&T::inertia>("inertia", "kg m^2", "Of turning, likewise.").above(0).as("axis gains"),
      field<&T::angular_damping>("angular_damping", "N m s/rad", "Of turning, likewise.").at_least(0).as("axis gains"),
      field<&T::angular_stiffness>("angular_stiffness", "N m/rad", "Of turning, likewise.")
          .at_least(0)
          .as("axis gains"),
      field<&T::force>("force", "", "Whether the law knows the forces of contact; not_sensed: it takes them for zero."),
      field<&T::match>(
          "match", "",
          "target: in an impact the apparent mass along each contact's normal is that with which the target "
          "is stopped there."),
      field<&T::null_rate>("null_rate", "1/s", "At which motion of the joints that does not move the hands is damped.")
          .at_least(0),
  });
  static constexpr Type type =
      structure<T>("impedance",
                   "Impedance at end-effectors, where approach.tracking.mode, impact.joints or post_impact.joints say "
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
