#include "grapnel/plan/joint_spline.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace grapnel {
namespace {

constexpr int kSplineDegree = 5, kAtEnd = 3;

}  // namespace

JointSpline::JointSpline(int knots) : knots_(knots) {
  if (knots < 0) throw std::invalid_argument("JointSpline: the number of knots is negative");
  for (int i = 0; i <= kSplineDegree; ++i) t_.push_back(0);
  for (int i = 1; i <= knots; ++i) t_.push_back(static_cast<double>(i) / (knots + 1));
  for (int i = 0; i <= kSplineDegree; ++i) t_.push_back(1);
}

// x => values and two derivatives of all N_k, by the de Boor-Cox recursion on the span that contains x.
void JointSpline::evaluate(double x, std::span<JointPoint> values) const {
  std::fill(values.begin(), values.end(), JointPoint{});
  if (knots_ == 0) return;
  const int span = std::min(static_cast<int>(x * (knots_ + 1)), knots_), first = span + kSplineDegree;
  // B[d][i]: the B-splines of degree d that do not vanish on the span, B_{first - d + i}.
  std::array<std::array<double, kSplineDegree + 1>, kSplineDegree + 1> B{};
  B[0][0] = 1;
  for (int d = 1; d <= kSplineDegree; ++d) {
    for (int i = 0; i <= d; ++i) {
      const int k = first - d + i;  // B_k of degree d from B_k and B_{k+1} of degree d - 1
      const double low = i > 0 ? (x - t_[k]) / (t_[k + d] - t_[k]) * B[d - 1][i - 1] : 0;
      const double high = i < d ? (t_[k + d + 1] - x) / (t_[k + d + 1] - t_[k + 1]) * B[d - 1][i] : 0;
      B[d][i] = low + high;
    }
  }
  // B_k' = d [B_k / (t_{k+d} - t_k) - B_{k+1} / (t_{k+d+1} - t_{k+1})], of degree d - 1 on the right.
  const auto slope = [&](int d, int i, const auto& lower) {
    const int k = first - d + i;
    const double low = i > 0 ? lower(i - 1) / (t_[k + d] - t_[k]) : 0;
    const double high = i < d ? lower(i) / (t_[k + d + 1] - t_[k + 1]) : 0;
    return d * (low - high);
  };
  const auto first_slope = [&](int i) {
    return slope(kSplineDegree - 1, i, [&](int m) { return B[kSplineDegree - 2][m]; });
  };
  for (int i = 0; i <= kSplineDegree; ++i) {
    const int k = first - kSplineDegree + i - kAtEnd;
    if (k < 0 || k >= knots_) continue;
    values[static_cast<std::size_t>(k)] = {B[kSplineDegree][i],
                                           slope(kSplineDegree, i, [&](int m) { return B[kSplineDegree - 1][m]; }),
                                           slope(kSplineDegree, i, first_slope)};
  }
}

// Path and coefficients => pieces of the trajectory, a Chebyshev series per span interpolated at its points.
std::vector<JointPiece> pieces_of(double begin, const JointPath& path, std::span<const double> coefficients) {
  const double T = path.duration;
  const int knots = static_cast<int>(coefficients.size());
  if (knots == 0) return {{begin, begin + T, path}};
  // Quartic and quintic profiles are polynomials of degree 5; a cycloid is resolved to rounding error by the higher
  // degree.
  const int degree = path.profile == JointProfile::cycloidal ? 24 : kSplineDegree;
  const JointSpline spline(knots);
  std::vector<JointPoint> N(coefficients.size());
  std::vector<JointPiece> pieces;
  for (int s = 0; s <= knots; ++s) {
    const double low = static_cast<double>(s) / (knots + 1), high = static_cast<double>(s + 1) / (knots + 1);
    std::vector<double> values;
    for (int k = 0; k <= degree; ++k) {
      const double x = chebyshev_point(low, high, k, degree);
      spline.evaluate(x, N);
      double value = evaluate(path, x * T).position;
      for (std::size_t i = 0; i < N.size(); ++i) value += coefficients[i] * N[i].position;
      values.push_back(value);
    }
    pieces.push_back(
        {s == 0 ? begin : pieces.back().end, s == knots ? begin + T : begin + high * T, chebyshev_interpolant(values)});
  }
  return pieces;
}

}  // namespace grapnel
