#include "grapnel/scenario/magnitudes.hpp"

#include <array>

namespace grapnel {
namespace {

struct OfUnit {
  std::string_view unit;  // the first of a place's
  Magnitudes magnitudes;
};

// Longer units before those that they begin with.
constexpr std::array kUnits{
    OfUnit{"kg m^2/s", {1e25, 0}}, OfUnit{"kg m^2", {1e25, 0}}, OfUnit{"kg m/s", {1e20, 0}}, OfUnit{"kg", {1e15, 1e-9}},
    OfUnit{"m/s^2", {1e6, 0}},     OfUnit{"m/s", {1e6, 0}},     OfUnit{"m", {1e4, 1e-9}},    OfUnit{"rad/s", {1e4, 0}},
    OfUnit{"rad", {1e4, 0}},       OfUnit{"Hz", {1e6, 1e-9}},   OfUnit{"s", {1e9, 1e-12}},   OfUnit{"N", {1e15, 0}},
    OfUnit{"1", {1e6, 0}},
};

}  // namespace

Magnitudes magnitudes_of(std::string_view unit) {
  for (const OfUnit& one : kUnits) {
    if (!unit.starts_with(one.unit)) continue;
    const std::string_view rest = unit.substr(one.unit.size());
    // "N m/rad or N/m" is a newton of something; "rad or m" a radian.
    if (rest.empty() || rest[0] == ' ' || rest[0] == ',' || rest[0] == '/' || rest[0] == ';') return one.magnitudes;
  }
  return {};
}

}  // namespace grapnel
