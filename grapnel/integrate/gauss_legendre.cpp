#include "grapnel/integrate/gauss_legendre.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grapnel {
namespace {

// P_0(x) ... P_m(x), by (k + 1) P_{k+1} = (2 k + 1) x P_k - k P_{k-1}.
std::vector<double> legendre(int m, double x) {
  std::vector<double> P(m + 1, 1.0);
  if (m > 0) P[1] = x;
  for (int k = 1; k < m; ++k) P[k + 1] = ((2 * k + 1) * x * P[k] - k * P[k - 1]) / (k + 1);
  return P;
}

// P_m'(x) from P_m and P_{m-1}; x is inside ]-1, 1[.
double slope(int m, double x, const std::vector<double>& P) { return m * (P[m - 1] - x * P[m]) / (1 - x * x); }

// The i-th smallest zero of P_m, by Newton's method from Tricomi's estimate.
double zero(int m, int i) {
  double x = -std::cos(std::numbers::pi * (i + 0.75) / (m + 0.5));
  for (int iteration = 0; iteration < 20; ++iteration) {
    const std::vector<double> P = legendre(m, x);
    const double step = P[m] / slope(m, x, P);
    x -= step;
    if (std::abs(step) < 1e-16) break;
  }
  return x;
}

}  // namespace

// Number of stages m => nodes, weights, a_ij by (2) and the last two Legendre coefficients by (1).
GaussLegendre::GaussLegendre(int stages) {
  if (stages < 2) throw std::invalid_argument("GaussLegendre: at least two stages are needed");
  const int m = stages;
  std::vector<std::vector<double>> P;  // at the nodes
  for (int i = 0; i < m; ++i) {
    const double x = zero(m, i);
    P.push_back(legendre(m, x));
    const double d = slope(m, x, P.back());
    node_.push_back(0.5 * (1 + x));
    weight_.push_back(1 / ((1 - x * x) * d * d));  // half of that on [-1, 1]
  }
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < m; ++j) {
      double sum = 2 * node_[i];
      for (int k = 1; k < m; ++k) sum += P[j][k] * (P[i][k + 1] - P[i][k - 1]);
      a_.push_back(0.5 * weight_[j] * sum);  // (2)
    }
    last_.push_back((2 * m - 1) * weight_[i] * P[i][m - 1]);  // (1)
    last_but_one_.push_back((2 * m - 3) * weight_[i] * P[i][m - 2]);
  }
}

}  // namespace grapnel
