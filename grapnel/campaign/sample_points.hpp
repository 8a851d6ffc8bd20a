#pragma once

/// @file
/// Points in the unit cube, one per case, and their generators. Thread safety: plain values; all functions may be
/// called from any thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/campaign/campaign.hpp"

namespace grapnel {

// --- Counter-based random numbers: Philox 4x32-10 (Salmon, Moraes, Dror and Shaw 2011). Numbers do not depend on
// earlier calls. ---

/// Purpose of random numbers: those of different uses are independent.
enum class RandomUse : std::uint32_t { uniform, permutation, jitter, scramble };

/// Four words of 32 random bits, the function of a seed, an index and a dimension.
std::array<std::uint32_t, 4> random_words(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension,
                                          RandomUse use);

/// A number in the open interval (0, 1) with 52 random bits, symmetric about 1/2.
double unit_number(std::uint32_t high, std::uint32_t low);

/// The same from seed, index and dimension.
double unit_number(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension);

// --- Permutations of 0 ... N-1 with constant cost per element ---

/// A pseudo-random permutation, chosen by seed, dimension and block. A Feistel network on pairs (a, b) with a < A,
/// b < B, A B >= N, whose rounds add a random function of the other number; values beyond N pass through it again
/// (cycle walking, Black and Rogaway 2002), which affects less than one in sqrt(N).
class KeyedPermutation {
 public:
  /// 1 <= size <= 2^48.
  KeyedPermutation(std::uint64_t size, std::uint64_t seed, std::uint32_t dimension, std::uint64_t block);
  /// The image of `i` < size.
  std::uint64_t operator()(std::uint64_t i) const;

 private:
  std::uint64_t once(std::uint64_t i) const;
  std::uint64_t size_, A_, B_, seed_, block_;
  std::uint32_t dimension_;
};

// --- Points ---

/// Point k is a function of sampling, dimensions, cases, seed and k alone, with a cost independent of k. Its
/// coordinates are greater than 0 and less than 1.
///
/// random: coordinates by Philox. latin_hypercube: in each block of `cases` points every coordinate has exactly one
/// value in each of `cases` equal parts of (0, 1), at a random position; blocks are independent of each other. sobol:
/// the sequence of Sobol with the direction numbers of Joe and Kuo (2008), as Boost.Random has them, in the order of
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
