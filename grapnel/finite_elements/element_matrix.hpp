#pragma once

/// @file
/// Mass and stiffness matrices of finite-element models, as programs of structural analysis write them: Matrix Market
/// or Abaqus' matrix output (.mtx), a table (.csv), CalculiX's matrix storage (.mas, .sti, with the .dof beside),
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

/// A degree of freedom: of a node the translations along x, y and z (components 1 to 3) and the rotations about them (4
/// to 6); component 0: a coordinate of its own, such as that of a mode.
struct ElementDof {
  long long node = 0;
  int component = 0;

  std::string text() const;  // "node 12, component 3"
  friend auto operator<=>(const ElementDof&, const ElementDof&) = default;
};

struct ElementMatrix {
  std::string name;               // of the file, and of the matrix in it where that has one
  Eigen::SparseMatrix<double> A;  // symmetric, both triangles
  std::vector<ElementDof> dofs;   // of its rows; empty where no file names them
  /// Nodes whose components are along the axes of another coordinate system than the model's, with its number.
  std::map<long long, long long> rotated_nodes = {};

  int size() const { return static_cast<int>(A.rows()); }
};

/// Reads a matrix; the file's name says in which format it is. `wanted` names one of several in a file; where it is
/// empty that is the one in the file, or of several the one whose name begins with `initial` (M or K). Matrices of
/// which a file has one triangle are completed, others must be symmetric. `names` is a file with the names of the rows,
/// for formats that have none; where it is empty a file with the matrix's name and the ending .dof is read if there is
/// one. Empty after a fault.
std::optional<ElementMatrix> read_element_matrix(const std::filesystem::path& path, const std::string& wanted,
                                                 char initial, FaultList& faults,
                                                 const std::filesystem::path& names = {});

/// Both with the rows of both, in one order: rows that are named by their names, of which a file leaves out those that
/// are zero; others as they stand. Where names repeat, as those of shells and beams that CalculiX expands to solids do,
/// both must name the same rows in the same order, which is kept. A fault, and false, if they do not belong together.
bool align(ElementMatrix& mass, ElementMatrix& stiffness, FaultList& faults);

/// Places of nodes: lines NODE, X, Y, Z.
struct NodePlace {
  long long node = 0;
  double x = 0, y = 0, z = 0;  // in the model's unit
  Mark mark;
};
std::vector<NodePlace> read_node_places(const std::filesystem::path& path, FaultList& faults);

}  // namespace grapnel
