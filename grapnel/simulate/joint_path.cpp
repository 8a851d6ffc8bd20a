#include "grapnel/simulate/joint_path.hpp"

#include <cmath>
#include <numbers>

namespace grapnel {
namespace {

// Position, first and second derivative with respect to x = t/T of the three shapes a path is made of.
struct Shape {
  double f, df, ddf;
};

// From 0 to 1 with zero rate and acceleration at both ends: (3.1) integrated, for s = 0.
Shape polynomial_step(double x) {
  return {x * x * x * (10 + x * (-15 + 6 * x)), x * x * (30 + x * (-60 + 30 * x)), x * (60 + x * (-180 + 120 * x))};
}
Shape cycloidal_step(double x) {
  const double w = 2 * std::numbers::pi;
  return {x - std::sin(w * x) / w, 1 - std::cos(w * x), w * std::sin(w * x)};
}
// Ends at 0 with unit rate: the terms of (3.1) that carry s, written without the division by the angle travelled.
Shape end_rate_term(double x) {
  return {x * x * x * (-4 + x * (7 - 3 * x)), x * x * (-12 + x * (28 - 15 * x)), x * (-24 + x * (84 - 60 * x))};
}
// Starts at 0 with unit rate and ends at rest at 0.
Shape start_rate_term(double x) {
  return {x * (1 + x * x * (-6 + x * (8 - 3 * x))), 1 + x * x * (-18 + x * (32 - 15 * x)),
          x * (-36 + x * (96 - 60 * x))};
}

}  // namespace

JointPoint evaluate(const JointPath& path, double t) {
  const double T = path.duration;
  const double start_rate = path.profile == JointProfile::quartic ? 0.0 : path.start_rate;
  if (t <= 0) return {path.start, start_rate, 0};
  if (t >= T) return {path.end, path.end_rate, 0};
  const double x = t / T;
  const Shape step = path.profile == JointProfile::cycloidal ? cycloidal_step(x) : polynomial_step(x);
  const Shape last = end_rate_term(x), first = start_rate_term(x);
  const double travel = path.end - path.start;
  return {path.start + travel * step.f + T * (path.end_rate * last.f + start_rate * first.f),
          travel / T * step.df + path.end_rate * last.df + start_rate * first.df,
          (travel / T * step.ddf + path.end_rate * last.ddf + start_rate * first.ddf) / T};
}

}  // namespace grapnel
