#include "grapnel/contact/contact_peaks.hpp"

namespace grapnel {

// Step => larger peaks; the centre of the forces needs an evaluation at the time of the peak.
void ContactPeaks::step(const ContactSet& contacts, double begin, double end, bool fresh,
                        const std::function<void(double t)>& evaluate) {
  const std::size_t n = peaks_.size();
  search_.step(begin, end, fresh, [&](double t, std::span<double> values) {
    evaluate(t);
    for (std::size_t g = 0; g < n; ++g) {
      const GroupContact& group = contacts.group(g);
      values[g] = group.normal_force, values[n + g] = group.depth;
      peaks_[g].beyond_model = peaks_[g].beyond_model || group.beyond_model;
    }
  });
  for (std::size_t g = 0; g < n; ++g) {
    const Peak &force = search_.peaks()[g], &depth = search_.peaks()[n + g];
    ContactPeak& peak = peaks_[g];
    peak.depth = depth.magnitude;
    if (!(force.magnitude > peak.force)) continue;
    evaluate(force.time);
    peak.force = force.magnitude, peak.time = force.time, peak.p_WC = contacts.group(g).p_WC;
  }
}

}  // namespace grapnel
