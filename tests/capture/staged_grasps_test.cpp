/// Grasps that close one after the other, at stated times or on arrival, and released grasps: the quantities that each
/// event conserves.

#include <gtest/gtest.h>

#include "capture/loop_case.hpp"

namespace grapnel::testing {
namespace staged_grasps_test {

// Without external loads the total momenta are constant.
void expect_constant_momenta(const CaptureResult& r) {
  const Vector3d p = vector_at(r, "system/linear_momentum", 0), l = vector_at(r, "system/angular_momentum", 0);
  EXPECT_GT(norm(p), 0.1);
  EXPECT_GT(norm(l), 0.1);
  for (std::size_t s = 0; s < r.series.time.size(); ++s) {
    EXPECT_LT(norm(vector_at(r, "system/linear_momentum", s) - p), 1e-11 * r.ledger.scale.linear_momentum);
    EXPECT_LT(norm(vector_at(r, "system/angular_momentum", s) - l), 1e-11 * r.ledger.scale.angular_momentum);
  }
}

// The energy change in an impact is half the sum over the grasps of the impulse times the relative velocity before the
// impact. Grasps that were closed before have no relative velocity.
void expect_energy_identity(const CaptureResult& r, const ImpactReport& i) {
  double work = 0;
  for (const GraspImpulse& g : i.grasps)
    work +=
        0.5 * (dot(g.impulse, g.relative_velocity_before) + dot(g.angular_impulse, g.relative_angular_velocity_before));
  EXPECT_NEAR(i.kinetic_energy_after - i.kinetic_energy_before, work, 1e-12 * r.ledger.scale.energy);
  EXPECT_LT(i.kinetic_energy_after, i.kinetic_energy_before);
}

CaptureProblem staged(const std::vector<int>& targets, const std::vector<double>& times, int index, double duration) {
  CaptureProblem p = random_loops({targets, {}, 6, 0.2, duration}, index);
  for (std::size_t g = 0; g < times.size(); ++g) {
    if (times[g] == 0) continue;
    p.grasps[g].closes = GraspSetup::Closes::at_time;
    p.grasps[g].closes_at = times[g];
  }
  return p;
}

TEST(SecondGraspLater, ImpactOfJoinedSystem) {
  for (int index = 40; index < 44; ++index) {
    SCOPED_TRACE(seed_note(index));
    const CaptureProblem p = staged({0, 0, 0}, {0, 1.5, 3}, index, 5);
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    expect_finite(r);
    expect_constant_momenta(r);
    ASSERT_EQ(r.impacts.size(), 3u);
    EXPECT_EQ(r.impact()->rows, 6);
    EXPECT_EQ(r.impacts[1].rows, 12);
    EXPECT_EQ(r.impacts[2].rows, 18);
    EXPECT_NEAR(r.impacts[1].time, 1.5, 1e-12);
    EXPECT_NEAR(r.impacts[2].time, 3, 1e-12);
    for (const ImpactReport& i : r.later_impacts()) {
      expect_energy_identity(r, i);
      // Existing grasps have no relative motion before the impact and transmit part of the impulse.
      EXPECT_LT(norm(i.grasps[0].relative_velocity_before), 1e-11);
      EXPECT_LT(norm(i.grasps[0].relative_angular_velocity_before), 1e-11);
      EXPECT_GT(norm(i.grasps.back().relative_velocity_before), 1e-3);
      EXPECT_GT(norm(i.grasps[0].impulse), 1e-3);
    }
    // Each grasp maintains its relative pose at closing through all later events.
    const char* phases[] = {"post_impact", "post_impact_2", "post_impact_3"};
    for (std::size_t g = 0; g < 3; ++g) {
      const Opening o = opening(p, r, g, first_sample(r, phases[g]), r.series.time.size() - 1);
      EXPECT_LT(o.position, 2e-12);
      EXPECT_LT(o.angle, 2e-12);
      EXPECT_NEAR(r.grasps[g].time, 1.5 * static_cast<double>(g), 1e-12);
      EXPECT_TRUE(r.grasps[g].captured);
    }
    // Positions are continuous in an impact; velocities are not.
    EXPECT_LT(jump(r, "post_impact", "contact_2", true), 1e-11);
    EXPECT_LT(jump(r, "contact_2", "post_impact_2", true), 1e-11);
    EXPECT_LT(jump(r, "post_impact", "post_impact_2", false), 1e-11);
    EXPECT_GT(jump(r, "post_impact", "post_impact_2", true), 1e-3);
    // Each grasp after the first closes a loop.
    ASSERT_EQ(r.loops.size(), 2u);
    EXPECT_EQ(r.loops[0].phase, "post_impact_2");
    EXPECT_EQ(r.loops[1].closures.size(), 2u);
  }
}

// Two grasps on one target, 1 s apart; a third grasp captures another target 0.5 s later.
TEST(SecondGraspLater, OnAnotherTarget) {
  const CaptureProblem p = staged({0, 0, 1}, {0, 1, 1.5}, 45, 3);
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  expect_constant_momenta(r);
  ASSERT_EQ(r.impacts.size(), 3u);
  EXPECT_EQ(r.impacts[2].rows, 18);
  expect_energy_identity(r, r.impacts[2]);
  EXPECT_LT(opening(p, r, 2, first_sample(r, "post_impact_3"), r.series.time.size() - 1).position, 2e-12);
  // The target is free until then: its linear momentum is constant.
  const Vector3d h = vector_at(r, "targets/target1/linear_momentum", 0);
  EXPECT_LT(norm(vector_at(r, "targets/target1/linear_momentum", last_sample(r, "post_impact_2")) - h),
            1e-11 * norm(h));
  EXPECT_GT(norm(vector_at(r, "targets/target1/linear_momentum", last_sample(r, "post_impact_3")) - h), 1e-3 * norm(h));
}

TEST(SecondGraspLater, MissedCaptureLeavesOpenChain) {
  CaptureProblem p = staged({0, 0}, {0, 1}, 46, 3);
  p.robot.end_effectors[1].envelope.emplace();
  p.robot.end_effectors[1].envelope->position = 1e-4;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  expect_constant_momenta(r);
  EXPECT_TRUE(r.later_impacts().empty());
  EXPECT_TRUE(r.loops.empty());
  ASSERT_EQ(r.grasps.size(), 2u);
  EXPECT_FALSE(r.grasps[1].captured);
  EXPECT_NE(r.grasps[1].reason.find("outside the envelope: distance"), std::string::npos) << r.grasps[1].reason;
  EXPECT_NEAR(r.grasps[1].time, 1, 1e-12);
  // The result equals that without this grasp.
  p.grasps.pop_back();
  const CaptureResult alone = simulate_capture(p);
  const Vector3d a = vector_at(r, "targets/target0/position", r.series.time.size() - 1),
                 b = vector_at(alone, "targets/target0/position", alone.series.time.size() - 1);
  EXPECT_LT(norm(a - b), 1e-11);
}

// --- During the approach

CaptureProblem approaching(const std::vector<double>& times, int index) {
  CaptureProblem p = staged({0, 0, 0}, times, index, 2);
  p.approach.emplace();
  p.approach->duration = 3;
  p.approach->profile = JointProfile::quintic;
  Random random(6000 + index);
  p.approach->final_rates.emplace();
  for (double q : p.joint_position) {
    p.approach->final_position.push_back(q + random.uniform(-0.3, 0.3));
    p.approach->final_rates->push_back(random.uniform(-0.1, 0.1));
  }
  for (TargetSetup& t : p.targets) t.given_at = TargetSetup::Instant::start;
  return p;
}

TEST(GraspsInTheApproach, OtherArmsFollowTrajectories) {
  for (int index = 50; index < 53; ++index) {
    SCOPED_TRACE(seed_note(index));
    const CaptureProblem p = approaching({1, 2, 0}, index);  // the third closes at the approach's end, at 3 s
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    expect_finite(r);
    ASSERT_TRUE(r.impact());
    ASSERT_EQ(r.impacts.size(), 3u);
    EXPECT_NEAR(r.impact()->time, 1, 1e-12);
    EXPECT_NEAR(r.impacts[1].time, 2, 1e-12);
    EXPECT_NEAR(r.impacts[2].time, 3, 1e-12);
    // Ideal drives hold the rates of arms that have not grasped yet, with any effort; the others are overpowered.
    for (std::size_t j = 0; j < 18; ++j) {
      const double first = r.impact()->joint_velocity_change[j], second = r.impacts[1].joint_velocity_change[j];
      if (j >= 6) {
        EXPECT_LT(std::abs(first), 1e-13) << j;
      }
      if (j >= 12) {
        EXPECT_LT(std::abs(second), 1e-13) << j;
      }
      if (j < 6) {
        EXPECT_GT(std::abs(first), 1e-7) << j;
      }
    }
    // Until their own grasp these joints follow their trajectories.
    for (std::size_t s = 0; s <= last_sample(r, "approach_3"); ++s) {
      const std::vector<double> q = joints_at(r, "joints/position", s),
                                to = joints_at(r, "joints/reference_position", s);
      for (std::size_t j = 12; j < 18; ++j) {
        if (std::isnan(to[j])) continue;  // samples of contacts
        EXPECT_NEAR(q[j], to[j], 1e-14);
      }
    }
    expect_constant_momenta(r);
    for (std::size_t g = 0; g < 3; ++g) {
      const char* phases[] = {"approach_2", "approach_3", "post_impact"};
      const Opening o = opening(p, r, g, first_sample(r, phases[g]), r.series.time.size() - 1);
      EXPECT_LT(o.position, 2e-12) << g;
      EXPECT_LT(o.angle, 2e-12) << g;
    }
  }
}

TEST(GraspsInTheApproach, AllCloseBeforeOrAfterEnd) {
  const CaptureResult early = simulate_capture(approaching({0.5, 1, 1.5}, 54));
  expect_passes(early);
  EXPECT_EQ(early.series.time.back(), 5);
  EXPECT_EQ(early.impact()->grasps.size(), 1u);
  EXPECT_EQ(early.impacts.size(), 3u);
  const CaptureResult late = simulate_capture(approaching({3.5, 4, 4.5}, 54));
  expect_passes(late);
  ASSERT_TRUE(late.impact());
  EXPECT_NEAR(late.impact()->time, 3.5, 1e-12);
  EXPECT_EQ(late.impacts.size(), 3u);
  // At the end of the approach, and at the end of the run.
  const CaptureResult edge = simulate_capture(approaching({3, 5, 0}, 54));
  expect_passes(edge);
  ASSERT_EQ(edge.grasps.size(), 3u);
  for (const GraspOutcome& g : edge.grasps) EXPECT_TRUE(g.captured) << g.end_effector << " " << g.reason;
  EXPECT_EQ(edge.impact()->grasps.size(), 2u);
  ASSERT_EQ(edge.impacts.size(), 2u);
  EXPECT_NEAR(edge.impacts[1].time, 5, 1e-12);
}

TEST(GraspsInTheApproach, WithOverpoweredDrives) {
  for (const JointControl mode : {JointControl::pd, JointControl::computed_torque}) {
    for (const PostImpactSetup::Joints after :
         {PostImpactSetup::Joints::free, PostImpactSetup::Joints::pd, PostImpactSetup::Joints::braked}) {
      CaptureProblem p = approaching({1, 2, 0}, 55);
      use_pd(p, 30, 12);
      p.approach->tracking.mode = mode;
      p.post_impact->joints = after;
      const CaptureResult r = simulate_capture(p);
      expect_passes(r);
      expect_finite(r);
      expect_constant_momenta(r);
    }
  }
}

// --- On arrival

// Two stub arms, 0.6 m apart, whose motors hold the joints. A bar with one end at the first end-effector rotates about
// it towards the second.
CaptureProblem swinging_bar(double approach) {
  CaptureProblem p;
  p.name = "swinging bar";
  p.robot.base = "base";
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 400;
  base.inertia = Symmetric3d::diagonal(80, 90, 100);
  p.robot.bodies = {base};
  for (int i = 0; i < 2; ++i) {
    const std::string n = std::to_string(i);
    BodyDescription b;
    b.name = "stub" + n, b.joint.name = "joint" + n, b.parent = "base";
    b.joint.type = JointType::revolute;
    b.X_PF.p = {0.6 * i, 0.5, 0};
    b.mass = 5, b.com = {0, 0.2, 0};
    b.inertia = Symmetric3d::diagonal(0.1, 0.05, 0.1);
    p.robot.bodies.push_back(b);
    p.robot.end_effectors.push_back({{"hand" + n, b.name, {Rotationd::identity(), {0, 0.4, 0}}}});
    p.joint_position.push_back(0);
    p.grasps.push_back({"hand" + n, "bar", n, GraspModel::point});
  }
  TargetSetup bar;
  bar.name = "bar";
  bar.mass = 20, bar.com = {0.3, 0, 0};
  bar.inertia = Symmetric3d::diagonal(0.2, 2, 2);
  bar.X_WT = {rotation_about({0, 0, 1}, 0.6), {0, 0.9, 0}};
  bar.V_WT = {{0, 0, -0.25}, {0, 0, 0}};
  bar.given_at = TargetSetup::Instant::start;
  bar.grasp_points = {{"0"}, {"1", {Rotationd::identity(), {0.6, 0, 0}}}};
  p.targets = {bar};
  p.grasps[1].closes = GraspSetup::Closes::on_arrival;
  p.robot.end_effectors[1].envelope.emplace();
  p.robot.end_effectors[1].envelope->position = 0.01;
  if (approach > 0) {
    p.approach.emplace();
    p.approach->duration = approach;
    p.approach->final_position = p.joint_position;
    p.grasps[0].closes = GraspSetup::Closes::at_time;
    p.grasps[0].closes_at = 0.5;
    // The bar is free before that; its drift brings its end near the first end-effector.
    p.targets[0].V_WT.linear = {0.05, 0, 0};
    p.targets[0].X_WT.p = p.targets[0].X_WT.p - Vector3d{0.02, 0, 0};
  }
  p.impact.emplace();
  p.post_impact.emplace();
  p.post_impact->duration = 8;
  p.post_impact->joints = PostImpactSetup::Joints::pd;
  p.post_impact->kp = {800, 800}, p.post_impact->kd = {200, 200};
  p.output_interval = 0.05;
  return p;
}

TEST(OnArrival, ClosesAtEdgeOfEnvelope) {
  const CaptureProblem p = swinging_bar(0);
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  expect_finite(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  ASSERT_EQ(r.grasps.size(), 2u);
  EXPECT_TRUE(r.grasps[1].captured);
  EXPECT_NEAR(r.grasps[1].distance, 0.01, 1e-9);
  EXPECT_GT(r.grasps[1].time, 1);
  EXPECT_LT(r.grasps[1].time, 4);
  EXPECT_NEAR(r.impacts[1].grasps[1].gap, 0.01, 1e-9);
  expect_energy_identity(r, r.impacts[1]);
  expect_constant_momenta(r);
  // The distance is larger at every earlier sample.
  for (std::size_t s = 0; s < last_sample(r, "post_impact"); ++s)
    EXPECT_GT(value_at(r, "grasps/hand1/distance", s), 0.01);
  const Opening o = opening(p, r, 1, first_sample(r, "post_impact_2"), r.series.time.size() - 1);
  EXPECT_LT(o.position, 2e-12);
}

TEST(OnArrival, NoClosingWithoutArrival) {
  CaptureProblem p = swinging_bar(0);
  p.targets[0].V_WT.angular = {0, 0, 0.05};  // away
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_TRUE(r.later_impacts().empty());
  EXPECT_FALSE(r.grasps[1].captured);
  EXPECT_EQ(r.grasps[1].reason, "did not come within its envelope before the run's end");
}

TEST(OnArrival, DuringApproachWithDrives) {
  for (const double duration : {1.0, 6.0}) {
    const CaptureProblem p = swinging_bar(duration);
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    expect_finite(r);
    ASSERT_EQ(r.grasps.size(), 2u);
    EXPECT_TRUE(r.grasps[0].captured);
    EXPECT_NEAR(r.grasps[0].time, 0.5, 1e-12);
    ASSERT_TRUE(r.grasps[1].captured) << r.grasps[1].reason;
    EXPECT_EQ(r.grasps[1].time<duration, duration> 3) << r.grasps[1].time;
    EXPECT_NEAR(r.grasps[1].distance, 0.01, 1e-9);
    expect_constant_momenta(r);
    EXPECT_EQ(r.series.time.back(), duration + 8);
  }
}

TEST(OnArrival, ClosesImmediatelyInsideEnvelope) {
  CaptureProblem p = swinging_bar(0);
  p.robot.end_effectors[1].envelope->position = 5;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_EQ(r.grasps[1].time, 0);
  EXPECT_TRUE(r.grasps[1].captured);
}

// --- Release

TEST(Release, PreservesMotion) {
  for (int index = 60; index < 64; ++index) {
    SCOPED_TRACE(seed_note(index));
    CaptureProblem p =
        random_loops({{0, 0, 0}, {GraspModel::rigid, GraspModel::hinge, GraspModel::rigid}, 6, 0.2, 6}, index);
    // First the end-effector that carries the target in the tree, which another replaces; then all others.
    p.post_impact->releases = {{1, {"hand0"}}, {3, {}}};
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    expect_finite(r);
    expect_constant_momenta(r);
    ASSERT_EQ(r.releases.size(), 2u);
    EXPECT_EQ(r.releases[0].end_effectors, std::vector<std::string>{"hand0"});
    EXPECT_EQ(r.releases[1].end_effectors, (std::vector<std::string>{"hand1", "hand2"}));
    EXPECT_NEAR(r.releases[1].time, 3, 1e-12);
    EXPECT_LT(jump(r, "post_impact", "post_impact_2", true), 1e-11);  // measured 3e-14
    EXPECT_LT(jump(r, "post_impact_2", "post_impact_3", true), 1e-11);
    for (std::size_t g = 0; g < 3; ++g) EXPECT_NEAR(r.grasps[g].released.value_or(-1), g == 0 ? 1 : 3, 1e-12);
    const std::size_t taken = first_sample(r, "post_impact_2"), free = first_sample(r, "post_impact_3");
    for (std::size_t g = 1; g < 3; ++g) {
      EXPECT_LT(opening(p, r, g, first_sample(r, "post_impact"), free).position, 2e-12);
      EXPECT_LT(opening(p, r, g, first_sample(r, "post_impact"), free).angle, 2e-12);
    }
    EXPECT_GT(opening(p, r, 0, taken, free).position, 1e-3);
    // The second phase has one loop, the last none; then the target is free.
    ASSERT_EQ(r.loops.size(), 2u);
    EXPECT_EQ(r.loops[1].closures.size(), 1u);
    const Vector3d h = vector_at(r, "targets/target0/linear_momentum", free);
    EXPECT_LT(norm(vector_at(r, "targets/target0/linear_momentum", r.series.time.size() - 1) - h),
              1e-12 * (1 + norm(h)));
    const auto holds = [&](const char* end_effector, std::size_t s) {
      return value_at(r, std::string("grasps/") + end_effector + "/holds", s);
    };
    EXPECT_EQ(holds("hand0", taken - 1), 1);
    EXPECT_EQ(holds("hand0", taken), 0);
    EXPECT_EQ(holds("hand1", taken), 1);
    EXPECT_EQ(holds("hand1", free), 0);
    EXPECT_GT(norm(vector_at(r, "grasps/hand1/force", taken)), 0);
    EXPECT_EQ(norm(vector_at(r, "grasps/hand1/force", free)), 0);
  }
}

TEST(Release, BeforeItsGraspClosesIsRejected) {
  CaptureProblem p = staged({0, 0}, {0, 2}, 65, 4);
  p.post_impact->releases = {{1, {"hand1"}}};
  try {
    simulate_capture(p);
    FAIL() << "no error";
  } catch (const CaptureProblemError& error) {
    EXPECT_STREQ(error.what(),
                 "end-effector 'hand1' in post_impact.release[0].end_effectors closes at 2 [s], must close before it "
                 "releases at 1");
  }
}

TEST(Release, GraspClosesAfterRelease) {
  CaptureProblem p = staged({0, 0}, {0, 2}, 66, 4);
  p.post_impact->releases = {{1, {"hand0"}}};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  expect_finite(r);
  expect_constant_momenta(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  EXPECT_EQ(r.impacts[1].rows, 6);
  ASSERT_EQ(r.impacts[1].grasps.size(), 1u);
  EXPECT_EQ(r.impacts[1].grasps[0].end_effector, "hand1");
  expect_energy_identity(r, r.impacts[1]);
  EXPECT_TRUE(r.loops.empty());
  EXPECT_LT(opening(p, r, 1, first_sample(r, "post_impact_3"), r.series.time.size() - 1).position, 2e-12);
}

// If one grasp closes and another is released at one instant, the closing comes first.
TEST(Release, AtClosingInstantOfAnotherGrasp) {
  CaptureProblem p = staged({0, 0}, {0, 2}, 67, 4);
  p.post_impact->releases = {{2, {"hand0"}}};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  expect_constant_momenta(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  ASSERT_EQ(r.releases.size(), 1u);
  EXPECT_TRUE(r.grasps[1].captured);
  EXPECT_LT(opening(p, r, 1, last_sample(r, "contact_2"), r.series.time.size() - 1).position, 2e-12);
}

TEST(Release, AllBasesAndJoints) {
  for (const RobotSetup::Base base : {RobotSetup::Base::free, RobotSetup::Base::held, RobotSetup::Base::fixed}) {
    for (const PostImpactSetup::Joints joints :
         {PostImpactSetup::Joints::free, PostImpactSetup::Joints::pd, PostImpactSetup::Joints::braked}) {
      CaptureProblem p = staged({0, 0}, {0, 1}, 68, 4);
      p.robot.base_mode = base;
      if (base != RobotSetup::Base::free) p.V_WB.reset();
      p.post_impact->joints = joints;
      p.post_impact->releases = {{2, {"hand0"}}, {3, {}}};
      const CaptureResult r = simulate_capture(p);
      expect_passes(r);
      expect_finite(r);
      EXPECT_EQ(r.releases.size(), 2u);
      EXPECT_LT(jump(r, "post_impact_2", "post_impact_3", true), 1e-11);
      if (base == RobotSetup::Base::fixed) {
        EXPECT_LT(norm(vector_at(r, "base/position", r.series.time.size() - 1) - p.X_WB.p), 1e-15);
      } else {
        expect_constant_momenta(r);
      }
    }
  }
}

}  // namespace staged_grasps_test
}  // namespace grapnel::testing
