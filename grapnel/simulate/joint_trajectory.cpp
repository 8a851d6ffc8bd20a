#include "grapnel/simulate/joint_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grapnel {

namespace {

// Position, first and second derivative with respect to x = t/T of the three basis functions of a path.
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
// Ends at 0 with unit rate: the terms of (3.1) that contain s, without division by the angle travelled.
Shape end_rate_term(double x) {
  return {x * x * x * (-4 + x * (7 - 3 * x)), x * x * (-12 + x * (28 - 15 * x)), x * (-24 + x * (84 - 60 * x))};
}
// Starts at 0 with unit rate and ends at rest at 0.
Shape start_rate_term(double x) {
  return {x * (1 + x * x * (-6 + x * (8 - 3 * x))), 1 + x * x * (-18 + x * (32 - 15 * x)),
          x * (-36 + x * (96 - 60 * x))};
}

}  // namespace

// Path and time since its begin [s] => position, rate and acceleration by (6.1); outside the path, its end values.
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

namespace {

// Value and first two derivatives with respect to x of sum_k c_k T_k(x), by Clenshaw's recurrence
// b_k = c_k + 2 x b_{k+1} - b_{k+2} and its derivatives; the sum is c_0 + x b_1 - b_2.
JointPoint clenshaw(const std::vector<double>& c, double x) {
  double b1 = 0, b2 = 0, d1 = 0, d2 = 0, e1 = 0, e2 = 0;  // of index k + 1 and k + 2: value, derivative, second
  for (std::size_t k = c.size(); k-- > 1;) {
    const double b = c[k] + 2 * x * b1 - b2;
    const double d = 2 * b1 + 2 * x * d1 - d2;
    const double e = 4 * d1 + 2 * x * e1 - e2;
    b2 = b1, b1 = b, d2 = d1, d1 = d, e2 = e1, e1 = e;
  }
  return {c[0] + x * b1 - b2, b1 + x * d1 - d2, 2 * d1 + x * e1 - e2};
}

JointPoint evaluate_piece(const JointPiece& piece, double t) {
  if (const auto* path = std::get_if<JointPath>(&piece.shape)) return evaluate(*path, t - piece.begin);
  const double half = 0.5 * (piece.end - piece.begin);
  const double x = std::clamp((t - 0.5 * (piece.begin + piece.end)) / half, -1.0, 1.0);
  const JointPoint p = clenshaw(std::get<ChebyshevPiece>(piece.shape).coefficients, x);
  return {p.position, p.rate / half, p.acceleration / (half * half)};
}

// The cubic with the given ends as a Chebyshev series on its interval of length h.
ChebyshevPiece hermite_cubic(double p0, double p1, double v0, double v1, double h) {
  // With x in [-1, 1]: a + b x + c x^2 + d x^3, from values and slopes (h/2) v at the ends.
  const double s0 = 0.5 * h * v0, s1 = 0.5 * h * v1;
  const double a = 0.5 * (p0 + p1) + 0.25 * (s0 - s1), b = 0.75 * (p1 - p0) - 0.25 * (s0 + s1);
  const double c = 0.25 * (s1 - s0), d = 0.25 * (s0 + s1) - 0.25 * (p1 - p0);
  // x^2 = (T_0 + T_2)/2, x^3 = (3 T_1 + T_3)/4.
  return {{a + 0.5 * c, b + 0.75 * d, 0.5 * c, 0.25 * d}};
}

// Rates of the cubic spline through the samples at its knots: the tridiagonal system of continuous acceleration,
//   h_k v_{k-1} + 2 (h_{k-1} + h_k) v_k + h_{k-1} v_{k+1} = 3 (h_k s_{k-1} + h_{k-1} s_k),  s_k = (p_{k+1} - p_k)/h_k,
// closed at each end by "not a knot" (de Boor, A Practical Guide to Splines, chapter IV).
std::vector<double> spline_rates(std::span<const double> t, std::span<const double> p) {
  const std::size_t n = t.size();
  std::vector<double> h(n - 1), s(n - 1);
  for (std::size_t k = 0; k + 1 < n; ++k) h[k] = t[k + 1] - t[k], s[k] = (p[k + 1] - p[k]) / h[k];
  if (n == 2) return {s[0], s[0]};
  if (n == 3) {  // the parabola
    const double curvature = (s[1] - s[0]) / (h[0] + h[1]);
    return {s[0] - curvature * h[0], s[0] + curvature * h[0], s[1] + curvature * h[1]};
  }
  std::vector<double> lower(n), diagonal(n), upper(n), right(n);
  diagonal[0] = h[1], upper[0] = h[0] + h[1];
  right[0] = ((h[0] + 2 * upper[0]) * h[1] * s[0] + h[0] * h[0] * s[1]) / upper[0];
  for (std::size_t k = 1; k + 1 < n; ++k) {
    lower[k] = h[k], diagonal[k] = 2 * (h[k - 1] + h[k]), upper[k] = h[k - 1];
    right[k] = 3 * (h[k] * s[k - 1] + h[k - 1] * s[k]);
  }
  lower[n - 1] = h[n - 2] + h[n - 3], diagonal[n - 1] = h[n - 3];
  right[n - 1] = (h[n - 2] * h[n - 2] * s[n - 3] + (2 * lower[n - 1] + h[n - 2]) * h[n - 3] * s[n - 2]) / lower[n - 1];
  for (std::size_t k = 1; k < n; ++k) {
    const double w = lower[k] / diagonal[k - 1];
    diagonal[k] -= w * upper[k - 1];
    right[k] -= w * right[k - 1];
  }
  std::vector<double> v(n);
  v[n - 1] = right[n - 1] / diagonal[n - 1];
  for (std::size_t k = n - 1; k-- > 0;) v[k] = (right[k] - upper[k] * v[k + 1]) / diagonal[k];
  return v;
}

}  // namespace

JointTrajectory JointTrajectory::at_rest(double position) {
  JointTrajectory trajectory;
  trajectory.pieces.push_back({0, 1, ChebyshevPiece{{position}}});
  return trajectory;
}

// Time t => point of the trajectory; at a common end of two pieces the later one.
JointPoint evaluate(const JointTrajectory& trajectory, double t) { return evaluate(trajectory, t, t); }

// Time t => point on the piece that contains `inside`, a time of the same smooth interval. Before the first piece and
// after the last, the end position with the end rate and zero acceleration.
JointPoint evaluate(const JointTrajectory& trajectory, double t, double inside) {
  const auto& pieces = trajectory.pieces;
  if (pieces.empty()) return {};
  if (inside < pieces.front().begin) {
    const JointPoint first = evaluate_piece(pieces.front(), pieces.front().begin);
    return {first.position, first.rate, 0};
  }
  if (inside >= pieces.back().end) {
    const JointPoint last = evaluate_piece(pieces.back(), pieces.back().end);
    return {last.position, last.rate, inside > pieces.back().end ? 0 : last.acceleration};
  }
  const auto next =
      std::upper_bound(pieces.begin(), pieces.end(), inside, [](double x, const JointPiece& p) { return x < p.begin; });
  return evaluate_piece(*(next - 1), t);
}

// Trajectory => begin of every piece and end of the last, in order; without the outer ends of constant pieces, where
// nothing changes.
std::vector<double> break_times(const JointTrajectory& trajectory) {
  std::vector<double> times;
  if (trajectory.pieces.empty()) return times;
  const auto is_constant = [](const JointPiece& piece) {
    const auto* series = std::get_if<ChebyshevPiece>(&piece.shape);
    return series != nullptr && series->coefficients.size() == 1;
  };
  for (const JointPiece& piece : trajectory.pieces) times.push_back(piece.begin);
  times.push_back(trajectory.pieces.back().end);
  if (is_constant(trajectory.pieces.back())) times.pop_back();
  if (is_constant(trajectory.pieces.front())) times.erase(times.begin());
  return times;
}

// Trajectory => nothing; throws std::invalid_argument if a piece is empty or not finite, leaves a gap, has a path of
// another duration, or a series without coefficients.
void validate(const JointTrajectory& trajectory) {
  const JointPiece* before = nullptr;
  for (const JointPiece& piece : trajectory.pieces) {
    if (!std::isfinite(piece.begin) || !std::isfinite(piece.end) || !(piece.end > piece.begin)) {
      throw std::invalid_argument("joint trajectory: a piece must end after it begins");
    }
    if (before != nullptr && piece.begin != before->end) {
      throw std::invalid_argument("joint trajectory: a piece must begin where the previous one ends");
    }
    if (const auto* path = std::get_if<JointPath>(&piece.shape)) {
      // An end computed as begin + duration is exact to within the rounding of the times.
      const double rounding = 1e-12 * (std::abs(piece.begin) + std::abs(piece.end));
      if (!(std::abs(piece.end - piece.begin - path->duration) <= rounding)) {
        throw std::invalid_argument("joint trajectory: a path must last as long as its piece");
      }
    } else if (std::get<ChebyshevPiece>(piece.shape).coefficients.empty()) {
      throw std::invalid_argument("joint trajectory: a series needs coefficients");
    }
    before = &piece;
  }
}

double chebyshev_point(double begin, double end, int k, int n) {
  if (k == 0) return begin;
  if (k == n) return end;
  return 0.5 * (begin + end) - 0.5 * (end - begin) * std::cos(std::numbers::pi * k / n);
}

// Values at n + 1 Chebyshev points cos(pi k/n), from x = -1 to x = +1 => coefficients of the interpolating series, by
// the discrete cosine transform. Throws std::invalid_argument for fewer than two values.
ChebyshevPiece chebyshev_interpolant(std::span<const double> values) {
  const int n = static_cast<int>(values.size()) - 1;
  if (n < 1) throw std::invalid_argument("chebyshev_interpolant: at least two values are needed");
  // c_m = (2/n) sum''_k f_k cos(pi m k'/n), k' counted from the end at x = +1; double primes halve the ends' terms.
  std::vector<double> c(n + 1);
  for (int m = 0; m <= n; ++m) {
    double sum = 0;
    for (int k = 0; k <= n; ++k) {
      const double weight = k == 0 || k == n ? 0.5 : 1.0;
      sum += weight * values[n - k] * std::cos(std::numbers::pi * ((m * k) % (2 * n)) / n);
    }
    c[m] = 2 * sum / n * (m == 0 || m == n ? 0.5 : 1.0);
  }
  return {std::move(c)};
}

// Samples => trajectory of Hermite cubics; without rates, those of the cubic spline. Throws std::invalid_argument for
// fewer than two samples, different numbers, non-finite values or times that do not increase.
JointTrajectory interpolate_samples(std::span<const double> times, std::span<const double> positions,
                                    std::span<const double> rates) {
  const std::size_t n = times.size();
  if (n < 2) throw std::invalid_argument("joint trajectory: at least two samples are needed");
  if (positions.size() != n || (!rates.empty() && rates.size() != n)) {
    throw std::invalid_argument("joint trajectory: times, positions and rates differ in number");
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (!std::isfinite(times[k]) || !std::isfinite(positions[k]) || (!rates.empty() && !std::isfinite(rates[k]))) {
      throw std::invalid_argument("joint trajectory: a number is not finite");
    }
    if (k > 0 && !(times[k] > times[k - 1])) throw std::invalid_argument("joint trajectory: times must increase");
  }
  const std::vector<double> v =
      rates.empty() ? spline_rates(times, positions) : std::vector<double>(rates.begin(), rates.end());
  JointTrajectory trajectory;
  for (std::size_t k = 0; k + 1 < n; ++k) {
    trajectory.pieces.push_back(
        {times[k], times[k + 1],
         hermite_cubic(positions[k], positions[k + 1], v[k], v[k + 1], times[k + 1] - times[k])});
  }
  return trajectory;
}

}  // namespace grapnel
