#include "grapnel/study/grid.hpp"

#include <cmath>

namespace grapnel {

std::vector<std::size_t> grid_position(std::span<const std::size_t> sizes, std::size_t point) {
  std::vector<std::size_t> position(sizes.size());
  for (std::size_t axis = sizes.size(); axis-- > 0;) {
    position[axis] = point % sizes[axis];
    point /= sizes[axis];
  }
  return position;
}

std::vector<double> spaced_values(double from, double to, std::size_t count, bool logarithmic) {
  std::vector<double> values(count, from);
  const double last = static_cast<double>(count) - 1;
  for (std::size_t i = 1; i < count; ++i) {
    const double at = static_cast<double>(i);
    // In this form 0 to 0.2 in 20 steps has 0.01, not its neighbour.
    values[i] = logarithmic ? from * std::pow(to / from, at / last) : (from * (last - at) + to * at) / last;
  }
  if (count > 1) values.back() = to;
  return values;
}

}  // namespace grapnel
