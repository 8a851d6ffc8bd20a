// Divergence in simulations beside the margins of the linear model: gains below the limit of stability and above it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/verdicts.hpp"
#include "linear/linear_scenarios.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace divergence_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kBelow = 0.8, kAbove = 1.25;  // of the gains at the limit of stability

// The factor on all gains at which the loops of the scenario become unstable, by the margin of the decisive channel.
double limit_of(const CaptureProblem& problem) {
  const LinearModel model = linearize(problem, {});
  EXPECT_TRUE(model.closed_loop) << model.closed_loop_absent;
  double least = 1e6;
  if (!model.closed_loop) return least;
  for (const LoopMargin& margin : model.closed_loop->margins)
    least = std::min(least, margin.gain_maximum.value_or(1e6));
  EXPECT_LT(least, 1e6);
  return least;
}

// text(factor on the gains) => the verdicts below and above the limit.
struct Verdicts {
  StabilityReport below, above;
  CaptureResult unstable;
};
template <class Text>
Verdicts verdicts_of(Text&& text) {
  const double limit = limit_of(problem_of(text(1)));
  Verdicts found;
  const auto simulated = [&](double share) {
    CaptureResult result = simulate_capture(problem_of(text(share * limit)));
    EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
    EXPECT_EQ(result.stability.size(), 1u);
    if (result.stability.empty()) result.stability.emplace_back();
    const StabilityReport& r = result.stability.front();
    std::printf("[ measured ] limit %.4g, %.2f of it: %s, from %.3g to %.3g, period %.3g s, since %.3g s\n", limit,
                share, r.reason.c_str(), r.amplitude_before, r.amplitude_after, r.period, r.since);
    return result;
  };
  found.below = simulated(kBelow).stability.front();
  found.unstable = simulated(kAbove);
  found.above = found.unstable.stability.front();
  return found;
}

std::string hinge_with(double gain, const std::string& joint_keys, const std::string& duration = "10") {
  std::string text = hinge(1.5 * gain, 1 * gain, "control: {period: 50 ms, delay: 30 ms}\n", joint_keys);
  text.replace(text.find("initial: {joints: [0.3]"), 23, "initial: {joint_rates: [0.05], joints: [0.3]");
  text.replace(text.find("duration: 10"), 12, "duration: " + duration);
  return text;
}

TEST(Divergence, OfAJointThatHolds) {
  const Verdicts found =
      verdicts_of([](double gain) { return hinge_with(gain, "", "4"); });  // then rates exceed any motor's
  EXPECT_EQ(found.below.verdict, Stability::stable) << found.below.reason;
  EXPECT_TRUE(std::isnan(found.below.since));
  EXPECT_EQ(found.above.verdict, Stability::unstable) << found.above.reason;
  EXPECT_LT(found.above.since, 3);
  EXPECT_EQ(found.above.of, "elbow");
}

TEST(Divergence, OfAJointAtItsEffortLimit) {
  const Verdicts found = verdicts_of([](double gain) { return hinge_with(gain, ", limits: {effort: 2}"); });
  EXPECT_EQ(found.below.verdict, Stability::stable) << found.below.reason;
  EXPECT_EQ(found.above.verdict, Stability::unstable) << found.above.reason;
  EXPECT_GT(found.above.saturated_share, 0.2);
  EXPECT_LT(found.above.since, 9);
  EXPECT_THAT(found.unstable.warnings, Contains(HasSubstr("control is unstable in hold")));
  EXPECT_THAT(result_table(found.unstable), HasSubstr("completed, but control is UNSTABLE"));
}

// A reference that moves excites errors; only a limit cycle is no answer to it.
TEST(Divergence, OfAJointThatFollowsAReference) {
  const Verdicts found = verdicts_of([](double gain) {
    std::string text = hinge_with(gain, ", limits: {effort: 2}");
    text.erase(text.find("motion:"), text.find("control:") - text.find("motion:"));
    return text +
           "approach: {duration: 10, final_joints: [1.2], tracking: {mode: pd, kp: " + std::to_string(1.5 * gain) +
           ", kd: " + std::to_string(gain) + "}}\n";
  });
  EXPECT_EQ(found.below.verdict, Stability::not_evaluated) << found.below.reason;
  EXPECT_EQ(found.above.verdict, Stability::unstable) << found.above.reason;
  EXPECT_THAT(found.above.reason, HasSubstr("alternates between its limits"));
  EXPECT_LT(found.above.since, 9);
}

// A body with a hinge, whose base control is sampled; `wheels`: keys of the robot; `moves`: the hinge follows a
// reference.
std::string body_with(double gain, const std::string& wheels, const std::string& limit, bool moves) {
  const std::string g = std::to_string(gain);
  return "schema: grapnel-scenario/1\nname: body\nrobot:\n  base: {name: bus, mass: 50, inertia: [2, 2.5, 3]}\n"
         "  links:\n    - {name: boom, parent: bus, joint: {name: hinge, type: revolute, axis: [0, 0, 1], origin: "
         "{position: [0.3, 0, 0]}}, mass: 1, com: [0.2, 0, 0], inertia: [0.001, 0.01, 0.01]}\n" +
         wheels +
         "initial: {joints: {hinge: 0}, base: {angular_velocity: [0.004, -0.003, 0.002]}}\n"
         "control: {period: 0.5, delay: 0.3}\n"
         "approach: {duration: 120, final_joints: {hinge: " +
         (moves ? "1" : "0") + "}, base_control: {kp: " + std::to_string(0.3 * gain) + ", kd: " + g + limit + "}}\n";
}

TEST(Divergence, OfTheBase) {
  const Verdicts found = verdicts_of([](double gain) { return body_with(gain, "", ", limit: 0.5", false); });
  EXPECT_EQ(found.below.verdict, Stability::stable) << found.below.reason;
  EXPECT_EQ(found.above.verdict, Stability::unstable) << found.above.reason;
  EXPECT_THAT(found.above.of, HasSubstr("base "));
  EXPECT_LT(found.above.since, 100);
}

TEST(Divergence, OfWheels) {
  const std::string wheels = "  wheel_array: {configuration: pyramid, inertia: 0.05, torque: 0.2, rate: 418.88}\n";
  for (const bool moves : {false, true}) {
    SCOPED_TRACE(moves);
    const Verdicts found = verdicts_of([&](double gain) { return body_with(gain, wheels, "", moves); });
    EXPECT_EQ(found.below.verdict, moves ? Stability::not_evaluated : Stability::stable) << found.below.reason;
    EXPECT_EQ(found.above.verdict, Stability::unstable) << found.above.reason;
    EXPECT_LT(found.above.since, 100);
  }
}

// The loops of a result are those of linearize() at the same times.
TEST(ControlLoops, AreThoseOfLinearModels) {
  const CaptureProblem problem = problem_of(hinge_with(1, ""));
  CaptureResult result = simulate_capture(problem);
  ASSERT_EQ(result.status, CaptureStatus::completed) << result.failure;
  EXPECT_THAT(result.control_loops, IsEmpty());
  add_control_loops(problem, result);
  ASSERT_EQ(result.control_loops.size(), 2u);
  EXPECT_EQ(result.control_loops[0].time, 0);
  EXPECT_NEAR(result.control_loops[1].time, 10, 0.01);
  EXPECT_LT(result.control_loops[1].time, 10);
  for (const ControlLoopReport& report : result.control_loops) {
    const LinearModel model = linearize(problem, {.time = report.time});
    ASSERT_TRUE(model.closed_loop);
    EXPECT_EQ(report.phase, "hold");
    EXPECT_TRUE(report.sampled);
    EXPECT_EQ(report.verdict, LinearStability::stable);
    EXPECT_EQ(report.laws, model.closed_loop->laws);
    ASSERT_EQ(report.margins.size(), 1u);
    EXPECT_DOUBLE_EQ(*report.margins[0].gain_maximum, *model.closed_loop->margins[0].gain_maximum);
    EXPECT_DOUBLE_EQ(*report.margins[0].delay, *model.closed_loop->margins[0].delay);
    EXPECT_THAT(control_loop_text(report), HasSubstr("stable; smallest margins of 1 channel: gain at most"));
  }
  EXPECT_THAT(result.warnings, IsEmpty());
  // Above the limit the verdict has the eigenvalue.
  const CaptureProblem unstable = problem_of(hinge_with(1.25 * limit_of(problem), "", "4"));
  CaptureResult grows = simulate_capture(unstable);
  add_control_loops(unstable, grows);
  ASSERT_FALSE(grows.control_loops.empty());
  EXPECT_EQ(grows.control_loops[0].verdict, LinearStability::unstable);
  EXPECT_THAT(grows.warnings,
              Contains(HasSubstr("the controlled system is unstable at t = 0 s in hold: the eigenvalue")));
  grows.stability.clear();
  EXPECT_THAT(result_table(grows), HasSubstr("completed, but the linear model of control is UNSTABLE"));
  const std::vector<Answer> answers = answers_of(grows);
  EXPECT_EQ(answers.back().word, "Unstable");
}

// In the time of a phase no loop of a shipped scenario is unstable, neither in its simulation nor in its linear models,
// although the instantaneous eigenvalues of most of these grow directly after an impact.
class ShippedScenarios : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedScenarios, HaveNoUnstableLoop) {
  SKIP_UNDER_SANITIZERS();
  const CaptureProblem problem = load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + GetParam() + ".yaml");
  CaptureResult result = simulate_capture(problem);
  for (const StabilityReport& report : result.stability)
    EXPECT_NE(report.verdict, Stability::unstable) << instability_text(report);
  add_control_loops(problem, result);
  EXPECT_THAT(result.warnings, Not(Contains(HasSubstr("margins"))));
  EXPECT_GE(result.control_loops.size(), 2u);
  for (const ControlLoopReport& report : result.control_loops)
    EXPECT_NE(report.verdict, LinearStability::unstable) << control_loop_text(report);
}

TEST(ControlLoops, GrowthOfAnInstantDecidesNothing) {
  SKIP_UNDER_SANITIZERS();
  const CaptureProblem problem = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/heavy-satellite-detumble.yaml");
  const LinearModel model = linearize(problem, {.time = 60});
  ASSERT_TRUE(model.closed_loop);
  const LinearModel::Modes& modes = model.closed_loop->stability;
  EXPECT_EQ(modes.eigenvalues.front().kind, LinearModel::Kind::grows);
  EXPECT_EQ(modes.verdict, LinearStability::undecided);
  EXPECT_THAT(modes.reason, HasSubstr("the motion changes it by"));
}

// A loop in its limit cycle never is steady, but grows at rest as well.
TEST(ControlLoops, ALimitCycleIsUnstableAtRest) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<Override> late{{"control.period", "0.05"}, {"control.delay", "0.05"}};
  const CaptureProblem problem = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml", late);
  for (const double time : {61.0, 65.0, 100.0}) {
    SCOPED_TRACE(time);
    const LinearModel model = linearize(problem, {.time = time});
    ASSERT_TRUE(model.closed_loop);
    EXPECT_EQ(model.closed_loop->stability.verdict, LinearStability::unstable);
    EXPECT_THAT(model.closed_loop->stability.reason, HasSubstr("at rest in this configuration"));
  }
}

// Friction turns robot and block with a time constant of six minutes; the phase has 20 s.
TEST(ControlLoops, GrowthBeyondThePhaseDecidesNothing) {
  const CaptureProblem problem = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/air-bearing-friction.yaml");
  EXPECT_EQ(linearize(problem, {.time = 10}).closed_loop->stability.verdict, LinearStability::unstable);
  CaptureResult result = simulate_capture(problem);
  add_control_loops(problem, result);
  ASSERT_EQ(result.control_loops.size(), 2u);
  EXPECT_EQ(result.control_loops[1].verdict, LinearStability::undecided);
  EXPECT_THAT(result.control_loops[1].reason, HasSubstr("the phase of 20 s is shorter than the time constant"));
}

// One model at the start and one before the end of every phase, in their order.
TEST(ControlLoops, OfEveryPhase) {
  const CaptureProblem problem = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/attitude-manoeuvre.yaml");
  CaptureResult result = simulate_capture(problem);
  ASSERT_EQ(result.status, CaptureStatus::completed) << result.failure;
  add_control_loops(problem, result);
  ASSERT_EQ(result.control_loops.size(), 2 * result.phases.size());
  for (std::size_t k = 0; k < result.phases.size(); ++k) {
    const MotionPhaseReport& phase = result.phases[k];
    EXPECT_NEAR(result.control_loops[2 * k].time, phase.begin, 1e-6 * phase.end);
    EXPECT_NEAR(result.control_loops[2 * k + 1].time, phase.end, 2e-4 * phase.duration());
    EXPECT_EQ(result.control_loops[2 * k].phase, result.control_loops[2 * k + 1].phase);
  }
}

TEST(ControlLoops, AStopEndsThem) {
  const CaptureProblem problem = problem_of(hinge_with(1, ""));
  CaptureResult result = simulate_capture(problem);
  const auto stop = [](const std::string& phase, double, double) {
    if (phase.starts_with("margins")) throw std::runtime_error("stopped");
  };
  EXPECT_THROW(add_control_loops(problem, result, stop), std::runtime_error);
  EXPECT_THAT(result.control_loops, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Divergence, ShippedScenarios,
                         ::testing::Values("air-bearing-friction", "compliant-grip", "heavy-satellite-detumble",
                                           "planar-admittance", "second-grip-later", "wheels-keep-attitude"),
                         [](const auto& given) {
                           std::string name = given.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace divergence_test
}  // namespace grapnel::testing
