#pragma once

/// @file
/// Which velocities of a tree act on which: the zeros of its mass matrix and of the derivatives of its dynamics.

#include <vector>

#include "grapnel/model/tree.hpp"

namespace grapnel {

/// Plain arrays of DerivativesStructure, for translation units of lanes, which use no standard containers of plain
/// numbers. A list k has the entries begin[k] to begin[k + 1].
struct DerivativesTables {
  const int *before_begin, *before;  // per velocity: those between the root and it, from the root outwards
  const int *beyond_begin, *beyond;  // per velocity: those that it carries
  const int *group_begin, *group;    // per group of columns: rows that its columns reach and that carry others, inwards
};

/// Columns of a right-hand side that a solution in lanes processes together.
constexpr int kDerivativeColumns = 4;

/// Of one velocity, those between the root and it, from the root outwards; with modal joints all that precede it, as
/// projected mass matrices are dense.
std::vector<std::vector<int>> velocities_before(const Tree<double>& tree);

/// Thread safety: immutable.
class DerivativesStructure {
 public:
  explicit DerivativesStructure(const Tree<double>& tree);
  DerivativesTables tables() const {
    return {before_begin_.data(), before_.data(),      beyond_begin_.data(),
            beyond_.data(),       group_begin_.data(), group_.data()};
  }

 private:
  std::vector<int> before_begin_, before_, beyond_begin_, beyond_, group_begin_, group_;
};

}  // namespace grapnel
