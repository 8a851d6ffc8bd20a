#include "random_scenarios/draws.hpp"

#include <fmt/format.h>
#include <rapidcheck.h>

#include <cmath>

#include "grapnel/spatial/pose.hpp"

namespace grapnel::testing {

int integer(int lower, int upper) { return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(lower, upper + 1)); }
double uniform(double lower, double upper) { return lower + (upper - lower) * 1e-3 * integer(0, 1000); }
double around(double size) { return size * 1e-3 * integer(0, 1000) * (integer(0, 1) == 0 ? 1 : -1); }
double decades(double lower, double upper) {
  const double value = lower * std::pow(upper / lower, uniform(0, 1));
  const double digits = std::pow(10, 2 - std::floor(std::log10(value)));
  return std::round(value * digits) / digits;
}
bool percent(int chance) { return integer(0, 99) >= 100 - chance; }
Vector3d vector(double size) { return {around(size), around(size), around(size)}; }

std::string list(const Numbers& numbers, const char* format) {
  std::string text;
  for (const double n : numbers) text += (text.empty() ? "" : ", ") + fmt::format(fmt::runtime(format), n);
  return "[" + text + "]";
}
std::string list(const Vector3d& v, const char* format) { return list(Numbers{v[0], v[1], v[2]}, format); }

std::string unit_vector() {
  const Vector3d v = vector(1);
  const double length = norm(v);
  if (percent(50) && length > 0.1) return list(Numbers{v[0] / length, v[1] / length, v[2] / length}, "{:.17g}");
  const int axis = integer(0, 5);
  const double sign = axis < 3 ? 1 : -1;
  return list(sign * Vector3d::unit((axis + 2) % 3));
}

std::string pose(double size) {
  std::string text = "position: " + list(vector(size));
  const int kind = integer(0, 2);
  if (kind == 1) text += ", rpy: " + list(vector(3.1));
  if (kind == 2) {
    const Vector3d v = vector(1);
    const double w = uniform(0.2, 1), length = std::sqrt(w * w + dot(v, v));
    text += ", quaternion_wxyz: " + list(Numbers{w / length, v[0] / length, v[1] / length, v[2] / length}, "{:.9f}");
  }
  return text;
}

std::string body(double mass, double least, double most, double com) {
  const double a = uniform(least, most), b = uniform(least, most), c = uniform(least, most);
  const Vector3d moments = mass / 12 * Vector3d{b * b + c * c, a * a + c * c, a * a + b * b};
  std::string inertia = list(moments);
  if (percent(40)) {
    const Rotationd R = rotation_from_rpy(around(3), around(3), around(3));
    const auto at = [&](int i, int j) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += R(i, k) * moments[k] * R(j, k);
      return sum;
    };
    inertia = fmt::format("{{xx: {:.12g}, yy: {:.12g}, zz: {:.12g}, xy: {:.12g}, xz: {:.12g}, yz: {:.12g}}}", at(0, 0),
                          at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2));
  }
  return fmt::format("mass: {:.6g}, com: {}, inertia: {}", mass, list(vector(com)), inertia);
}

std::string in_lines(std::string members, const std::string& indent) {
  for (const char* key : {", com:", ", inertia:"}) members.replace(members.find(key), 2, "\n" + indent);
  return members;
}

}  // namespace grapnel::testing
