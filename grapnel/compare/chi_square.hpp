#pragma once

/// @file
/// The chi-square distribution, and the bound of verdicts on measurements.

namespace grapnel {

/// Stated uncertainties are rarely known more accurately than this, relatively.
inline constexpr double kStatedAccuracy = 0.1;

/// P(chi-square with n degrees of freedom > x), n > 0.
double chi_square_tail(double x, double n);
/// The x with chi_square_tail(x, n) = p, 0 < p < 1.
double chi_square_quantile(double p, double n);

/// The chi-square per degree of freedom that 99.9 % of consistent logs do not exceed, if the stated uncertainty is
/// accurate to kStatedAccuracy.
double chi_square_bound(double n);

}  // namespace grapnel
