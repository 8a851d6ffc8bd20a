#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

const char* name_of(Sampling sampling) {
  switch (sampling) {
    case Sampling::latin_hypercube:
      return "latin_hypercube";
    case Sampling::sobol:
      return "sobol";
    case Sampling::random:
      break;
  }
  return "random";
}

const char* name_of(CampaignPlan plan) { return plan == CampaignPlan::nominal ? "nominal" : "per_case"; }

std::uint64_t Campaign::total() const {
  std::uint64_t points = 1;
  for (const StudyAxis& axis : design) points *= axis.values.size();
  return points * cases;
}

std::vector<std::size_t> Campaign::position(std::uint64_t point) const {
  std::vector<std::size_t> sizes;
  for (const StudyAxis& axis : design) sizes.push_back(axis.values.size());
  return grid_position(sizes, point);
}

}  // namespace grapnel
