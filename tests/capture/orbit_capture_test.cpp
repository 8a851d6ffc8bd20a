/// Captures in an orbiting frame in free fall: plans, target motion, the ledger and recorded quantities.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/recorded.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/problem/target_motion.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace orbit_capture_test {

OrbitSetup low_orbit() {
  OrbitSetup orbit;
  orbit.altitude = 400e3;
  return orbit;
}
CaptureProblem planned() {
  CaptureProblem p = thesis_case();
  p.approach->final_position.clear();
  p.approach->match = RateMatch::twist;
  p.approach->plan.emplace();
  p.output_interval = 0.25;
  p.orbit = low_orbit();
  return p;
}

TEST(OrbitCapture, PlansIncludeField) {
  CaptureProblem p = planned();
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  for (std::size_t g = 0; g < 2; ++g) {
    const GraspError m = grasp_error(p, r, g, last_sample(r, "approach"));
    EXPECT_LT(m.distance(), 1e-9);
    EXPECT_LT(norm(m.relative_velocity()) + norm(m.relative_spin()), 1e-9);
  }
  // Final distance of a plan without the field.
  p.orbit.reset();
  const CaptureResult without = simulate_capture(p);
  EXPECT_FALSE(without.orbit);
  CaptureProblem stated = planned();
  stated.approach->plan.reset();
  stated.approach->match.reset();
  stated.approach->final_position = without.plan->final_position;
  stated.approach->final_rates = without.plan->final_rates;
  const CaptureResult missed = simulate_capture(stated);
  const double miss = grasp_error(stated, missed, 0, last_sample(missed, "approach")).distance();
  EXPECT_GT(miss, 1e-5);
  EXPECT_LT(miss, 1e-2);
  std::printf("[ measured ] a plan without the field misses by %.3g m\n", miss);
}

TEST(OrbitCapture, TargetStateGivenAtCapture) {
  CaptureProblem p = planned();
  p.impact.reset();
  p.targets[0].given_at = TargetSetup::Instant::capture;
  p.orbit->altitude.reset();
  p.orbit->semi_major_axis = 9e6, p.orbit->eccentricity = 0.2, p.orbit->true_anomaly = 1;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const std::string group = "targets/" + p.targets[0].name;
  const Posed X = pose_at(r, group, last_sample(r, "approach"));
  EXPECT_LT(norm(X.p - p.targets[0].X_WT.p), 1e-10);
  EXPECT_LT(rotation_angle(transpose(X.R) * p.targets[0].X_WT.R), 1e-10);
  // The start state differs from that without the field by about mu/R^3 r T^2.
  const TargetMotion given{p.targets[0].X_WT, p.targets[0].V_WT};
  const Posed start = propagate_target(p, p.targets[0], given, p.approach->duration, 0).X_WT;
  EXPECT_LT(norm(pose_at(r, group, 0).p - start.p), 1e-10);
  p.orbit.reset();
  EXPECT_GT(norm(propagate_target(p, p.targets[0], given, p.approach->duration, 0).X_WT.p - start.p), 1e-5);
}

// A complete capture 37 m from the reference point, in two frames. The second frame starts at that displacement and
// moves at constant velocity.
TEST(OrbitCapture, DependsOnlyOnReferencePoint) {
  CaptureProblem p = thesis_case();
  p.orbit = low_orbit();
  p.V_WB = Twistd::zero();
  p.contact.largest_gap = CaptureEnvelope::kAny;
  p.output_interval = 1;
  p.post_impact.emplace();
  p.post_impact->duration = 100;
  CaptureProblem far = p;
  const Vector3d by{20, -30, 10};
  far.X_WB.p += by;
  for (TargetSetup& t : far.targets) t.X_WT.p += by;
  CaptureProblem moving = far;
  const MovingFrame frame{by, {0.4, -0.2, 0.1}};
  moving = seen_from(frame, far);
  const CaptureResult here = simulate_capture(p), there = simulate_capture(far), again = simulate_capture(moving);
  for (const CaptureResult* r : {&here, &there, &again}) {
    ASSERT_EQ(r->status, CaptureStatus::completed) << r->failure;
    expect_passes(*r);
  }
  const auto moved = [&](const CaptureResult& r) { return r.post_impact_end->base.position; };
  const double end = there.post_impact_end->time;
  EXPECT_LT(norm(moved(there) - moved(again) - frame.place(end)), 1e-7);
  // The field differs 37 m away.
  EXPECT_GT(norm(moved(there) - moved(here) - by), 0.1);
}

TEST(OrbitCapture, RecordedInOrbitalAxes) {
  CaptureProblem p = thesis_case();
  p.orbit = low_orbit();
  p.output_interval = 0.25;
  p.orbit->radial = {0, 0, 1}, p.orbit->along_track = {0.6, 0.8, 0};
  p.X_WB.p += Vector3d{1, 2, 30};
  for (TargetSetup& t : p.targets) t.X_WT.p += Vector3d{1, 2, 30};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_TRUE(r.orbit);
  EXPECT_EQ(r.orbit->body, "earth");
  EXPECT_DOUBLE_EQ(r.orbit->radius, 6778137);
  EXPECT_NEAR(r.orbit->rate, 1.1314e-3, 5e-8);
  EXPECT_NEAR(r.orbit->period, 5553.6, 0.1);
  for (std::size_t s = 0; s < r.series.time.size(); s += 7) {
    const double angle = r.orbit->rate * r.series.time[s];
    const Vector3d up = std::cos(angle) * p.orbit->radial + std::sin(angle) * p.orbit->along_track;
    const Vector3d along = std::cos(angle) * p.orbit->along_track - std::sin(angle) * p.orbit->radial;
    EXPECT_LT(norm(vector_at(r, "orbit/radial", s) - up), 1e-12);
    EXPECT_LT(norm(vector_at(r, "orbit/along_track", s) - along), 1e-12);
    EXPECT_DOUBLE_EQ(value_at(r, "orbit/radius", s), 6778137);
    const Vector3d place = pose_at(r, "base", s).p, orbital = vector_at(r, "base/orbital_position", s);
    EXPECT_NEAR(orbital[0], dot(place, up), 1e-11);
    EXPECT_NEAR(orbital[1], dot(place, along), 1e-11);
    EXPECT_NEAR(orbital[2], dot(place, cross(up, along)), 1e-11);
    const Vector3d speed = twist_at(r, "targets/" + p.targets[0].name, s).linear;
    const Vector3d at = vector_at(r, "targets/" + p.targets[0].name + "/orbital_position", s);
    const Vector3d in_orbit = vector_at(r, "targets/" + p.targets[0].name + "/orbital_velocity", s);
    EXPECT_NEAR(in_orbit[0], dot(speed, up) + r.orbit->rate * at[1], 1e-11);
    EXPECT_NEAR(in_orbit[1], dot(speed, along) - r.orbit->rate * at[0], 1e-11);
  }
  std::printf("[ measured ] gap %.3g m\n", r.impact()->grasps[0].gap);
  // Without an orbit none of these series exist.
  p.orbit.reset();
  const CaptureResult without = simulate_capture(p);
  for (const Series& s : without.series.series) EXPECT_EQ(s.path.find("orbit"), std::string::npos) << s.path;
}

// A planar robot cannot follow the field's out-of-plane effect; the planner reports it.
TEST(OrbitCapture, InfeasiblePlansInFieldFail) {
  CaptureProblem p = planned();
  p.orbit->radial = {0, 0, 1}, p.orbit->along_track = {0.6, 0.8, 0};
  p.X_WB.p += Vector3d{0, 0, 30};
  for (TargetSetup& t : p.targets) t.X_WT.p += Vector3d{0, 0, 30};
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, ::testing::HasSubstr("without the orbit's field, the loads or the base's attitude control"));
}

TEST(OrbitCapture, NamesErrorsInProgrammedProblems) {
  const auto failure = [](auto change) -> std::string {
    CaptureProblem p = planned();
    change(p);
    try {
      simulate_capture(p);
    } catch (const CaptureProblemError& error) {
      return error.what();
    }
    return "none";
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(failure([](CaptureProblem&) {}), "none");
  EXPECT_THAT(failure([](CaptureProblem& p) { p.orbit->altitude.reset(); }), HasSubstr("orbit: its semi-major axis"));
  EXPECT_THAT(failure([](CaptureProblem& p) { p.robot.base_mode = RobotSetup::Base::fixed; }),
              HasSubstr("orbit: the robot's base is fixed to the ground"));
  EXPECT_THAT(failure([](CaptureProblem& p) {
                p.orbit.reset();
                p.loads.resize(1);
                p.loads[0].body = p.robot.base, p.loads[0].frame = LoadFrame::orbit;
              }),
              HasSubstr("external_wrenches[0].frame: orbit needs 'orbit' in the scenario"));
}

}  // namespace orbit_capture_test
}  // namespace grapnel::testing
