#pragma once

/// @file
/// What an optimization file varies.

#include <string>

#include "grapnel/study/optimization_moves.hpp"
#include "grapnel/study/quantity.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// An item of 'variables'. Only the members of its kind are in use.
struct SearchedVariable {
  enum class Kind { path, quantity, patch, posture };
  Kind kind = Kind::path;
  std::string name;   // as tables have it
  std::string unit;   // of from and to
  std::string place;  // "variables[0]", for messages
  Mark mark, from_mark, to_mark;
  double from = 0, to = 1;
  std::string path;
  Mark path_mark;
  Quantity quantity;
  bool in_degrees = false;
  ContactPatch patch;

  double in_si(double value) const;
};

/// A variable whose structure has been checked. `base`: the scenario, whose names it may use; null if there is none.
SearchedVariable read_searched_variable(const Node& node, const std::string& place, const CaptureProblem* base,
                                        FaultList& faults);

}  // namespace grapnel
