/// Tracking that is not ideal, noise, attitude control of the base, loads from outside: what they do, and that plans
/// allow for them. Impulses of loads and references are computed here.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numbers>

#include "capture/recorded.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace disturbed_plan_test {

using ::testing::HasSubstr;

CaptureProblem approach_only(RateMatch match = RateMatch::twist) {
  CaptureProblem p = thesis_case();
  p.impact.reset();
  p.approach->match = match;
  p.output_interval = 0.25;
  return p;
}
CaptureProblem planned() {
  CaptureProblem p = approach_only();
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  return p;
}
void control(CaptureProblem& p, double kp, double kd) {
  p.approach->base_control.emplace();
  p.approach->base_control->kp = {kp, kp, kp};
  p.approach->base_control->kd = {kd, kd, kd};
}
void computed_torque(CaptureProblem& p, double kp, double kd) {
  use_pd(p, kp, kd);
  p.approach->tracking.mode = JointControl::computed_torque;
}

// Largest deviation of the joints from an ideal run's, over all samples.
double deviation(const CaptureResult& a, const CaptureResult& b, const std::string& path = "joints/position") {
  const std::vector<double>&x = series(a, path).data, &y = series(b, path).data;
  EXPECT_EQ(x.size(), y.size());
  double most = 0;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) most = std::max(most, std::abs(x[i] - y[i]));
  return most;
}

// --- Tracking -------------------------------------------------------------------------------------------------------

TEST(ComputedTorque, EqualsIdealTracking) {
  CaptureProblem p = planned();
  const CaptureResult ideal = simulate_capture(p);
  computed_torque(p, 4, 4);
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  EXPECT_LT(deviation(ideal, r), 1e-9);
  EXPECT_LT(deviation(ideal, r, "base/position"), 1e-9);
  for (std::size_t g = 0; g < 2; ++g) EXPECT_LT(meeting(p, r, g, last_sample(r, "approach")).distance(), 1e-9);
  // A start off the reference dies out: critically damped, e(t) = e0 (1 + 2 t) exp(-2 t) for kp = 4, kd = 4.
  CaptureProblem friction = p;
  for (BodyDescription& b : friction.robot.bodies) {
    if (!b.parent.empty()) b.joint.friction = {2, 0.3, 1e-2};
  }
  const CaptureResult rough = simulate_capture(friction);
  ASSERT_EQ(rough.status, CaptureStatus::completed) << rough.failure;
  expect_passes(rough);
  EXPECT_GT(deviation(ideal, rough), 1e-4);
  EXPECT_LT(value_at(rough, "system/friction_work", last_sample(rough, "approach")), -1e-3);
  std::printf("[ measured ] computed torque %.2g, with friction %.2g rad\n", deviation(ideal, r),
              deviation(ideal, rough));
}

TEST(Saturation, ReportedWithEffortAtLimit) {
  for (bool pd : {true, false}) {
    CaptureProblem p = approach_only();
    const double limit = 0.12;
    for (BodyDescription& b : p.robot.bodies) {
      if (!b.parent.empty()) b.joint.limits.effort = limit;
    }
    pd ? use_pd(p, 49, 14) : computed_torque(p, 4, 4);
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    EXPECT_EQ(row(r, "joint_effort_violation").value, 0);
    int saturated = 0;
    for (const LimitEvent& e : r.limit_events) {
      EXPECT_EQ(e.kind, LimitKind::effort_saturated);
      EXPECT_EQ(e.phase, "approach");
      EXPECT_EQ(std::abs(e.limit), limit);
      EXPECT_NEAR(std::abs(e.worst_value), limit, 1e-12);
      ++saturated;
    }
    EXPECT_GT(saturated, 0);
    double most = 0;
    int at_limit = 0;
    for (double effort : series(r, "joints/effort").data) {
      most = std::max(most, std::abs(effort));
      at_limit += std::abs(effort) == limit;
    }
    EXPECT_EQ(most, limit);
    EXPECT_GT(at_limit, 3);
  }
}

TEST(Noise, ChangesErrorByItsSizeAndIsReproducible) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = planned();
  const CaptureResult quiet = simulate_capture(p);
  const auto with = [&](double size, std::uint64_t seed) {
    CaptureProblem q = p;
    q.approach->tracking.noise = TrackingNoise{size, 0.5, seed};
    return simulate_capture(q);
  };
  const CaptureResult a = with(1e-3, 1), again = with(1e-3, 1), other = with(1e-3, 2), less = with(1e-4, 1);
  ASSERT_EQ(a.status, CaptureStatus::completed) << a.failure;
  for (const CaptureResult* r : {&a, &other, &less}) expect_passes(*r);
  for (std::size_t s = 0; s < a.series.series.size(); ++s) {
    const auto &x = a.series.series[s].data, &y = again.series.series[s].data;
    ASSERT_EQ(x.size(), y.size());
    EXPECT_EQ(std::memcmp(x.data(), y.data(), x.size() * sizeof(double)), 0) << a.series.series[s].path;
  }
  EXPECT_GT(deviation(a, other), 1e-4);
  const double large = deviation(a, quiet), small = deviation(less, quiet);
  EXPECT_GT(large, 1e-3);
  EXPECT_LT(large, 5e-3);  // the most of 480 normal values
  EXPECT_NEAR(large / small, 10, 1e-6);
  double square = 0;
  const std::vector<double>&x = series(a, "joints/position").data, &y = series(quiet, "joints/position").data;
  for (std::size_t i = 0; i < x.size(); ++i) square += (x[i] - y[i]) * (x[i] - y[i]) / static_cast<double>(x.size());
  EXPECT_NEAR(std::sqrt(square), 1e-3, 2e-4);
  const double miss = meeting(p, a, 0, last_sample(a, "approach")).distance();
  EXPECT_GT(miss, 1e-5);
  EXPECT_LT(miss, 2e-2);  // a few noises at 1 to 3 m
  std::printf("[ measured ] deviation %.3g, rms %.3g, miss %.3g\n", large, std::sqrt(square), miss);
}

// --- Attitude control -----------------------------------------------------------------------------------------------

TEST(BaseControl, ErrorDecreasesWithStiffness) {
  double before = 1;
  for (double kp : {50.0, 500.0, 5000.0}) {
    CaptureProblem p = approach_only();
    p.approach->match.reset();
    control(p, kp, 2 * std::sqrt(kp * 600));
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    double most = 0, torque = 0;
    for (std::size_t s = 0; s < r.series.time.size(); ++s) {
      most = std::max(most, rotation_angle(pose_at(r, "base", s).R));
      if (s < 2) continue;
      // What turns the total about the centre of mass comes from the controller alone: its mean over an interval.
      const Vector3d dl = vector_at(r, "system/angular_momentum", s) - vector_at(r, "system/angular_momentum", s - 1);
      torque = std::max(torque, norm(dl) / (r.series.time[s] - r.series.time[s - 1]));
    }
    EXPECT_LT(most, 0.3 * before);
    // A spring-damper yields at most by the torque that it gives over its stiffness, and a lag of its damping.
    EXPECT_LT(kp * most, 3 * torque);
    EXPECT_GT(torque, 0.5);
    std::printf("[ measured ] kp %g: %.3g rad, torque %.3g N m\n", kp, most, torque);
    before = most;
  }
  EXPECT_LT(before, 1e-2);
}

TEST(BaseControl, IncludedInPlanOrFailureReported) {
  SKIP_UNDER_SANITIZERS();
  int arrived = 0;
  for (double gain : {0.1, 1.0, 5.0, 20.0, 100.0, 1000.0}) {
    for (bool turn : {false, true}) {
      CaptureProblem p = planned();
      control(p, gain, 5 * gain);
      if (turn) p.approach->base_control->R_WD = rotation_about({0, 0, 1}, 0.1);
      const CaptureResult r = simulate_capture(p);
      if (r.status != CaptureStatus::completed) {
        EXPECT_THAT(r.failure, HasSubstr("loads or"));
        EXPECT_THAT(r.failure, HasSubstr("attitude control"));
        EXPECT_TRUE(r.plan);
        continue;
      }
      expect_passes(r);
      for (std::size_t g = 0; g < 2; ++g) {
        const Meeting m = meeting(p, r, g, last_sample(r, "approach"));
        EXPECT_LT(m.distance(), 1e-9);
        EXPECT_LT(norm(m.relative_velocity()) + norm(m.relative_spin()), 1e-9);
      }
      ++arrived;
    }
  }
  EXPECT_GE(arrived, 12);  // all of them; each within 1e-10
}

// --- Loads ----------------------------------------------------------------------------------------------------------

LoadSetup load(const std::string& body, const Vector3d& point, const Wrenchd& amplitude, LoadProfile::Shape shape,
               double start, double end) {
  LoadSetup l;
  l.body = body, l.p_BP = point, l.amplitude = amplitude;
  l.profile.shape = shape, l.profile.start = start, l.profile.end = end;
  return l;
}

// Profiles by hand.
double constant_integral(double start, double end, double t) { return std::clamp(t, start, end) - start; }
double half_sine_integral(double start, double end, double t) {
  const double T = end - start, x = std::clamp(t, start, end) - start;
  return T / std::numbers::pi * (1 - std::cos(std::numbers::pi * x / T));
}

TEST(Loads, ImpulseIsTheirIntegralInAllPhases) {
  CaptureProblem p = thesis_case_pd();
  p.approach->duration = 10;
  p.approach->match.reset();
  p.post_impact.emplace();
  p.post_impact->duration = 10;
  p.output_interval = 0.25;
  const Vector3d f1{0.3, -0.1, 0.05}, f2{-0.4, 0.2, 0.1}, f3{0.2, 0.3, -0.1};
  p.loads = {load("arm-1-link-2", {0.4, 0.1, 0}, {{0, 0, 0}, f1}, LoadProfile::Shape::constant, 2, 14),
             load("base", {0, 0, 0}, {{0, 0, 0.2}, f2}, LoadProfile::Shape::half_sine, 3, 9.5),
             load("target:target-1", {0.2, 0, 0.1}, {{0, 0, 0}, f3}, LoadProfile::Shape::half_sine, 8, 13)};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  Worst worst("impulse against the integral");
  const Vector3d start = vector_at(r, "system/linear_momentum", 0);
  for (std::size_t s = 0; s < r.series.time.size(); ++s) {
    const double t = r.series.time[s];
    const Vector3d impulse =
        constant_integral(2, 14, t) * f1 + half_sine_integral(3, 9.5, t) * f2 + half_sine_integral(8, 13, t) * f3;
    EXPECT_LT(worst.note(norm(vector_at(r, "system/linear_momentum", s) - start - impulse), static_cast<int>(s)),
              1e-10);
  }
  EXPECT_GT(norm(vector_at(r, "system/linear_momentum", r.series.time.size() - 1) - start), 2);
}

TEST(Loads, PlanIncludesLoadsOnArmsAndBase) {
  for (double size : {0.01, 0.1, 0.5}) {
    CaptureProblem p = planned();
    p.loads = {
        load("arm-1-link-2", {0.4, 0, 0}, {{0, 0, 0.1 * size}, {size, 0, 0}}, LoadProfile::Shape::half_sine, 1, 9),
        load("base", {0, 0.3, 0}, {{0, 0, 0}, {0, size, 0}}, LoadProfile::Shape::constant, 4, 12)};
    p.loads[0].frame = LoadFrame::body;
    const CaptureResult r = simulate_capture(p);
    if (r.status != CaptureStatus::completed) {
      EXPECT_THAT(r.failure, HasSubstr("loads or"));
      EXPECT_GT(size, 0.2);
      continue;
    }
    expect_passes(r);
    for (std::size_t g = 0; g < 2; ++g) {
      const Meeting m = meeting(p, r, g, last_sample(r, "approach"));
      EXPECT_LT(m.distance(), 1e-9);
      EXPECT_LT(norm(m.relative_velocity()) + norm(m.relative_spin()), 1e-9);
    }
  }
}

TEST(Disturbed, RunsAreBitIdentical) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = planned();
  control(p, 20, 50);
  p.approach->tracking.noise = TrackingNoise{1e-4, 1, 7};
  p.loads = {load("arm-1-link-2", {0.4, 0, 0}, {{0, 0, 0.01}, {0.1, 0, 0}}, LoadProfile::Shape::sine, 1, 9)};
  p.loads[0].profile.frequency = 0.3;
  const CaptureResult a = simulate_capture(p), b = simulate_capture(p);
  ASSERT_EQ(a.status, CaptureStatus::completed) << a.failure;
  EXPECT_EQ(a.plan->final_position, b.plan->final_position);
  EXPECT_EQ(a.plan->final_rates, b.plan->final_rates);
  for (std::size_t s = 0; s < a.series.series.size(); ++s) {
    const auto &x = a.series.series[s].data, &y = b.series.series[s].data;
    ASSERT_EQ(x.size(), y.size());
    EXPECT_EQ(std::memcmp(x.data(), y.data(), x.size() * sizeof(double)), 0) << a.series.series[s].path;
  }
}

TEST(Loads, ReportsInfeasibleLoads) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = planned();
  p.loads = {load("base", {0, 0, 0}, {{0, 0, 0}, {20, 0, 0}}, LoadProfile::Shape::constant, 2, 18)};
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, HasSubstr("loads or the base's attitude control"));
  EXPECT_THAT(r.failure, HasSubstr("'tip-1' stays "));
  EXPECT_FALSE(r.plan->found);
  ASSERT_EQ(r.plan->miss.size(), 2u);
  EXPECT_GT(r.plan->miss[0].distance, 0.5);
  std::printf("[ measured ] %s\n", r.failure.c_str());
}

TEST(BaseControl, DampsBaseAfterImpact) {
  CaptureProblem p = thesis_case();
  p.post_impact.emplace();
  p.post_impact->duration = 60;
  p.post_impact->joints = PostImpactSetup::Joints::braked;
  p.post_impact->base_control.emplace();
  BaseControlSetup& control = *p.post_impact->base_control;
  control.kp = {20, 20, 20}, control.kd = {200, 250, 200}, control.limit = {2, 2, 2};
  p.momentum = Momentumd{{5, -3, 20}, {1, 0, 0}};
  p.output_interval = 0.02;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  const std::size_t first = first_sample(r, "post_impact"), last = r.series.time.size() - 1;
  EXPECT_LT(norm(vector_at(r, "base/angular_velocity", last)),
            0.1 * norm(vector_at(r, "base/angular_velocity", first)));
  // The law by hand, from the recorded motion: what it gives is what the total has got.
  const Rotationd R_WD = pose_at(r, "base", first).R;
  const auto torque = [&](std::size_t s) {
    const Rotationd R = pose_at(r, "base", s).R;
    const Vector3d phi = rotation_vector(transpose(R_WD) * R);
    const Vector3d w = transposed_times(R, vector_at(r, "base/angular_velocity", s));
    Vector3d t;
    for (int k = 0; k < 3; ++k) t[k] = std::clamp(-(control.kp[k] * phi[k] + control.kd[k] * w[k]), -2.0, 2.0);
    return R * t;
  };
  Vector3d impulse = Vector3d::zero();
  int cut = 0;
  Worst worst("angular impulse by hand");
  for (std::size_t s = first + 1; s <= last; ++s) {
    impulse += 0.01 * (torque(s - 1) + torque(s));
    const Vector3d got = vector_at(r, "system/angular_momentum", s) - vector_at(r, "system/angular_momentum", first);
    EXPECT_LT(worst.note(norm(got - impulse), static_cast<int>(s)), 2e-4);
    cut += norm(torque(s)) >= 2 * (1 - 1e-12);
  }
  EXPECT_GT(norm(impulse), 10);
  EXPECT_GT(cut, 50);
}

// A target that is held has its body's origin at the contact point; a force still attacks where the user put it.
TEST(Loads, PointOfApplicationOnCapturedTarget) {
  for (GraspModel model : {GraspModel::rigid, GraspModel::hinge, GraspModel::point}) {
    CaptureProblem p = thesis_case();
    p.approach->duration = 5;
    p.approach->match.reset();
    for (GraspSetup& g : p.grasps) g.model = model;
    p.targets[0].com = {0.1, 0.2, -0.1};
    p.targets[0].X_WT.R = rotation_about({0.6, 0, 0.8}, 0.7);
    p.post_impact.emplace();
    p.post_impact->duration = 6;
    p.output_interval = 0.01;
    const Vector3d f{0.3, -0.2, 0.4}, point{0.3, -0.4, 0.2};
    CaptureProblem q = p;  // the same wrench about another point of the body
    p.loads = {load("target:target-1", point, {{0, 0, 0}, f}, LoadProfile::Shape::constant, 5.5, 10)};
    const Vector3d elsewhere{-0.5, 0.1, 0.7};
    q.loads = {
        load("target:target-1", elsewhere, {cross(point - elsewhere, f), f}, LoadProfile::Shape::constant, 5.5, 10)};
    p.loads[0].frame = q.loads[0].frame = LoadFrame::body;
    const CaptureResult a = simulate_capture(p), b = simulate_capture(q);
    ASSERT_EQ(a.status, CaptureStatus::completed) << a.failure;
    expect_passes(a);
    const std::size_t end = a.series.time.size() - 1;
    EXPECT_LT(norm(vector_at(a, "targets/target-1/position", end) - vector_at(b, "targets/target-1/position", end)),
              1e-9);
    EXPECT_LT(norm(vector_at(a, "base/position", end) - vector_at(b, "base/position", end)), 1e-9);
    // The torque about the world's origin from the recorded motion alone, by Simpson's rule.
    Momentumd impulse = Momentumd::zero();
    const std::size_t first = sample_at(a, "post_impact", 5.5), last = sample_at(a, "post_impact", 10);
    ASSERT_EQ((last - first) % 2, 0u);
    for (std::size_t s = first; s <= last; ++s) {
      const double w = 0.01 / 3 * (s == first || s == last ? 1 : (s - first) % 2 ? 4 : 2);
      const Posed X = pose_at(a, "targets/target-1", s);
      impulse.linear += (w * (X.R * f));
      impulse.angular += w * cross(X.p + X.R * point, X.R * f);
    }
    const auto about_origin = [&](std::size_t s) {
      return vector_at(a, "system/angular_momentum", s) +
             cross(vector_at(a, "system/center_of_mass", s), vector_at(a, "system/linear_momentum", s));
    };
    EXPECT_LT(norm(vector_at(a, "system/linear_momentum", last) - vector_at(a, "system/linear_momentum", first) -
                   impulse.linear),
              1e-8);
    EXPECT_LT(norm(about_origin(last) - about_origin(first) - impulse.angular), 1e-8);
    EXPECT_GT(norm(impulse.angular), 0.5);
  }
}

}  // namespace disturbed_plan_test
}  // namespace grapnel::testing
