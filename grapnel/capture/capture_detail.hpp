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
  /// books look at the ends of steps, some 32 in a phase, instead of output instants. Absent: scene, time series, loads
  /// on grips (unless loops are closed), and of an impact its measures, sensitivities, null space and the published
  /// estimate.
  columns
};

}  // namespace grapnel
