#include "grapnel/study/grid.hpp"

#include <cmath>

namespace grapnel {

template <>
const Type& type_of<StudyAxis>() {
  using T = StudyAxis;
  static constexpr Field fields[] = {
      field<&T::name>("name", "path, quantity, or label of the study"),
      field<&T::unit>("unit", "unit of its numbers; empty: unknown, or no numbers"),
      field<&T::description>("description", "what the axis changes"),
      derived<[](const T& axis) { return shown_values(axis); }>("values", "as stated",
                                                                "values as in the file, or labels"),
  };
  static constexpr Type type = structure<T>("StudyAxis", "an axis of a study.", fields);
  return type;
}

std::vector<std::variant<double, std::string>> shown_values(const StudyAxis& axis) {
  std::vector<std::variant<double, std::string>> values;
  for (const AxisValue& value : axis.values) {
    if (axis.is_numeric)
      values.emplace_back(value.number);
    else
      values.emplace_back(value.label);
  }
  return values;
}

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
    // In this form 0 to 0.2 in 20 steps contains exactly 0.01.
    values[i] = logarithmic ? from * std::pow(to / from, at / last) : (from * (last - at) + to * at) / last;
  }
  if (count > 1) values.back() = to;
  return values;
}

}  // namespace grapnel
