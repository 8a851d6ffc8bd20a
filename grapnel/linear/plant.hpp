#pragma once

/// @file
/// Private to this module: the linear model of a system without laws.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "grapnel/linear/linear_variables.hpp"
#include "grapnel/linear/operating_point.hpp"

namespace grapnel {

/// x' = A x + B u, and the estimated error of each entry of A.
struct Plant {
  Eigen::MatrixXd A, B, error;
};

/// The system without laws, under the constant generalized forces of the operating point, (27.3) and (27.4).
Plant plant_of(const OperatingPoint& point, MinimalCoordinates& coordinates, const PhaseSetup& setup,
               const Eigen::VectorXd& commands, const std::vector<LinearInput>& inputs);

/// Its A in closed form, (27.4a); absent with an orbit's field, loads, slipping grasps or tendons, where redundant
/// loops leave no derivative, or where the simulated accelerations differ, as by sticking friction at rate zero. By
/// differences, always. `constant`: generalized forces.
std::optional<Derivative> analytical_rates(const OperatingPoint& point, MinimalCoordinates& coordinates,
                                           const PhaseSetup& setup, const Eigen::VectorXd& constant);
Derivative rates_by_differences(const OperatingPoint& point, MinimalCoordinates& coordinates, const PhaseSetup& setup,
                                const Eigen::VectorXd& constant);

}  // namespace grapnel
