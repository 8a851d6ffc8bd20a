// Linear models and margins of scenarios beside their closed forms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/linear/stability.hpp"
#include "linear/linear_scenarios.hpp"

namespace grapnel::testing {
namespace linear_closed_forms_test {

using Complex = std::complex<double>;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Stability = LinearModel::Stability;
using Kind = LinearModel::Kind;

constexpr double I = kHingeInertia;

// The distance of a number from the nearest eigenvalue of the model, as z if sampled.
double distance(const LinearModel::Modes& modes, Complex value, bool sampled) {
  double least = 1e300;
  for (const auto& e : modes.eigenvalues) {
    const Complex have = sampled ? Complex(*e.z_real, *e.z_imaginary) : Complex(e.real, e.imaginary);
    least = std::min(least, std::abs(have - value));
  }
  return least;
}

// I s^2 + d s + k = 0; the loop gain is (d s + k)/(I s^2).
TEST(LinearClosedForms, OfAHingeUnderPd) {
  const double k = 20, d = 1.6;
  const LinearModel model = linear_model(hinge(k, d));
  ASSERT_EQ(model.states.size(), 2u);
  EXPECT_EQ(model.states[0].name, "joints/position/elbow");
  EXPECT_EQ(model.states[1].unit, "rad/s");
  EXPECT_DOUBLE_EQ(*model.states[0].value, 0.3);
  EXPECT_NEAR(matrix_of(model.B)(1, 0), 1 / I, 1e-12);
  ASSERT_TRUE(model.closed_loop) << model.closed_loop_absent;
  const auto& loop = *model.closed_loop;
  EXPECT_EQ(loop.stability.verdict, Stability::stable) << loop.stability.reason;
  const Complex root = (-d + std::sqrt(Complex(d * d - 4 * k * I))) / (2 * I);
  const double error = distance(loop.stability, root, false);
  std::printf("[ measured ] eigenvalue: %.2g of 1/s\n", error);
  EXPECT_LT(error, 1e-8);
  ASSERT_EQ(loop.margins.size(), 1u);
  const auto& margin = loop.margins.front();
  // |L| = 1: I^2 w^4 = k^2 + d^2 w^2.
  const double w = std::sqrt((d * d + std::sqrt(d * d * d * d + 4 * k * k * I * I)) / (2 * I * I));
  const double phase = std::atan2(d * w, k);
  EXPECT_NEAR(*margin.phase, phase, 1e-6);
  EXPECT_NEAR(*margin.phase_frequency, w, 1e-6 * w);
  EXPECT_NEAR(*margin.delay, phase / w, 1e-6 * phase / w);
  EXPECT_FALSE(margin.gain_maximum);
  EXPECT_FALSE(margin.gain_minimum);
}

// Without a law: two zero eigenvalues, which are drift.
TEST(LinearClosedForms, OfAFreeHingeDrift) {
  const LinearModel model = linear_model(hinge(20, 1.6));
  ASSERT_EQ(model.open_loop.eigenvalues.size(), 2u);
  EXPECT_EQ(model.open_loop.verdict, Stability::marginal) << model.open_loop.reason;
  for (const auto& e : model.open_loop.eigenvalues) EXPECT_EQ(e.kind, Kind::drift);
}

// I x'' = u from sample to sample, u = -(k theta + d rate) of the previous sample for the time `late`, then of this
// one.
Eigen::Matrix3d sampled_hinge(double k, double d, double T, double late) {
  const double rest = T - late;
  Eigen::Matrix3d M;
  M << 1, T, (late * late / 2 + late * rest) / I, 0, 1, late / I, 0, 0, 0;
  const Eigen::Vector3d now(rest * rest / (2 * I), rest / I, 1);
  return M + now * Eigen::RowVector3d(-k, -d, 0);
}

double radius(const Eigen::MatrixXd& M) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(M, false).eigenvalues().cwiseAbs().maxCoeff();
}

// The value between a stable and an unstable one at which f exceeds 1.
template <class F>
double limit(double stable, double unstable, F&& f) {
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (stable + unstable);
    (f(middle) > 1 ? unstable : stable) = middle;
  }
  return stable;
}

TEST(LinearClosedForms, OfASampledHingeWithDelay) {
  const double k = 20, d = 12, T = 0.05, late = 0.015;
  const LinearModel model = linear_model(hinge(k, d, "control: {period: 50 ms, delay: 15 ms}\n"));
  ASSERT_TRUE(model.closed_loop && model.sampled) << model.closed_loop_absent;
  const auto& loop = *model.closed_loop;
  EXPECT_TRUE(loop.sampled);
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd(sampled_hinge(k, d, T, late)), false);
  for (int i = 0; i < 3; ++i) {
    const double error = distance(loop.stability, solver.eigenvalues()[i], true);
    std::printf("[ measured ] z %d: %.2g\n", i, error);
    EXPECT_LT(error, 1e-8);
  }
  EXPECT_NEAR(model.sampled->Bd_previous[1][0], late / I, 1e-12);
  EXPECT_NEAR(model.sampled->Bd[0][0], (T - late) * (T - late) / (2 * I), 1e-12);
  ASSERT_EQ(loop.margins.size(), 1u);
  const double gain = limit(1, 100, [&](double f) { return radius(sampled_hinge(f * k, f * d, T, late)); });
  EXPECT_NEAR(*loop.margins[0].gain_maximum, gain, 1e-5 * gain);
  const double delay = limit(0, T - late, [&](double more) { return radius(sampled_hinge(k, d, T, late + more)); });
  ASSERT_LT(delay, 0.99 * (T - late));  // within the closed form of one period
  EXPECT_NEAR(*loop.margins[0].delay, delay, 1e-3 * delay);
}

// A delay of several periods: the same loop as a polynomial, I (z - 1)^2 z^n + ... = 0.
TEST(LinearClosedForms, OfASampledHingeWithADelayOfTwoPeriods) {
  const double k = 2, d = 1, T = 0.05;
  const LinearModel model = linear_model(hinge(k, d, "control: {period: 50 ms, delay: 100 ms}\n"));
  ASSERT_TRUE(model.closed_loop);
  EXPECT_EQ(model.sampled->whole_periods, 2u);
  int checked = 0;
  for (const auto& e : model.closed_loop->stability.eigenvalues) {
    const Complex z(*e.z_real, *e.z_imaginary);
    if (std::abs(z) < 1e-3) continue;
    const Complex p = (z - 1.0) * (z - 1.0) * z * z + (k * T * T / (2 * I)) * (z + 1.0) + (d * T / I) * (z - 1.0);
    EXPECT_LT(std::abs(p), 1e-9) << z;
    ++checked;
  }
  EXPECT_EQ(checked, 4);
}

// Gain times sample time too high: reported, and the simulation grows by the predicted factor per sample.
TEST(LinearClosedForms, UnstableSampledLawGrowsAsPredicted) {
  const double k = 4, d = 21;  // d T/I = 2.1
  std::string text = hinge(k, d, "control: {period: 50 ms}\noutput: {interval: 50 ms}\n");
  text.replace(text.find("initial:"), std::string("initial: {joints: [0.3]}").size(),
               "initial: {joints: [0.3], joint_rates: [1e-3]}");
  text.replace(text.find("duration: 10"), 12, "duration: 4");
  const CaptureProblem problem = problem_of(text);
  const LinearModel model = linearize(problem, {});
  ASSERT_TRUE(model.closed_loop);
  const auto& loop = *model.closed_loop;
  EXPECT_EQ(loop.stability.verdict, Stability::unstable);
  EXPECT_THAT(model.warnings, Contains(HasSubstr("the controlled system is unstable")));
  EXPECT_TRUE(loop.margins.empty());
  const auto& first = loop.stability.eigenvalues.front();
  EXPECT_EQ(first.kind, Kind::grows);
  const double growth = std::hypot(*first.z_real, *first.z_imaginary);
  ASSERT_GT(growth, 1.01);
  const CaptureResult result = simulate_capture(problem);
  ASSERT_EQ(result.status, CaptureStatus::completed) << result.failure;
  const auto rates = std::find_if(result.series.series.begin(), result.series.series.end(),
                                  [](const Series& s) { return s.path == "joints/velocity"; });
  ASSERT_NE(rates, result.series.series.end());
  ASSERT_GT(rates->data.size(), 75u);
  const double simulated = std::pow(std::abs(rates->data[70] / rates->data[40]), 1.0 / 30);
  std::printf("[ measured ] growth per sample: %.6f, simulated %.6f\n", growth, simulated);
  EXPECT_NEAR(simulated, growth, 1e-3 * growth);
}

// A rigid body under an external torque about each axis: three loops of double integrators, beside free translation.
TEST(LinearClosedForms, OfAttitudeControlOfARigidBody) {
  const LinearModel model = linear_model(
      "schema: grapnel-scenario/1\n"
      "name: body\n"
      "robot: {name: body, base: {name: bus, mass: 50, inertia: [8, 6, 5]}}\n"
      "motion:\n"
      "  - {name: hold, duration: 10, base_control: {kp: [4, 5, 6], kd: [3, 4, 5]}}\n");
  ASSERT_TRUE(model.closed_loop) << model.closed_loop_absent;
  const auto& loop = *model.closed_loop;
  EXPECT_EQ(loop.stability.verdict, Stability::stable) << loop.stability.reason;
  const double inertia[] = {8, 6, 5}, kp[] = {4, 5, 6}, kd[] = {3, 4, 5};
  ASSERT_EQ(loop.margins.size(), 3u);
  for (int axis = 0; axis < 3; ++axis) {
    const Complex root =
        (-kd[axis] + std::sqrt(Complex(kd[axis] * kd[axis] - 4 * kp[axis] * inertia[axis]))) / (2 * inertia[axis]);
    EXPECT_LT(distance(loop.stability, root, false), 1e-8);
    const double a = kd[axis] * kd[axis], b = 4 * kp[axis] * kp[axis] * inertia[axis] * inertia[axis];
    const double w = std::sqrt((a + std::sqrt(a * a + b)) / (2 * inertia[axis] * inertia[axis]));
    EXPECT_NEAR(*loop.margins[static_cast<std::size_t>(axis)].phase, std::atan2(kd[axis] * w, kp[axis]), 1e-6);
  }
  const auto is_free = [](const auto& e) { return e.kind == Kind::drift || e.kind == Kind::conserved; };
  EXPECT_EQ(std::ranges::count_if(loop.stability.eigenvalues, is_free), 6);
}

TEST(LinearClosedForms, ErrorsNameTheTime) {
  const CaptureProblem problem = problem_of(hinge(20, 1.6));
  EXPECT_THAT([&] { linearize(problem, {.time = 11}); },
              ThrowsMessage<LinearizeError>(HasSubstr("no motion follows t = 11 s")));
  EXPECT_THAT([&] { linearize(problem, {.time = -1}); }, ThrowsMessage<LinearizeError>(HasSubstr("at least 0")));
}

// An effort at its limit does not respond to the state.
TEST(LinearClosedForms, SaturatedEffortHasNoGain) {
  std::string text = hinge(200, 1, "", ", limits: {effort: 5}");
  text.replace(text.find("initial:"), std::string("initial: {joints: [0.3]}").size(),
               "initial: {joints: [0.3], joint_rates: [-20]}");
  const LinearModel model = linear_model(text);
  ASSERT_TRUE(model.closed_loop) << model.closed_loop_absent;
  EXPECT_THAT(model.notes, Contains(HasSubstr("at its limit of 5")));
  EXPECT_EQ(matrix_of(model.closed_loop->K).norm(), 0);
  EXPECT_NE(model.closed_loop->stability.verdict, Stability::stable) << model.closed_loop->stability.reason;
  EXPECT_THAT(model.closed_loop->stability.reason, HasSubstr("is at its limit"));
}

// A spring too weak to hold a link that centrifugal force pulls outwards: growth that could be tumbling, not "stable".
TEST(LinearClosedForms, AWeakLawOnARotatingBaseIsNotCalledStable) {
  const std::string text =
      "schema: grapnel-scenario/1\n"
      "name: spinning arm\n"
      "robot:\n"
      "  name: r\n"
      "  base: {name: bus, mass: 1000, inertia: [500, 500, 800]}\n"
      "  links:\n"
      "    - {name: link, parent: bus, mass: 5, com: [0.5, 0, 0], inertia: [0.01, 0.3, 0.3],\n"
      "       joint: {name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [1.5, 0, 0]}}}\n"
      "initial: {joints: [180 deg], base: {angular_velocity: [0, 0, 0.5]}}\n"
      "motion: [{name: hold, duration: 60, joints: pd, kp: 0.6, kd: 0.2}]\n";
  const LinearModel model = linear_model(text);
  ASSERT_TRUE(model.closed_loop) << model.closed_loop_absent;
  EXPECT_EQ(model.closed_loop->stability.verdict, Stability::undecided) << model.closed_loop->stability.reason;
  EXPECT_GT(model.closed_loop->stability.eigenvalues[0].real, 0.3);
  EXPECT_THAT(model.warnings, Contains(HasSubstr("not decided")));
}

TEST(LinearClosedForms, GainsOfAllStates) {
  LinearModel model;
  model.states = {{"a", "", {}}, {"b", "", {}}, {"c", "", {}}};
  model.closed_loop.emplace();
  model.closed_loop->states = {"c", "a"};
  model.closed_loop->K = {{1, 2}, {3, 4}};
  EXPECT_EQ(gain_of_all_states(model), (LinearModel::Matrix{{2, 0, 1}, {4, 0, 3}}));
}

TEST(LinearClosedForms, DelaysOfManyPeriodsAreErrors) {
  const CaptureProblem problem = problem_of(hinge(20, 1.6));
  EXPECT_THROW(linearize(problem, {0, 1e-9, 10}), LinearizeError);
  EXPECT_THROW(linearize(problem, {0, {}, 1}), LinearizeError);
}

// Two decays, of which one belongs to a and one to b, whatever the units of b.
TEST(LinearClosedForms, DominantStatesDoNotDependOnUnits) {
  for (const double unit : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    ReducedLoop reduced;
    reduced.loop.A = (Eigen::Matrix2d() << -1, 0.5 / unit, 0.2 * unit, -4).finished();
    reduced.loop.states = {"a", "b"};
    const LinearModel::Modes modes = modes_of(reduced);
    ASSERT_EQ(modes.eigenvalues.size(), 2u);
    EXPECT_EQ(modes.eigenvalues[0].state, "a") << unit;
    EXPECT_EQ(modes.eigenvalues[1].state, "b") << unit;
  }
}

}  // namespace linear_closed_forms_test
}  // namespace grapnel::testing
