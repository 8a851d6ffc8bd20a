#include "grapnel/plant/plant_variables.hpp"

#include "grapnel/problem/capture_system.hpp"

namespace grapnel {
namespace {

using VariableType = PlantVariable::Type;
using Causality = PlantVariable::Causality;

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
  void out_motion(const std::string& of, const std::string& whose) {
    out_array(of + ".position", 3, "m", "Origin of " + whose + ", in W");
    out_array(of + ".quaternion_wxyz", 4, "1", "Orientation of " + whose + " in W");
    out_array(of + ".velocity", 3, "m/s", "Of the origin of " + whose + ", in W");
    out_array(of + ".angular_velocity", 3, "rad/s", "Of " + whose + ", in its axes");
  }

 private:
  PlantVariables& list_;
};

void list_inputs(const CaptureProblem& plant, const std::vector<const JointDescription*>& joints, Lister& list,
                 PlantVariables& variables) {
  for (const JointDescription* joint : joints) {
    const bool slides = joint->type == JointType::prismatic;
    list.add(Causality::input, VariableType::real, "joint." + joint->name + ".effort", slides ? "N" : "N.m",
             "Commanded effort of the joint's motor; clipped at its limit");
  }
  variables.joints = joints.size();
  variables.base_torque = plant.control->base_torque;
  if (variables.base_torque) {
    for (int k = 1; k <= 3; ++k)
      list.add(Causality::input, VariableType::real, "base.torque[" + std::to_string(k) + "]", "N.m",
               "Torque on the base, in its axes; through its wheels where it has any");
  }
  if (!plant.control->base_actuators) return;
  for (const WheelSetup& wheel : plant.robot.wheels)
    list.add(Causality::input, VariableType::real, "wheel." + wheel.name + ".torque", "N.m",
             "Torque of the motor on the wheel, about its axis; clipped at its limit");
  for (const MomentGyroSetup& gyro : plant.robot.gyros)
    list.add(Causality::input, VariableType::real, "gyro." + gyro.name + ".gimbal_rate", "rad/s",
             "Commanded rate of the gimbal, relative to the base; clipped at its limit");
  for (const ThrusterSetup& thruster : plant.robot.thrusters)
    list.add(Causality::input, VariableType::boolean, "thruster." + thruster.name + ".on", "",
             "Whether the valve is open; it stays open for its minimum time");
  variables.wheels = plant.robot.wheels.size(), variables.gyros = plant.robot.gyros.size();
  variables.thrusters = plant.robot.thrusters.size();
}

void list_motion(const CaptureProblem& plant, const std::vector<const JointDescription*>& joints, Lister& list) {
  list.out_whole("phase", "0: approach; 1: after the impact; 2: the run has ended");
  list.out_whole("piece", "Number of motion segments so far minus one: increases when grasps close or open");
  for (const JointDescription* joint : joints) {
    const bool slides = joint->type == JointType::prismatic;
    const std::string name = "joint." + joint->name, unit = slides ? "m" : "rad";
    list.out(name + ".position", unit, "Sensor reading");
    list.out(name + ".rate", unit + "/s", "Sensor reading");
    list.out(name + ".desired_position", unit, "Reference value");
    list.out(name + ".desired_rate", unit + "/s", "Reference value");
    list.out(name + ".desired_acceleration", unit + "/s2", "Reference value");
  }
  list.out_motion("base", "the base");
  for (const WheelSetup& wheel : plant.robot.wheels)
    list.out("wheel." + wheel.name + ".rate", "rad/s", "Relative to the base");
  for (const MomentGyroSetup& gyro : plant.robot.gyros) {
    list.out("gyro." + gyro.name + ".angle", "rad", "Of the gimbal");
    list.out("gyro." + gyro.name + ".rate", "rad/s", "Of the gimbal, relative to the base");
  }
  for (const TargetSetup& target : plant.targets) {
    list.out_motion("target." + target.name, "the target");
    list.out_flag("target." + target.name + ".held", "Whether a grasp holds it");
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
  std::vector<const JointDescription*> joints;
  for (const int j : system.robot_joints)
    joints.push_back(&system.model.bodies()[system.model.joints()[j]].description.joint);
  PlantVariables variables;
  Lister list(variables);
  for (const PlantParameter& parameter : parameters)
    list.add(Causality::parameter, VariableType::real, parameter.path, parameter.unit,
             "Value of the scenario, in SI units", parameter.start);
  list_inputs(plant, joints, list, variables);
  list_motion(plant, joints, list);
  list_end(plant, list);
  return variables;
}

std::vector<double> PlantOutputs::numbers() const {
  std::vector<double> list{static_cast<double>(phase), static_cast<double>(piece)};
  const auto add = [&](std::initializer_list<double> numbers) { list.insert(list.end(), numbers); };
  const auto add_motion = [&](const Motion& m) {
    add({m.position[0], m.position[1], m.position[2]});
    add({m.quaternion_wxyz.w, m.quaternion_wxyz.x, m.quaternion_wxyz.y, m.quaternion_wxyz.z});
    add({m.velocity[0], m.velocity[1], m.velocity[2]});
    add({m.angular_velocity[0], m.angular_velocity[1], m.angular_velocity[2]});
  };
  for (const Joint& j : joints) add({j.position, j.rate, j.desired_position, j.desired_rate, j.desired_acceleration});
  add_motion(base);
  list.insert(list.end(), wheel_rates.begin(), wheel_rates.end());
  for (const Gimbal& gimbal : gimbals) list.insert(list.end(), {gimbal.angle, gimbal.rate});
  for (std::size_t t = 0; t < targets.size(); ++t) {
    add_motion(targets[t]);
    add({static_cast<double>(held[t])});
  }
  for (const bool flag : {end.ended, end.completed, end.conserved, end.feasible}) add({flag ? 1.0 : 0.0});
  add({end.capture_time, end.linear_momentum_drift, end.angular_momentum_drift, end.work_energy_residual,
       end.energy_drift, end.impact_energy_lost});
  for (const char captured : end.captured) add({static_cast<double>(captured)});
  return list;
}

}  // namespace grapnel
