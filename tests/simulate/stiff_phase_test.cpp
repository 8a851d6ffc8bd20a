/// Phases that are stiff: bodies at rest in stiff contacts, sampled control, closed loops. Implicit and explicit steps
/// agree, and rest does not drift.

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/resting_box.hpp"

namespace grapnel::testing {
namespace stiff_phase_test {

using Method = IntegrationSetup::Method;
double largest_difference(std::span<const double> a, std::span<const double> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

// Largest motion after 100 s.
struct Rest {
  double drift = 0;   // of positions and the quaternion, since t = 100 s
  double jitter = 0;  // rate
  State reference;

  void note(const PhaseSample& sample) {
    if (sample.time < 100) return;
    if (sample.time == 100) reference = sample.state;
    drift = std::max(drift, largest_difference(sample.state.q, reference.q));
    for (const double v : sample.state.v) jitter = std::max(jitter, std::abs(v));
  }
};

// 1,000 s at rest: no drift, no jitter, few steps.
TEST(StiffPhase, HeavyBoxRestsForAThousandSeconds) {
  const RestingBox box;
  Rest rest;
  PhaseObservers observers;
  observers.observe = [&](const PhaseSample& sample) { rest.note(sample); };
  const PhaseOutcome outcome = box.run(1000, Method::automatic, 1e-12, observers, 10);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  std::printf("[ measured ] steps %ld, implicit %ld in %zu spans, evaluations %ld, drift %.2g m, largest rate %.2g\n",
              outcome.steps, outcome.implicit_steps, outcome.implicit_spans.size(), outcome.rhs_evaluations, rest.drift,
              rest.jitter);
  EXPECT_LT(rest.drift, 1e-9);
  EXPECT_LT(rest.jitter, 1e-9);
  EXPECT_GT(outcome.implicit_steps, 0);
  ASSERT_FALSE(outcome.implicit_spans.empty());
  EXPECT_EQ(outcome.implicit_spans.back()[1], 1000);
  EXPECT_LT(outcome.steps, 2000);
}

// The impact, sliding and coming to rest: both methods reach the state of explicit steps with a tight tolerance.
TEST(StiffPhase, MethodsAgree) {
  const RestingBox box;
  const PhaseOutcome exact = box.run(3, Method::adaptive_8, 1e-12);
  for (const Method method : {Method::automatic, Method::radau_9}) {
    const PhaseOutcome outcome = box.run(3, method, 1e-11);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    const double difference = std::max(largest_difference(outcome.end_state.q, exact.end_state.q),
                                       largest_difference(outcome.end_state.v, exact.end_state.v));
    std::printf("[ measured ] difference %.2g; steps %ld, implicit %ld, evaluations %ld; explicit %ld\n", difference,
                outcome.steps, outcome.implicit_steps, outcome.rhs_evaluations, exact.rhs_evaluations);
    EXPECT_LT(difference, 1e-9);
    EXPECT_NEAR(outcome.integrals.contacts[0].work, exact.integrals.contacts[0].work, 1e-7);
  }
}

}  // namespace stiff_phase_test
}  // namespace grapnel::testing
