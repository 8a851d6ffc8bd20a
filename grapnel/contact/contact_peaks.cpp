#include "grapnel/contact/contact_peaks.hpp"

#include <algorithm>
#include <limits>

namespace grapnel {

// A group that is beyond the model at a time of the step => the begin of this overlap, by bisection from the begin of
// the step.
ContactPeak::Limit ContactPeaks::limit_of(const ContactSet& contacts, std::size_t group, double begin, double beyond,
                                          const std::function<void(double t)>& evaluate) {
  double within = begin;
  const auto is_beyond = [&](double t) {
    evaluate(t);
    return contacts.group(group).beyond_model;
  };
  if (is_beyond(begin)) return {begin, contacts.group(group).depth};
  while (true) {
    const double middle = 0.5 * (within + beyond);
    if (!(within < middle && middle < beyond)) break;
    (is_beyond(middle) ? beyond : within) = middle;
  }
  evaluate(beyond);
  return {beyond, contacts.group(group).depth};
}

// Step => larger peaks; the centre of the forces needs an evaluation at the time of the peak.
void ContactPeaks::step(const ContactSet& contacts, double begin, double end, bool fresh,
                        const std::function<void(double t)>& evaluate) {
  const std::size_t n = peaks_.size();
  constexpr double kNever = std::numeric_limits<double>::infinity();
  beyond_.assign(n, kNever);
  search_.step(begin, end, fresh, [&](double t, std::span<double> values) {
    evaluate(t);
    for (std::size_t g = 0; g < n; ++g) {
      const GroupContact& group = contacts.group(g);
      values[g] = group.normal_force, values[n + g] = group.depth;
      if (group.beyond_model) beyond_[g] = std::min(beyond_[g], t);
    }
  });
  for (std::size_t g = 0; g < n; ++g) {
    const Peak &force = search_.peaks()[g], &depth = search_.peaks()[n + g];
    ContactPeak& peak = peaks_[g];
    peak.depth = depth.magnitude;
    if (!peak.beyond_model && beyond_[g] < kNever)
      peak.beyond_model = limit_of(contacts, g, begin, beyond_[g], evaluate);
    if (!(force.magnitude > peak.force)) continue;
    evaluate(force.time);
    peak.force = force.magnitude, peak.time = force.time, peak.p_WC = contacts.group(g).p_WC;
  }
}

}  // namespace grapnel
