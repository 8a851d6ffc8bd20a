#include "grapnel/capture/contact_series.hpp"

namespace grapnel {

std::vector<Series> ContactSeries::series() const {
  const std::vector<std::string> xyz{"x", "y", "z"};
  std::vector<Series> all;
  for (const ContactSeriesPair& pair : pairs_) {
    const std::string &a = pair.a, &b = pair.b;
    const std::string group = "contacts/" + a + "--" + b + "/";
    all.push_back({group + "force", "N", "force of " + a + " on " + b + ", in W: normal forces and friction", xyz, {}});
    all.push_back(
        {group + "normal_force", "N", "sum of the normal forces at all places of contact", {"normal_force"}, {}});
    all.push_back({group + "point", "m", "centre of the normal forces, in W; NaN while the bodies are apart", xyz, {}});
    all.push_back({group + "depth", "m", "largest penetration, of both surfaces together", {"depth"}, {}});
    if (!pair.hard) continue;
    all.push_back({group + "impacts", "1", "number of impacts in an instant so far", {"impacts"}, {}});
    all.push_back({group + "impact_impulse", "N s", "sum of the normal impulses so far", {"impulse"}, {}});
  }
  return all;
}

void ContactSeries::put(std::span<const ContactSample> samples, SeriesRow& row) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const ContactSample apart;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const ContactSample& given = samples.empty() ? apart : samples[i];
    const ContactSample& pair = given.touches ? given : apart;
    row.put(pair.force_on_b);
    row.put(pair.normal_force);
    row.put(pair.touches ? pair.point : Vector3d{kNone, kNone, kNone});
    row.put(pair.depth);
    if (!pairs_[i].hard) continue;
    row.put(given.impacts);
    row.put(given.impact_impulse);
  }
}

}  // namespace grapnel
