#include "grapnel/integrate/peak_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace grapnel {

namespace {

constexpr int kNodes = 5;
constexpr int kGrid = 32;  // intervals of a step at whose ends the polynomial is evaluated
// Minimum relative increase for a refined search: equal peaks are not searched again because of rounding.
constexpr double kWorthwhile = 1e-9;
// Margin by which a quantity may exceed the polynomial, as a fraction of its range in the step.
constexpr double kUncertain = 0.02;

const std::array<double, kNodes> kLobatto{0, 0.5 - 0.5 * std::sqrt(3.0 / 7.0), 0.5, 0.5 + 0.5 * std::sqrt(3.0 / 7.0),
                                          1};

// Lagrange polynomials of the nodes, at the grid points.
using Basis = std::array<std::array<double, kNodes>, kGrid + 1>;
// Nodes kLobatto => values of the Lagrange polynomials at kGrid + 1 equidistant points of the unit interval.
Basis make_basis() {
  Basis basis;
  for (int g = 0; g <= kGrid; ++g) {
    const double x = static_cast<double>(g) / kGrid;
    for (int i = 0; i < kNodes; ++i) {
      basis[g][i] = 1;
      for (int j = 0; j < kNodes; ++j) {
        if (j != i) basis[g][i] *= (x - kLobatto[j]) / (kLobatto[i] - kLobatto[j]);
      }
    }
  }
  return basis;
}

// Maximum of the parabola through values at -1, 0 and 1, and its excess over the middle value; empty if it opens
// upwards.
struct Vertex {
  double at, rise;
};
std::optional<Vertex> vertex(double before, double middle, double after) {
  const double bend = before - 2 * middle + after, slope = 0.5 * (after - before);
  if (!(bend < 0)) return std::nullopt;
  return Vertex{-slope / bend, -0.5 * slope * slope / bend};
}

// Position in the step (0 to 1) and value of the maximum magnitude of the interpolating polynomial; empty if it is at
// an end.
struct Promise {
  double at, magnitude;
};
// Values at the nodes => place and value of the largest magnitude of their polynomial: maximum on the grid, refined by
// a parabola; empty if it is at an end of the step.
std::optional<Promise> promise(const std::array<double, kNodes>& values) {
  static const Basis basis = make_basis();
  std::array<double, kGrid + 1> p;
  int top = 0;
  for (int g = 0; g <= kGrid; ++g) {
    p[g] = 0;
    for (int i = 0; i < kNodes; ++i) p[g] += basis[g][i] * values[i];
    if (std::abs(p[g]) > std::abs(p[top])) top = g;
  }
  const double sign = p[top] < 0 ? -1 : 1;
  const int middle = std::clamp(top, 1, kGrid - 1);
  const std::optional<Vertex> v = vertex(sign * p[middle - 1], sign * p[middle], sign * p[middle + 1]);
  if (!v) return std::nullopt;
  const double at = (middle + v->at) / kGrid;
  if (!(at > 0 && at < 1)) return std::nullopt;
  return Promise{at, sign * p[middle] + v->rise};
}

}  // namespace

PeakSearch::PeakSearch(std::size_t searched, std::size_t all) : all_(all), peaks_(searched) {}

const PeakSearch::Point& PeakSearch::evaluate(double t, const Quantities& at) {
  if (used_ == points_.size()) points_.emplace_back();
  Point& point = points_[used_++];
  point.time = t;
  point.values.resize(all_);
  at(t, point.values);
  for (std::size_t i = 0; i < peaks_.size(); ++i) {
    const double magnitude = std::abs(point.values[i]);
    if (!(magnitude <= peaks_[i].magnitude)) peaks_[i] = {magnitude, t};
  }
  return point;
}

// Refines the maximum magnitude near t by repeated parabolic interpolation.
void PeakSearch::climb(std::size_t quantity, double t, double begin, double end, const Quantities& at) {
  constexpr int kMaxTries = 8;
  constexpr double kApart = 0.02, kClose = 0.2;  // of the step; of kApart
  const double apart = kApart * (end - begin);
  const auto magnitude = [&](double time) {
    return std::abs(evaluate(std::clamp(time, begin, end), at).values[quantity]);
  };
  for (int i = 0; i < kMaxTries; ++i) {
    // All three points are inside the step.
    const double center = std::clamp(t, begin + apart, end - apart);
    const std::optional<Vertex> v = vertex(magnitude(center - apart), magnitude(center), magnitude(center + apart));
    if (!v) return;  // no maximum nearby
    const double next = std::clamp(center + std::clamp(v->at, -4.0, 4.0) * apart, begin, end);
    magnitude(next);
    if (std::abs(next - t) < kClose * apart || std::abs(v->at) < kClose) return;
    t = next;
  }
}

// Step => points at its nodes and refined ones, in order of time, and updated peaks. Quantities whose interpolating
// polynomial may exceed their peak are searched by climb(); `fresh`: the values at `begin` differ from those at the
// last end.
void PeakSearch::step(double begin, double end, bool fresh, const Quantities& at) {
  if (!fresh && used_ > 0 && points_[used_ - 1].time == begin) {
    std::swap(points_[0], points_[used_ - 1]);
    used_ = 1;
  } else {
    used_ = 0;
    evaluate(begin, at);
  }
  if (!(end > begin)) return;
  for (int i = 1; i < kNodes; ++i) evaluate(i == kNodes - 1 ? end : begin + kLobatto[i] * (end - begin), at);
  for (std::size_t q = 0; q < peaks_.size(); ++q) {
    std::array<double, kNodes> values;
    for (std::size_t i = 0; i < kNodes; ++i) values[i] = points_[i].values[q];
    const auto [least, largest] = std::minmax_element(values.begin(), values.end());
    const double range = *largest - *least, worthwhile = (1 + kWorthwhile) * peaks_[q].magnitude;
    if (!(std::max(std::abs(*largest), std::abs(*least)) + range > worthwhile)) continue;
    const std::optional<Promise> p = promise(values);
    if (p && p->magnitude + kUncertain * range > worthwhile) climb(q, begin + p->at * (end - begin), begin, end, at);
  }
  std::sort(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(used_),
            [](const Point& a, const Point& b) { return a.time < b.time; });
}

}  // namespace grapnel
