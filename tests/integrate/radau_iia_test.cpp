// Radau IIA: order with and without stiffness, dense output, quadratures, and repeated steps.
#include "grapnel/integrate/radau_iia.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "integrate/problems.hpp"

namespace grapnel {
namespace radau_iia_test {

using problems::largest_difference;
using problems::Vector;

// Point by point.
template <class Derivative>
auto at_each(Derivative derivative) {
  return [derivative](std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
    const std::size_t n = y.size() / t.size();
    for (std::size_t k = 0; k < t.size(); ++k) derivative(t[k], y.subspan(k * n, n), dydt.subspan(k * n, n));
  };
}

// x' = w, w' = -(x - s) / e^2 - 2 (w - s') / e + s'' with s = cos(t + 0.7), and the integral of w s': x = s, w = s',
// however stiff the spring.
double phase(double t) { return t + 0.7; }
StiffSystem held_to_cosine(double e) {
  return {1, 1, 1, at_each([e](double t, std::span<const double> y, std::span<double> dydt) {
            const double c = std::cos(phase(t)), s = std::sin(phase(t));
            dydt[0] = y[1];
            dydt[1] = -(y[0] - c) / (e * e) - 2 * (y[1] + s) / e - c;
            dydt[2] = -y[1] * s;
          })};
}
Vector cosine_at(double t) {
  return {std::cos(phase(t)), -std::sin(phase(t)), 0.5 * t - 0.25 * (std::sin(2 * phase(t)) - std::sin(2 * phase(0)))};
}

// Two-body motion, nonlinear.
StiffSystem kepler() { return {2, 2, 0, at_each(problems::Kepler{})}; }

RadauIIA radau_with(StiffSystem system, const Vector& start, double tolerance, double first_step) {
  const Vector sizes(start.size(), 1.0), tolerances(start.size(), tolerance);
  RadauIIA radau(std::move(system), start, sizes, tolerances);
  radau.restart(first_step);
  return radau;
}

// Errors of one step of length h from the exact solution: at its end, of the quadrature, between its stages.
struct Errors {
  double end = 0, work = 0, between = 0;
};
Errors errors_of_a_step(double e, double h) {
  RadauIIA radau = radau_with(held_to_cosine(e), cosine_at(0), 1e-9, 1e-3);
  EXPECT_TRUE(radau.step(1e-3));
  EXPECT_TRUE(radau.end_at(h));  // for any estimated error
  const Vector exact = cosine_at(h);
  Errors errors{largest_difference(radau.y().first(2), exact), std::abs(radau.y()[2] - exact[2])};
  Vector y(3);
  for (double share : {0.13, 0.4, 0.77}) {
    radau.at(share * h, y);
    errors.between = std::max(errors.between, largest_difference(std::span(y).first(2), cosine_at(share * h)));
  }
  return errors;
}

double order(double coarse, double fine) { return std::log2(coarse / fine); }

// Steps shorter than all time scales: the error is of order h^10 at the end, also for quadratures, and h^6 between
// stages.
TEST(RadauIIA, OrderIsNine) {
  const Errors coarse = errors_of_a_step(1, 1), fine = errors_of_a_step(1, 0.5);
  std::printf("[ measured ] powers of h: end %.2f, quadrature %.2f, between %.2f; errors %.2g, %.2g, %.2g\n",
              order(coarse.end, fine.end), order(coarse.work, fine.work), order(coarse.between, fine.between), fine.end,
              fine.work, fine.between);
  EXPECT_NEAR(order(coarse.end, fine.end), 10, 0.5);         // measured 9.85
  EXPECT_NEAR(order(coarse.work, fine.work), 10, 1);         // measured 9.36
  EXPECT_NEAR(order(coarse.between, fine.between), 6, 0.5);  // measured 6.31
}

// Steps ten thousand times longer than the stiff time scale: the order is reduced to that of the stages [Hairer and
// Wanner 1996, IV.15].
TEST(RadauIIA, OrderOnAStiffProblem) {
  const Errors coarse = errors_of_a_step(1e-5, 0.5), fine = errors_of_a_step(1e-5, 0.25);
  std::printf("[ measured ] stiff: power of h %.2f, error %.2g; between %.2f, %.2g\n", order(coarse.end, fine.end),
              fine.end, order(coarse.between, fine.between), fine.between);
  EXPECT_NEAR(order(coarse.end, fine.end), 5, 0.5);          // measured 4.75
  EXPECT_NEAR(order(coarse.between, fine.between), 5, 0.5);  // measured 4.80
  EXPECT_LT(fine.end, 1e-7);                                 // measured 3.6e-8
}

TEST(RadauIIA, StepsFollowTheTolerance) {
  const double e = 0.5, until = 2 * std::numbers::pi;
  double last = 0;
  long last_steps = 0;
  for (double tolerance : {1e-5, 1e-7, 1e-9}) {
    RadauIIA radau = radau_with(kepler(), problems::Kepler::exact(0, e), tolerance, 1e-3);
    long steps = 0;
    while (radau.time() < until) {
      ASSERT_TRUE(radau.step(until)) << radau.message();
      ++steps;
    }
    EXPECT_EQ(radau.time(), until);
    const double error = largest_difference(radau.y(), problems::Kepler::exact(until, e));
    std::printf("[ measured ] tolerance %.0e: error %.2g, %ld steps, %ld evaluations, %ld iterations\n", tolerance,
                error, steps, radau.evaluations(), radau.iterations());
    EXPECT_LT(error, tolerance);  // measured 0.04 of it at most: the end is better than the estimate
    if (last > 0) {
      EXPECT_LT(error, 0.1 * last);
      EXPECT_LT(steps, 3 * last_steps);  // a hundredth of the error by 100^(1/6) = 2.2 times the steps
    }
    last = error, last_steps = steps;
  }
}

// A step repeated with an earlier end has the accuracy of a step's end, not that of the polynomial; a step that ends at
// its begin is no step.
TEST(RadauIIA, StepsEndAtGivenTimes) {
  RadauIIA radau = radau_with(held_to_cosine(1), cosine_at(0), 1e-7, 0.25);
  radau.limit_step(0.25);
  ASSERT_TRUE(radau.step(10));
  ASSERT_TRUE(radau.step(10));
  EXPECT_EQ(radau.time(), 0.5);
  Vector y(3);
  radau.at(0.4, y);
  const double between = largest_difference(y, cosine_at(0.4));
  ASSERT_TRUE(radau.end_at(0.4));
  EXPECT_EQ(radau.time(), 0.4);
  EXPECT_EQ(radau.begin(), 0.25);
  const double ended = largest_difference(radau.y(), cosine_at(0.4));
  std::printf("[ measured ] %.2g between, %.2g when it ends there\n", between, ended);
  EXPECT_LT(ended, 1e-2 * between);
  ASSERT_TRUE(radau.end_at(0.25));
  EXPECT_EQ(radau.time(), 0.25);
  EXPECT_LT(largest_difference(radau.y(), cosine_at(0.25)), 1e-2 * between);
  ASSERT_TRUE(radau.step(0.3));
  EXPECT_EQ(radau.time(), 0.3);
  EXPECT_LT(largest_difference(radau.y(), cosine_at(0.3)), 1e-2 * between);
}

// The last points evaluated together are the stages of the accepted step, and the step's end is not evaluated again.
TEST(RadauIIA, EvaluatesTheStagesLast) {
  const StiffSystem inner = held_to_cosine(0.1);
  Vector times, begin;
  std::vector<int> alone;  // number of evaluations at a step's begin
  const auto noting = [&](std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
    if (t.size() == RadauIIA::kStages) times.assign(t.begin(), t.end());
    if (t.size() == 1) alone.back() += std::equal(y.begin(), y.end(), begin.begin());
    inner.derivatives(t, y, dydt);
  };
  RadauIIA radau = radau_with({1, 1, 1, noting}, cosine_at(0), 1e-7, 0.01);
  for (int step = 0; step < 6; ++step) {
    alone.push_back(0);
    begin.assign(radau.y().begin(), radau.y().end());
    if (step == 4) radau.jump();
    ASSERT_TRUE(radau.step(10));
    if (step == 2) {
      ASSERT_TRUE(radau.end_at(0.5 * (radau.begin() + radau.time())));
    }
    for (int i = 0; i < RadauIIA::kStages; ++i) EXPECT_EQ(times[i], radau.time_of_stage(i));
  }
  EXPECT_EQ(alone, (std::vector<int>{1, 0, 0, 0, 1, 0}));
  EXPECT_LT(largest_difference(radau.y(), cosine_at(radau.time())), 1e-7);  // measured 8.9e-9
}

TEST(RadauIIA, ReportsWhenNoStepSucceeds) {
  const StiffSystem broken{1, 1, 0, at_each([](double t, std::span<const double> y, std::span<double> dydt) {
                             dydt[0] = y[1];
                             dydt[1] = t > 0.1 ? NAN : -y[0];
                           })};
  RadauIIA radau = radau_with(broken, {1, 0}, 1e-6, 0.05);
  bool made = true;
  for (int i = 0; made && i < 200; ++i) made = radau.step(1);
  EXPECT_FALSE(made);
  EXPECT_LE(radau.time(), 0.1);
  EXPECT_NE(radau.message().find("no step succeeds"), std::string::npos) << radau.message();
}

}  // namespace radau_iia_test
}  // namespace grapnel
