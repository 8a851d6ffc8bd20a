#include "grapnel/integrate/integrate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/runge_kutta_4.hpp"
#include "integrate/problems.hpp"

namespace grapnel {
namespace events_test {

using problems::Vector;
using std::numbers::pi;

// y = (sin t, cos t)
const auto kOscillator = [](double, std::span<const double> y, std::span<double> dydt) {
  dydt[0] = y[1], dydt[1] = -y[0];
};
const auto kFirst = [](double, std::span<const double> y) { return y[0]; };

template <class Event>
std::vector<EventLocation> all_events(double t0, double t_end, const Event& g, Crossing crossing,
                                      const StepControl& control = {}, const EventOptions& options = {}) {
  const Manifold manifold{.size = 2};
  DormandPrince853<double> stepper(manifold, {.rtol = 1e-13, .atol = 1e-13}, control);
  EventLocator<double> locator(manifold, options);
  stepper.start(kOscillator, t0, Vector{std::sin(t0), std::cos(t0)}, t_end);
  std::vector<EventLocation> events;
  while (stepper.status() == StepStatus::running) {
    stepper.step(kOscillator);
    if (const auto event = locator.find(stepper, kOscillator, g, crossing)) {
      events.push_back(*event);
      EXPECT_EQ(g(event->time, locator.state()), event->value);
    }
  }
  return events;
}

TEST(Events, CrossingsAreFoundInTheirDirection) {
  const auto any = all_events(0.5, 10.0, kFirst, Crossing::any);
  ASSERT_EQ(any.size(), 3U);
  for (int k = 1; k <= 3; ++k) {
    EXPECT_NEAR(any[k - 1].time, k * pi, 1e-12 * k * pi);  // measured at most 1.4e-13
    EXPECT_EQ(any[k - 1].rising, k == 2);
    EXPECT_LT(std::abs(any[k - 1].value), 1e-12);
    EXPECT_TRUE(any[k - 1].rising ? any[k - 1].value >= 0.0 : any[k - 1].value <= 0.0);  // just past the crossing
  }
  const auto rising = all_events(0.5, 10.0, kFirst, Crossing::rising);
  ASSERT_EQ(rising.size(), 1U);
  EXPECT_NEAR(rising[0].time, 2.0 * pi, 1e-11);
  EXPECT_EQ(all_events(0.5, 10.0, kFirst, Crossing::falling).size(), 2U);
}

TEST(Events, BackwardIntegrationFindsTheFirstCrossing) {
  const auto events = all_events(4.0, -1.0, kFirst, Crossing::any);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, pi, 1e-12);  // measured 1.2e-14
  EXPECT_TRUE(events[0].rising);           // in the direction of integration
  EXPECT_LE(events[0].time, pi + 1e-15);
  EXPECT_NEAR(events[1].time, 0.0, 1e-12);  // measured 5.7e-14
}

TEST(Events, EachCrossingIsReportedOnce) {
  for (const double h : {0.013, 0.1, 0.4}) {
    EXPECT_EQ(all_events(0.5, 30.0, kFirst, Crossing::any, {.initial_step = h, .max_step = h}).size(), 9U) << h;
  }
  // A step that ends exactly where g is 0: t − 1 with steps of 1/4.
  const auto g = [](double t, std::span<const double>) { return t - 1.0; };
  const auto events = all_events(0.0, 2.0, g, Crossing::any, {.initial_step = 0.25, .max_step = 0.25});
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].time, 1.0);
  EXPECT_EQ(events[0].value, 0.0);
  EXPECT_TRUE(all_events(1.0, 2.0, g, Crossing::any).empty());  // a start on the zero does not count
}

TEST(Events, ExcursionsShorterThanASampleAreNoticed) {
  // Below zero for 0.02 around t = 1.03, in one step of 2 with samples 0.25 apart.
  const auto g = [](double t, std::span<const double>) { return (t - 1.03) * (t - 1.03) - 1e-4; };
  const StepControl control{.initial_step = 2.0, .max_step = 2.0};
  const auto run = [&](Crossing crossing) {
    const Manifold manifold{.size = 2};
    DormandPrince853<double> stepper(manifold, {.rtol = 1.0, .atol = 1e3}, control);
    EventLocator<double> locator(manifold);
    stepper.start(kOscillator, 0.0, Vector{0.0, 1.0}, 2.0);
    stepper.step(kOscillator);
    EXPECT_EQ(stepper.status(), StepStatus::finished);
    return locator.find(stepper, kOscillator, g, crossing);
  };
  const auto falling = run(Crossing::falling), rising = run(Crossing::rising);
  ASSERT_TRUE(falling && rising);
  EXPECT_NEAR(falling->time, 1.02, 1e-11);  // measured 1e-13
  EXPECT_FALSE(falling->rising);
  EXPECT_NEAR(rising->time, 1.04, 1e-11);  // measured 0
}

TEST(Events, RestartAtTheEventDoesNotFindItAgain) {
  // A ball that bounces without loss: y = (height, speed), unit gravity, from height 1/2: contacts at t = 1, 3, 5, …
  const auto rhs = [](double, std::span<const double> y, std::span<double> dydt) { dydt[0] = y[1], dydt[1] = -1.0; };
  const Manifold manifold{.size = 2};
  DormandPrince853<double> stepper(manifold, {});
  EventLocator<double> locator(manifold);
  stepper.start(rhs, 0.0, Vector{0.5, 0.0}, 20.0);
  std::vector<double> contacts;
  while (stepper.status() == StepStatus::running && contacts.size() < 50) {
    stepper.step(rhs);
    if (const auto contact = locator.find(stepper, rhs, kFirst, Crossing::falling)) {
      contacts.push_back(contact->time);
      const Vector after = {0.0, -locator.state()[1]};
      stepper.start(rhs, contact->time, after, 20.0);
    }
  }
  ASSERT_EQ(contacts.size(), 10U);
  for (int k = 0; k < 10; ++k) EXPECT_NEAR(contacts[k], 2.0 * k + 1.0, 1e-11);  // measured at most 4.4e-12
}

TEST(Events, WorkWithTheFixedStepMethod) {
  const Manifold manifold{.size = 2};
  RungeKutta4<double> stepper(manifold, 0.01);
  EventLocator<double> locator(manifold);
  stepper.start(kOscillator, 0.5, Vector{std::sin(0.5), std::cos(0.5)}, 4.0);
  std::vector<double> times;
  while (stepper.status() == StepStatus::running) {
    stepper.step(kOscillator);
    if (const auto event = locator.find(stepper, kOscillator, kFirst)) times.push_back(event->time);
  }
  ASSERT_EQ(times.size(), 1U);
  EXPECT_NEAR(times[0], pi, 1e-9);  // the method's own error; measured 2.2e-10
}

TEST(Events, MisuseIsReported) {
  const Manifold manifold{.size = 2};
  EXPECT_THROW(EventLocator<double>(manifold, {.samples = 0}), std::invalid_argument);
  EXPECT_THROW(EventLocator<double>(manifold, {.time_tolerance = 0.0}), std::invalid_argument);
  DormandPrince853<double> stepper(manifold, {});
  EventLocator<double> locator(manifold);
  EXPECT_THROW(locator.find(stepper, kOscillator, kFirst), std::logic_error);
  stepper.start(kOscillator, 0.0, Vector{0.0, 1.0}, 1.0);
  stepper.step(kOscillator);
  EXPECT_THROW(locator.find(stepper, kOscillator, [](double, std::span<const double>) { return std::nan(""); }),
               std::domain_error);
}

TEST(ShrinkBracket, ConvergesFastAndKeepsTheSignChange) {
  const auto check = [](const auto& f, double begin, double end, double root, int most_calls) {
    int calls = 0;
    const auto counted = [&](double t) { return ++calls, f(t); };
    const Bracket b = shrink_bracket(counted, {begin, f(begin), end, f(end)}, 1e-14);
    EXPECT_LE(std::abs(b.end - b.begin), 1e-14);
    EXPECT_GE((root - b.begin) * (end - begin), -1e-15);
    EXPECT_GE((b.end - root) * (end - begin), -1e-15);
    EXPECT_LE(b.begin_value * b.end_value, 0.0);
    EXPECT_LE(calls, most_calls);
  };
  check([](double t) { return std::cos(t) - t; }, 0.0, 1.0, 0.73908513321516064, 12);  // measured 6
  check([](double t) { return std::cos(t) - t; }, 1.0, 0.0, 0.73908513321516064, 12);  // measured 6
  check([](double t) { return std::cbrt(t - 0.3); }, -1.0, 2.0, 0.3, 60);              // measured 47
  check([](double t) { return std::pow(t - 0.3, 9.0); }, -1.0, 2.0, 0.3, 120);         // measured 49
  check([](double t) { return t < 0.7 ? -1.0 : 1e-3; }, 0.0, 1.0, 0.7, 60);            // measured 47
}

}  // namespace events_test
}  // namespace grapnel
