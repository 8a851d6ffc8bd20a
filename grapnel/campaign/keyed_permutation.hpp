#pragma once

/// @file
/// Permutations of 0 ... N-1 of which one element costs the same as for N = 1.

#include <cstdint>

namespace grapnel {

/// A pseudo-random permutation, chosen by seed, dimension and block. A Feistel network on pairs (a, b) with a < A,
/// b < B, A B >= N, whose rounds add a random function of the other number; what falls beyond N goes through it again
/// (cycle walking, Black and Rogaway 2002), which less than one in sqrt(N) does.
class KeyedPermutation {
 public:
  /// 1 <= size <= 2^48.
  KeyedPermutation(std::uint64_t size, std::uint64_t seed, std::uint32_t dimension, std::uint64_t block);
  /// Where `i` < size goes.
  std::uint64_t operator()(std::uint64_t i) const;

 private:
  std::uint64_t once(std::uint64_t i) const;
  std::uint64_t size_, A_, B_, seed_, block_;
  std::uint32_t dimension_;
};

}  // namespace grapnel
