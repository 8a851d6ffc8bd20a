#include "grapnel/report/figure.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {

namespace {

constexpr std::array<const char*, 8> kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                             "#8a7400", "#56b4e9", "#e69f00", "#777777"};
constexpr std::array<const char*, 4> kDashes{"solid", "(12,5)", "(3,4)", "(14,4,3,4)"};

std::array<int, 3> parts_of(const std::string& color) {
  const long value = std::strtol(color.c_str() + 1, nullptr, 16);
  return {static_cast<int>(value >> 16 & 0xff), static_cast<int>(value >> 8 & 0xff), static_cast<int>(value & 0xff)};
}

}  // namespace

const char* series_color(int index) { return kColors[static_cast<std::size_t>(index) % kColors.size()]; }
const char* series_dash(int index) { return kDashes[static_cast<std::size_t>(index) % kDashes.size()]; }

std::string line_style(const std::string& color, int dash, double width) {
  return fmt::format("lc rgb '{}' dt {} lw {:g}", color, series_dash(dash), width);
}

std::string lightened(const std::string& color, double share) {
  std::string mixed = "#";
  for (const int part : parts_of(color)) {
    mixed += fmt::format("{:02x}", static_cast<int>(std::lround(255 + (part - 255) * std::clamp(share, 0.0, 1.0))));
  }
  return mixed;
}

std::string translucent(const std::string& color, double opacity) {
  return fmt::format("#{:02x}{}", static_cast<int>(std::lround(255 * (1 - std::clamp(opacity, 0.0, 1.0)))),
                     color.substr(1));
}

}  // namespace grapnel
