#pragma once

/// @file
/// The rows of a model's matrices that form its interface, and their motions with it. Internal to this module.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "grapnel/import/component_modes.hpp"

namespace grapnel {

/// Rows of the interface, their motions for each of its six motions, and all other rows.
struct ModelParts {
  std::vector<int> boundary, inner;
  Eigen::MatrixXd motion;  // boundary x 6: [translation; rotation]
};

/// For matrices from align(). Empty after an error.
std::optional<ModelParts> interface_rows(const ElementMatrix& mass, const ElementMatrix& stiffness,
                                         const ElementInterface& interface, FaultList& faults);

}  // namespace grapnel
