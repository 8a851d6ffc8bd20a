// The stepper that changes between DOP853 and Radau IIA: stiff problems with known solutions, and the choice.
#include "grapnel/integrate/automatic_stepper.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "grapnel/integrate/integrate.hpp"
#include "integrate/problems.hpp"

namespace grapnel {
namespace automatic_stepper_test {

using problems::largest_difference;
using problems::Vector;

// A mass on a spring and damper of time constant `e` that follows cos(t + 0.7): x'' = s'' - (x - s)/e^2 - 2 (x' -
// s')/e, and the integral of x' s', on which nothing depends. From any start, x = s after some e.
struct Follower {
  double e;
  static double s(double t) { return std::cos(t + 0.7); }
  static double ds(double t) { return -std::sin(t + 0.7); }
  void operator()(double t, std::span<const double> y, std::span<double> dydt) const {
    dydt[0] = y[1];
    dydt[1] = -s(t) - (y[0] - s(t)) / (e * e) - 2 * (y[1] - ds(t)) / e;
    dydt[2] = y[1] * ds(t);
  }
  static void coupled(std::vector<int>& numbers) { numbers.insert(numbers.end(), {0, 1}); }
};

// Robertson's reaction, up to t = 1e11; the solution of the test set for IVP solvers (Mazzia and Magherini, ROBER).
TEST(AutomaticStepper, Robertson) {
  const auto rhs = [](double, std::span<const double> y, std::span<double> dydt) {
    const double a = 0.04 * y[0], b = 1e4 * y[1] * y[2], c = 3e7 * y[1] * y[1];
    dydt[0] = -a + b;
    dydt[1] = a - b - c;
    dydt[2] = c;
  };
  const Vector start = {1, 0, 0}, exact = {2.083340149701255e-8, 8.333360770334713e-14, 0.9999999791665050};
  AutomaticStepper stepper({.size = 3}, {.rtol = 1e-9, .atol = 1e-9, .atol_components = {1e-12, 1e-16, 1e-12}});
  const IntegrationResult result = integrate(stepper, rhs, 0, start, 1e11);
  ASSERT_TRUE(result.finished()) << result.explanation();
  std::printf("[ measured ] relative errors %.2g, %.2g, %.2g, steps %d, implicit %d, evaluations %d\n",
              stepper.state()[0] / exact[0] - 1, stepper.state()[1] / exact[1] - 1, stepper.state()[2] / exact[2] - 1,
              static_cast<int>(result.statistics.accepted), static_cast<int>(stepper.implicit_steps()),
              static_cast<int>(result.statistics.rhs_evaluations));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(stepper.state()[i] / exact[i], 1, 1e-5) << i;
}

// |y(t + h)/y(t)| of DOP853 for y' = lambda y and z = h lambda.
double growth(std::complex<double> z) {
  using Complex = std::complex<double>;
  std::array<Complex, dop853::kExtendedStages> stages{Complex(1)};
  const Complex from = 1;
  Complex state, end, error5, error3;
  const dop853::StepStages<Complex> step{0, z, 1, &from, &state, stages.data()};
  const auto rhs = [](Complex, const Complex* y, Complex* dydt) { *dydt = *y; };
  dop853::evaluate_stages(rhs, step, &end, &error5, &error3);
  return std::abs(end);
}

// The limit of stability is nearly the same in all directions, from vibrations to dampers, so that one criterion
// serves.
TEST(AutomaticStepper, StabilityLimitOfExplicitSteps) {
  double least = 100, largest = 0, imaginary = 0, real = 0;
  for (int degree = 90; degree <= 180; ++degree) {
    const std::complex<double> direction = std::polar(1.0, degree * std::numbers::pi / 180);
    double limit = 0.01;
    while (growth((limit + 0.01) * direction) <= 1 + 1e-9) limit += 0.01;
    least = std::min(least, limit), largest = std::max(largest, limit);
    if (degree == 90) imaginary = limit;
    if (degree == 180) real = limit;
  }
  std::printf("[ measured ] h |lambda| at most %.2f (imaginary) and %.2f (real); %.2f to %.2f\n", imaginary, real,
              least, largest);
  EXPECT_NEAR(imaginary, 5.97, 0.02);
  EXPECT_NEAR(real, 6.39, 0.02);
  EXPECT_GT(least, 5.9);
  EXPECT_LT(largest, 6.9);
}

// A motion that is not stiff: the same steps as DOP853, bit by bit.
TEST(AutomaticStepper, IsDormandPrinceWithoutStiffness) {
  const Vector start = problems::Kepler::exact(0, 0.5);
  AutomaticStepper stepper({.size = 4}, {});
  DormandPrince853<double> reference({.size = 4}, {});
  const IntegrationResult result = integrate(stepper, problems::Kepler{}, 0, start, 50);
  const IntegrationResult expected = integrate(reference, problems::Kepler{}, 0, start, 50);
  EXPECT_EQ(result.statistics.rhs_evaluations, expected.statistics.rhs_evaluations);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(stepper.state()[i], reference.state()[i]);
  EXPECT_EQ(stepper.implicit_steps(), 0);
}

// Stiffness that ends: y' = -k(t) (y - s) + s' with k from 1e5 to 1 around t = 5. Explicit steps are long then.
TEST(AutomaticStepper, ReturnsToExplicitSteps) {
  const auto rhs = [](double t, std::span<const double> y, std::span<double> dydt) {
    const double k = 1 + 1e5 / (1 + std::exp(4 * (t - 5)));
    dydt[0] = -k * (y[0] - Follower::s(t)) + Follower::ds(t);
  };
  AutomaticStepper stepper({.size = 1}, {.rtol = 1e-10, .atol = 1e-10});
  const Vector start = {Follower::s(0)};
  const IntegrationResult result = integrate(stepper, rhs, 0, start, 40);
  ASSERT_TRUE(result.finished()) << result.explanation();
  ASSERT_EQ(stepper.implicit_spans().size(), 1u);
  std::printf("[ measured ] implicit up to %.3g, error %.2g, evaluations %d\n", stepper.implicit_spans()[0][1],
              std::abs(stepper.state()[0] - Follower::s(40)), static_cast<int>(result.statistics.rhs_evaluations));
  EXPECT_GT(stepper.implicit_spans()[0][1], 5);
  EXPECT_LT(stepper.implicit_spans()[0][1], 12);
  EXPECT_NEAR(stepper.state()[0], Follower::s(40), 1e-8);
}

// Sampled control: the end time moves, the derivative jumps, the state is replaced; implicit steps continue.
TEST(AutomaticStepper, StepsAcrossSamples) {
  double force = 0;
  const double e = 1e-5;
  const auto rhs = [&](double, std::span<const double> y, std::span<double> dydt) {
    dydt[0] = y[1];
    dydt[1] = force - y[0] / (e * e) - 2 * y[1] / e;
  };
  AutomaticStepper stepper({.size = 2}, {.rtol = 1e-10, .atol = 1e-16});
  const Vector start = {0, 0};
  stepper.start(rhs, 0, start, 0.01);
  for (int sample = 0; sample < 100; ++sample) {
    while (stepper.status() == StepStatus::running) stepper.step(rhs);
    ASSERT_EQ(stepper.status(), StepStatus::finished) << stepper.explanation();
    EXPECT_NEAR(stepper.state()[0], force * e * e, 1e-12 * (1 + std::abs(force)));
    const Vector same(stepper.state().begin(), stepper.state().end());
    force = std::sin(0.1 * sample);
    stepper.set_end_time(0.01 * (sample + 2));
    stepper.set_state(rhs, same);
  }
  EXPECT_GT(stepper.implicit_steps(), 0);
  EXPECT_LT(stepper.statistics().rhs_evaluations, 100000);  // DOP853 alone: 12 * 1/(6e-5) = 2e5
}

TEST(AutomaticStepper, LimitsHold) {
  AutomaticStepper few({.size = 3}, {.rtol = 1e-10, .atol = 1e-10}, {.max_steps = 20});
  const Vector start = {Follower::s(0), Follower::ds(0), 0};
  EXPECT_EQ(integrate(few, Follower{1e-5}, 0, start, 1).status, StepStatus::too_many_steps);
  AutomaticStepper shorter({.size = 3}, {.rtol = 1e-10, .atol = 1e-10}, {.max_step = 0.01});
  EXPECT_TRUE(integrate(shorter, Follower{1e-5}, 0, start, 1).finished());
  EXPECT_GE(shorter.statistics().accepted, 100);
}

// Steps of the implicit stepper for a follower, and the error of an integral with the rate g(t, y), on which nothing
// depends; without its error control if `controlled` is false.
struct IntegratedSteps {
  double error = 0;
  int steps = 0, rejected = 0;
};
template <class Rate>
IntegratedSteps integrate_rate(const Follower& follower, const Rate& rate, double exact, bool controlled) {
  const auto rhs = [&](double t, std::span<const double> y, std::span<double> dydt) {
    follower(t, y, dydt);
    dydt[2] = rate(t, y);
  };
  RadauStepper stepper({.size = 3, .controlled = controlled ? 3 : 2}, {.rtol = 1e-10, .atol = 1e-10}, {}, {0, 1});
  const Vector start = {Follower::s(0), Follower::ds(0), 0};
  const IntegrationResult result = integrate(stepper, rhs, 0, start, 10);
  EXPECT_TRUE(result.finished()) << result.explanation();
  return {std::abs(stepper.state()[2] - exact), static_cast<int>(result.statistics.accepted),
          static_cast<int>(result.statistics.rejected)};
}

// The rate of the integral changes faster than the motion, so that the integral limits the steps.
TEST(RadauStepper, IntegralsAreUnderErrorControl) {
  const auto rate = [](double t, std::span<const double>) { return std::cos(40 * t); };
  const double exact = std::sin(400.0) / 40;
  const IntegratedSteps with = integrate_rate({1e-3}, rate, exact, true);
  const IntegratedSteps without = integrate_rate({1e-3}, rate, exact, false);
  std::printf("[ measured ] error %.2g in %d steps; without control %.2g in %d\n", with.error, with.steps,
              without.error, without.steps);
  EXPECT_LT(with.error, 1e-9);
  EXPECT_GT(without.error, 1e-6);
}

// The rate magnifies errors of the fast velocity, which die out within a step. The estimate leaves them out: the error
// at the begin of a step rejects no step.
TEST(RadauStepper, IntegralsOfFastModesRejectFewSteps) {
  const auto rate = [](double t, std::span<const double> y) { return 1e5 * (y[1] - Follower::ds(t)) + 1; };
  const IntegratedSteps with = integrate_rate({1e-5}, rate, 10, true);
  std::printf("[ measured ] error %.2g, %d steps, %d rejected\n", with.error, with.steps, with.rejected);
  EXPECT_LT(with.error, 1e-8);
  EXPECT_LT(with.rejected, 20);
}

TEST(RadauStepper, ArgumentsAreChecked) {
  const auto rhs = [](double, std::span<const double> y, std::span<double> dydt) { dydt[0] = -y[0]; };
  EXPECT_THROW(RadauStepper({.size = 2}, {}, {}, {0, 2}), std::invalid_argument);
  EXPECT_THROW(RadauStepper({.size = 2}, {}, {}, {1, 0}), std::invalid_argument);
  EXPECT_THROW(RadauStepper({.size = 2}, {.rtol = -1}, {}, {0}), std::invalid_argument);
  EXPECT_THROW(RadauStepper({.size = 2}, {}, {.max_steps = 0}, {0}), std::invalid_argument);
  RadauStepper stepper({.size = 1}, {}, {}, {0});
  const Vector start = {1};
  EXPECT_THROW(stepper.start(rhs, 0, start, -1), std::invalid_argument);
  EXPECT_THROW(stepper.propose_step(0), std::invalid_argument);
  EXPECT_THROW(stepper.prepare_dense_output(rhs), std::logic_error);
}

// Limited explicit steps until a trial.
int steps_until_trial(StiffnessMonitor& monitor) {
  constexpr int kMost = 10'000;
  for (int steps = 1; steps <= kMost; ++steps) {
    if (monitor.explicit_step({.size = 1e-3, .product = 5, .bend = 1e3, .motion = 5})) return steps;
  }
  return kMost;
}

// A trial of six implicit steps of 1 s in total, judged once, whose explicit steps would cost 14/6 of `radius` =>
// whether explicit steps are preferred.
bool judge(StiffnessMonitor& monitor, double radius) {
  monitor.begin_trial();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(monitor.implicit_step(0));
  EXPECT_TRUE(monitor.implicit_step(0));
  return monitor.prefers_explicit(1, {.evaluations = 1000, .factorizations = 1}, 2, radius);
}

TEST(StiffnessMonitor, TrialThatPaysResetsTheWaitAlsoIfAnEventEndsIt) {
  StiffnessMonitor monitor;
  EXPECT_EQ(steps_until_trial(monitor), 15);
  EXPECT_TRUE(judge(monitor, 100));
  EXPECT_EQ(steps_until_trial(monitor), 15);  // 30 in total
  EXPECT_TRUE(judge(monitor, 100));
  EXPECT_EQ(steps_until_trial(monitor), 30);  // 60 in total
  EXPECT_FALSE(judge(monitor, 1e4));
  monitor.forget();  // an event
  EXPECT_EQ(steps_until_trial(monitor), 15);
}

}  // namespace automatic_stepper_test
}  // namespace grapnel
