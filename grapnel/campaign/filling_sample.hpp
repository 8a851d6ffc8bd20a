#pragma once

/// @file
/// Points that fill the unit cube, for searches that begin at several places.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace grapnel {

/// The additive recurrence with the generalized golden ratio (Roberts 2018): shift + i alpha modulo 1 with
/// alpha_k = phi^-k, phi the root of phi^(d + 1) = phi + 1 above 1.
class FillingSample {
 public:
  FillingSample(std::size_t dimensions, std::uint64_t seed) {
    double phi = 1.5;
    for (int i = 0; i < 100; ++i) phi = std::pow(1 + phi, 1 / (static_cast<double>(dimensions) + 1));
    for (std::size_t k = 0; k < dimensions; ++k) {
      alpha_.push_back(std::pow(phi, -static_cast<double>(k + 1)));
      shift_.push_back(seeded_shift(seed, k));
    }
  }
  /// A coordinate of a point, in 0 ... 1.
  double at(std::size_t point, std::size_t dimension) const {
    const double x = shift_[dimension] + static_cast<double>(point) * alpha_[dimension];
    return x - std::floor(x);
  }

 private:
  // In 0 ... 1 (Steele, Lea and Flood's splitmix64).
  static double seeded_shift(std::uint64_t seed, std::size_t dimension) {
    std::uint64_t z = seed * 0x9e3779b97f4a7c15u + (dimension + 1) * 0xd1b54a32d192ed03u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return static_cast<double>(z >> 11) * 0x1p-53;
  }

  std::vector<double> alpha_, shift_;
};

}  // namespace grapnel
