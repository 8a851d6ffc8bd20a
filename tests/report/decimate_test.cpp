// Decimation: for any series, omitted samples deviate by at most the reported bound.

#include "grapnel/report/series_table.hpp"
#include "support/sanitizers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace grapnel {
namespace decimate_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// One scalar series over [0, 1].
TimeSeries over_unit_time(std::size_t samples, const std::function<double(double)>& value,
                          const std::string& path = "q") {
  TimeSeries s;
  s.phases = {"approach"};
  s.series = {{path, "m", "", {""}, {}}};
  for (std::size_t i = 0; i < samples; ++i) {
    s.time.push_back(static_cast<double>(i) / static_cast<double>(samples - 1));
    s.phase.push_back(0);
    s.series[0].data.push_back(value(s.time.back()));
  }
  return s;
}

// The largest deviation of omitted samples, relative to the allowed one; infinite where numbers and NaN are mixed.
double worst_deviation(const TimeSeries& s, const std::vector<std::size_t>& retained, double bound) {
  const std::vector<double> allowed = deviations_allowed(s, bound);
  double worst = 0;
  for (std::size_t k = 0; k + 1 < retained.size(); ++k) {
    const std::size_t a = retained[k], b = retained[k + 1];
    for (std::size_t i = a + 1; i < b; ++i) {
      const double part = (s.time[i] - s.time[a]) / (s.time[b] - s.time[a]);
      for (std::size_t n = 0; n < s.series.size(); ++n) {
        const std::size_t width = static_cast<std::size_t>(s.series[n].width());
        for (std::size_t c = 0; c < width; ++c) {
          const auto at = [&](std::size_t sample) { return s.series[n].data[sample * width + c]; };
          if (std::isnan(at(a)) && std::isnan(at(b)) && std::isnan(at(i))) continue;
          const double line = at(a) + part * (at(b) - at(a));
          const double off = at(i) == at(a) && at(i) == at(b) ? 0 : std::abs(at(i) - line) / allowed[n];
          worst = std::isnan(off) ? std::numeric_limits<double>::infinity() : std::max(worst, off);
        }
      }
    }
  }
  return worst;
}

// Several series of all kinds: smooth, random walk, noise, jumps, constant, NaN in an interval, a quaternion.
TimeSeries mixed(unsigned seed, std::size_t samples) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  TimeSeries s;
  s.phases = {"approach", "contact", "post_impact"};
  s.series = {{"base/position", "m", "", {"x", "y", "z"}, {}},
              {"base/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}},
              {"joints/reference_position", "rad", "", {"a"}, {}},
              {"grasps/tip/force", "N", "", {"x", "y", "z"}, {}},
              {"constant", "J", "", {""}, {}}};
  double walk = 1e3 * normal(random), time = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const bool at_impact = i == samples / 3 || i == samples / 3 + 1;
    if (!at_impact) time += std::exp(normal(random));
    walk += 0.01 * normal(random);
    s.time.push_back(time);
    s.phase.push_back(i < samples / 3 ? 0 : i < samples / 3 + 2 ? 1 : 2);
    const double angle = 1e-3 * time + (i > samples / 2 ? 0.3 : 0), jump = i % 97 < 48 ? -2 : 5;
    const auto put = [&](std::size_t n, std::initializer_list<double> values) {
      s.series[n].data.insert(s.series[n].data.end(), values);
    };
    put(0, {std::sin(0.01 * time), walk, 1e-17 * normal(random)});
    put(1, {std::cos(angle), 0, 0, std::sin(angle)});
    put(2, {i % 200 < 150 ? angle : kNaN});
    put(3, {i > samples / 3 && i < samples / 3 + 40 ? normal(random) : 0, 0, jump});
    put(4, {42.0});
  }
  return s;
}

TEST(Decimate, OmittedSamplesAreWithinTheBound) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const TimeSeries s = mixed(seed, 1500);
    for (const double bound : {kFinestBound, 1e-3, kCoarsestBound, 0.1}) {
      const auto retained = *retained_samples(s, bound);
      EXPECT_LE(worst_deviation(s, retained, bound), 1 + 1e-9)
          << "seed " << seed << ", bound " << bound;  // measured 1.0
      EXPECT_TRUE(std::is_sorted(retained.begin(), retained.end(), std::less_equal<>()));
    }
  }
}

TEST(Decimate, AParabolaTakesAsManyLinesAsItMust) {
  // A chord of length h deviates from x^2 by h^2/4: 0.02 for 1e-4, with ends at samples.
  const auto retained = *retained_samples(over_unit_time(10001, [](double t) { return t * t; }), 1e-4);
  EXPECT_GE(retained.size(), 51u);
  EXPECT_LE(retained.size(), 53u);
}

TEST(Decimate, RetainsOnlyEndsOfLine) {
  EXPECT_EQ(retained_samples(over_unit_time(1000, [](double t) { return 3 - 7 * t; }), 1e-4)->size(), 2u);
}

TEST(Decimate, RetainsBothSidesOfJump) {
  const TimeSeries s = over_unit_time(1001, [](double t) { return t < 0.5 ? 0.0 : 1.0; });
  EXPECT_EQ(*retained_samples(s, 1e-2), (std::vector<std::size_t>{0, 499, 500, 1000}));
}

TEST(Decimate, DropsRoundingNoise) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  // Noise on a constant, below single precision.
  EXPECT_EQ(retained_samples(over_unit_time(1000, [&](double) { return 5 + 1e-15 * uniform(random); }), 1e-4)->size(),
            2u);
  // Noise about zero, relative to another series with the same unit.
  TimeSeries s = over_unit_time(1000, [&](double) { return 1e-15 * uniform(random); });
  s.series.push_back({"large", "m", "", {""}, std::vector<double>(1000, 10.0)});
  EXPECT_EQ(retained_samples(s, 1e-4)->size(), 2u);
  // But small variations above rounding errors are retained.
  s = over_unit_time(1000, [&](double) { return 1e-6 * uniform(random); });
  s.series.push_back({"large", "m", "", {""}, std::vector<double>(1000, 10.0)});
  EXPECT_GT(retained_samples(s, 1e-4)->size(), 900u);
}

TEST(Decimate, NumbersAndNoNumbersAreNotMixed) {
  TimeSeries s = over_unit_time(100, [](double t) { return t > 0.3 && t < 0.6 ? kNaN : 1.0; });
  EXPECT_EQ(*retained_samples(s, 1e-2), (std::vector<std::size_t>{0, 29, 30, 59, 60, 99}));
  s.series[0].data[80] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(*retained_samples(s, 1e-2), (std::vector<std::size_t>{0, 29, 30, 59, 60, 79, 80, 81, 99}));
}

TEST(Decimate, PhasesAndEqualTimesStay) {
  TimeSeries s = over_unit_time(100, [](double) { return 1.0; });
  s.phases = {"approach", "contact", "post_impact"};
  for (std::size_t i = 0; i < 100; ++i) s.phase[i] = i < 40 ? 0 : i < 42 ? 1 : 2;
  s.time[40] = s.time[41] = s.time[42] = s.time[39];
  s.time[71] = s.time[70];  // a second instant within a phase
  EXPECT_EQ(*retained_samples(s, 1e-2), (std::vector<std::size_t>{0, 39, 40, 41, 42, 70, 71, 99}));
}

TEST(Decimate, PeaksOfContactForcesStay) {
  // A peak that a coarse line may omit: 1e-3 of the range above its neighbours.
  const auto force = [](double t) { return t < 0.25 ? 100.0 : t == 0.5 ? 10.001 : 10.0; };
  TimeSeries s = over_unit_time(101, force, "grasps/tip/force");
  s.phases = {"contact", "post_impact"};
  for (std::size_t i = 0; i < 101; ++i) s.phase[i] = i < 30 ? 0 : 1;
  const auto retained = *retained_samples(s, 1e-2);
  EXPECT_TRUE(std::count(retained.begin(), retained.end(), 50u));
  for (const char* path : {"contacts/tip--debris/force", "contacts/tip--debris/normal_force"}) {
    s.series[0].path = path;
    EXPECT_EQ(*retained_samples(s, 1e-2), retained) << path;
  }
  s.series[0].path = "grasps/tip/distance";
  const auto without = *retained_samples(s, 1e-2);
  EXPECT_FALSE(std::count(without.begin(), without.end(), 50u));
}

TEST(Decimate, RetainsPeaksOfLoopDefects) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1e-15);
  const TimeSeries s = over_unit_time(
      10000, [&](double) { return uniform(random); }, "loops/tip/position_defect");
  const auto retained = *retained_samples(s, 1e-4);
  EXPECT_LE(retained.size(), 66u);
  const auto& x = s.series[0].data;
  for (std::size_t part = 0; part < 64; ++part) {
    const std::size_t first = part * 10000 / 64 + 2, last = (part + 1) * 10000 / 64 - 2;
    const double largest = *std::max_element(x.begin() + static_cast<std::ptrdiff_t>(first),
                                             x.begin() + static_cast<std::ptrdiff_t>(last));
    double shown = 0;
    for (const std::size_t i : retained) {
      if (i + 3 >= first && i <= last + 3) shown = std::max(shown, x[i]);
    }
    EXPECT_GE(shown, largest) << part;
  }
}

TEST(Decimate, TheBoundGrowsUntilItFits) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  double walk = 0;
  const TimeSeries s = over_unit_time(20000, [&](double) { return walk += normal(random); });
  const Decimation fine = decimate(s, 20000), coarse = decimate(s, 3000), least = decimate(s, 10);
  EXPECT_EQ(fine.bound, 1e-4);
  EXPECT_GT(coarse.bound, 1e-4);
  EXPECT_LE(coarse.retained.size(), 3000u);
  EXPECT_FALSE(retained_samples(s, coarse.bound / 2, 3000));  // this bound is nearly minimal
  EXPECT_EQ(least.bound, kCoarsestBound);                     // the coarsest bound, although too many samples remain
  EXPECT_GT(least.retained.size(), 10u);
  for (const Decimation& d : {fine, coarse, least}) EXPECT_LE(worst_deviation(s, d.retained, d.bound), 1 + 1e-9);
}

TEST(Decimate, ReportsCompleteSeries) {
  const Decimation d = decimate(over_unit_time(3, [](double t) { return t * t; }), 100);
  EXPECT_EQ(d.retained.size(), 3u);
  EXPECT_EQ(d.bound, 0);
}

TEST(Decimate, FewAndNoSamples) {
  EXPECT_TRUE(retained_samples({}, 1e-4)->empty());
  const TimeSeries one = [] {
    TimeSeries s;
    s.time = {5};
    s.phase = {0};
    s.phases = {"approach"};
    s.series = {{"q", "m", "", {""}, {1}}};
    return s;
  }();
  EXPECT_EQ(*retained_samples(one, 1e-4), std::vector<std::size_t>{0});
  TimeSeries backwards = over_unit_time(5, [](double t) { return t; });
  backwards.time = {0, 2, 1, kNaN, 3};
  EXPECT_EQ(retained_samples(backwards, 1e-4)->size(), 5u);
}

TEST(Decimate, AMillionSamplesBecomeFew) {
  SKIP_UNDER_SANITIZERS();
  // Forty components, half of them noisy: the time must be linear in the number of samples.
  constexpr std::size_t kSamples = 1'000'000;
  TimeSeries s = over_unit_time(kSamples, [](double t) { return std::sin(300 * t); });
  s.series.push_back({"vectors", "m", "", std::vector<std::string>(19, "c"), {}});
  s.series.push_back({"noisy", "N", "", std::vector<std::string>(20, "c"), {}});
  std::minstd_rand random(1);
  for (std::size_t i = 0; i < kSamples; ++i) {
    for (std::size_t c = 0; c < 19; ++c)
      s.series[1].data.push_back(static_cast<double>(c) * std::cos(static_cast<double>(c) * s.time[i]));
    const double slow = std::sin(5 * s.time[i]);
    for (std::size_t c = 0; c < 20; ++c)
      s.series[2].data.push_back(slow +
                                 1e-3 * (static_cast<double>(random()) / static_cast<double>(random.max()) - 0.5));
  }
  const Decimation d = decimate(s, 6000);
  EXPECT_EQ(d.bound, 8e-4);
  EXPECT_LE(d.retained.size(), 6000u);  // measured 4 to 6 thousand
  EXPECT_LE(worst_deviation(s, d.retained, d.bound), 1 + 1e-9);
}

}  // namespace decimate_test
}  // namespace grapnel
