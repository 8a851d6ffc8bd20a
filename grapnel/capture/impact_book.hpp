#pragma once

/// @file
/// The ledger's rows about impacts: the largest residual over all of a run. Thread safety: one thread at a time.

#include <array>
#include <optional>

#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/result/ledger.hpp"

namespace grapnel {

class ImpactBook {
 public:
  void note(const ImpactSolution& solution);
  /// Of an impulse that locks joints.
  void note_brake(double energy_identity_residual);
  /// Nothing where there was no impact.
  void write(Ledger& ledger) const;

 private:
  std::optional<std::array<double, 3>> residuals_;  // momentum, energy, constraint
  std::optional<double> brake_;
};

}  // namespace grapnel
