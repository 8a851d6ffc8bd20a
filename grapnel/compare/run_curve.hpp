#pragma once

/// @file
/// The simulated course of a quantity as a function of time, from the samples of a run.

#include <cstddef>
#include <span>
#include <vector>

namespace grapnel {

/// Cubic interpolation between samples. The slope at a sample is that of the parabola through it and its neighbours. At
/// a jump (two samples of one time) each side has its own slopes, and the value is that after the jump. Between samples
/// without a value (NaN) the curve has none.
class RunCurve {
 public:
  /// `values` holds `width` numbers per time; times do not decrease.
  RunCurve(std::vector<double> time, std::vector<double> values, std::size_t width);

  /// The curve as a sensor reports it that averages over the `window` [s] before its time stamp.
  RunCurve averaged(double window) const;

  std::size_t width() const { return width_; }
  double begin() const;  ///< the first time that has a value
  double end() const;
  /// Times of the jumps.
  std::vector<double> jumps() const;

  /// Writes `width` numbers; NaN outside the curve.
  void value(double time, std::span<double> out) const;
  /// The value of the sample with this place among `count` samples of exactly this time. False: the curve has another
  /// number of them, or is averaged.
  bool value_at_jump(double time, std::size_t place, std::size_t count, std::span<double> out) const;
  /// The derivative [1/s].
  void slope(double time, std::span<double> out) const;

  /// Estimated root mean square error of the interpolation, per component: the error at every second sample of a curve
  /// through the others, divided by 8, since halving the interval divides the error of smooth curves by 8 at least.
  /// NaN with fewer than five samples.
  std::vector<double> interpolation_error() const;
  /// Whether the value at this time is that of a sample, without interpolation.
  bool has_sample_at(double time) const;

  /// Time in which the curve changes by its own spread [s]: the smallest ratio over all components. Infinite for a
  /// constant.
  double characteristic_time() const;

 private:
  std::size_t interval_at(double time) const;
  bool connects(std::size_t i, std::size_t j) const;
  void set_slopes();
  void add_integral();
  double at(std::size_t interval, std::size_t component, double time) const;
  double slope_at(std::size_t interval, std::size_t component, double time) const;
  double integral_to(std::size_t interval, std::size_t component, double time) const;
  template <class Single, class Over>
  void evaluate(double time, std::span<double> out, Single single, Over over) const;

  std::size_t width_;
  std::vector<double> time_, values_, slopes_;
  double window_ = 0;
  // Of averages: the integral up to each sample, and the number of intervals without a value up to it.
  std::vector<double> integral_;
  std::vector<int> holes_;
};

}  // namespace grapnel
