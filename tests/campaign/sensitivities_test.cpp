/// Derivatives of outcomes against closed forms and independent differences; kinks and jumps; first-order uncertainty.
#include "grapnel/campaign/sensitivities.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/campaign/uncertain_value.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace sensitivities_test {

using ::testing::HasSubstr;

// ---- Functions of numbers ----

using Function = std::function<std::vector<double>(const std::vector<double>&)>;

std::vector<std::vector<DerivativeEntry>> derivatives(const Function& f, const std::vector<DifferenceVariable>& at,
                                                      double scale = 1) {
  std::vector<double> center;
  for (const DifferenceVariable& one : at) center.push_back(one.value);
  const FunctionValue value{f(center)};
  const std::vector<double> scales(value.values.size(), scale);
  return differentiate(
      [&](const std::vector<std::vector<double>>& points) {
        std::vector<FunctionValue> values;
        for (const auto& point : points) values.push_back({f(point)});
        return values;
      },
      value, at, scales);
}

TEST(Differences, OfSmoothFunctionsStayWithinTheirErrors) {
  const auto entries = derivatives(
      [](const std::vector<double>& x) {
        return std::vector<double>{std::sin(x[0]) * std::exp(x[1]), x[0] * x[0] * x[0] / x[1], 7};
      },
      {{0.7, 0.7, 0.007}, {2, 2, 0.02}});
  const double exact[2][3] = {{std::cos(0.7) * std::exp(2), 3 * 0.7 * 0.7 / 2, 0},
                              {std::sin(0.7) * std::exp(2), -0.7 * 0.7 * 0.7 / 4, 0}};
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t j = 0; j < 3; ++j) {
      const DerivativeEntry& one = entries[k][j];
      EXPECT_EQ(one.verdict, Differentiable::yes);
      EXPECT_LE(std::abs(one.derivative - exact[k][j]), one.error + 1e-300) << k << j;
      EXPECT_LT(one.error, 1e-8);
    }
  }
}

TEST(Differences, AKinkHasTwoDerivatives) {
  // The second kink is beside the value: smaller steps do not reach it.
  const auto entries = derivatives(
      [](const std::vector<double>& x) {
        return std::vector<double>{std::max(x[0], 1.0) + 2 * x[0], std::max(x[0], 1.004), std::abs(x[0] - 1)};
      },
      {{1, 1, 0.01}})[0];
  EXPECT_EQ(entries[0].verdict, Differentiable::no);
  EXPECT_NEAR(*entries[0].left, 2, 1e-9);
  EXPECT_NEAR(*entries[0].right, 3, 1e-9);
  EXPECT_THAT(entries[0].reason, HasSubstr("a kink: the derivative is 2 below this value and 3 above it"));
  EXPECT_EQ(entries[1].verdict, Differentiable::yes);
  EXPECT_NEAR(entries[1].derivative, 0, 1e-9);
  EXPECT_EQ(entries[2].verdict, Differentiable::no);  // central differences alone are zero
}

TEST(Differences, AJumpHasNone) {
  const auto entries =
      derivatives([](const std::vector<double>& x) { return std::vector<double>{x[0] > 1 ? x[0] + 0.1 : x[0]}; },
                  {{1, 1, 0.01}})[0];
  EXPECT_EQ(entries[0].verdict, Differentiable::no);
  EXPECT_THAT(entries[0].reason, HasSubstr("a jump by 0.1"));
}

// With a ratio of 2 between steps all of them would be at its zeros.
TEST(Differences, AnOscillationAtAllStepsIsNotSmooth) {
  const double h = 0.01;
  const auto sine = [&](const std::vector<double>& x) {
    return std::vector<double>{std::sin(8 * std::acos(-1.0) / h * (x[0] - 1))};
  };
  EXPECT_NE(derivatives(sine, {{1, 1, h}})[0][0].verdict, Differentiable::yes);
}

TEST(Differences, TwoStepsThatAgreeAreNotEnough) {
  // A narrow bump between the other steps, at the smallest step of each round.
  const double h = 0.01;
  const auto bumps = [&](const std::vector<double>& x) {
    const double d = x[0] - 1;
    const bool is_on_one = std::ranges::any_of(std::array{h, h / 8, 8 * h},
                                               [&](double first) { return d > 0.24 * first && d < 0.32 * first; });
    return std::vector<double>{x[0] + (is_on_one ? 0.01 : 0)};
  };
  EXPECT_EQ(derivatives(bumps, {{1, 1, h}})[0][0].verdict, Differentiable::not_decided);
}

TEST(Differences, OfNoiseAreNotDetermined) {
  for (const double rate : {7.7e4, 1.3e5, 5.9e5, 1e6}) {
    const auto noise = [&](const std::vector<double>& x) { return std::vector<double>{std::sin(rate * x[0] * x[0])}; };
    EXPECT_EQ(derivatives(noise, {{1, 1, 0.01}})[0][0].verdict, Differentiable::not_decided) << rate;
  }
}

TEST(Differences, OfFailingNeighboursAreNotDecidedByFarOnes) {
  const auto verdict = [](auto exists) {
    const std::vector<DifferenceVariable> at{{1, 1, 0.01}};
    const std::vector<double> scales{1};
    return differentiate(
        [&](const std::vector<std::vector<double>>& points) {
          std::vector<FunctionValue> values;
          for (const auto& point : points) {
            if (exists(point[0]))
              values.push_back({{point[0]}});
            else
              values.push_back({.values = {}, .failure = "fails"});
          }
          return values;
        },
        {{1.0}}, at, scales)[0][0];
  };
  EXPECT_EQ(verdict([](double x) { return x < 1.008; }).verdict, Differentiable::yes);  // smaller steps decide
  const DerivativeEntry beside = verdict([](double x) { return x < 1 + 1e-9; });
  EXPECT_EQ(beside.verdict, Differentiable::no);
  // Only the farthest point of each round fails: steps of 0.01, and of an eighth and eight times of it.
  const auto fails = [](double x, double step) { return std::abs(x - 1 - step) < 1e-9; };
  const DerivativeEntry far =
      verdict([&](double x) { return !fails(x, 0.01) && !fails(x, 0.01 / 8) && !fails(x, 0.08); });
  EXPECT_EQ(far.verdict, Differentiable::not_decided);
  EXPECT_THAT(beside.reason, HasSubstr("beside this value: fails"));
}

TEST(Differences, NeedRoomForAStep) {
  DifferenceVariable at{1, 1, 0.01};
  at.least = at.most = 1;
  const auto same = [](const std::vector<double>& x) { return x; };
  const DerivativeEntry one = derivatives(same, {at})[0][0];
  EXPECT_EQ(one.verdict, Differentiable::not_decided);
  EXPECT_EQ(one.reason, "the bounds leave no room for a step");
}

TEST(Differences, AreOneSidedBesideABound) {
  const auto root = [](const std::vector<double>& x) {
    EXPECT_GE(x[0], 0);
    return std::vector<double>{std::exp(x[0])};
  };
  DifferenceVariable at{0, 1, 0.01};
  at.least = 0;
  const DerivativeEntry one = derivatives(root, {at})[0][0];
  EXPECT_TRUE(one.is_one_sided);
  EXPECT_EQ(one.verdict, Differentiable::yes);
  EXPECT_NEAR(one.derivative, 1, one.error);
  EXPECT_LT(one.error, 1e-4);
  at.value = 0.005;  // half a step away: central, with shorter steps
  EXPECT_FALSE(derivatives(root, {at})[0][0].is_one_sided);
}

// ---- Two bodies ----

struct Strike {
  double striker = 8, ball = 4, speed = 0.2, sideways = 0, restitution = 0.5, friction = 0;
};

// All digits, since a kink is at one number.
std::string number(double x) { return fmt::format("{}", x); }

// A free body with an end-effector is struck by a ball in the line of centers.
std::string strike(const Strike& s, const std::string& more = "") {
  return "schema: grapnel-scenario/1\n"
         "name: strike\n"
         "robot:\n"
         "  name: striker\n"
         "  base: {name: bus, mass: " +
         number(s.striker) +
         ", inertia: [1, 1, 1]}\n"
         "  links:\n"
         "    - {name: panel, parent: bus, joint: {name: hinge, type: fixed}, mass: 1e-9, inertia: [1e-12, 1e-12, "
         "1e-12]}\n"
         "  end_effectors: [{name: tip, link: bus, position: [0.5, 0, 0], approach_axis: [1, 0, 0]}]\n"
         "initial: {joints: []}\n"
         "targets:\n"
         "  - name: ball\n"
         "    mass: " +
         number(s.ball) +
         "\n"
         "    inertia: [0.3, 0.3, 0.3]\n"
         "    geometry: {shape: sphere, radius: 0.3}\n"
         "    state: {position: [0.8, 0, 0], velocity: [" +
         number(-s.speed) + ", " + number(s.sideways) +
         ", 0]}\n"
         "    grasp_points: [{name: front, position: [-0.3, 0, 0], approach_direction: [1, 0, 0], normal: [-1, 0, "
         "0]}]\n"
         "grasps: [{end_effector: tip, target: ball, point: front, model: contact}]\n"
         "contact: {gap: weld_as_found}\n"
         "impact: {law: friction, restitution: " +
         number(s.restitution) + ", friction: " + number(s.friction) + "}\n" + more;
}

struct Choice {
  std::vector<std::string> by, of;
  StudyMode mode = StudyMode::impact;
};

SensitivityReport sensitivities_of(const std::string& text, const Choice& choice) {
  const test::Folder folder;
  const SensitivityTask task =
      load_sensitivities(folder.write("scenario.yaml", text), {choice.by, choice.of, choice.mode});
  return sensitivities(task, {.threads = 2});
}

const SensitivityReport::Derivative& entry(const SensitivityReport& report, const std::string& of,
                                           const std::string& by) {
  for (const auto& outcome : report.outcomes) {
    if (outcome.name != of) continue;
    for (const auto& one : outcome.by) {
      if (one.by == by) return one;
    }
  }
  ADD_FAILURE() << of << " by " << by;
  static const SensitivityReport::Derivative none{};
  return none;
}

void expect_derivative(const SensitivityReport& report, const std::string& of, const std::string& by, double exact,
                       double accuracy) {
  const SensitivityReport::Derivative& one = entry(report, of, by);
  EXPECT_EQ(one.verdict, Differentiable::yes) << of << " by " << by << ": " << one.reason;
  EXPECT_NEAR(one.derivative.value_or(NAN), exact, accuracy) << of << " by " << by;
  EXPECT_LE(std::abs(one.derivative.value_or(NAN) - exact), 2 * one.error.value_or(NAN) + 1e-12) << of << " by " << by;
}

TEST(Sensitivities, OfACentralImpactHaveTheirClosedForms) {
  const Strike s;
  const SensitivityReport report = sensitivities_of(
      strike(s), {{"targets.ball.mass", "robot.base.mass", "targets.ball.state.velocity", "impact.restitution"},
                  {"grasps/tip/impulse_magnitude", "base/velocity_change", "grasps/tip/impulse/y"}});
  // P = (1 + e) m v, 1/m = 1/m1 + 1/m2.
  const double m1 = s.striker + 1e-9, m2 = s.ball, m = m1 * m2 / (m1 + m2), e = s.restitution, v = s.speed;
  const double P = (1 + e) * m * v, by_m2 = (1 + e) * v * m * m / (m2 * m2), by_m1 = (1 + e) * v * m * m / (m1 * m1);
  const std::string impulse = "grasps/tip/impulse_magnitude";
  EXPECT_NEAR(report.outcomes.at(0).value, P, 1e-12);
  expect_derivative(report, impulse, "targets.ball.mass", by_m2, 1e-7);
  expect_derivative(report, impulse, "robot.base.mass", by_m1, 1e-7);
  expect_derivative(report, impulse, "targets.ball.state.velocity/x", -(1 + e) * m, 1e-9);
  expect_derivative(report, impulse, "impact.restitution", m * v, 1e-9);
  expect_derivative(report, "base/velocity_change/x", "robot.base.mass", -by_m1 / m1 + P / (m1 * m1), 1e-8);
  EXPECT_NEAR(*entry(report, impulse, "targets.ball.mass").elasticity, m / m2, 1e-6);
  // Symmetry: a sideways velocity has no first-order effect on the impulse, and no mass on its sideways part.
  expect_derivative(report, impulse, "targets.ball.state.velocity/y", 0, 1e-9);
  expect_derivative(report, "grasps/tip/impulse/y", "targets.ball.mass", 0, 1e-12);
}

// The tangential impulse is that of sliding below the critical coefficient, and that of sticking above it.
TEST(Sensitivities, AtTheLimitOfSlidingThereIsAKink) {
  Strike s{.sideways = 0.03, .restitution = 0};
  const double m = 1 / (1 / (s.striker + 1e-9) + 1 / s.ball);
  const double tangential = 1 / (1 / m + 0.25 / 1 + 0.09 / 0.3);
  const double critical = s.sideways * tangential / (s.speed * m);
  const Choice choice{{"impact.friction"}, {"grasps/tip/impulse_tangential", "grasps/tip/impulse_normal"}};
  s.friction = 0.5 * critical;
  const SensitivityReport slides = sensitivities_of(strike(s), choice);
  expect_derivative(slides, "grasps/tip/impulse_tangential", "impact.friction", s.speed * m, 1e-9);
  s.friction = 2 * critical;
  expect_derivative(sensitivities_of(strike(s), choice), "grasps/tip/impulse_tangential", "impact.friction", 0, 1e-9);
  s.friction = critical;
  const SensitivityReport report = sensitivities_of(strike(s), choice);
  const SensitivityReport::Derivative& kink = entry(report, "grasps/tip/impulse_tangential", "impact.friction");
  EXPECT_EQ(kink.verdict, Differentiable::no);
  EXPECT_NEAR(kink.left.value_or(NAN), s.speed * m, 1e-6);
  EXPECT_NEAR(kink.right.value_or(NAN), 0, 1e-6);
  EXPECT_THAT(kink.reason, HasSubstr("contact of tip: "));
  expect_derivative(report, "grasps/tip/impulse_normal", "impact.friction", 0, 1e-9);
  EXPECT_THAT(sensitivities_text(report), HasSubstr("impact.friction: NO: a kink"));
}

// ---- Motion ----

// A slide with viscous friction reaches a rate after T = (m/c) ln(v0/v1).
std::string braked_slide() {
  return "schema: grapnel-scenario/1\n"
         "name: slide\n"
         "robot:\n"
         "  name: slide\n"
         "  base: {name: bench, mode: fixed, mass: 100, inertia: [10, 10, 10]}\n"
         "  links:\n"
         "    - {name: car, parent: bench, joint: {name: rail, type: prismatic, axis: [1, 0, 0], friction: {viscous: "
         "0.8}}, mass: 2, inertia: [1, 1, 1]}\n"
         "initial: {joints: [0], joint_rates: [0.5]}\n"
         "motion:\n"
         "  - {name: slow, duration: 20, joints: free, until: {joint_rate: 0.1}}\n"
         "  - {name: after, duration: 1, joints: free}\n";
}

TEST(Sensitivities, OfAnEventContainItsTime) {
  const SensitivityReport report = sensitivities_of(
      braked_slide(), {{"robot.links.car.joint.friction.viscous", "robot.links.car.mass", "initial.joint_rates[0]",
                        "motion.slow.until.joint_rate"},
                       {"phases/slow/duration", "end/joints/rail/velocity", "end/joints/rail/position"},
                       StudyMode::run});
  const double m = 2, c = 0.8, v0 = 0.5, v1 = 0.1, T = m / c * std::log(v0 / v1);
  const std::string duration = "phases/slow/duration", rate = "end/joints/rail/velocity",
                    position = "end/joints/rail/position", friction = "robot.links.car.joint.friction.viscous";
  EXPECT_NEAR(report.outcomes.at(0).value, T, 1e-9);
  expect_derivative(report, duration, friction, -T / c, 1e-6);
  expect_derivative(report, duration, "robot.links.car.mass", T / m, 1e-6);
  expect_derivative(report, duration, "initial.joint_rates[0]", m / (c * v0), 1e-6);
  expect_derivative(report, duration, "motion.slow.until.joint_rate", -m / (c * v1), 1e-5);
  // After the event the rate is v1 exp(-c t / m) for t = 1 s, whatever v0: the event's time removes its effect.
  expect_derivative(report, rate, "initial.joint_rates[0]", 0, 1e-9);
  expect_derivative(report, rate, friction, -v1 / m * std::exp(-c / m), 1e-8);
  // x = (m/c) (v0 - v1 exp(-c/m)).
  expect_derivative(report, position, "initial.joint_rates[0]", m / c, 1e-7);
}

// An axisymmetric body: its angular velocity turns about the angular momentum with the rate |h| / A.
std::array<double, 3> spun(double A, double C, double spin, double t) {
  const double wx = 0.2, hx = A * wx, hz = C * spin, h = std::hypot(hx, hz), angle = h / A * t;
  const double nx = hx / h, nz = hz / h, along = wx * nx + spin * nz;
  const double s = std::sin(angle), k = std::cos(angle), ax = wx - along * nx, az = spin - along * nz;
  // n x a has only a y component.
  return {along * nx + k * ax, s * (nz * ax - nx * az), along * nz + k * az};
}

TEST(Sensitivities, OfTumblingHaveTheirClosedForm) {
  const std::string text =
      "schema: grapnel-scenario/1\n"
      "name: top\n"
      "robot:\n"
      "  name: top\n"
      "  base: {name: body, mass: 10, inertia: [3, 3, 5]}\n"
      "  links:\n"
      "    - {name: mast, parent: body, joint: {name: root, type: fixed}, mass: 1e-9, inertia: [1e-12, 1e-12, 1e-12]}\n"
      "initial: {base: {angular_velocity: [0.2, 0, 0.5]}, joints: []}\n"
      "motion: {duration: 30, joints: free}\n";
  const SensitivityReport report = sensitivities_of(
      text,
      {{"initial.base.angular_velocity[2]", "robot.base.inertia"}, {"end/base/angular_velocity"}, StudyMode::run});
  const double d = 1e-6;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string of = std::string("end/base/angular_velocity/") + "xyz"[i];
    const double by_spin = (spun(3, 5, 0.5 + d, 30)[i] - spun(3, 5, 0.5 - d, 30)[i]) / (2 * d);
    const double by_C = (spun(3, 5 + d, 0.5, 30)[i] - spun(3, 5 - d, 0.5, 30)[i]) / (2 * d);
    EXPECT_NEAR(report.outcomes.at(i).value, spun(3, 5, 0.5, 30)[i], 1e-9);
    expect_derivative(report, of, "initial.base.angular_velocity[2]", by_spin, 1e-5);
    expect_derivative(report, of, "robot.base.inertia/zz", by_C, 1e-5);
  }
}

// ---- A planned capture ----

CaptureProblem planned(const std::string& mass, double tolerance) {
  return load_scenario(
      test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml"),
      std::vector<Override>{{"targets[0].mass", mass}, {"integration.relative_tolerance", number(tolerance)}});
}

// Approach, impact and motion afterwards: against the exact sensitivity of the impact by dual numbers, where the plan
// does not depend on the value, and against differences with another step and tolerance.
TEST(Sensitivities, OfAPlannedCaptureAgreeWithOtherMethods) {
  SKIP_UNDER_SANITIZERS();  // the other cases run the same code
  const SensitivityTask task =
      load_sensitivities(test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml"),
                         {{"targets[0].mass"}, {"grasps/*/impulse_magnitude", "end/base/angular_velocity/z"}});
  const SensitivityReport report = sensitivities(task, {.threads = 2});
  const double mass = report.values.at(0).value, d = 0.003 * mass;
  const CaptureResult here = simulate_capture(planned(number(mass), 1e-12));
  const ImpactReport& impact = *here.impact();
  const auto exact = std::find_if(impact.sensitivities.begin(), impact.sensitivities.end(), [&](const auto& one) {
    return one.parameter == "target mass" && one.target == impact.grasps[0].target;
  });
  ASSERT_NE(exact, impact.sensitivities.end());
  ASSERT_GT(std::abs(exact->impulse_magnitude.at(0)), 1e-4);
  for (std::size_t g = 0; g < impact.grasps.size(); ++g) {
    const std::string of = "grasps/" + impact.grasps[g].end_effector + "/impulse_magnitude";
    expect_derivative(report, of, "targets[0].mass", exact->impulse_magnitude.at(g), 1e-8);
  }
  const CaptureResult more = simulate_capture(planned(number(mass + d), 1e-11)),
                      less = simulate_capture(planned(number(mass - d), 1e-11));
  const double plain =
      (more.post_impact_end->base.angular_velocity[2] - less.post_impact_end->base.angular_velocity[2]) / (2 * d);
  ASSERT_GT(std::abs(plain), 1e-5);
  const auto& one = entry(report, "end/base/angular_velocity/z", "targets[0].mass");
  EXPECT_EQ(one.verdict, Differentiable::yes);
  EXPECT_NEAR(*one.derivative / plain, 1, 1e-3);
}

// ---- First-order uncertainty ----

TEST(FirstOrder, MomentsAreThoseOfTheDrawnNumbers) {
  using Kind = NumberDistribution::Kind;
  const NumberDistribution all[] = {{Kind::normal, 2, 0.5, 0, 0, false},      {Kind::normal, 2, 0.5, 1.8, 4, true},
                                    {Kind::normal, 0, 1, 2, HUGE_VAL, true},  {Kind::log_normal, 2, 0.3, 0, 0, false},
                                    {Kind::log_normal, 2, 0.3, 1, 2.5, true}, {Kind::uniform, 0, 0, -1, 3, false},
                                    {Kind::integers, 0, 0, 2, 5, false}};
  for (const NumberDistribution& d : all) {
    constexpr int n = 200'000;
    double sum = 0, squares = 0;
    for (int i = 0; i < n; ++i) {
      const double x = d.at((i + 0.5) / n);
      sum += x, squares += x * x;
    }
    const auto [mean, variance] = moments_of(d);
    EXPECT_NEAR(mean, sum / n, 1e-4);
    EXPECT_NEAR(variance, squares / n - sum * sum / n / n, 1e-3);
  }
}

std::string uncertain_strike(std::size_t cases) {
  return "schema: grapnel-campaign/1\n"
         "name: uncertain strike\n"
         "scenario: scenario.yaml\n"
         "simulate: impact\n"
         "cases: " +
         std::to_string(cases) +
         "\n"
         "seed: 3\n"
         "sampling: latin_hypercube\n"
         "uncertain:\n"
         "  - {path: targets.ball.mass, as: factor, normal: {deviation: 0.02}}\n"
         "  - {path: robot.base.mass, uniform: {from: 7.6, to: 8.4}}\n"
         "  - {paths: ['targets.ball.state.velocity[0]', impact.restitution], as: offset, normal: {covariance: [[4e-6, "
         "-8e-6], [-8e-6, 1e-4]]}}\n"
         "success:\n"
         "  - {name: soft, holds: grasps/tip/impulse_magnitude < 0.81}\n"
         "  - base/velocity_change/x < 1 or captured\n";
}

TEST(FirstOrder, AgreesWithACampaignOfSmallUncertainties) {
  const test::Folder folder;
  folder.write("scenario.yaml", strike({}));
  const auto file = folder.write("campaign.yaml", uncertain_strike(400));
  const SensitivityReport report = sensitivities(load_sensitivities(file, {}), {.threads = 2});
  const SensitivityReport::Outcome& impulse = report.outcomes.at(0);
  ASSERT_EQ(impulse.name, "grasps/tip/impulse_magnitude");
  ASSERT_TRUE(impulse.deviation.has_value());
  double shares = 0;
  for (const auto& one : impulse.by) shares += one.share.value_or(NAN);
  EXPECT_NEAR(shares, 1, 1e-12);
  ASSERT_EQ(report.limits.size(), 1u);
  EXPECT_TRUE(report.limits[0].holds);
  ASSERT_EQ(report.unjudged.size(), 1u);

  const Campaign campaign = load_campaign(file);
  const auto column = std::find_if(campaign.columns.begin(), campaign.columns.end(),
                                   [&](const Column& one) { return one.name == impulse.name; });
  ASSERT_NE(column, campaign.columns.end());
  const auto c = static_cast<std::size_t>(column - campaign.columns.begin());
  double sum = 0, squares = 0, below = 0;
  for (std::uint64_t k = 0; k < campaign.cases; ++k) {
    const auto row = run_campaign_case(campaign, k);
    ASSERT_TRUE(row && row->status == CaseStatus::ok);
    sum += row->values[c], squares += row->values[c] * row->values[c], below += row->values[c] < 0.81;
  }
  const double n = static_cast<double>(campaign.cases), mean = sum / n,
               deviation = std::sqrt(squares / n - mean * mean);
  EXPECT_NEAR(impulse.value / mean, 1, 2e-3);
  EXPECT_NEAR(*impulse.deviation / deviation, 1, 0.05);
  EXPECT_NEAR(*report.limits[0].probability, below / n, 0.05);
}

TEST(FirstOrder, ChoicesAndRandomDirectionsAreHeld) {
  const test::Folder folder;
  folder.write("scenario.yaml", strike({}));
  std::string text = uncertain_strike(10);
  const std::string more = "  - {path: impact.friction, discrete: {values: [0.3, 0.1], weights: [1, 3]}}\n";
  text.replace(text.find("uncertain:\n"), 11, "uncertain:\n" + more);
  const auto file = folder.write("campaign.yaml", text);
  const SensitivityTask task = load_sensitivities(file, {});
  ASSERT_EQ(task.notes.size(), 1u);
  EXPECT_THAT(task.notes[0], HasSubstr("impact.friction has no mean, and is held at its most probable choice"));
  std::vector<double> at;
  for (const SensitivityValue& value : task.values) at.push_back(value.value);
  EXPECT_EQ(at.size(), 4u);
  EXPECT_EQ(task.problem(at).problem.impact->friction, 0.1);
  // A random direction needs a value of the scenario.
  text.replace(text.find(more), more.size(),
               "  - {path: targets.ball.state.angular_velocity, sphere: {length: 0.1}}\n");
  EXPECT_THAT(load_sensitivities(folder.write("campaign.yaml", text), {}).notes.at(0),
              HasSubstr("targets.ball.state.angular_velocity has no mean, and is held at the scenario's value"));
}

// ---- Errors ----

TEST(Sensitivities, ReportAllUnknownNames) {
  const test::Folder folder;
  const auto file = folder.write("scenario.yaml", strike({}));
  try {
    load_sensitivities(file, {{"targets.ball.mas", "targets.bal.mass", "impact.law", "impact.restitution"},
                              {"grasps/tip/impuls_magnitude", "grasps"}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.faults().size(), 4u) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'mass'?"));
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'ball'?"));
    EXPECT_THAT(error.what(), HasSubstr("the scenario has the text 'friction' at impact.law"));
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'grasps/tip/impulse_magnitude'?"));
  }
}

TEST(Sensitivities, ByOneValueTwiceAreAnError) {
  const test::Folder folder;
  const auto file = folder.write("scenario.yaml", strike({}));
  try {
    load_sensitivities(file, {{"targets.ball.mass", "targets[0].mass", "targets.ball.state.velocity[0]",
                               "targets.ball.state.velocity", "impact.restitution"},
                              {}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.faults().size(), 2u) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("is the same value as targets.ball.mass"));
    EXPECT_THAT(error.what(), HasSubstr("contains targets.ball.state.velocity[0]"));
  }
}

TEST(Sensitivities, OfAFailingCaptureAreAnError) {
  const test::Folder folder;
  std::string text = strike({});
  text.replace(text.find("gap: weld_as_found"), 18, "gap: refuse, limit: 1e-9");
  text.replace(text.find("[0.8, 0, 0]"), 11, "[0.9, 0, 0]");
  const SensitivityTask task = load_sensitivities(folder.write("scenario.yaml", text), {});
  EXPECT_THROW(sensitivities(task), SensitivitiesFailed);
}

TEST(Sensitivities, AreTheSameForAnyNumberOfThreads) {
  const test::Folder folder;
  const SensitivityTask task = load_sensitivities(folder.write("scenario.yaml", strike({})),
                                                  {{"impact.restitution", "targets.ball.mass"}, {}, StudyMode::impact});
  const std::string one = sensitivities_json(sensitivities(task, {.threads = 1}));
  EXPECT_EQ(one, sensitivities_json(sensitivities(task, {.threads = 3})));
  EXPECT_THAT(one, HasSubstr("grapnel-sensitivities/1"));
}

}  // namespace sensitivities_test
}  // namespace grapnel
