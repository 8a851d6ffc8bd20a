#include "grapnel/plant/plant_variables.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/problem/capture_system.hpp"

namespace grapnel {
namespace {

using VariableType = PlantVariable::Type;
using Causality = PlantVariable::Causality;

// "N m" => "N.m", "rad/s^2" => "rad/s2".
std::string fmi_unit(std::string unit) {
  std::replace(unit.begin(), unit.end(), ' ', '.');
  std::erase(unit, '^');
  return unit;
}

class Lister {
 public:
  explicit Lister(PlantVariables& list) : list_(list) {}

  void add(Causality causality, VariableType type, std::string name, std::string unit, std::string words,
           double start = 0) {
    list_.all.push_back({std::move(name), std::move(unit), std::move(words), type, causality, start});
    ++(causality == Causality::parameter ? list_.parameters
       : causality == Causality::input   ? list_.inputs
                                         : list_.outputs);
  }
  void out(std::string name, const std::string& unit, std::string words) {
    add(Causality::output, VariableType::real, std::move(name), unit, std::move(words));
  }
  void out_flag(std::string name, std::string words) {
    add(Causality::output, VariableType::boolean, std::move(name), "", std::move(words));
  }
  void out_whole(std::string name, std::string words) {
    add(Causality::output, VariableType::whole, std::move(name), "", std::move(words));
  }
  void out_array(const std::string& name, int size, const std::string& unit, const std::string& words) {
    for (int k = 1; k <= size; ++k) out(name + "[" + std::to_string(k) + "]", unit, words);
  }
  void out_target(const std::string& of) {
    out_array(of + "position", 3, "m", "Origin of the target, in W");
    out_array(of + "quaternion_wxyz", 4, "1", "Orientation of the target in W");
    out_array(of + "velocity", 3, "m/s", "Of the origin of the target, in W");
    out_array(of + "angular_velocity", 3, "rad/s", "Of the target, in its axes");
  }
  void signal(Causality causality, const ControllerSignal& signal, const std::string& prefix, bool is_prismatic) {
    using Kind = ControllerSignal::Kind;
    const VariableType type = signal.kind == Kind::real    ? VariableType::real
                              : signal.kind == Kind::whole ? VariableType::whole
                                                           : VariableType::boolean;
    for (int k = 0; k < signal.size; ++k)
      add(causality, type, prefix + signal.plant + (signal.size > 1 ? fmt::format("[{}]", k + 1) : ""),
          type == VariableType::real ? fmi_unit(signal_unit(signal, k, is_prismatic)) : "", signal.text);
  }

 private:
  PlantVariables& list_;
};

// "joint.NAME." of the variables of a joint.
std::string prefix_of(SignalOwner owner, const std::string& name) {
  if (owner == SignalOwner::run) return {};
  std::string kind = owner_name(owner);
  std::replace(kind.begin(), kind.end(), '-', '_');
  return name.empty() ? kind + "." : fmt::format("{}.{}.", kind, name);
}

// Calls `target` for the motion of each target, and `signal` for each signal of an owner, in the order of the outputs.
template <class OnTarget, class OnSignal>
void for_each_output(const ControlledRobot& robot, const OnTarget& target, const OnSignal& signal) {
  using Owner = SignalOwner;
  for (const Owner owner :
       {Owner::run, Owner::joint, Owner::base, Owner::end_effector, Owner::wheel, Owner::gyro, Owner::target}) {
    for (std::size_t i = 0; i < owner_count(owner, robot); ++i) {
      if (owner == Owner::target) target(i);
      for (std::size_t s = 0; s < kInputSignals; ++s) {
        const ControllerSignal& about = input_signals[s].about;
        if (about.owner == owner && about.plant && is_sensed(input_signals[s], i, robot)) signal(s, i);
      }
    }
  }
}

void list_end(const CaptureProblem& plant, Lister& list) {
  list.out_flag("end.ended",
                "Whether the run has ended; the following outputs are valid then, and zero or false before");
  list.out_flag("end.completed", "Whether the run completed");
  list.out_flag("end.conserved", "Whether all conservation checks passed");
  list.out_flag("end.feasible", "Whether joint limits and clearances were checked and satisfied");
  list.out("end.capture_time", "s", "Planned closing time of the grasps");
  list.out("end.linear_momentum_drift", "1", "Row of the ledger");
  list.out("end.angular_momentum_drift", "1", "Row of the ledger");
  list.out("end.work_energy_residual", "1", "Row of the ledger");
  list.out("end.energy_drift", "1", "Row of the ledger");
  list.out("end.impact_energy_lost", "J", "By the first impact");
  for (std::size_t i = 0; i < plant.grasps.size(); ++i)
    list.out_flag("end.captured[" + std::to_string(i + 1) + "]",
                  "Whether " + plant.grasps[i].end_effector + " captured " + plant.grasps[i].target);
}

}  // namespace

PlantVariables plant_variables(const CaptureProblem& plant, const std::vector<PlantParameter>& parameters) {
  const CaptureSystem system = make_capture_system(plant);
  PlantVariables variables;
  ControlledRobot& robot = variables.robot;
  robot = controlled_parts(plant);
  std::vector<bool> prismatic;
  for (const int j : system.robot_joints) {
    const JointDescription& joint = system.model.joint_body(j).description.joint;
    robot.joints.push_back(joint.name), prismatic.push_back(joint.type == JointType::prismatic);
  }
  Lister list(variables);
  for (const PlantParameter& parameter : parameters)
    list.add(Causality::parameter, VariableType::real, parameter.path, parameter.unit,
             "Value of the scenario, in SI units", parameter.start);
  const auto list_signal = [&](Causality causality, const ControllerSignal& signal, std::size_t i) {
    list.signal(causality, signal, prefix_of(signal.owner, owner_names(signal.owner, robot)[i]),
                signal.owner == SignalOwner::joint && prismatic[i]);
  };
  for (const CommandSignal& command : command_signals) {
    if (!is_commanded(command, robot)) continue;
    for (std::size_t i = 0; i < owner_count(command.about.owner, robot); ++i)
      list_signal(Causality::input, command.about, i);
  }
  list.out_whole("phase", "0: approach; 1: after the impact; 2: the run has ended");
  for_each_output(
      robot, [&](std::size_t i) { list.out_target(prefix_of(SignalOwner::target, robot.targets[i].name)); },
      [&](std::size_t s, std::size_t i) { list_signal(Causality::output, input_signals[s].about, i); });
  list_end(plant, list);
  return variables;
}

std::vector<double> PlantOutputs::numbers(const ControlledRobot& robot) const {
  std::vector<double> list{static_cast<double>(phase)};
  const auto add = [&](std::initializer_list<double> numbers) { list.insert(list.end(), numbers); };
  for_each_output(
      robot,
      [&](std::size_t i) {
        const Motion& m = targets.at(i);
        add({m.position[0], m.position[1], m.position[2]});
        add({m.quaternion_wxyz.w, m.quaternion_wxyz.x, m.quaternion_wxyz.y, m.quaternion_wxyz.z});
        add({m.velocity[0], m.velocity[1], m.velocity[2]});
        add({m.angular_velocity[0], m.angular_velocity[1], m.angular_velocity[2]});
      },
      [&](std::size_t s, std::size_t i) {
        const auto size = static_cast<std::size_t>(input_signals[s].about.size);
        for (std::size_t k = i * size; k < (i + 1) * size; ++k) list.push_back(signals[s].at(k));
      });
  for (const bool flag : {end.ended, end.completed, end.conserved, end.feasible}) add({flag ? 1.0 : 0.0});
  add({end.capture_time, end.linear_momentum_drift, end.angular_momentum_drift, end.work_energy_residual,
       end.energy_drift, end.impact_energy_lost});
  for (const char captured : end.captured) add({static_cast<double>(captured)});
  return list;
}

}  // namespace grapnel
