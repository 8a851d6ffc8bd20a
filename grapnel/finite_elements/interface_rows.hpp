#pragma once

/// @file
/// Which rows of a model's matrices are its interface's, and how they follow it. Internal to this module.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "grapnel/finite_elements/component_modes.hpp"

namespace grapnel {

/// Rows at the interface, their motion for each of its six, and all other rows.
struct ModelParts {
  std::vector<int> boundary, inner;
  Eigen::MatrixXd motion;  // boundary x 6: [translation; rotation]
};

/// Of matrices that align() has made. Empty after a fault.
std::optional<ModelParts> interface_rows(const ElementMatrix& mass, const ElementMatrix& stiffness,
                                         const ElementInterface& interface, FaultList& faults);

}  // namespace grapnel
