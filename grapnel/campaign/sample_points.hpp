#pragma once

/// @file
/// Points in the unit cube, one per case. Thread safety: plain values; at() may be called from any thread.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

/// Point k is a function of sampling, dimensions, cases, seed and k alone, at a cost that does not depend on k. Its
/// coordinates are greater than 0 and less than 1.
///
/// random: coordinates by Philox. latin_hypercube: of the points of each block of `cases` every coordinate has exactly
/// one in each of `cases` equal parts of (0, 1), anywhere in it; blocks are independent of each other. sobol: the
/// sequence of Sobol with the direction numbers of Joe and Kuo (2008), as Boost.Random has them, in the order of
/// Antonov and Saleev, its digits scrambled by a random lower triangular matrix and a random digital shift (Matousek
/// 1998); the first 2^m points, and every aligned block of 2^m, are the same kind of net as Sobol's. Digits beyond 32
/// are random.
class SamplePoints {
 public:
  static constexpr std::size_t kMostDimensions = 1000;

  /// `cases` >= 1: the size of a Latin hypercube. @throws std::invalid_argument if there are too many dimensions.
  SamplePoints(Sampling sampling, std::size_t dimensions, std::uint64_t cases, std::uint64_t seed);

  std::size_t dimensions() const { return dimensions_; }
  /// Point k, into `point` of that many numbers. With sobol k < 2^32. @throws std::invalid_argument beyond.
  void at(std::uint64_t k, std::span<double> point) const;

 private:
  double coordinate(std::uint64_t k, std::uint32_t dimension) const;

  Sampling sampling_;
  std::size_t dimensions_;
  std::uint64_t cases_, seed_;
  std::vector<std::uint32_t> directions_;  // sobol: 32 per dimension, scrambled
  std::vector<std::uint32_t> shifts_;      // sobol: per dimension
};

/// Direction numbers of Sobol's sequence, 32 per dimension: point k, in the order of Antonov and Saleev, has in
/// dimension d the digits XOR of those whose bit is set in the Gray code of k. Leading digits are the highest bits.
std::vector<std::uint32_t> sobol_directions(std::size_t dimensions);

}  // namespace grapnel
