#pragma once

/// @file
/// Zero and minimum of a function of one variable. Inside this module only.

#include <cmath>

namespace grapnel {

/// Where f changes sign between `low` and `high`, to about 1e-13 of their distance; `low_value` is f(low). Calls
/// f(double) -> double.
template <class Function>
double crossing(Function&& f, double low, double high, double low_value) {
  for (int step = 0; step < 44; ++step) {
    const double middle = 0.5 * (low + high);
    ((f(middle) < 0) == (low_value < 0) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Where f is least between `low` and `high`, if it has one minimum there, to about 1e-8 of their distance (rounding
/// lets no search of values see more). Golden section. Calls f(double) -> double.
template <class Function>
double golden_minimum(Function&& f, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  double x1 = high - kGolden * (high - low), x2 = low + kGolden * (high - low);
  double f1 = f(x1), f2 = f(x2);
  for (int step = 0; step < 38; ++step) {
    if (f1 < f2) {
      high = x2, x2 = x1, f2 = f1;
      x1 = high - kGolden * (high - low), f1 = f(x1);
    } else {
      low = x1, x1 = x2, f1 = f2;
      x2 = low + kGolden * (high - low), f2 = f(x2);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace grapnel
