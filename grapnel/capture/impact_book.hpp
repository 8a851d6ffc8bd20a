#pragma once

/// @file
/// The ledger's rows about impacts: the largest residual over all of a run. Thread safety: one thread at a time.

#include <optional>

#include "grapnel/capture/impact_report.hpp"
#include "grapnel/result/ledger.hpp"

namespace grapnel {

class ImpactBook {
 public:
  void note(const ImpactResiduals& residuals);
  /// Of an impact that took time: the residual of its balance of energy.
  void note_compliant(double energy_residual);
  /// Of an impulse that locks joints.
  void note_brake(double energy_identity_residual);
  /// Nothing where there was no impact.
  void write(Ledger& ledger) const;

 private:
  std::optional<ImpactResiduals> residuals_;
  std::optional<double> compliant_, brake_;
};

}  // namespace grapnel
