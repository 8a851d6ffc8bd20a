#pragma once

/// @file
/// Mass and stiffness matrices of finite-element models in formats of structural analysis programs: Matrix Market or
/// Abaqus's matrix output (.mtx), a table (.csv), CalculiX's matrix storage (.mas, .sti, with the .dof file beside it),
/// Nastran's DMIG entries (.pch, .bdf, .dat, .nas, .dmig) and OUTPUT4 (.op4), text or binary.

#include <Eigen/SparseCore>
#include <compare>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel {

/// A degree of freedom of a node: translations along x, y and z (components 1 to 3) and rotations about them (4 to 6);
/// component 0: a scalar coordinate, such as that of a mode.
struct ElementDof {
  long long node = 0;
  int component = 0;

  std::string text() const;  // "node 12, component 3"
  friend auto operator<=>(const ElementDof&, const ElementDof&) = default;
};

struct ElementMatrix {
  std::string name;               // of the file, and of the matrix in it if named
  Eigen::SparseMatrix<double> A;  // symmetric, both triangles
  std::vector<ElementDof> dofs;   // of its rows; empty if no file names them
  /// Nodes whose components are in another coordinate system than the model's, with its number.
  std::map<long long, long long> rotated_nodes = {};

  int size() const { return static_cast<int>(A.rows()); }
};

/// Reads a matrix; the extension of the file selects the format. `wanted` names one of several matrices in a file; if
/// it is empty, the only matrix or the one whose name begins with `initial` (M or K) is read. A single triangle in a
/// file is completed; other matrices must be symmetric. `names` is a file with the names of the rows, for formats
/// without names; if it is empty, a file with the matrix's name and the ending .dof is read if it exists. Empty after
/// an error.
std::optional<ElementMatrix> read_element_matrix(const std::filesystem::path& path, const std::string& wanted,
                                                 char initial, FaultList& faults,
                                                 const std::filesystem::path& names = {});

/// Gives both matrices the rows of both, in the same order: named rows are matched by name, since files omit zero rows;
/// others by position. If names repeat, as for shells and beams that CalculiX expands to solids, both must name the
/// same rows in the same order, which is kept. Adds an error and returns false if they do not match.
bool align(ElementMatrix& mass, ElementMatrix& stiffness, FaultList& faults);

/// Positions of nodes: lines NODE, X, Y, Z.
struct NodePlace {
  long long node = 0;
  double x = 0, y = 0, z = 0;  // in the model's unit
  Mark mark;
};
std::vector<NodePlace> read_node_places(const std::filesystem::path& path, FaultList& faults);

}  // namespace grapnel
