#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

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
