#include <gtest/gtest.h>

#include <boost/random/sobol.hpp>
#include <map>
#include <set>

#include "grapnel/campaign/sample_points.hpp"

namespace grapnel {
namespace draw_sample_test {

std::vector<double> point(const SamplePoints& samples, std::uint64_t k) {
  std::vector<double> p(samples.dimensions());
  samples.at(k, p);
  return p;
}

TEST(RandomNumber, IsPhiloxAndNeverAtAnEnd) {
  // The known answer of Random123's own kat_vectors for philox4x32-10, counter and key zero.
  const auto words = random_words(0, 0, 0, RandomUse::uniform);
  EXPECT_EQ(words[0], 0x6627e8d5u);
  EXPECT_EQ(words[3], 0x9b00dbd8u);
  EXPECT_GT(unit_number(0u, 0u), 0.0);
  EXPECT_LT(unit_number(~0u, ~0u), 1.0);
  EXPECT_EQ(unit_number(0u, 0u), 1 - unit_number(~0u, ~0u));
}

TEST(KeyedPermutation, IsOne) {
  for (const std::uint64_t size : {1u, 2u, 3u, 10u, 97u, 1000u}) {
    const KeyedPermutation permutation(size, 5, 3, 0);
    std::set<std::uint64_t> seen;
    for (std::uint64_t i = 0; i < size; ++i) {
      const std::uint64_t to = permutation(i);
      ASSERT_LT(to, size);
      seen.insert(to);
    }
    EXPECT_EQ(seen.size(), size);
  }
}

// Of three things all six orders are about equally frequent.
TEST(KeyedPermutation, AllOrdersOccur) {
  std::map<std::vector<std::uint64_t>, int> counts;
  constexpr int kSeeds = 6000;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const KeyedPermutation p(3, seed, 0, 0);
    ++counts[{p(0), p(1), p(2)}];
  }
  EXPECT_EQ(counts.size(), 6u);
  for (const auto& [order, count] : counts) EXPECT_NEAR(count, kSeeds / 6, 150);  // 5 deviations
}

TEST(Samples, OfEveryKindAreInsideAndDoNotDependOnTheOrder) {
  for (const Sampling sampling : {Sampling::random, Sampling::latin_hypercube, Sampling::sobol}) {
    const SamplePoints samples(sampling, 7, 100, 42), again(sampling, 7, 100, 42), other(sampling, 7, 100, 43);
    std::vector<std::vector<double>> forward;
    for (std::uint64_t k = 0; k < 300; ++k) forward.push_back(point(samples, k));
    for (std::uint64_t k = 300; k-- > 0;) {
      const auto p = point(again, k);
      EXPECT_EQ(p, forward[k]);
      for (const double u : p) EXPECT_TRUE(u > 0 && u < 1);
    }
    EXPECT_NE(point(other, 5), forward[5]);
    EXPECT_NE(forward[1][0], forward[1][1]);
  }
}

TEST(Samples, ALatinHypercubeHasOnePointInEveryPartOfEveryDimension) {
  constexpr std::uint64_t kCases = 1000;
  const SamplePoints samples(Sampling::latin_hypercube, 6, kCases, 1);
  for (std::uint64_t block = 0; block < 3; ++block) {
    std::vector<std::set<std::uint64_t>> parts(6);
    for (std::uint64_t k = block * kCases; k < (block + 1) * kCases; ++k) {
      const auto p = point(samples, k);
      for (std::size_t d = 0; d < p.size(); ++d) parts[d].insert(static_cast<std::uint64_t>(p[d] * kCases));
    }
    for (const auto& dimension : parts) EXPECT_EQ(dimension.size(), kCases);
  }
  // Blocks are independent.
  EXPECT_NE(static_cast<int>(point(samples, 0)[0] * kCases), static_cast<int>(point(samples, kCases)[0] * kCases));
}

TEST(Samples, LatinHypercubesOfManyCasesStayInTheirParts) {
  constexpr std::uint64_t kCases = 999'999'937;
  const SamplePoints samples(Sampling::latin_hypercube, 1, kCases, 1);
  for (const std::uint64_t k : {std::uint64_t{0}, std::uint64_t{12345}, kCases - 1}) {
    const double u = point(samples, k)[0];
    const auto part = static_cast<double>(KeyedPermutation(kCases, 1, 0, 0)(k));
    EXPECT_GT(u * kCases, part);
    EXPECT_LT(u * kCases, part + 1);
  }
}

// Point k by direction numbers is the k-th that Boost's engine gives in turn (it leaves out the origin).
TEST(Sobol, DirectionNumbersGiveTheSequence) {
  constexpr std::size_t kDimensions = 40;
  const auto directions = sobol_directions(kDimensions);
  boost::random::sobol_engine<std::uint32_t, 32> engine(kDimensions);
  for (std::uint32_t k = 1; k < 300; ++k) {
    const std::uint32_t gray = k ^ (k >> 1);
    for (std::size_t d = 0; d < kDimensions; ++d) {
      std::uint32_t digits = 0;
      for (std::size_t j = 0; j < 32; ++j) {
        if (gray >> j & 1) digits ^= directions[d * 32 + j];
      }
      ASSERT_EQ(digits, engine()) << k << " " << d;
      if (k == 2 && d < 2) {  // 0.75, 0.25
        EXPECT_EQ(digits, d == 0 ? 0xC0000000u : 0x40000000u);
      }
    }
  }
}

// Elementary intervals of the first two dimensions: a (0, m, 2)-net has one of its 2^m points in each, whatever their
// shape, scrambled or not; so has every aligned block.
TEST(Sobol, ScrambledPointsAreANet) {
  constexpr int kBits = 8;
  for (const std::uint64_t seed : {0u, 1u, 77u}) {
    const SamplePoints samples(Sampling::sobol, 2, 1, seed);
    for (const std::uint64_t begin : {0u, 1u << kBits, 5u << kBits}) {
      for (int split = 0; split <= kBits; ++split) {
        std::set<std::pair<int, int>> cells;
        for (std::uint64_t k = begin; k < begin + (1u << kBits); ++k) {
          const auto p = point(samples, k);
          cells.insert({static_cast<int>(p[0] * (1 << split)), static_cast<int>(p[1] * (1 << (kBits - split)))});
        }
        EXPECT_EQ(cells.size(), std::size_t{1} << kBits) << "seed " << seed << ", split " << split;
      }
    }
  }
}

// The mean of a smooth function: far better than by random points.
TEST(Sobol, IntegratesBetterThanRandomPoints) {
  constexpr std::uint64_t kCases = 4096;
  const auto error = [&](Sampling sampling) {
    const SamplePoints samples(sampling, 6, kCases, 3);
    double sum = 0;
    for (std::uint64_t k = 0; k < kCases; ++k) {
      double product = 1;
      for (const double u : point(samples, k)) product *= 1 + 0.5 * (u - 0.5);
      sum += product;
    }
    return std::abs(sum / kCases - 1);
  };
  const double sobol = error(Sampling::sobol), latin = error(Sampling::latin_hypercube),
               random = error(Sampling::random);
  EXPECT_LT(sobol, 1e-4);
  EXPECT_LT(latin, 2e-3);
  EXPECT_LT(random, 3e-2);
  EXPECT_GT(random, 10 * sobol);
}

TEST(Samples, RejectUnsupportedRequests) {
  EXPECT_THROW(SamplePoints(Sampling::random, 1001, 1, 0), std::invalid_argument);
  EXPECT_THROW(SamplePoints(Sampling::random, 1, 0, 0), std::invalid_argument);
  const SamplePoints samples(Sampling::sobol, 1, 1, 0);
  std::vector<double> p(1);
  EXPECT_THROW(samples.at(std::uint64_t{1} << 32, p), std::invalid_argument);
}

}  // namespace draw_sample_test
}  // namespace grapnel
