#pragma once

/// @file
/// The time series of contacts between shapes.

#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

/// Two bodies that may touch, at a sample. All shapes of a body together.
struct ContactSample {
  bool touches = false;
  Vector3d point = Vector3d::zero();       // centre of the normal forces, in W [m]; only if it touches
  Vector3d force_on_b = Vector3d::zero();  // on the second body, normal and friction, in W [N]
  double normal_force = 0;                 // sum of the magnitudes at all places [N]
  double depth = 0;                        // largest penetration, of both surfaces together [m]
  // Of a hard pair, since the run began:
  double impacts = 0;         // number
  double impact_impulse = 0;  // sum of their normal impulses [N s]
};

/// A pair of the series, by the names in CaptureResult::contacts.
struct ContactSeriesPair {
  std::string a, b;
  bool hard = false;
};

/// Declares the series of all pairs and writes their samples.
class ContactSeries {
 public:
  explicit ContactSeries(std::vector<ContactSeriesPair> pairs) : pairs_(std::move(pairs)) {}

  /// contacts/A--B/force, normal_force, point and depth of each pair, and of hard pairs also impacts and
  /// impact_impulse, without values.
  std::vector<Series> series() const;
  /// Writes one sample of each pair, in their order; empty: all bodies are apart. Bodies that are apart have no point:
  /// NaN.
  void put(std::span<const ContactSample> samples, SeriesRow& row) const;

 private:
  std::vector<ContactSeriesPair> pairs_;
};

}  // namespace grapnel
