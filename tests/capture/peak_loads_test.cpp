/// Peak loads over all phases: found in the integrator's steps, independent of the recorded samples.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "capture/impact_case.hpp"
#include "grapnel/capture/effort_watch.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace peak_loads_test {

// --- The search in a step ---

TEST(PeakSearch, FindsMaximaBetweenItsPoints) {
  constexpr double kPi = std::numbers::pi;
  double error = 0, late = 0;
  for (int i = 1; i <= 40; ++i) {
    const double length = 0.02 * i;  // of a step, against a period of pi
    PeakSearch search(3, 4);
    const auto at = [](double t, std::span<double> q) {
      q[0] = std::sin(2 * t), q[1] = -3 * std::exp(-0.1 * t) * (1 - std::cos(2 * t)), q[2] = t, q[3] = 1e9;
    };
    const long steps = static_cast<long>(std::ceil(2 / length));
    for (long s = 0; s < steps; ++s)
      search.step(2.0 * static_cast<double>(s) / static_cast<double>(steps),
                  2.0 * static_cast<double>(s + 1) / static_cast<double>(steps), s == 0, at);
    // (e^-at (1 - cos 2t))' = 0: a (1 - cos 2t) = 2 sin 2t, tan t = 2 / a.
    const double t1 = std::atan2(2, 0.1), largest = 3 * std::exp(-0.1 * t1) * (1 - std::cos(2 * t1));
    ASSERT_EQ(search.peaks().size(), 3U);
    error = std::max(
        {error, std::abs(search.peaks()[0].magnitude - 1), std::abs(search.peaks()[1].magnitude / largest - 1)});
    late = std::max({late, std::abs(search.peaks()[0].time - kPi / 4), std::abs(search.peaks()[1].time - t1)});
    EXPECT_EQ(search.peaks()[2].magnitude, 2);
    EXPECT_EQ(search.peaks()[2].time, 2);
    for (std::size_t k = 1; k < search.points().size(); ++k)
      EXPECT_LE(search.points()[k - 1].time, search.points()[k].time);
  }
  std::printf("[ measured ] peaks off by %.2g, their times by %.2g s\n", error, late);
  EXPECT_LT(error, 1e-9);  // measured 9e-12
  EXPECT_LT(late, 1e-4);   // measured 3e-6
}

TEST(EffortWatch, DetectsSaturation) {
  PeakSearch search(1, 1);
  EffortWatch watch;
  watch.begin_phase("approach");
  watch.watch("elbow", 0, 0.5, true);
  const auto at = [](double t, std::span<double> q) { q[0] = std::clamp(std::sin(t), -0.5, 0.5); };
  for (int s = 0; s < 20; ++s) {
    search.step(0.3 * s, 0.3 * (s + 1), s == 0, at);
    watch.step(search.points(), at);
  }
  const std::vector<LimitEvent> events = watch.end_phase();
  ASSERT_EQ(events.size(), 2U);
  constexpr double kPi = std::numbers::pi;
  for (std::size_t i = 0; i < 2; ++i) {
    const double shift = static_cast<double>(i) * kPi;
    EXPECT_EQ(events[i].kind, LimitKind::effort_saturated);
    EXPECT_EQ(events[i].joint, "elbow");
    EXPECT_NEAR(events[i].begin_time, kPi / 6 + shift, 1e-8);    // measured 6e-10
    EXPECT_NEAR(events[i].end_time, 5 * kPi / 6 + shift, 1e-8);  // measured 6e-10
    EXPECT_EQ(events[i].limit, i == 0 ? 0.5 : -0.5);
  }
}

// --- Captures ---

const PeakLoad* find(const CaptureResult& r, const std::string& of, const std::string& quantity,
                     const std::string& phase) {
  for (const PeakLoad& load : r.peak_loads) {
    if (load.of == of && load.quantity == quantity && load.phase == phase) return &load;
  }
  return nullptr;
}

// Two arms track under PD control with noise, capture one target each, and hold it; drives and base control saturate.
CaptureProblem driven_case() {
  CaptureProblem p = thesis_case_pd();
  p.contact.gap = ContactSetup::Gap::translate_target;
  p.approach->tracking.noise = TrackingNoise{1e-4, 2, 7};
  BaseControlSetup control;
  control.kp = {20, 20, 20}, control.kd = {60, 60, 60}, control.limit = {0.5, 0.5, 0.5};
  p.approach->base_control = control;
  p.post_impact = PostImpactSetup{};
  p.post_impact->duration = 10;
  p.post_impact->joints = PostImpactSetup::Joints::pd;
  p.post_impact->kp.assign(6, 30);
  p.post_impact->kd.assign(6, 20);
  for (BodyDescription& body : p.robot.bodies) body.joint.limits.effort = 1.5;
  for (EndEffectorSetup& e : p.robot.end_effectors) e.rating.force = 10;
  return p;
}

CaptureProblem loop_case(PostImpactSetup::Joints joints) {
  LoopOptions options;
  options.time = 4;
  CaptureProblem p = random_loops(options, 3);
  p.post_impact->joints = joints;
  return p;
}

void expect_same_loads(const CaptureResult& a, const CaptureResult& b) {
  ASSERT_EQ(a.peak_loads.size(), b.peak_loads.size());
  ASSERT_GT(a.peak_loads.size(), 10U);
  double largest = 0;
  for (std::size_t i = 0; i < a.peak_loads.size(); ++i) {
    const PeakLoad &x = a.peak_loads[i], &y = b.peak_loads[i];
    EXPECT_EQ(x.of + x.quantity + x.phase, y.of + y.quantity + y.phase);
    largest = std::max(largest, std::abs(x.peak - y.peak) / (std::abs(x.peak) + 1e-12));
    EXPECT_EQ(x.time, y.time) << x.of << " " << x.quantity;
  }
  EXPECT_LT(largest, 1e-6);  // measured 0: bit-identical
  ASSERT_EQ(a.limit_events.size(), b.limit_events.size());
  for (std::size_t i = 0; i < a.limit_events.size(); ++i) {
    if (a.limit_events[i].kind != LimitKind::effort_saturated) continue;
    EXPECT_EQ(a.limit_events[i].begin_time, b.limit_events[i].begin_time);
    EXPECT_EQ(a.limit_events[i].end_time, b.limit_events[i].end_time);
  }
}

void expect_no_influence_of_output(CaptureProblem p) {
  const CaptureResult unrecorded = simulate_capture(p, {}, CaptureDetail::columns_and_loads);
  ASSERT_EQ(unrecorded.status, CaptureStatus::completed) << unrecorded.failure;
  for (const double interval : {0.5, 0.05, 0.005}) {
    SCOPED_TRACE(interval);
    p.output_interval = interval;
    const CaptureResult r = simulate_capture(p);
    expect_same_loads(unrecorded, r);
    for (const GraspLoad& g : r.grasp_loads) {
      const PeakLoad* force = find(r, g.end_effector, "force", g.phase);
      ASSERT_TRUE(force);
      EXPECT_EQ(g.largest_force, force->peak);
      EXPECT_EQ(g.determined.size(), 6U);
    }
    EXPECT_EQ(r.grasp_loads.size(), p.grasps.size());
  }
}

TEST(PeakLoads, IndependentOfOutputInterval) {
  SKIP_UNDER_SANITIZERS();
  expect_no_influence_of_output(driven_case());
}
TEST(PeakLoads, ClosedLoopsIndependentOfOutputInterval) {
  SKIP_UNDER_SANITIZERS();
  expect_no_influence_of_output(loop_case(PostImpactSetup::Joints::pd));
  expect_no_influence_of_output(loop_case(PostImpactSetup::Joints::braked));
}

// Densely recorded values approach the peaks from below.
TEST(PeakLoads, LimitOfDenseOutput) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = driven_case();
  p.output_interval = 0.005;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const std::vector<std::string>& joints = series(r, "joints/effort").components;
  double most = 0;
  int compared = 0;
  for (std::size_t phase = 0; phase < r.series.phases.size(); ++phase) {
    const auto largest = [&](const std::string& path, std::size_t component, std::size_t width) {
      double value = 0;
      for (std::size_t s = 0; s < r.series.time.size(); ++s) {
        if (r.series.phase[s] == static_cast<int>(phase))
          value = std::max(value, std::abs(series(r, path).data[s * width + component]));
      }
      return value;
    };
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const std::pair<const char*, const char*> pairs[] = {
          {"joints/effort", "driving"}, {"joints/reaction_force", "force"}, {"joints/reaction_moment", "moment"}};
      for (const auto& [path, quantity] : pairs) {
        const PeakLoad* load = find(r, joints[j], quantity, r.series.phases[phase]);
        if (!load || load->assumed_duration) continue;
        ++compared;
        const double seen = largest(path, j, joints.size());
        EXPECT_LE(seen, load->peak * (1 + 1e-9)) << joints[j] << " " << path;
        most = std::max(most, 1 - seen / load->peak);
      }
    }
  }
  std::printf("[ measured ] samples every 5 ms miss at most %.2g of %d peaks\n", most, compared);
  EXPECT_EQ(compared, 2 * 6 * 3);
  EXPECT_LT(most, 2e-3);  // measured 2.9e-4
}

// One arm on a free base: the reaction force of its first joint accelerates the base.
TEST(PeakLoads, ReactionsMatchBaseAcceleration) {
  CaptureProblem p = thesis_case_pd();
  p.robot.bodies.resize(4);  // base and arm 1
  p.robot.end_effectors.resize(1), p.targets.resize(1), p.grasps.resize(1);
  p.joint_position.resize(3), p.approach->final_position.resize(3);
  use_pd(p, 49, 14);
  p.approach->match.reset();
  p.output_interval = 0.01;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const double mass = p.robot.bodies[0].mass;
  ASSERT_EQ(norm(p.robot.bodies[0].com), 0);
  double error = 0, largest = 0;
  for (std::size_t s = 4; s + 4 < first_sample(r, "contact"); ++s) {
    Vector3d a = Vector3d::zero();
    const double c[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    for (std::size_t k = 1; k <= 4; ++k)
      a = a + (c[k - 1] / 0.01) * (vector_at(r, "base/velocity", s + k) - vector_at(r, "base/velocity", s - k));
    error = std::max(error, std::abs(mass * norm(a) - value_at(r, "joints/reaction_force", s, 0)));
    largest = std::max(largest, mass * norm(a));
  }
  std::printf("[ measured ] %.2g N of %.3g N\n", error, largest);
  EXPECT_LT(error, 1e-8 * largest);  // measured 4e-11
  const PeakLoad* peak = find(r, p.robot.bodies[1].joint.name, "force", "approach");
  ASSERT_TRUE(peak);
  EXPECT_NEAR(peak->peak, largest, 1e-2 * largest);
}

// Loads jump when grasps close: peaks include the first instant of a phase.
TEST(PeakLoads, TheInstantAfterAnImpactCounts) {
  CaptureProblem p = driven_case();
  for (BodyDescription& body : p.robot.bodies) body.joint.limits.effort = JointLimits{}.effort;
  p.post_impact->kp.assign(6, 0.0);
  p.post_impact->kd.assign(6, 5.0);  // the largest rate gives the largest effort
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const std::size_t first = first_sample(r, "post_impact");
  double rate = 0;
  std::size_t fastest = 0;
  for (std::size_t j = 0; j < 6; ++j) {
    const double one = std::abs(value_at(r, "joints/velocity", first, static_cast<int>(j)));
    if (one > rate) rate = one, fastest = j;
  }
  const PeakLoad* peak = find(r, series(r, "joints/velocity").components[fastest], "driving", "post_impact");
  ASSERT_TRUE(peak);
  EXPECT_EQ(peak->time, r.impact()->time);
  EXPECT_NEAR(peak->peak, 5 * rate, 1e-12);
  EXPECT_GT(peak->peak, 0.05);
}

// The rating of a grasp covers the impact but not the later loads: the margin over all phases is negative.
TEST(PeakLoads, MarginOverAllPhases) {
  CaptureProblem p = driven_case();
  p.impact->duration = 1;  // assumed duration of a soft impact
  const CaptureResult first = simulate_capture(p);
  ASSERT_EQ(first.status, CaptureStatus::completed) << first.failure;
  const std::string end_effector = p.grasps[0].end_effector;
  const double in_impact = find(first, end_effector, "force", "contact")->peak;
  const double afterwards = find(first, end_effector, "force", "post_impact")->peak;
  ASSERT_GT(afterwards, 1.2 * in_impact);
  for (EndEffectorSetup& e : p.robot.end_effectors) e.rating.force = 0.5 * (in_impact + afterwards);
  for (BodyDescription& body : p.robot.bodies) body.joint.limits.effort = JointLimits{}.effort;
  p.approach->base_control.reset();
  const CaptureResult r = simulate_capture(p);
  for (const LoadMargin& m : r.impact()->margins) {
    if (m.of == end_effector) {
      EXPECT_GT(m.margin(), 0);
    }
  }
  const PeakLoad* load = find(r, end_effector, "force", "post_impact");
  ASSERT_TRUE(load);
  EXPECT_EQ(load->rating, p.robot.end_effectors[0].rating.force);
  EXPECT_FALSE(load->assumed_duration);
  EXPECT_TRUE(find(r, end_effector, "force", "contact")->assumed_duration);
  EXPECT_FALSE(find(r, end_effector, "impulse", "contact")->assumed_duration);
}

TEST(PeakLoads, SaturationTimes) {
  const CaptureResult r = simulate_capture(driven_case());
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  double drive = 0, base = 0;
  for (const LimitEvent& e : r.limit_events) {
    ASSERT_EQ(e.kind, LimitKind::effort_saturated);
    EXPECT_NEAR(std::abs(e.worst_value), std::abs(e.limit), 1e-8);
    (e.joint == "base control z" ? base : drive) += e.end_time - e.begin_time;
  }
  std::printf("[ measured ] drives saturate for %.4g s in all, base control for %.4g s\n", drive, base);
  EXPECT_GT(drive, 0.01);
  EXPECT_GT(base, 0.01);
  const PeakLoad* torque = find(r, "base control", "driving/z", "approach");
  ASSERT_TRUE(torque);
  EXPECT_EQ(torque->peak, 0.5);
  EXPECT_EQ(torque->rating, std::numeric_limits<double>::infinity());  // the limit is not a rating
  // The summary contains the sums of these durations.
  double drives_in_all = 0, base_in_all = 0;
  for (const SaturationReport& s : r.saturation)
    (s.actuator == SaturationReport::Actuator::base_control ? base_in_all : drives_in_all) += s.duration;
  EXPECT_NEAR(drives_in_all, drive, 1e-12);  // measured 0
  EXPECT_NEAR(base_in_all, base, 1e-12);     // measured 0
  double recorded = 0;
  for (std::size_t s = 0; s < r.series.time.size(); ++s)
    recorded = std::max(recorded, std::abs(vector_at(r, "base/control_torque", s)[2]));
  EXPECT_EQ(recorded, 0.5);
}

// Brakes that stop the arms also load grasps and joints.
TEST(PeakLoads, LoadsOfBrakes) {
  CaptureProblem p = contact_capture_case(2);
  p.post_impact->joints = PostImpactSetup::Joints::braked;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_TRUE(r.impact()->brake);
  const BrakeReport& brake = *r.impact()->brake;
  for (std::size_t j = 0; j < brake.joints.size(); ++j) {
    const PeakLoad* load = find(r, brake.joints[j], "driving_impulse", "brake");
    ASSERT_TRUE(load);
    EXPECT_NEAR(load->peak, std::abs(brake.impulse[j]), 1e-9 * std::abs(brake.impulse[j]));  // measured 2e-13
  }
  for (const BrakeGrasp& g : brake.grasps) {
    const PeakLoad* load = find(r, g.end_effector, "impulse", "brake");
    ASSERT_TRUE(load);
    EXPECT_EQ(load->peak, norm(g.impulse));
  }
}

TEST(PeakLoads, CompliantImpactPeaks) {
  const CaptureResult r = simulate_capture(yielding_case(1e6, 1));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  double latest = 0;
  for (const JointImpulse& j : r.impact()->joints) {
    const PeakLoad* load = find(r, j.joint, "force", "contact");
    ASSERT_TRUE(load);
    EXPECT_EQ(load->peak, j.peak_force);
    EXPECT_FALSE(load->assumed_duration);
    EXPECT_GE(load->time, r.impact()->time);  // some peaks occur at the first contact, from the dampers
    latest = std::max(latest, load->time);
    EXPECT_LE(load->time, r.impact()->time + r.impact()->duration);
  }
  EXPECT_GT(latest, r.impact()->time);
}

}  // namespace peak_loads_test
}  // namespace grapnel::testing
