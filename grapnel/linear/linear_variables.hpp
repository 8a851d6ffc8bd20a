#pragma once

/// @file
/// Private to this module: the states, inputs and outputs of a linear model.

#include <functional>
#include <string>
#include <vector>

#include "grapnel/linear/operating_point.hpp"

namespace grapnel {

std::vector<LinearModel::Variable> states_of(const OperatingPoint& point, const MinimalCoordinates& coordinates);
std::vector<std::string> names_of(const std::vector<LinearModel::Variable>& variables);

struct LinearInput {
  LinearModel::Variable variable;
  Eigen::VectorXd force;  // generalized, per unit
};
/// Efforts of the robot's joints and wheels, the wrench on the base, thrusts. `commands`: EvaluatedPhase::commands().
std::vector<LinearInput> inputs_of(const OperatingPoint& point, const Eigen::VectorXd& commands);

struct LinearOutputs {
  std::vector<LinearModel::Variable> variables;
  std::function<Eigen::VectorXd(const State&)> at;
};
/// Positions and rates of joints, pose and twist of the base in its axes, twists of the targets that are connected with
/// it, in theirs. The coordinates must outlive the result.
LinearOutputs outputs_of(const OperatingPoint& point, const MinimalCoordinates& coordinates);

}  // namespace grapnel
