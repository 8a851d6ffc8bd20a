// The states, inputs and outputs of a linear model: their names, and what they are in the model of the bodies.
#include <fmt/format.h>

#include <algorithm>

#include "grapnel/linear/linear_variables.hpp"

namespace grapnel {
namespace {

using Variable = LinearModel::Variable;
constexpr std::string_view kAxes[] = {"x", "y", "z"};

// --- Names ---

// A velocity of the model: the name and unit of its position and rate. Bodies are named as in time series; those of
// targets without the prefix of the model.
struct CoordinateName {
  std::string position, position_unit, rate, rate_unit;
};

std::string group_of(const CaptureProblem& problem, const Body& body) {
  const std::string& name = body.description.name;
  if (name == problem.robot.base) return "base";
  for (const TargetSetup& target : problem.targets) {
    if (name == target_body_name(target.name)) return "targets/" + target.name;
  }
  return "bodies/" + name;
}

CoordinateName single_name(const CaptureProblem& problem, const JointDescription& joint, int k) {
  const bool slides = slides_along_axis(joint.type);
  const std::string unit = slides ? "m" : "rad", rate = slides ? "m/s" : "rad/s";
  for (const WheelSetup& wheel : problem.robot.wheels) {
    if (joint.name == wheel_body_name(wheel.name))
      return {"wheels/angle/" + wheel.name, unit, "wheels/rate/" + wheel.name, rate};
  }
  const std::string name = joint.name + (velocity_count(joint.type) > 1 ? fmt::format("/{}", k + 1) : "");
  return {"joints/position/" + name, unit, "joints/velocity/" + name, rate};
}

std::vector<CoordinateName> names_of(const OperatingPoint& point) {
  std::vector<CoordinateName> names(static_cast<std::size_t>(point.model().velocities()));
  for (const Body& body : point.model().bodies()) {
    const JointDescription& joint = body.description.joint;
    for (int k = 0; k < velocity_count(joint.type); ++k) {
      CoordinateName& name = names[static_cast<std::size_t>(body.v + k)];
      const std::string axis(kAxes[k % 3]);
      if (joint.type == JointType::free) {
        const std::string group = group_of(point.problem, body);
        name = k < 3 ? CoordinateName{group + "/rotation/" + axis, "rad", group + "/angular_velocity/" + axis, "rad/s"}
                     : CoordinateName{group + "/displacement/" + axis, "m", group + "/velocity/" + axis, "m/s"};
      } else if (joint.type == JointType::spherical) {
        name = {"joints/rotation/" + joint.name + "/" + axis, "rad",
                "joints/angular_velocity/" + joint.name + "/" + axis, "rad/s"};
      } else {
        name = single_name(point.problem, joint, k);
      }
    }
  }
  return names;
}

// Per velocity the coordinate of its joint in State::q, of joints with one axis; -1 for others.
std::vector<int> coordinates_of_velocities(const Model& model) {
  std::vector<int> q(static_cast<std::size_t>(model.velocities()), -1);
  for (const Body& body : model.bodies()) {
    const JointType type = body.description.joint.type;
    if (type == JointType::free || type == JointType::spherical) continue;
    for (int k = 0; k < velocity_count(type); ++k) q[static_cast<std::size_t>(body.v + k)] = body.q + k;
  }
  return q;
}

// The twist of a body, in its axes.
Eigen::VectorXd own_twist(const Kinematics& kinematics, int body) {
  const Posed& X = kinematics.X_WB[static_cast<std::size_t>(body)];
  const Twistd& V = kinematics.V_WB[static_cast<std::size_t>(body)];
  const Vector3d w = transposed_times(X.R, V.angular), v = transposed_times(X.R, V.linear);
  return (Eigen::VectorXd(6) << w[0], w[1], w[2], v[0], v[1], v[2]).finished();
}

}  // namespace

std::vector<Variable> states_of(const OperatingPoint& point, const MinimalCoordinates& coordinates) {
  const std::vector<CoordinateName> names = names_of(point);
  const std::vector<int> q = coordinates_of_velocities(point.model());
  std::vector<Variable> states, rates;
  for (const int v : coordinates.independent()) {
    const CoordinateName& name = names[static_cast<std::size_t>(v)];
    const int at = q[static_cast<std::size_t>(v)];
    states.push_back({name.position, name.position_unit, {}});
    if (at >= 0) states.back().value = point.state.q[static_cast<std::size_t>(at)];
    rates.push_back({name.rate, name.rate_unit, point.state.v[static_cast<std::size_t>(v)]});
  }
  states.insert(states.end(), rates.begin(), rates.end());
  return states;
}

std::vector<std::string> names_of(const std::vector<Variable>& variables) {
  std::vector<std::string> names;
  for (const Variable& one : variables) names.push_back(one.name);
  return names;
}

// Inputs: efforts of the robot's joints and wheels, the wrench on the base, thrusts.
std::vector<LinearInput> inputs_of(const OperatingPoint& point, const Eigen::VectorXd& commands) {
  const Model& model = point.model();
  const auto unit = [&](int v) { return Eigen::VectorXd(Eigen::VectorXd::Unit(model.velocities(), v)); };
  std::vector<LinearInput> inputs;
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.joint_body(j);
    const JointDescription& joint = body.description.joint;
    if (point.elsewhere[static_cast<std::size_t>(body.v)] || joint.spring || !joint.mimic.empty() || joint.modal)
      continue;
    if (joint.name.starts_with("grasp:") || joint.name.starts_with("target:")) continue;
    const CoordinateName name = single_name(point.problem, joint, 0);
    const std::string what = name.position.starts_with("wheels/")
                                 ? "wheels/torque/" + name.position.substr(std::string_view("wheels/angle/").size())
                                 : "joints/effort/" + joint.name;
    inputs.push_back(
        {{what, slides_along_axis(joint.type) ? "N" : "N m", commands[static_cast<Eigen::Index>(j)]}, unit(body.v)});
  }
  if (!point.has_free_base()) return inputs;
  const auto joints = static_cast<Eigen::Index>(model.joints().size());
  for (int k = 0; k < 6; ++k) {
    const std::string axis(kAxes[k % 3]);
    inputs.push_back(
        {{(k < 3 ? "base/torque/" : "base/force/") + axis, k < 3 ? "N m" : "N", k < 3 ? commands[joints + k] : 0.0},
         unit(point.base_velocity() + k)});
  }
  for (const ThrusterSetup& thruster : point.problem.robot.thrusters) {
    Eigen::VectorXd force = Eigen::VectorXd::Zero(model.velocities());
    const Vector3d moment = cross(thruster.position, thruster.direction);
    for (int k = 0; k < 3; ++k) {
      force[point.base_velocity() + k] = moment[k];
      force[point.base_velocity() + 3 + k] = thruster.direction[k];
    }
    inputs.push_back({{"thrusters/thrust/" + thruster.name, "N", 0.0}, force});
  }
  return inputs;
}

// Outputs: positions and rates of joints, pose and twist of the base in its axes, twists of the targets that are
// connected with it, in theirs.
LinearOutputs outputs_of(const OperatingPoint& point, const MinimalCoordinates& coordinates) {
  const Model& model = point.model();
  const Eigen::Index n = model.velocities();
  const std::vector<CoordinateName> names = names_of(point);
  std::vector<int> positions, rates, targets;
  LinearOutputs outputs;
  const std::vector<int> q = coordinates_of_velocities(model);
  const auto add = [&](bool is_rate, int v) {
    const CoordinateName& name = names[static_cast<std::size_t>(v)];
    (is_rate ? rates : positions).push_back(v);
    const int at = q[static_cast<std::size_t>(v)];
    std::optional<double> value;
    if (is_rate) value = point.state.v[static_cast<std::size_t>(v)];
    if (!is_rate && at >= 0) value = point.state.q[static_cast<std::size_t>(at)];
    outputs.variables.push_back(
        {is_rate ? name.rate : name.position, is_rate ? name.rate_unit : name.position_unit, value});
  };
  for (const bool is_rate : {false, true}) {
    for (std::size_t j = 0; j < model.joints().size(); ++j) {
      if (!point.elsewhere[static_cast<std::size_t>(model.joint_body(j).v)]) add(is_rate, model.joint_body(j).v);
    }
    for (int k = 0; k < 6 && point.has_free_base(); ++k) add(is_rate, point.base_velocity() + k);
  }
  const Kinematics here = forward_kinematics(model, point.state);
  for (const TargetSetup& target : point.problem.targets) {
    const int body = model.body_index(target_body_name(target.name));
    const Body& root = model.bodies()[static_cast<std::size_t>(model.bodies()[static_cast<std::size_t>(body)].root)];
    if (root.description.joint.type == JointType::free && point.elsewhere[static_cast<std::size_t>(root.v)]) continue;
    targets.push_back(body);
    const Eigen::VectorXd twist = own_twist(here, body);
    for (int k = 0; k < 6; ++k)
      outputs.variables.push_back(
          {fmt::format("targets/{}/{}/{}", target.name, k < 3 ? "angular_velocity" : "velocity", kAxes[k % 3]),
           k < 3 ? "rad/s" : "m/s", twist[k]});
  }
  outputs.at = [&model, &coordinates, n, positions, rates, targets](const State& state) {
    const Eigen::VectorXd deviation = coordinates.deviation(state);
    const auto of_targets = static_cast<Eigen::Index>(6 * targets.size());
    Eigen::VectorXd y(static_cast<Eigen::Index>(positions.size() + rates.size()) + of_targets);
    y << Eigen::VectorXd(deviation.head(n)(positions)), Eigen::VectorXd(deviation.tail(n)(rates)),
        Eigen::VectorXd::Zero(of_targets);
    const Kinematics kinematics = forward_kinematics(model, state);
    for (std::size_t i = 0; i < targets.size(); ++i)
      y.segment(y.size() - of_targets + static_cast<Eigen::Index>(6 * i), 6) = own_twist(kinematics, targets[i]);
    return y;
  };
  return outputs;
}

}  // namespace grapnel
