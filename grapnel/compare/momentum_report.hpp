#pragma once

/// @file
/// Momentum and energy of measured motion, in the reports of comparisons and impulses.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace grapnel {

struct MomentumCurve;

/// A component of an impulse, or of a momentum.
struct MeasuredComponent {
  std::string name, unit;
  bool determined = false;
  std::optional<double> value, uncertainty, simulated;
};

/// Of the robot or a target, at the first and the last time.
struct MomentumReport {
  std::string body;
  std::vector<std::string> missing;
  std::size_t samples = 0;
  std::vector<MeasuredComponent> first, last;
};

std::vector<MomentumReport> momentum_report(std::span<const MomentumCurve> curves);

/// The table of the terminal, with the determined components, and what would determine more.
std::string momentum_report_text(std::span<const MomentumReport> report);

}  // namespace grapnel
