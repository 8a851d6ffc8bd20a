#include "grapnel/integrate/integrate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "integrate/problems.hpp"

namespace grapnel {
namespace integrate_test {

using problems::Coupled;
using problems::largest_difference;
using problems::Vector;

template <class Method>
void expect_outputs(Method& stepper, double bound) {
  const Vector outputs = {0.0, 0.0, 0.013, 0.5, 0.5, 1.0, 2.9999, 3.0};
  std::size_t next = 0;
  double error = 0.0;
  const IntegrationResult result =
      integrate(stepper, Coupled{}, 0.0, Coupled::exact(0.0), 3.0,
                ObservedTimes{outputs, [&](double t, std::span<const double> y) {
                                ASSERT_LT(next, outputs.size());
                                EXPECT_EQ(t, outputs[next++]);
                                error = std::max(error, largest_difference(y, Coupled::exact(t)));
                              }});
  EXPECT_EQ(next, outputs.size());
  EXPECT_LT(error, bound);
  EXPECT_TRUE(result.finished()) << result.explanation();
  EXPECT_EQ(result.time, 3.0);
  EXPECT_EQ(result.statistics.accepted, stepper.statistics().accepted);
  EXPECT_GT(result.statistics.accepted, 0);
}

TEST(Integrate, ObservesAtTheOutputTimesWithEitherMethod) {
  DormandPrince853<double> adaptive({.size = Coupled::kSize}, {});
  expect_outputs(adaptive, 1e-8);  // measured 1.2e-10
  RungeKutta4<double> fixed({.size = Coupled::kSize}, 0.01);
  expect_outputs(fixed, 1e-7);  // measured 1.4e-9
}

TEST(Integrate, RunsBackwards) {
  DormandPrince853<double> stepper({.size = Coupled::kSize}, {.rtol = 1e-13, .atol = 1e-13});
  const Vector outputs = {3.0, 1.5, 0.0};
  int count = 0;
  const auto result =
      integrate(stepper, Coupled{}, 3.0, Coupled::exact(3.0), 0.0,
                ObservedTimes{outputs, [&](double t, auto y) {
                                EXPECT_LT(largest_difference(y, Coupled::exact(t)), 1e-10);  // measured at most 9.6e-13
                                ++count;
                              }});
  EXPECT_TRUE(result.finished());
  EXPECT_EQ(count, 3);
}

TEST(Integrate, RefusesOutputTimesOutOfOrder) {
  RungeKutta4<double> stepper({.size = Coupled::kSize}, 0.1);
  const auto run = [&](const Vector& outputs) {
    integrate(stepper, Coupled{}, 0.0, Coupled::exact(0.0), 1.0, ObservedTimes{outputs, [](double, auto) {}});
  };
  EXPECT_NO_THROW(run({0.0, 1.0}));
  EXPECT_THROW(run({0.5, 0.4}), std::invalid_argument);
  EXPECT_THROW(run({-0.1}), std::invalid_argument);
  EXPECT_THROW(run({1.1}), std::invalid_argument);
  EXPECT_THROW(run({std::nan("")}), std::invalid_argument);
}

TEST(Integrate, ReportsAFailureAndTheOutputsBeforeIt) {
  const auto rhs = [](double, std::span<const double> y, std::span<double> dydt) { dydt[0] = y[0] * y[0]; };
  DormandPrince853<double> stepper({.size = 1}, {});
  const Vector outputs = {0.0, 0.5, 0.9, 1.5};
  int count = 0;
  const auto result =
      integrate(stepper, rhs, 0.0, Vector{1.0}, 2.0, ObservedTimes{outputs, [&](double, auto) { ++count; }});
  EXPECT_EQ(count, 3);
  EXPECT_FALSE(result.finished());
  EXPECT_EQ(result.status, StepStatus::step_too_small);
  EXPECT_NEAR(result.time, 1.0, 1e-9);
  EXPECT_THAT(result.explanation(), ::testing::HasSubstr("step below the resolution of time"));
  EXPECT_EQ(IntegrationResult{}.status, StepStatus::not_started);
}

TEST(Integrate, WorksWithoutOutput) {
  DormandPrince853<double> stepper({.size = Coupled::kSize}, {});
  EXPECT_TRUE(integrate(stepper, Coupled{}, 0.0, Coupled::exact(0.0), 1.0).finished());
  EXPECT_LT(largest_difference(stepper.state(), Coupled::exact(1.0)), 1e-9);  // measured 5.8e-12
}

}  // namespace integrate_test
}  // namespace grapnel
