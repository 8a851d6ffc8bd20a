#pragma once

/// @file
/// Shells and beams that CalculiX expands to solids: each of their nodes becomes several, whose rows all have the name
/// of the first one and whose places no file tells. Internal to this module.

#include <Eigen/SparseCore>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// A row that belongs to a node of which the place before expansion is known.
struct ExpandedRow {
  int row = 0;
  long long node = 0;
  int component = 1;              // 1 to 3
  std::array<double, 3> place{};  // of the node
};

/// What rows do while the free model with this stiffness moves rigidly: for each of `rows` its motion by the six
/// motions of the origin, [translation; rotation]. The places of expanded nodes follow from three facts: the stiffness
/// of the free model has no force against a rigid motion, expanded nodes lie symmetrically about the node they come
/// from, and a rotation moves a place p by theta x p. `others` are rows of more nodes with known places. Empty, with
/// the reason, if that does not determine them.
std::optional<std::vector<std::array<double, 6>>> expanded_motions(const Eigen::SparseMatrix<double>& stiffness,
                                                                   const std::vector<ExpandedRow>& rows,
                                                                   const std::vector<ExpandedRow>& others,
                                                                   std::string& reason);

}  // namespace grapnel
