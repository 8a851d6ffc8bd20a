#include "grapnel/campaign/sample_points.hpp"

#include <Random123/philox.h>
#include <bit>
#include <boost/random/sobol.hpp>
#include <stdexcept>

namespace grapnel {

std::array<std::uint32_t, 4> random_words(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension,
                                          RandomUse use) {
  const r123::Philox4x32::key_type key = {{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  const r123::Philox4x32::ctr_type counter = {{static_cast<std::uint32_t>(index),
                                               static_cast<std::uint32_t>(index >> 32), dimension,
                                               static_cast<std::uint32_t>(use)}};
  const r123::Philox4x32::ctr_type words = r123::Philox4x32()(counter, key);
  return {words[0], words[1], words[2], words[3]};
}

double unit_number(std::uint32_t high, std::uint32_t low) {
  const std::uint64_t bits = (std::uint64_t{high} << 32 | low) >> 12;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52;  // exact: 53 bits
}

double unit_number(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension) {
  const auto words = random_words(seed, index, dimension, RandomUse::uniform);
  return unit_number(words[0], words[1]);
}

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

namespace {

constexpr int kBits = 32;

// XOR of the direction numbers at the set bits.
std::uint32_t combined(const std::uint32_t* directions, std::uint32_t bits) {
  std::uint32_t digits = 0;
  for (; bits != 0; bits &= bits - 1) digits ^= directions[std::countr_zero(bits)];
  return digits;
}

// L x modulo 2 for a random lower triangular L with ones on its diagonal: digit i (from the highest bit) of the result
// is that of x plus some of those before it. Whether they are among them is row i of the matrix.
std::uint32_t scrambled(std::uint32_t x, const std::uint32_t* rows) {
  std::uint32_t result = 0;
  for (int i = 0; i < kBits; ++i) {
    const std::uint32_t bit = std::uint32_t{1} << (kBits - 1 - i);
    const std::uint32_t before = i == 0 ? 0 : ~std::uint32_t{0} << (kBits - i);
    if (std::popcount(x & ((rows[i] & before) | bit)) % 2 == 1) result |= bit;
  }
  return result;
}

}  // namespace

std::vector<std::uint32_t> sobol_directions(std::size_t dimensions) {
  boost::random::sobol_engine<std::uint32_t, kBits> engine(dimensions);
  std::vector<std::uint32_t> directions(dimensions * kBits);
  for (int j = 0; j < kBits; ++j) {
    // The point whose Gray code is 2^j is 2^(j+1) - 1; the engine counts from the point after the origin.
    const std::uint32_t point = static_cast<std::uint32_t>((std::uint64_t{1} << (j + 1)) - 1);
    engine.seed(point - 1);
    for (std::size_t d = 0; d < dimensions; ++d) directions[d * kBits + static_cast<std::size_t>(j)] = engine();
  }
  return directions;
}

SamplePoints::SamplePoints(Sampling sampling, std::size_t dimensions, std::uint64_t cases, std::uint64_t seed)
    : sampling_(sampling), dimensions_(dimensions), cases_(cases), seed_(seed) {
  if (dimensions > kMostDimensions) throw std::invalid_argument("sampling: too many dimensions");
  if (cases == 0) throw std::invalid_argument("sampling: the number of cases must be positive");
  if (sampling != Sampling::sobol || dimensions == 0) return;
  directions_ = sobol_directions(dimensions);
  for (std::uint32_t d = 0; d < dimensions; ++d) {
    std::uint32_t rows[kBits];
    for (std::uint32_t i = 0; i < kBits; ++i) rows[i] = random_words(seed, i, d, RandomUse::scramble)[0];
    for (std::size_t j = 0; j < kBits; ++j) directions_[d * kBits + j] = scrambled(directions_[d * kBits + j], rows);
    shifts_.push_back(random_words(seed, kBits, d, RandomUse::scramble)[0]);
  }
}

double SamplePoints::coordinate(std::uint64_t k, std::uint32_t dimension) const {
  if (sampling_ == Sampling::random) return unit_number(seed_, k, dimension);
  const auto words = random_words(seed_, k, dimension, RandomUse::jitter);
  if (sampling_ == Sampling::sobol) {
    const auto index = static_cast<std::uint32_t>(k);
    const std::uint32_t digits = combined(directions_.data() + std::size_t{dimension} * kBits, index ^ (index >> 1));
    return unit_number(digits ^ shifts_[dimension], words[0]);
  }
  const std::uint64_t block = k / cases_;
  const KeyedPermutation permutation(cases_, seed_, dimension, block);
  // 22 bits within the part: the sum is exact for a billion parts, so that every point stays in its part.
  const double within = (static_cast<double>(words[0] >> 10) + 0.5) * 0x1p-22;
  return (static_cast<double>(permutation(k % cases_)) + within) / static_cast<double>(cases_);
}

void SamplePoints::at(std::uint64_t k, std::span<double> point) const {
  if (sampling_ == Sampling::sobol && k >> kBits != 0)
    throw std::invalid_argument("sampling: sobol has at most 2^32 points");
  for (std::size_t d = 0; d < dimensions_; ++d) point[d] = coordinate(k, static_cast<std::uint32_t>(d));
}

}  // namespace grapnel
