#pragma once

/// @file
/// What makes one of many solutions the better one. Thread safety: plain values; values use the FloatingBase they are
/// given as scratch.

#include "grapnel/plan/goal.hpp"

namespace grapnel {

/// A number that is to be least, of final joint values. See PlanSetup::Measure.
struct Measure {
  enum class Kind { excursion, nearest, limits, manipulability, as_found };
  Kind kind = Kind::excursion;
  std::vector<double> reference;     // excursion: where the joints start; nearest: the guess
  std::vector<double> lower, upper;  // position limits, infinite where none

  /// Value, and its gradient (one entry per joint) unless null.
  /// excursion, nearest: sum (theta - reference)^2 / 2. limits: sum ((theta - middle)/(upper - lower))^2 / 2 over
  /// joints with two finite limits. manipulability: -log det(J_g J_g^T) / 2 summed over goals, of the rows that the
  /// goal constrains, dependent rows left out; its gradient by central differences. as_found: 0.
  double value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> theta,
               std::vector<double>* gradient) const;
};

}  // namespace grapnel
