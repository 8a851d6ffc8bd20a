#include "grapnel/campaign/keyed_permutation.hpp"

#include "grapnel/campaign/random_number.hpp"

namespace grapnel {
namespace {

constexpr std::uint32_t kRounds = 8;

// The smallest whole number whose square is at least n.
std::uint64_t root_above(std::uint64_t n) {
  std::uint64_t low = 1, high = std::uint64_t{1} << 24;
  while (low < high) {
    const std::uint64_t middle = (low + high) / 2;
    if (middle * middle >= n)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

}  // namespace

KeyedPermutation::KeyedPermutation(std::uint64_t size, std::uint64_t seed, std::uint32_t dimension, std::uint64_t block)
    : size_(size), A_(root_above(size)), B_((size + A_ - 1) / A_), seed_(seed), block_(block), dimension_(dimension) {}

std::uint64_t KeyedPermutation::once(std::uint64_t i) const {
  std::uint64_t a = i / B_, b = i % B_;
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    // One number depends on the other, the round and the block, each within its own bits: a, b < 2^24.
    const std::uint64_t other = round % 2 == 0 ? b : a;
    const auto words =
        random_words(seed_, other | std::uint64_t{round} << 24 | block_ << 32, dimension_, RandomUse::permutation);
    const std::uint64_t random = std::uint64_t{words[0]} << 32 | words[1];
    if (round % 2 == 0)
      a = (a + random % A_) % A_;
    else
      b = (b + random % B_) % B_;
  }
  return a * B_ + b;
}

std::uint64_t KeyedPermutation::operator()(std::uint64_t i) const {
  do i = once(i);
  while (i >= size_);
  return i;
}

}  // namespace grapnel
