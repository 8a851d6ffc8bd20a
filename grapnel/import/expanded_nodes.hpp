#pragma once

/// @file
/// Shells and beams that CalculiX expands to solids: each of their nodes becomes several, whose rows all have the name
/// of the original node and whose positions no file contains. Internal to this module.

#include <Eigen/SparseCore>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// A row of a node whose position before expansion is known.
struct ExpandedRow {
  int row = 0;
  long long node = 0;
  int component = 1;              // 1 to 3
  std::array<double, 3> place{};  // of the node
};

/// Motions of rows under rigid motions of the free model with this stiffness: for each of `rows` its motion for the six
/// motions of the origin, [translation; rotation]. Three facts determine the positions of expanded nodes: the stiffness
/// of the free model has no force against a rigid motion, expanded nodes are symmetric about their original node, and a
/// rotation moves a position p by theta x p. `others` are rows of further nodes with known positions. Empty, with the
/// reason, if they are not determined.
std::optional<std::vector<std::array<double, 6>>> expanded_motions(const Eigen::SparseMatrix<double>& stiffness,
                                                                   const std::vector<ExpandedRow>& rows,
                                                                   const std::vector<ExpandedRow>& others,
                                                                   std::string& reason);

}  // namespace grapnel
