#include "grapnel/integrate/dormand_prince_853.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "integrate/problems.hpp"

namespace grapnel {
namespace dormand_prince_853_test {

using problems::Coupled;
using problems::Kepler;
using problems::largest_difference;
using problems::Vector;
using Stepper853 = DormandPrince853<double>;

const Tolerances kNoErrorControl{.rtol = 1e10, .atol = 1e10};

StepControl fixed_step(double h) { return {.initial_step = h, .max_step = h}; }

template <class Rhs>
void run(Stepper853& stepper, Rhs&& rhs, double t0, const Vector& y0, double t1) {
  stepper.start(rhs, t0, y0, t1);
  while (stepper.step(rhs) == StepStatus::running) {
  }
}

struct FixedStepErrors {
  double end;
  double dense;
};

FixedStepErrors errors_of_fixed_steps(double t_end, int steps) {
  Stepper853 stepper({.size = Coupled::kSize}, kNoErrorControl, fixed_step(t_end / steps));
  const Coupled rhs;
  stepper.start(rhs, 0.0, Coupled::exact(0.0), t_end);
  FixedStepErrors errors{0.0, 0.0};
  Vector y(Coupled::kSize);
  while (stepper.status() == StepStatus::running) {
    stepper.step(rhs);
    for (const double theta : {0.3, 0.5, 0.8}) {
      const double t = stepper.previous_time() + theta * (stepper.time() - stepper.previous_time());
      stepper.interpolate(rhs, t, y);
      errors.dense = std::max(errors.dense, largest_difference(y, Coupled::exact(t)));
    }
  }
  EXPECT_EQ(stepper.statistics().accepted, steps);
  EXPECT_EQ(stepper.statistics().rejected, 0);
  errors.end = largest_difference(stepper.state(), Coupled::exact(t_end));
  return errors;
}

TEST(DormandPrince853, ConvergesWithOrder8) {
  const double coarse = errors_of_fixed_steps(8.0, 32).end;
  const double fine = errors_of_fixed_steps(8.0, 64).end;
  const double finest = errors_of_fixed_steps(8.0, 128).end;
  EXPECT_NEAR(std::log2(coarse / fine), 8.0, 0.5) << coarse << " " << fine;  // measured 8.2
  EXPECT_NEAR(std::log2(fine / finest), 8.0, 0.5) << fine << " " << finest;  // measured 7.7
}

// Of order 7, so its error within one step is of order h⁸; here it is a thousand times the error at the ends.
TEST(DormandPrince853, DenseOutputConvergesWithOrder7) {
  const FixedStepErrors coarse = errors_of_fixed_steps(4.0, 32);
  const FixedStepErrors fine = errors_of_fixed_steps(4.0, 64);
  EXPECT_GT(fine.dense, 100.0 * fine.end);  // measured 400 times
  EXPECT_NEAR(std::log2(coarse.dense / fine.dense), 8.0, 0.5) << coarse.dense << " " << fine.dense;  // measured 7.8
}

// SciPy 1.10's DOP853 has the same error, 1.205e-10, with the same 906 steps: this is the error of the method.
TEST(DormandPrince853, KeplerOrbitAgainstClosedForm) {
  constexpr double kEccentricity = 0.6;
  const double t_end = 20.0 * std::numbers::pi + 1.0;  // slightly more than ten revolutions
  Stepper853 stepper({.size = Kepler::kSize}, {.rtol = 1e-13, .atol = 1e-13});
  const Kepler rhs;
  stepper.start(rhs, 0.0, Kepler::exact(0.0, kEccentricity), t_end);
  double dense_error = 0.0;
  Vector y(Kepler::kSize);
  while (stepper.status() == StepStatus::running) {
    stepper.step(rhs);
    const double middle = 0.5 * (stepper.previous_time() + stepper.time());
    stepper.interpolate(rhs, middle, y);
    dense_error = std::max(dense_error, largest_difference(y, Kepler::exact(middle, kEccentricity)));
  }
  ASSERT_EQ(stepper.status(), StepStatus::finished);
  EXPECT_EQ(stepper.time(), t_end);
  EXPECT_LT(largest_difference(stepper.state(), Kepler::exact(t_end, kEccentricity)), 1e-9);  // measured 1.2e-10
  EXPECT_LT(dense_error, 5e-9);                                                               // measured 7.4e-10
  EXPECT_LT(stepper.statistics().rhs_evaluations, 16000);                                     // measured 14000
}

// The Arenstorf orbit returns to its start after one period (HNW I, II.0, (0.1)–(0.2)); the close passage of the earth
// amplifies errors by several orders of magnitude.
TEST(DormandPrince853, ArenstorfOrbitCloses) {
  const auto rhs = [](double, std::span<const double> y, std::span<double> dydt) {
    const double mu = 0.012277471, rest = 1.0 - mu;
    const double d1 = std::pow((y[0] + mu) * (y[0] + mu) + y[1] * y[1], 1.5);
    const double d2 = std::pow((y[0] - rest) * (y[0] - rest) + y[1] * y[1], 1.5);
    dydt[0] = y[2];
    dydt[1] = y[3];
    dydt[2] = y[0] + 2.0 * y[3] - rest * (y[0] + mu) / d1 - mu * (y[0] - rest) / d2;
    dydt[3] = y[1] - 2.0 * y[2] - rest * y[1] / d1 - mu * y[1] / d2;
  };
  const Vector y0 = {0.994, 0.0, 0.0, -2.00158510637908252240537862224};
  Stepper853 stepper({.size = 4}, {.rtol = 1e-14, .atol = 1e-14});
  run(stepper, rhs, 0.0, y0, 17.0652165601579625588917206249);
  ASSERT_EQ(stepper.status(), StepStatus::finished);
  EXPECT_LT(std::hypot(stepper.state()[0] - y0[0], stepper.state()[1] - y0[1]), 1e-9);  // measured 1.3e-12
}

TEST(DormandPrince853, ErrorFollowsTheTolerance) {
  double previous = 0.0;
  for (const double tolerance : {1e-5, 1e-7, 1e-9, 1e-11}) {
    Stepper853 stepper({.size = Kepler::kSize}, {.rtol = tolerance, .atol = tolerance});
    run(stepper, Kepler{}, 0.0, Kepler::exact(0.0, 0.6), 7.0);
    const double error = largest_difference(stepper.state(), Kepler::exact(7.0, 0.6));
    EXPECT_LT(error, 100.0 * tolerance) << tolerance;  // measured 1 … 19 times the tolerance
    EXPECT_GT(error, 1e-3 * tolerance) << tolerance;   // no step wasted; measured 1 times
    if (previous > 0.0) {
      EXPECT_NEAR(std::log10(previous / error), 2.0, 1.2) << tolerance;  // measured 1.3 … 2.0
    }
    previous = error;
  }
}

// Ten turns on an orbit of eccentricity 0.9: before every passage the error grows from step to step.
TEST(DormandPrince853, PredictiveControlRejectsFewerSteps) {
  constexpr double kEccentricity = 0.9, kEnd = 63;
  IntegrationStatistics statistics[2];
  for (const bool predictive : {false, true}) {
    Stepper853 stepper({.size = Kepler::kSize}, {.rtol = 1e-12, .atol = 1e-12}, {.predictive = predictive});
    run(stepper, Kepler{}, 0.0, Kepler::exact(0.0, kEccentricity), kEnd);
    EXPECT_LT(largest_difference(stepper.state(), Kepler::exact(kEnd, kEccentricity)), 1e-6);
    statistics[predictive ? 1 : 0] = stepper.statistics();
  }
  const auto &before = statistics[0], &after = statistics[1];
  std::printf("[ measured ] rejected %ld -> %ld of %ld -> %ld steps, evaluations %ld -> %ld\n",
              static_cast<long>(before.rejected), static_cast<long>(after.rejected), static_cast<long>(before.accepted),
              static_cast<long>(after.accepted), static_cast<long>(before.rhs_evaluations),
              static_cast<long>(after.rhs_evaluations));
  EXPECT_LT(after.rejected, before.rejected / 2);
  EXPECT_LT(after.rhs_evaluations, before.rhs_evaluations);
}

TEST(DormandPrince853, BackwardIntegrationReturnsToTheStart) {
  Stepper853 stepper({.size = Kepler::kSize}, {.rtol = 1e-13, .atol = 1e-13});
  const Vector y0 = Kepler::exact(0.0, 0.6);
  run(stepper, Kepler{}, 0.0, y0, 10.0);
  const Vector there(stepper.state().begin(), stepper.state().end());
  EXPECT_GT(largest_difference(there, y0), 0.5);
  run(stepper, Kepler{}, 10.0, there, -3.0);
  EXPECT_EQ(stepper.status(), StepStatus::finished);
  EXPECT_EQ(stepper.time(), -3.0);
  EXPECT_LT(stepper.time(), stepper.previous_time());
  EXPECT_LT(largest_difference(stepper.state(), Kepler::exact(-3.0, 0.6)), 1e-11);  // measured 5.3e-12
}

TEST(DormandPrince853, EndsExactlyAndInterpolatesTheEndsOfTheStepExactly) {
  Stepper853 stepper({.size = Coupled::kSize}, {});
  const Coupled rhs;
  const double t0 = 0.1, t_end = 2.0 / 3.0;
  stepper.start(rhs, t0, Coupled::exact(t0), t_end);
  Vector before(stepper.state().begin(), stepper.state().end()), y(2);
  while (stepper.status() == StepStatus::running) {
    stepper.step(rhs);
    stepper.interpolate(rhs, stepper.previous_time(), y);
    EXPECT_EQ(y, before);
    before.assign(stepper.state().begin(), stepper.state().end());
    stepper.interpolate(rhs, stepper.time(), y);
    EXPECT_EQ(y, before);
  }
  EXPECT_EQ(stepper.time(), t_end);
  EXPECT_EQ(stepper.status(), StepStatus::finished);
}

TEST(DormandPrince853, DenseOutputCostsThreeEvaluationsOnRequest) {
  Stepper853 stepper({.size = Coupled::kSize}, {});
  const Coupled rhs;
  Vector y(2);
  stepper.start(rhs, 0.0, Coupled::exact(0.0), 3.0);
  EXPECT_EQ(stepper.statistics().rhs_evaluations, 2);
  EXPECT_THROW(stepper.interpolate(rhs, 0.0, y), std::logic_error);
  stepper.step(rhs);
  ASSERT_EQ(stepper.statistics().rejected, 0);
  EXPECT_EQ(stepper.statistics().rhs_evaluations, 14);
  EXPECT_THROW(stepper.interpolate(0.5 * stepper.time(), y), std::logic_error);
  stepper.interpolate(rhs, 0.5 * stepper.time(), y);
  stepper.interpolate(rhs, 0.7 * stepper.time(), y);
  stepper.interpolate(0.2 * stepper.time(), y);
  EXPECT_EQ(stepper.statistics().rhs_evaluations, 17);
  EXPECT_THROW(stepper.interpolate(1.1 * stepper.time(), y), std::out_of_range);
  EXPECT_THROW(stepper.interpolate(std::nan(""), y), std::out_of_range);
  stepper.step(rhs);
  EXPECT_EQ(stepper.statistics().rhs_evaluations, 29);
  EXPECT_THROW(stepper.interpolate(stepper.time(), y), std::logic_error);
}

TEST(DormandPrince853, BlowUpIsReportedWithItsTime) {
  const auto rhs = [](double, std::span<const double> y, std::span<double> dydt) { dydt[0] = y[0] * y[0]; };
  Stepper853 stepper({.size = 1}, {});
  EXPECT_EQ(stepper.status(), StepStatus::not_started);
  EXPECT_EQ(stepper.step(rhs), StepStatus::not_started);
  run(stepper, rhs, 0.0, {1.0}, 2.0);  // y = 1/(1 − t)
  EXPECT_EQ(stepper.status(), StepStatus::step_too_small) << stepper.explanation();
  EXPECT_NEAR(stepper.time(), 1.0, 1e-9);  // measured 8.2e-12
  EXPECT_THAT(stepper.explanation(), ::testing::HasSubstr("failed at t = "));
  EXPECT_THROW(stepper.reset_derivative(rhs), std::logic_error);
  run(stepper, rhs, 0.0, {1.0}, 0.5);  // a stepper may be restarted
  EXPECT_EQ(stepper.status(), StepStatus::finished);
  EXPECT_NEAR(stepper.state()[0], 2.0, 1e-8);  // measured 1.5e-11
}

TEST(DormandPrince853, NonFiniteRightHandSideIsReportedWithItsTime) {
  const auto rhs = [](double t, std::span<const double>, std::span<double> dydt) {
    dydt[0] = t <= 0.7 ? 1.0 : std::nan("");
  };
  Stepper853 stepper({.size = 1}, {});
  run(stepper, rhs, 0.0, {0.0}, 2.0);
  EXPECT_EQ(stepper.status(), StepStatus::non_finite);
  EXPECT_NEAR(stepper.time(), 0.7, 1e-13);  // measured 3.4e-15
  run(stepper, rhs, 1.0, {0.0}, 2.0);
  EXPECT_EQ(stepper.status(), StepStatus::non_finite);
  EXPECT_EQ(stepper.time(), 1.0);
  run(stepper, rhs, 0.0, {std::numeric_limits<double>::infinity()}, 0.5);
  EXPECT_EQ(stepper.status(), StepStatus::non_finite);
}

// A step that diverges, in a stiff contact for instance, may overflow one estimate only: it must not count as exact.
TEST(DormandPrince853, OverflowingErrorEstimateIsNoAcceptableError) {
  const double infinite = std::numeric_limits<double>::infinity(), large = std::numeric_limits<double>::max();
  EXPECT_FALSE(dop853::combined_error(1e-3, 1e300, infinite, 4) <= 1);
  EXPECT_FALSE(dop853::combined_error(1e-3, large, 1.0, 4) <= 1);
  EXPECT_EQ(dop853::combined_error(0.5, 4.0, 0.0, 4), 0.5);
  EXPECT_EQ(dop853::combined_error(0.5, 0.0, 0.0, 4), 0.0);
}

TEST(DormandPrince853, StepLimitsHold) {
  Stepper853 few({.size = Kepler::kSize}, {}, {.max_steps = 7});
  run(few, Kepler{}, 0.0, Kepler::exact(0.0, 0.6), 100.0);
  EXPECT_EQ(few.status(), StepStatus::too_many_steps);
  EXPECT_EQ(few.statistics().accepted + few.statistics().rejected, 7);

  Stepper853 bounded({.size = Kepler::kSize}, {.rtol = 1e-3, .atol = 1e-3}, {.max_step = 0.01});
  const Kepler rhs;
  bounded.start(rhs, 0.0, Kepler::exact(0.0, 0.6), 1.0);
  while (bounded.status() == StepStatus::running) {
    bounded.step(rhs);
    EXPECT_LE(bounded.time() - bounded.previous_time(), 0.01 * (1.0 + 2e-10));
  }
  EXPECT_EQ(bounded.statistics().accepted, 100);
}

TEST(DormandPrince853, ArgumentsAreChecked) {
  EXPECT_THROW(Stepper853({.size = 2, .quaternions = {0}}, {}), std::invalid_argument);
  EXPECT_THROW(Stepper853({.size = 2}, {.atol = -1.0}), std::invalid_argument);
  EXPECT_THROW(Stepper853({.size = 2}, {}, {.initial_step = -1.0}), std::invalid_argument);
  EXPECT_THROW(Stepper853({.size = 2}, {}, {.max_step = 0.0}), std::invalid_argument);
  EXPECT_THROW(Stepper853({.size = 2}, {}, {.max_steps = 0}), std::invalid_argument);
  Stepper853 stepper({.size = Coupled::kSize}, {});
  EXPECT_THROW(stepper.start(Coupled{}, 0.0, Vector{1.0}, 1.0), std::invalid_argument);
  EXPECT_THROW(stepper.start(Coupled{}, 0.0, Vector{1.0, 1.0}, std::nan("")), std::invalid_argument);
  EXPECT_THROW(stepper.set_end_time(1.0), std::logic_error);
  stepper.start(Coupled{}, 1.0, Vector{1.0, 1.0}, 1.0);
  EXPECT_EQ(stepper.status(), StepStatus::finished);
}

TEST(DormandPrince853, EndTimeMovesWithoutLosingTheStepSize) {
  Stepper853 stepper({.size = Kepler::kSize}, {.rtol = 1e-12, .atol = 1e-12});
  const Kepler rhs;
  stepper.start(rhs, 0.0, Kepler::exact(0.0, 0.1), 0.05);
  for (int i = 1; i <= 200; ++i) {
    stepper.set_end_time(0.05 * i);
    while (stepper.status() == StepStatus::running) stepper.step(rhs);
    ASSERT_EQ(stepper.time(), 0.05 * i);
  }
  EXPECT_LT(stepper.statistics().accepted, 230);                                    // measured 200
  EXPECT_LT(largest_difference(stepper.state(), Kepler::exact(10.0, 0.1)), 1e-11);  // measured 1.7e-14
  EXPECT_THROW(stepper.set_end_time(9.0), std::invalid_argument);
}

TEST(DormandPrince853, StateMayBeReplacedAndDenseOutputStillShowsTheStep) {
  Stepper853 stepper({.size = Coupled::kSize}, {});
  const Coupled rhs;
  stepper.start(rhs, 0.0, Coupled::exact(0.0), 4.0);
  stepper.step(rhs);
  const double t = stepper.time();
  Vector integrated(stepper.state().begin(), stepper.state().end()), y(2);
  stepper.set_state(rhs, Vector{5.0, 6.0});
  EXPECT_EQ(stepper.state()[0], 5.0);
  EXPECT_EQ(stepper.derivative()[0], std::cos(t) * 5.0 * (1.0 + t) * 6.0);
  stepper.interpolate(rhs, 0.5 * t, y);
  EXPECT_LT(largest_difference(y, Coupled::exact(0.5 * t)), 1e-9);  // measured 1.1e-15
  stepper.interpolate(rhs, t, y);
  EXPECT_EQ(y, integrated);
  stepper.set_state(rhs, Coupled::exact(t));
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_LT(largest_difference(stepper.state(), Coupled::exact(4.0)), 1e-8);  // measured 1e-11
}

// A force that switches at a known time: with reset_derivative at the switch the solution is exact to rounding error.
TEST(DormandPrince853, DerivativeMayBeResetWhereTheRightHandSideSwitches) {
  double force = 1.0;
  const auto rhs = [&](double, std::span<const double> y, std::span<double> dydt) { dydt[0] = y[1], dydt[1] = force; };
  Stepper853 stepper({.size = 2}, {});
  run(stepper, rhs, 0.0, {0.0, 0.0}, 1.0);
  force = -1.0;
  stepper.set_end_time(2.0);
  stepper.reset_derivative(rhs);
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_NEAR(stepper.state()[0], 1.0, 1e-14);  // measured 4.4e-16
  EXPECT_NEAR(stepper.state()[1], 0.0, 1e-14);  // measured 0
  EXPECT_EQ(stepper.statistics().rejected, 0);
}

// Quadratures after the controlled part are integrated to the same order without influence on the steps.
// An oscillator, and integrals of its motion, two of which change only if `on`.
struct Integrals {
  bool names_still, on = true;

  void operator()(double, std::span<const double> y, std::span<double> dydt) const {
    const double rates[] = {y[1], -y[0], on ? y[0] : 0.0, y[1] * y[1], on ? y[1] * y[2] : 0.0, y[0] * y[3]};
    std::copy(std::begin(rates), std::end(rates), dydt.begin());
  }
};
struct NamedIntegrals : Integrals {
  void still(std::vector<NumberRange>& ranges) const {
    if (names_still && !on) ranges = {{2, 3}, {4, 5}};
  }
};

// All states, their dense output, and the stepper's measures, of pieces in which the integrals change or not, after
// jumps of the state.
Vector trace_of(bool names_still) {
  NamedIntegrals rhs{{names_still}};
  Stepper853 stepper({.size = 6}, {.rtol = 1e-9, .atol = 1e-9});
  Vector trace, y = {1, 0.2, 0.1, -0.3, 0.4, 0}, inside(y.size());
  stepper.start(rhs, 0.0, y, 1.0);
  for (int piece = 0; piece < 5; ++piece) {
    while (stepper.status() == StepStatus::running) {
      stepper.step(rhs);
      const double stiffness = stepper.stiffness();
      const auto [bend, motion] = stepper.bend();
      stepper.interpolate(rhs, 0.5 * (stepper.previous_time() + stepper.time()), inside);
      trace.insert(trace.end(), {stepper.time(), stepper.proposed_step(), stiffness, bend, motion});
      trace.insert(trace.end(), inside.begin(), inside.end());
      trace.insert(trace.end(), stepper.state().begin(), stepper.state().end());
    }
    stepper.set_end_time(stepper.time() + 1);
    rhs.on = piece == 2;
    y.assign(stepper.state().begin(), stepper.state().end());
    y[2] += 0.7, y[4] -= 0.2;
    if (rhs.on)
      stepper.start(rhs, stepper.time(), y, stepper.end_time());
    else if (piece != 1)
      stepper.set_state(rhs, y);
  }
  return trace;
}

TEST(DormandPrince853, NumbersThatRemainConstantAreLeftAsTheyAre) {
  const Vector named = trace_of(true), all = trace_of(false);
  EXPECT_GT(named.size(), 15 * 17U);
  EXPECT_EQ(named, all);  // bit by bit
}

TEST(DormandPrince853, UncontrolledComponentsAreIntegrated) {
  const auto with_work = [](double t, std::span<const double> y, std::span<double> dydt) {
    Kepler{}(t, y.first(4), dydt.first(4));
    dydt[4] = 1e6 * (dydt[2] * y[2] + dydt[3] * y[3]);  // a million times the rate of kinetic energy
  };
  const auto kinetic = [](std::span<const double> y) { return 0.5 * (y[2] * y[2] + y[3] * y[3]); };
  const Tolerances tolerances{.rtol = 1e-10, .atol = 1e-12};
  Stepper853 plain({.size = 4}, tolerances), carried({.size = 5, .controlled = 4}, tolerances);
  Vector y0 = Kepler::exact(0.0, 0.6);
  run(plain, Kepler{}, 0.0, y0, 3.0);
  y0.push_back(0.0);
  run(carried, with_work, 0.0, y0, 3.0);
  EXPECT_EQ(plain.statistics().accepted, carried.statistics().accepted);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(plain.state()[i], carried.state()[i]);
  EXPECT_NEAR(carried.state()[4] * 1e-6, kinetic(carried.state()) - kinetic(y0), 1e-9);  // measured 3.4e-11
}

TEST(DormandPrince853, ExceptionLeavesTheLastStep) {
  int calls = 0;
  const auto rhs = [&](double t, std::span<const double> y, std::span<double> dydt) {
    if (++calls == 20) throw std::runtime_error("stop");
    Coupled{}(t, y, dydt);
  };
  Stepper853 stepper({.size = 2}, {});
  stepper.start(rhs, 0.0, Coupled::exact(0.0), 4.0);
  stepper.step(rhs);
  const double t = stepper.time();
  const Vector y(stepper.state().begin(), stepper.state().end());
  EXPECT_THROW(stepper.step(rhs), std::runtime_error);
  EXPECT_EQ(stepper.time(), t);
  EXPECT_EQ(stepper.status(), StepStatus::running);
  EXPECT_EQ(largest_difference(stepper.state(), y), 0.0);
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_LT(largest_difference(stepper.state(), Coupled::exact(4.0)), 1e-8);  // measured 1e-11
}

}  // namespace dormand_prince_853_test
}  // namespace grapnel
