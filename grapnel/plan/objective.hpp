#pragma once

/// @file
/// What makes one of many solutions the better one. Thread safety: plain values; values use the FloatingBase they are
/// given as scratch.

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/path_segment.hpp"

namespace grapnel {

/// A number that is to be least, of the final joint values and rates of a segment. See PlanSetup::Objective.
class Objective {
 public:
  enum class Kind { excursion, nearest, limits, manipulability, as_found };

  Objective() = default;
  /// For a segment that begins as `start` says. `guess` is read by nearest, limits by limits.
  Objective(Kind kind, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
            std::vector<double> upper);

  Kind kind() const { return kind_; }

  /// Derivatives with final values and rates, one per joint each.
  struct Gradient {
    std::vector<double> position, rate;
  };
  /// Value, and its gradient unless null. `rate` may be empty: zero.
  /// excursion: how much the joints move on the way,
  ///   1/2 sum_j integral_0^1 (d theta_j/dx)^2 dx / integral_0^1 s'(x)^2 dx,   x = (t - begin)/(end - begin)
  /// with s of (6.1): half the sum of squares of the ways from rest to rest, more where the rates at the ends make the
  /// joints swing. nearest: half the sum of squares of the distances from the guess. limits: the same from the middles
  /// of the ranges, over the ranges, of joints with two finite limits. manipulability: -log sqrt det(J_g J_g^T) summed
  /// over goals, of the rows that a goal constrains, dependent rows left out; its gradient by central differences.
  /// as_found: 0.
  double value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
               std::span<const double> rate, Gradient* gradient) const;

 private:
  double excursion(std::span<const double> position, std::span<const double> rate, Gradient* gradient) const;

  Kind kind_ = Kind::as_found;
  SegmentStart start_;
  std::vector<double> guess_, lower_, upper_;
  // Integrals of products of s', e', b' of (6.1) over that of s'^2.
  double se_ = 0, sb_ = 0, ee_ = 0, eb_ = 0, bb_ = 0;
};

}  // namespace grapnel
