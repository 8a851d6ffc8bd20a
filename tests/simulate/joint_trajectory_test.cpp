/// Trajectories in pieces: series, splines, joins, breaks.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/simulate/joint_trajectory.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace joint_trajectory_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Values of f at the Chebyshev points of [begin, end], interpolated.
template <class F>
JointTrajectory interpolated(double begin, double end, int n, F f) {
  std::vector<double> values;
  for (int k = 0; k <= n; ++k) values.push_back(f(chebyshev_point(begin, end, k, n)));
  JointTrajectory trajectory;
  trajectory.pieces.push_back({begin, end, chebyshev_interpolant(values)});
  return trajectory;
}

TEST(ChebyshevPiece, ReproducesPolynomialsUpToItsDegree) {
  Worst worst("position, rate, acceleration of interpolated polynomials");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const int n = random.integer(1, 9);
    const std::vector<double> c = random.values(n + 1, 2);
    const double begin = random.uniform(-5, 5), length = random.uniform(0.5, 4);
    // In x = (t - begin)/length by Horner's rule, with derivatives.
    const auto exact = [&](double t) {
      const double x = (t - begin) / length;
      double p = 0, d = 0, e = 0;
      for (int k = n; k >= 0; --k) e = e * x + 2 * d, d = d * x + p, p = p * x + c[k];
      return JointPoint{p, d / length, e / (length * length)};
    };
    const JointTrajectory trajectory =
        interpolated(begin, begin + length, n, [&](double t) { return exact(t).position; });
    for (double x : {0.0, 1e-9, 0.2, 0.5, 0.77, 1.0}) {
      const double t = begin + x * length;
      const JointPoint p = evaluate(trajectory, t), q = exact(t);
      // Markov: rounding grows by n^2 with each derivative.
      EXPECT_LT(worst.note(std::abs(p.position - q.position), i), 1e-13);  // all three measured at most 6e-15
      EXPECT_LT(worst.note(std::abs(p.rate - q.rate) * length / (n * n), i), 1e-12);
      EXPECT_LT(worst.note(std::abs(p.acceleration - q.acceleration) * length * length / (n * n * n * n), i), 1e-11);
    }
  }
}

TEST(ChebyshevPiece, ReproducesSineToRounding) {
  const JointTrajectory trajectory = interpolated(1, 4, 24, [](double t) { return std::sin(t); });
  double position = 0, rate = 0, acceleration = 0;
  for (int k = 0; k <= 300; ++k) {
    const double t = 1 + 0.01 * k;
    const JointPoint p = evaluate(trajectory, t);
    position = std::max(position, std::abs(p.position - std::sin(t)));
    rate = std::max(rate, std::abs(p.rate - std::cos(t)));
    acceleration = std::max(acceleration, std::abs(p.acceleration + std::sin(t)));
  }
  std::printf("[ measured ] sine: %.3g, rate %.3g, acceleration %.3g\n", position, rate, acceleration);
  EXPECT_LT(position, 5e-15);      // measured 1.3e-15
  EXPECT_LT(rate, 5e-13);          // measured 1.1e-13: n^2 times the above
  EXPECT_LT(acceleration, 5e-11);  // measured 8.3e-12: n^4
}

TEST(ChebyshevPiece, PointsIncreaseAndEndExactly) {
  EXPECT_EQ(chebyshev_point(0.1, 0.7, 0, 7), 0.1);
  EXPECT_EQ(chebyshev_point(0.1, 0.7, 7, 7), 0.7);
  for (int k = 0; k < 7; ++k) EXPECT_LT(chebyshev_point(0.1, 0.7, k, 7), chebyshev_point(0.1, 0.7, k + 1, 7));
  EXPECT_THROW(chebyshev_interpolant(std::vector<double>{1}), std::invalid_argument);
}

// Three pieces of different kinds that meet in position and rate, not in acceleration.
JointTrajectory three_pieces() {
  JointTrajectory trajectory;
  trajectory.pieces.push_back({1, 3, JointPath{JointProfile::quintic, 2, 0.5, 1.5, 0.2, -0.4}});
  // 1.5 - 0.4 (t - 3) + 0.7 (t - 3)^2 on [3, 4], in x = 2 t - 7: c0 + c1 x + c2 (2 x^2 - 1).
  trajectory.pieces.push_back({3, 4, ChebyshevPiece{{1.5 - 0.2 + 0.7 * 0.375, -0.2 + 0.35, 0.7 * 0.125}}});
  trajectory.pieces.push_back({4, 6, JointPath{JointProfile::cycloidal, 2, 1.8, 2, 1, 0}});
  return trajectory;
}

TEST(JointTrajectory, RateAndAccelerationAreDerivatives) {
  const JointTrajectory trajectory = three_pieces();
  const double h = 1e-3;
  for (double t : {1.3, 2.1, 2.9, 3.1, 3.5, 3.9, 4.1, 5.0, 5.9}) {
    const auto slope = [&](auto of) {
      return (8 * (of(t + h) - of(t - h)) - (of(t + 2 * h) - of(t - 2 * h))) / (12 * h);
    };
    const JointPoint p = evaluate(trajectory, t);
    EXPECT_NEAR(slope([&](double s) { return evaluate(trajectory, s).position; }), p.rate, 1e-10);
    EXPECT_NEAR(slope([&](double s) { return evaluate(trajectory, s).rate; }), p.acceleration, 1e-9);
  }
}

TEST(JointTrajectory, LaterPieceAppliesAtJoin) {
  const JointTrajectory trajectory = three_pieces();
  for (double join : {3.0, 4.0}) {
    const JointPoint before = evaluate(trajectory, join, join - 0.1), after = evaluate(trajectory, join, join + 0.1);
    EXPECT_NEAR(before.position, after.position, 1e-15);
    EXPECT_NEAR(before.rate, after.rate, 1e-15);
    EXPECT_GT(std::abs(before.acceleration - after.acceleration), 1);
    EXPECT_EQ(evaluate(trajectory, join).acceleration, after.acceleration);
    EXPECT_NEAR(evaluate(trajectory, join - 1e-9).acceleration, before.acceleration, 1e-6);
  }
  EXPECT_NEAR(evaluate(trajectory, 3).acceleration, 1.4, 1e-14);
}

TEST(JointTrajectory, StaysAtItsEnds) {
  const JointTrajectory trajectory = three_pieces();
  for (double t : {-7.0, 0.999}) {
    const JointPoint p = evaluate(trajectory, t);
    EXPECT_EQ(p.position, 0.5);
    EXPECT_EQ(p.rate, 0.2);
    EXPECT_EQ(p.acceleration, 0);
  }
  EXPECT_EQ(evaluate(trajectory, 6).position, 2);
  EXPECT_EQ(evaluate(trajectory, 9).position, 2);
  EXPECT_EQ(evaluate(JointTrajectory(), 2).position, 0);
  const JointPoint rest = evaluate(JointTrajectory::at_rest(0.3), 17);
  EXPECT_EQ(rest.position, 0.3);
  EXPECT_EQ(rest.rate, 0);
  // A parabola: the acceleration holds up to the end itself and vanishes beyond it.
  const JointTrajectory parabola = interpolated(0, 1, 2, [](double t) { return t * t; });
  EXPECT_NEAR(evaluate(parabola, 1).acceleration, 2, 1e-13);
  EXPECT_EQ(evaluate(parabola, 1.1).acceleration, 0);
  EXPECT_EQ(evaluate(parabola, 1, 2).acceleration, 0);
  EXPECT_EQ(evaluate(parabola, 0, -1).acceleration, 0);
}

TEST(JointTrajectory, BreaksAtEndsOfMovingPieces) {
  EXPECT_THAT(break_times(three_pieces()), ElementsAre(1, 3, 4, 6));
  EXPECT_THAT(break_times(JointTrajectory::at_rest(1)), IsEmpty());
  EXPECT_THAT(break_times(JointTrajectory()), IsEmpty());
  JointTrajectory waits = three_pieces();
  waits.pieces.insert(waits.pieces.begin(), {0, 1, ChebyshevPiece{{0.5}}});
  EXPECT_THAT(break_times(waits), ElementsAre(1, 3, 4, 6));
}

struct Samples {
  std::vector<double> times, positions, rates;
};
// Of the cubic 1 - 2 t + 0.5 t^2 + 0.3 t^3 at irregular times.
Samples cubic(std::vector<double> times, double cubed = 0.3, double squared = 0.5) {
  Samples s;
  s.times = std::move(times);
  for (double t : s.times) {
    s.positions.push_back(1 + t * (-2 + t * (squared + t * cubed)));
    s.rates.push_back(-2 + t * (2 * squared + t * 3 * cubed));
  }
  return s;
}

TEST(InterpolateSamples, IsExactForCubics) {
  const Samples s = cubic({-1, -0.3, 0.1, 1.2, 1.5, 3});
  for (bool with_rates : {false, true}) {
    const JointTrajectory trajectory = interpolate_samples(
        s.times, s.positions, with_rates ? std::span<const double>(s.rates) : std::span<const double>());
    EXPECT_EQ(trajectory.pieces.size(), 5u);
    EXPECT_NO_THROW(validate(trajectory));
    for (double t = -1; t < 3; t += 0.07) {
      const JointPoint p = evaluate(trajectory, t);
      EXPECT_NEAR(p.position, 1 + t * (-2 + t * (0.5 + t * 0.3)), 2e-14);
      EXPECT_NEAR(p.rate, -2 + t * (1 + t * 0.9), 1e-13);
      EXPECT_NEAR(p.acceleration, 1 + 1.8 * t, 1e-12);
    }
  }
  // Two samples: a line. Three: a parabola. Four: not-a-knot at both ends makes one cubic.
  const Samples line = cubic({1, 4}, 0, 0), parabola = cubic({1, 2, 4}, 0), four = cubic({0, 1, 3, 4});
  EXPECT_NEAR(evaluate(interpolate_samples(line.times, line.positions), 2.7).position, 1 - 2 * 2.7, 1e-14);
  EXPECT_NEAR(evaluate(interpolate_samples(parabola.times, parabola.positions), 3.3).position,
              1 + 3.3 * (-2 + 3.3 * 0.5), 1e-14);
  EXPECT_NEAR(evaluate(interpolate_samples(four.times, four.positions), 2).acceleration, 1 + 3.6, 1e-13);
}

TEST(InterpolateSamples, SplineHasContinuousAccelerationAndNoKnotNextToTheEnds) {
  Random random(4);
  std::vector<double> times{0}, positions{0.2};
  for (int k = 0; k < 12; ++k) {
    times.push_back(times.back() + random.uniform(0.1, 1));
    positions.push_back(random.uniform(-1, 1));
  }
  const JointTrajectory spline = interpolate_samples(times, positions);
  const auto third = [&](std::size_t k) {
    const double h = times[k + 1] - times[k], middle = times[k] + 0.5 * h;
    return (evaluate(spline, times[k + 1], middle).acceleration - evaluate(spline, times[k], middle).acceleration) / h;
  };
  double jump = 0;
  for (std::size_t k = 1; k + 1 < times.size(); ++k) {
    EXPECT_NEAR(evaluate(spline, times[k]).position, positions[k], 1e-14);
    const JointPoint before = evaluate(spline, times[k], times[k] - 1e-3), after = evaluate(spline, times[k]);
    EXPECT_NEAR(before.rate, after.rate, 1e-12);
    EXPECT_NEAR(before.acceleration, after.acceleration, 1e-10);
    jump = std::max(jump, std::abs(third(k) - third(k - 1)));
  }
  EXPECT_GT(jump, 1);  // a spline, not one cubic
  EXPECT_NEAR(third(0), third(1), 1e-8);
  EXPECT_NEAR(third(times.size() - 2), third(times.size() - 3), 1e-8);
}

TEST(InterpolateSamples, ReproducesRates) {
  const std::vector<double> times{0, 1, 1.5}, positions{0, 2, -1}, rates{1, -3, 0.5};
  const JointTrajectory trajectory = interpolate_samples(times, positions, rates);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(evaluate(trajectory, times[k]).position, positions[k], 1e-15);
    EXPECT_NEAR(evaluate(trajectory, times[k]).rate, rates[k], 1e-14);
  }
  EXPECT_GT(std::abs(evaluate(trajectory, 1, 0.9).acceleration - evaluate(trajectory, 1).acceleration), 1);
}

template <class F>
std::string message_of(F f) {
  try {
    f();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(InterpolateSamples, RejectsInvalidTable) {
  const auto message = [](std::vector<double> t, std::vector<double> p, std::vector<double> v = {}) {
    return message_of([&] { interpolate_samples(t, p, v); });
  };
  EXPECT_THAT(message({1}, {1}), HasSubstr("at least two samples"));
  EXPECT_THAT(message({1, 2}, {1}), HasSubstr("differ in number"));
  EXPECT_THAT(message({1, 2}, {1, 2}, {1}), HasSubstr("differ in number"));
  EXPECT_THAT(message({1, 1}, {1, 2}), HasSubstr("times must increase"));
  EXPECT_THAT(message({1, 2}, {1, NAN}), HasSubstr("not finite"));
  EXPECT_THAT(message({1, 2}, {1, 2}, {0, INFINITY}), HasSubstr("not finite"));
  EXPECT_EQ(message({1, 2}, {1, 2}, {0, 0}), "accepted");
}

TEST(JointTrajectory, ValidationNamesError) {
  const auto message = [](const JointTrajectory& trajectory) { return message_of([&] { validate(trajectory); }); };
  EXPECT_EQ(message(three_pieces()), "accepted");
  EXPECT_EQ(message({0.1, JointPath{JointProfile::quintic, 0.2, 0, 1, 0, 0}}), "accepted");  // 0.1 + 0.2 rounds
  JointTrajectory gap = three_pieces();
  gap.pieces.erase(gap.pieces.begin() + 1);
  EXPECT_THAT(message(gap), HasSubstr("begin where the previous one ends"));
  JointTrajectory backwards = three_pieces();
  backwards.pieces[0].begin = 5;
  EXPECT_THAT(message(backwards), HasSubstr("end after it begins"));
  JointTrajectory longer = three_pieces();
  std::get<JointPath>(longer.pieces[2].shape).duration = 3;
  EXPECT_THAT(message(longer), HasSubstr("last as long as its piece"));
  JointTrajectory empty = three_pieces();
  empty.pieces[1].shape = ChebyshevPiece{};
  EXPECT_THAT(message(empty), HasSubstr("needs coefficients"));
}

}  // namespace joint_trajectory_test
}  // namespace grapnel::testing
