#pragma once

/// @file
/// How much of a capture is worked out. Thread safety: plain values.

namespace grapnel {

enum class CaptureDetail {
  /// Everything that CaptureResult can hold.
  full,
  /// What studies and campaigns keep of a case (study/column.hpp): warnings, plan, grips, impacts with impulses,
  /// joints, energies and margins, states between phases, clearance, limits, ledger and cost. What is there is the
  /// same, bit for bit, but for the ledger: where neither clearance nor joint limits nor closed loops are watched its
  /// books look at the ends of steps, some 32 in a phase, instead of output instants; and for efforts against their
  /// limits, which are looked at where clearance is. Absent: scene, time series, loads of phases in motion (those of
  /// impacts are there), and of an impact its measures, sensitivities, null space and the published estimate.
  columns,
  /// The same with the loads of all phases: some two thirds slower, and nothing of it may be integrated in lanes.
  columns_and_loads
};

}  // namespace grapnel
