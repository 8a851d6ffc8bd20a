#pragma once

/// @file
/// Residuals of a log against a run, and the offset between their clocks.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/compare/run_curve.hpp"
#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// Maximum number of components of a quantity.
inline constexpr std::size_t kMostComponents = 64;

/// A measured quantity and its simulated course, in one unit and along the same axes.
struct ComparedQuantity {
  std::string name;                     ///< unique
  std::string run;                      ///< the run's series
  std::string unit;                     ///< of the residuals: SI
  std::vector<std::string> components;  ///< of the residuals
  std::vector<std::string> columns;     ///< of the log
  std::vector<double> time;             ///< of the log's clock [s], does not decrease
  std::vector<double> measured;         ///< run.width() numbers per sample; NaN: missing
  RunCurve curve;
  bool is_orientation = false;             ///< quaternions w, x, y, z; residuals are rotation vectors
  std::optional<double> uncertainty;       ///< standard uncertainty of each sample and component
  std::optional<double> bias_uncertainty;  ///< of an error that all samples of a component share
  bool aligns = true;                      ///< takes part in the search for the offset

  // How the log states it, for computations with the model.
  std::string series = {};                     ///< of the run, without the component
  std::optional<std::size_t> component = {};   ///< of the series; empty: all
  std::string frame = {};                      ///< body in whose axes vectors are; empty: W
  Quaterniond axes = Quaterniond::identity();  ///< of the log in that frame
  Vector3d origin = Vector3d::zero();          ///< of positions, in W [m]
  double average = 0;                          ///< [s] before each time stamp

  std::size_t residual_width() const { return is_orientation ? 3 : curve.width(); }
  std::size_t samples() const { return time.size(); }
};

/// measured - simulated for a sample, at this time of the run. Where log and run have the same number of samples at one
/// time, as at a jump in the run's own exports, the sample is compared with its counterpart. For orientations the
/// rotation vector from the simulated to the measured one, in the measured body's axes. NaN where either is missing.
void residual_of(const ComparedQuantity& quantity, std::size_t sample, double run_time, std::span<double> out);

/// The relation of the clocks: run time = log time + offset + drift (log time - reference).
struct LogClock {
  double offset = 0;     ///< [s]
  double drift = 0;      ///< [1]
  double reference = 0;  ///< [s]

  double run_time(double log_time) const { return log_time + offset + drift * (log_time - reference); }
};

/// The drift that a search of the offset assumes, or searches.
struct ClockDrift {
  double value = 0;               ///< [1]
  double reference = 0;           ///< time of the log at which the clock has the offset [s]
  std::optional<double> largest;  ///< largest magnitude of a searched drift; empty: `value` is given
};

/// A clock that was found.
struct ClockOffset {
  double offset = 0;       ///< [s]
  double uncertainty = 0;  ///< standard uncertainty [s]; of uncorrelated noise
  bool is_determined = false;
  std::string why_not;          ///< reason, if it is not determined
  std::optional<double> other;  ///< another offset that fits nearly as well, as periodic motion has [s]
  double drift = 0;             ///< [1]
  double drift_uncertainty = 0;
};

/// The range of offsets for which at least half of the shorter record overlaps the other. @pre a quantity
struct OffsetRange {
  double from = 0, to = 0;
};
OffsetRange possible_offsets(std::span<const ComparedQuantity* const> quantities);

/// Minimizes the sum of Huber's loss of the weighted residuals over the offset. A constant bias of each component is
/// estimated together with the offset. Samples outside the run cost what they cost against a constant, so that an
/// offset that avoids the comparison has no advantage. Weights are the stated uncertainties, or else the noise
/// estimated from second differences of the log. A searched drift is fitted together with the offset.
/// docs/how-to/compare.md describes the method.
ClockOffset find_offset(std::span<const ComparedQuantity* const> quantities, const OffsetRange& range,
                        const ClockDrift& drift = {});

/// The inverse rotation.
inline Quaterniond conjugate(const Quaterniond& q) { return {q.w, -q.x, -q.y, -q.z}; }

/// The median of the finite values; NaN without any.
double median_of(std::vector<double> values);
/// The median interval between increasing times; NaN without any.
double median_interval(std::span<const double> time);

}  // namespace grapnel
