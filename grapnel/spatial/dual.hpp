#pragma once

/// @file
/// A dual number: a value and its derivative with respect to one parameter, propagated by the chain rule (forward
/// automatic differentiation; Griewank and Walther 2008, chapter 3). It is a scalar in the sense of scalar.hpp, so the
/// templated kernels compute exact derivatives, up to rounding error, without a step size. Comparisons use values only:
/// at a branch the derivative is that of the selected side.

#include <cmath>

#include "grapnel/spatial/sine_cosine.hpp"

namespace grapnel {

/// a = value + derivative * epsilon with epsilon^2 = 0. The derivative's unit is the value's per unit of the parameter.
struct Dual {
  double value = 0;
  double derivative = 0;

  constexpr Dual() = default;
  /// A constant. Implicit, so that constants mix with dual numbers as they do with doubles.
  constexpr Dual(double constant) : value(constant) {}
  constexpr Dual(double value_, double derivative_) : value(value_), derivative(derivative_) {}

  constexpr Dual& operator+=(const Dual& b) { return value += b.value, derivative += b.derivative, *this; }
  constexpr Dual& operator-=(const Dual& b) { return value -= b.value, derivative -= b.derivative, *this; }
  constexpr Dual& operator*=(const Dual& b) {
    derivative = derivative * b.value + value * b.derivative;
    value *= b.value;
    return *this;
  }
  constexpr Dual& operator/=(const Dual& b) {
    value /= b.value;
    derivative = (derivative - value * b.derivative) / b.value;
    return *this;
  }

  friend constexpr Dual operator+(Dual a, const Dual& b) { return a += b; }
  friend constexpr Dual operator-(Dual a, const Dual& b) { return a -= b; }
  friend constexpr Dual operator*(Dual a, const Dual& b) { return a *= b; }
  friend constexpr Dual operator/(Dual a, const Dual& b) { return a /= b; }
  friend constexpr Dual operator-(const Dual& a) { return {-a.value, -a.derivative}; }
  friend constexpr bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend constexpr bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
};

inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return {root, a.derivative / (2 * root)};
}
/// Sine and cosine of an angle [rad], from the kernels' own implementation.
inline SineCosine<Dual> sine_cosine(const Dual& angle) {
  const SineCosine<double> at = sine_cosine(angle.value);
  return {{at.sine, at.cosine * angle.derivative}, {at.cosine, -at.sine * angle.derivative}};
}
inline Dual sin(const Dual& a) { return sine_cosine(a).sine; }
inline Dual cos(const Dual& a) { return sine_cosine(a).cosine; }

}  // namespace grapnel
