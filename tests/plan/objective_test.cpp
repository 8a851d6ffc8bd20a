/// Objectives: against their definitions, and gradients against finite differences.

#include "grapnel/plan/goal.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "plan/plan_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace objective_test {

struct MeasureCase {
  Servicer servicer;
  SegmentStart start;
  std::vector<double> guess, lower, upper, position, rate;
  std::vector<Goal> goals;
};

MeasureCase random_measure(int i, JointProfile profile) {
  MeasureCase c{random_servicer(i), {}, {}, {}, {}, {}, {}, {}};
  Random random(300 + i);
  c.start = {1.0, 1.0 + random.uniform(0.5, 20), profile, c.servicer.theta(), c.servicer.rates(), Posed::identity()};
  if (profile == JointProfile::quartic) c.start.rate.assign(c.start.rate.size(), 0.0);
  for (double x : c.start.position) {
    c.guess.push_back(x + random.uniform(-1, 1));
    c.position.push_back(x + random.uniform(-1, 1));
    c.rate.push_back(random.uniform(-0.5, 0.5));
    c.lower.push_back(random.chance(0.3) ? -kNone : x - random.uniform(1, 3));
    c.upper.push_back(x + random.uniform(1, 3));
  }
  Goal g;
  g.frame = static_cast<int>(c.servicer.model.frames().size()) - 1;
  g.orientation = i % 2 ? Goal::Orientation::pose : Goal::Orientation::free;
  c.goals = {g};
  return c;
}

constexpr JointProfile kProfiles[] = {JointProfile::quartic, JointProfile::cycloidal, JointProfile::quintic};

TEST(Excursion, FromRestToRestIsHalfTheSumOfSquares) {
  for (JointProfile profile : kProfiles) {
    MeasureCase c = random_measure(1, profile);
    c.start.rate.assign(c.start.rate.size(), 0.0);
    FloatingBase base(c.servicer.model, true);
    const Objective m(Objective::Kind::excursion, c.start, c.guess, c.lower, c.upper);
    double expected = 0;
    for (std::size_t j = 0; j < c.position.size(); ++j)
      expected += 0.5 * std::pow(c.position[j] - c.start.position[j], 2);
    EXPECT_DOUBLE_EQ(m.value(base, c.goals, c.position, {}, nullptr), expected);
  }
}

TEST(Excursion, IsTheIntegralOfTheSquaredRates) {
  Worst worst("excursion against the integral over the path, relative");
  for (JointProfile profile : kProfiles) {
    const MeasureCase c = random_measure(2, profile);
    FloatingBase base(c.servicer.model, true);
    const Objective m(Objective::Kind::excursion, c.start, c.guess, c.lower, c.upper);
    const double T = c.start.end - c.start.begin;
    constexpr int kParts = 4000;
    double sum = 0, unit = 0;  // midpoint rule
    for (int k = 0; k < kParts; ++k) {
      const double t = (k + 0.5) / kParts * T;
      unit += std::pow(T * evaluate(JointPath{profile, T, 0, 1, 0, 0}, t).rate, 2);
      for (std::size_t j = 0; j < c.position.size(); ++j) {
        const JointPath path{profile, T, c.start.position[j], c.position[j], c.start.rate[j], c.rate[j]};
        sum += std::pow(T * evaluate(path, t).rate, 2);
      }
    }
    const double value = m.value(base, c.goals, c.position, c.rate, nullptr);
    EXPECT_LT(worst.note(std::abs(value / (0.5 * sum / unit) - 1), 0), 1e-6);  // measured 5.3e-9: the midpoint rule's
  }
}

TEST(Objective, GradientsAgreeWithFiniteDifferences) {
  using Kind = Objective::Kind;
  Worst worst("gradients of measures");
  for (int i = 0; i < 12; ++i) {
    for (Kind kind : {Kind::excursion, Kind::nearest, Kind::limits, Kind::manipulability, Kind::as_found}) {
      SCOPED_TRACE(seed_note(i));
      MeasureCase c = random_measure(i, kProfiles[i % 3]);
      FloatingBase base(c.servicer.model, true);
      const Objective m(kind, c.start, c.guess, c.lower, c.upper);
      Objective::Gradient g;
      m.value(base, c.goals, c.position, c.rate, &g);
      double scale = 1;
      for (double x : g.position) scale = std::max(scale, std::abs(x));
      for (std::size_t j = 0; j < c.position.size(); ++j) {
        const auto difference = [&](std::vector<double>& x) {
          const double h = 1e-4, at = x[j];
          x[j] = at + h;
          const double above = m.value(base, c.goals, c.position, c.rate, nullptr);
          x[j] = at - h;
          const double below = m.value(base, c.goals, c.position, c.rate, nullptr);
          x[j] = at;
          return (above - below) / (2 * h);
        };
        EXPECT_LT(worst.note(std::abs(difference(c.position) - g.position[j]) / scale, i), 1e-5);
        EXPECT_LT(worst.note(std::abs(difference(c.rate) - g.rate[j]) / scale, i), 1e-5);  // measured 9.2e-7
      }
    }
  }
}

}  // namespace objective_test
}  // namespace grapnel::testing
