/// Stages of captures by contacts: contact, closing, rest, latching, and the ways in which they fail.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace stages_test {

using ::testing::HasSubstr;
using Stage = StagesReport::Stage;
using Failure = StagesReport::Failure;
using Cage = StagesReport::Cage;

// Two balls on linear drives that close along y around a ball, with pads of this friction.
struct Scene {
  std::string position = "[0, 0, 1]", velocity = "[0, 0, 0]", rotation = "[0, 0, 0]";
  std::string friction = "0.5";
  std::string stages = "settled: {speed: 1 mm/s, rate: 5e-3, for: 0.5}";
  std::string phases =
      "{name: close, duration: 4, joints: pd, kp: 200, kd: 60, move: {joints: [0.2, 0.2], duration: 2}}";
  std::string grasp;  // further keys; empty: no grasp

  std::string finger(const std::string& name, double side) const {
    return fmt::format(
        "    - name: {0}\n"
        "      parent: base\n"
        "      joint: {{name: {0}-drive, type: prismatic, axis: [0, {1}, 0], origin: {{position: [0, {2}, 1]}}}}\n"
        "      mass: 2\n"
        "      inertia: [0.01, 0.01, 0.01]\n"
        "      geometry: {{shape: box, size: [0.2, 0.04, 0.2]}}\n",
        name, -side, 0.3 * side);
  }
  std::string text() const {
    const std::string key = grasp.empty() ? "motion" : "post_impact";
    return "schema: grapnel-scenario/1\nname: gripper\nrobot:\n  name: r\n"
           "  base: {name: base, mass: 100, inertia: [10, 10, 10]}\n  links:\n" +
           finger("left", 1) + finger("right", -1) +
           "  end_effectors: [{name: palm, link: base, position: [0, 0, 0.9]}]\n"
           "initial: {joints: [0, 0]}\ntargets:\n"
           "  - {name: ball, mass: 5, inertia: [0.02, 0.02, 0.02], geometry: {shape: sphere, radius: 0.1}, state: "
           "{at: start, position: " +
           position + ", velocity: " + velocity + ", angular_velocity: " + rotation +
           "}, grasp_points: [{name: middle, position: [0, 0, 0]}]}\n"
           "materials: [{name: pad, stiffness: 1e4, damping: 50, friction: " +
           friction + ", torsional_length: 0.02}]\ncontacts: {between: [[left, right], [ball]], material: pad}\n" +
           (stages.empty() ? "" : "stages: {" + stages + "}\n") +
           (grasp.empty() ? ""
                          : "grasps: [{end_effector: palm, target: ball, point: middle, " + grasp +
                                "}]\nimpact: {law: plastic, joints: free}\n") +
           key + ":\n  - " + phases + "\n";
  }
  CaptureResult run() const {
    const test::TemporaryFolder folder;
    return simulate_capture(load_scenario(folder.write("scenario.yaml", text())));
  }
};

const StagesReport& report(const CaptureResult& r) {
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  return r.stages.at(0);
}

const Series* series(const CaptureResult& r, const std::string& path) {
  const auto found = std::ranges::find(r.series.series, path, &Series::path);
  return found == r.series.series.end() ? nullptr : &*found;
}

std::string fault_of(const Scene& scene) {
  const test::TemporaryFolder folder;
  try {
    load_scenario(folder.write("scenario.yaml", scene.text()));
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(Stages, ATargetSettlesBetweenTwoFingers) {
  Scene scene;
  scene.position = "[0, 0.03, 1]", scene.rotation = "[0, 0, 0.1]";
  const CaptureResult r = scene.run();
  const StagesReport& s = report(r);
  EXPECT_EQ(s.reached, Stage::settled);
  EXPECT_EQ(s.failure, Failure::none);
  ASSERT_TRUE(s.contact_time && s.closing_time && s.closed_time && s.settled_time);
  EXPECT_EQ(*s.closing_time, 0);
  EXPECT_EQ(*s.closed_time, 2);
  EXPECT_GT(*s.settled_time, *s.contact_time + 0.5);
  // PD control presses each pad with kp times the remaining distance, to first order.
  const double lacks = 0.2 - (0.3 - 0.02 - 0.1);
  EXPECT_NEAR(s.grip_force, 2 * 200 * lacks, 0.02 * 2 * 200 * lacks);
  ASSERT_TRUE(s.least_friction_margin);
  EXPECT_GT(*s.least_friction_margin, 0.5);
  EXPECT_FALSE(s.latched_time);
}

// The time series shows when motion falls below the bounds for good.
TEST(Stages, SettlingFollowsTheTimeSeries) {
  Scene scene;
  scene.velocity = "[0, 0.02, 0]";
  const CaptureResult r = scene.run();
  const StagesReport& s = report(r);
  ASSERT_TRUE(s.settled_time);
  const Series *speed = series(r, "stages/ball/speed"), *rate = series(r, "stages/ball/rate");
  ASSERT_TRUE(speed && rate);
  double last = 0;
  for (std::size_t i = 0; i < r.series.time.size(); ++i) {
    if (speed->data[i] > 1e-3 || rate->data[i] > 5e-3) last = r.series.time[i];
  }
  EXPECT_GT(*s.settled_time, last + 0.5);
  EXPECT_LT(*s.settled_time, last + 0.5 + 0.06);  // one output interval later at most
}

TEST(Stages, AGraspClosesWhenItsTargetIsSettled) {
  Scene scene;
  scene.position = "[0, 0.03, 1]", scene.grasp = "closes_when_settled: true";
  const CaptureResult r = scene.run();
  const StagesReport& s = report(r);
  EXPECT_EQ(s.reached, Stage::latched);
  ASSERT_TRUE(s.settled_time && s.latched_time);
  EXPECT_NEAR(*s.latched_time, *s.settled_time, 1e-6);
  ASSERT_EQ(r.grasps.size(), 1u);
  EXPECT_TRUE(r.grasps[0].captured);
  EXPECT_EQ(r.capture_verdict(), Captured::yes);
  EXPECT_NEAR(r.grasps[0].time, *s.latched_time, 1e-9);
  // The remaining relative velocity is an impact, within the bound of settling.
  ASSERT_NE(r.impact(), nullptr);
  EXPECT_LT(norm(r.impact()->grasps.at(0).relative_velocity_before), 1e-3);
}

TEST(Stages, ALatchEndsAPhase) {
  Scene scene;
  scene.grasp = "closes_when_settled: true";
  scene.phases =
      "{name: close, duration: 8, joints: pd, kp: 200, kd: 60, move: {joints: [0.2, 0.2], duration: 2}, until: {event: "
      "latched}}\n  - {name: held, duration: 0.5, joints: braked}";
  const CaptureResult r = scene.run();
  ASSERT_EQ(r.phases.size(), 2u);
  EXPECT_EQ(r.phases[0].end, report(r).latched_time.value());
  EXPECT_EQ(r.phases[0].ended, MotionPhaseReport::End::condition);
  EXPECT_NEAR(r.phases[1].end, r.phases[0].end + 0.5, 1e-12);
  scene.grasp = "";
  EXPECT_THAT(fault_of(scene), HasSubstr("requires a grasp with closes_when_settled"));
}

TEST(Stages, FailuresAreNamed) {
  Scene far;
  far.position = "[0, 0, 3]";
  EXPECT_EQ(report(far.run()).failure, Failure::closed_on_nothing);
  EXPECT_EQ(report(far.run()).reached, Stage::approach);
  Scene pushed;  // without friction it moves on, out of the fingers
  pushed.friction = "0", pushed.position = "[0.03, 0, 1]", pushed.velocity = "[0.05, 0, 0]";
  pushed.phases = "{name: close, duration: 8, joints: pd, kp: 200, kd: 60, move: {joints: [0.2, 0.2], duration: 2}}";
  const CaptureResult out = pushed.run();
  EXPECT_EQ(report(out).failure, Failure::pushed_away);
  EXPECT_EQ(report(out).reached, Stage::contact);
  EXPECT_GT(report(out).failure_time.value_or(0), *report(out).contact_time);
  Scene waits = far;
  waits.grasp = "closes_when_settled: true";
  const CaptureResult missed = waits.run();
  EXPECT_FALSE(missed.grasps.at(0).captured);
  EXPECT_THAT(missed.grasps.at(0).reason, HasSubstr("did not settle"));
}

TEST(Stages, AReleasedTargetIsLost) {
  Scene scene;
  scene.phases =
      "{name: close, duration: 4, joints: pd, kp: 200, kd: 60, move: {joints: [0.2, 0.2], duration: 2}}\n"
      "  - {name: open, duration: 3, joints: pd, kp: 200, kd: 60, move: {joints: [0, 0], duration: 1}}";
  const CaptureResult r = scene.run();
  EXPECT_EQ(report(r).reached, Stage::settled);
  EXPECT_TRUE(report(r).failure == Failure::lost || report(r).failure == Failure::slipped);
  EXPECT_GT(report(r).failure_time.value_or(0), 4);
}

TEST(Stages, TwoFingersAreNoCage) {
  Scene scene;
  scene.stages = "settled: {speed: 1 mm/s, rate: 5e-3, for: 0.5}, cage: {resolution: 0.01}";
  scene.grasp = "closes_when_settled: true";
  const CaptureResult r = scene.run();
  const StagesReport& s = report(r);
  EXPECT_EQ(s.cage, Cage::can_leave);
  EXPECT_EQ(s.failure, Failure::jammed);
  EXPECT_FALSE(s.latched_time);
  EXPECT_NEAR(s.cage_allowance, 0.02, 5e-3);
}

TEST(Stages, FaultsHavePlaces) {
  Scene scene;
  scene.stages = "settled: {speed: 1 mm/s, rate: 5e-3, for: 0.5}, gripper: [lift]";
  EXPECT_THAT(fault_of(scene), HasSubstr("unknown link 'lift' in stages.gripper[0]"));
  EXPECT_THAT(fault_of(scene), HasSubstr("left"));
  scene.stages = "settled: {speed: 1 mm/s, rate: 5e-3, for: 0.5}, closing: shut";
  EXPECT_THAT(fault_of(scene), HasSubstr("there is no phase of motion 'shut'"));
  scene.stages = "settled: {speed: 1 mm/s, rate: 5e-3, for: 0.5}, gripper: [base]";
  EXPECT_THAT(fault_of(scene), HasSubstr("no link of the gripper may touch target 'ball'"));
  scene.stages = "settled: {speed: 0, rate: 5e-3}";
  EXPECT_THAT(fault_of(scene), HasSubstr("missing key 'for' in stages.settled"));
  scene.stages = "", scene.grasp = "closes_when_settled: true";
  EXPECT_THAT(fault_of(scene), HasSubstr("needs 'stages' of target 'ball'"));
}

}  // namespace stages_test
}  // namespace grapnel::testing
