#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

template <>
const Type& type_of<Sampling>() {
  static constexpr Choice choices[] = {choice(Sampling::random, "random"),
                                       choice(Sampling::latin_hypercube, "latin_hypercube"),
                                       choice(Sampling::sobol, "sobol")};
  static constexpr Type type = enumeration<Sampling>("Sampling", choices);
  return type;
}

template <>
const Type& type_of<CampaignPlan>() {
  static constexpr Choice choices[] = {choice(CampaignPlan::nominal, "nominal"),
                                       choice(CampaignPlan::per_case, "per_case")};
  static constexpr Type type = enumeration<CampaignPlan>("CampaignPlan", choices);
  return type;
}

// Names of choices are literals, and end as such.
const char* name_of(Sampling sampling) { return name_in_files(sampling).data(); }
const char* name_of(CampaignPlan plan) { return name_in_files(plan).data(); }

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
