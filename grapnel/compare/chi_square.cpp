#include "grapnel/compare/chi_square.hpp"

#include <boost/math/special_functions/gamma.hpp>

namespace grapnel {

double chi_square_tail(double x, double n) { return x > 0 ? boost::math::gamma_q(n / 2, x / 2) : 1; }

double chi_square_quantile(double p, double n) { return 2 * boost::math::gamma_q_inv(n / 2, p); }

double chi_square_bound(double n) {
  constexpr double kExceeding = 1e-3;
  return chi_square_quantile(kExceeding, n) / n * (1 + kStatedAccuracy) * (1 + kStatedAccuracy);
}

}  // namespace grapnel
