#pragma once

/// @file
/// Peaks of contacts between shapes during a motion: of a pair's normal force and depth, found step by step on the
/// integrator's dense output. Thread safety: one thread at a time.

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/integrate/peak_search.hpp"

namespace grapnel {

/// Largest values of a group of a ContactSet.
struct ContactPeak {
  double force = 0;                  // sum of the normal forces [N]
  double time = 0;                   // of this force [s]
  Vector3d p_WC = Vector3d::zero();  // centre of the normal forces then, in W
  double depth = 0;                  // [m]
  /// The first overlap that was too deep for the model: its begin [s], and the depth then [m].
  struct Limit {
    double time, depth;
  };
  std::optional<Limit> beyond_model = {};
};

class ContactPeaks {
 public:
  explicit ContactPeaks(std::size_t groups = 0) : search_(2 * groups, 2 * groups), peaks_(groups) {}

  /// Adds a step from `begin` to `end`. `evaluate`: evaluates `contacts` at a time within it. `fresh`: see PeakSearch.
  void step(const ContactSet& contacts, double begin, double end, bool fresh,
            const std::function<void(double t)>& evaluate);

  std::span<const ContactPeak> peaks() const { return peaks_; }

 private:
  static ContactPeak::Limit limit_of(const ContactSet& contacts, std::size_t group, double begin, double beyond,
                                     const std::function<void(double t)>& evaluate);

  PeakSearch search_;  // forces of all groups, then depths
  std::vector<ContactPeak> peaks_;
  std::vector<double> beyond_;  // scratch: the first time in the step at which a group is beyond the model [s]
};

}  // namespace grapnel
