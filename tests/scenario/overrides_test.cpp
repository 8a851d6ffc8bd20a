#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace overrides_test {

using testing::ElementsAre;

class Overrides : public testing::Test {
 protected:
  Overrides() {
    const std::string whole = kSmallScenario;
    folder_.write("robot.yaml", small_robot());
    path_ = folder_.write("scenario.yaml", "name: test\nrobot: robot.yaml\n" + whole.substr(whole.find("initial:")));
  }
  CaptureProblem load(const std::vector<Override>& overrides) const { return load_scenario(path_, overrides); }
  std::vector<std::string> faults(const std::string& argument) const {
    return faults_of_file(path_, {parse_override(argument)});
  }

  TemporaryFolder folder_;
  std::filesystem::path path_;
};

TEST_F(Overrides, ReachEverything) {
  const CaptureProblem p = load({{"approach.duration", "10"},
                                 {"targets[0].mass", "12"},
                                 {"targets.ball.inertia", "{xx: 2, yy: 2, zz: 2}"},
                                 {"targets.ball.grasp_points.grip.position[1]", "0.25"},
                                 {"grasps.tip.model", "point"},
                                 {"robot.base.mass", "600"},
                                 {"robot.links.upper.joint.limits.effort", ".inf"},
                                 {"robot.links[1].mass", "6"},
                                 {"initial.joints.elbow", "0.75"},
                                 {"name", "other"}});
  EXPECT_EQ(p.approach->duration, 10);
  EXPECT_EQ(p.targets[0].mass, 12);
  EXPECT_EQ(p.targets[0].inertia.xx, 2);
  EXPECT_EQ(p.targets[0].grasp_points[0].X_TG.p[1], 0.25);
  EXPECT_EQ(p.grasps[0].model, GraspModel::point);
  EXPECT_EQ(p.robot.bodies[0].mass, 600);
  EXPECT_EQ(p.robot.bodies[2].mass, 6);
  EXPECT_THAT(p.joint_position, ElementsAre(0.5, 0.75));
  EXPECT_EQ(p.name, "other");
}

TEST_F(Overrides, CreateAbsentKeys) {
  const CaptureProblem p = load({{"integration.relative_tolerance", "1e-9"},
                                 {"approach.tracking", "{mode: pd, kp: 49, kd: 14}"},
                                 {"approach.tracking.kp", "50"},
                                 {"gravity", "[0, 0, -1]"}});
  EXPECT_EQ(p.integration.relative_tolerance, 1e-9);
  EXPECT_THAT(p.approach->tracking.kp, ElementsAre(50, 50));
  EXPECT_EQ(p.gravity[2], -1);
}

TEST_F(Overrides, ReachPartsOfAnApproach) {
  folder_.write("motion.csv", "time,shoulder,elbow\n0,0.5,1\n8,0.25,0.5\n");
  const CaptureProblem p = load({{"robot.end_effectors.tip.approach_axis", "[1, 0, 0]"},
                                 {"robot.end_effectors.tip.envelope.position", "0.05"},
                                 {"targets.ball.grasp_points.grip.approach_direction", "[0, -1, 0]"},
                                 {"grasps.tip.orientation", "axis"},
                                 {"approach", "{duration: 20, profile: quintic, plan: {}}"},
                                 {"approach.plan.starts", "3"},
                                 {"approach.straight_in", "{stand_off: 0.2, duration: 2}"},
                                 {"approach.waypoints", "[{time: 5, joints: [0, 0]}]"},
                                 {"approach.waypoints[0].rates.elbow", "0.5"},
                                 {"approach.tracking", "{mode: pd, kp: 1, kd: 1, noise: {position: 0.01}}"},
                                 {"approach.tracking.noise.seed", "7"},
                                 {"approach.base_control", "{kp: 1, kd: 1, limit: [1, 2, 3]}"},
                                 {"approach.base_control.limit[1]", "4"},
                                 {"approach.capture_at", "envelope"},
                                 {"post_impact.base_control", "{kp: 5, kd: 6}"},
                                 {"external_wrenches", "[{body: base}]"},
                                 {"external_wrenches[0].time", "{shape: half_sine, end: 2}"},
                                 {"external_wrenches[0].force", "[1, 2, 3]"},
                                 {"clearance.enabled", "false"},
                                 {"clearance.ignore", "[[base, ball]]"},
                                 {"clearance.ignore[0][1]", "lower"}});
  EXPECT_TRUE(p.robot.end_effectors[0].approach_axis);
  EXPECT_EQ(p.robot.end_effectors[0].envelope->position, 0.05);
  EXPECT_EQ(p.grasps[0].orientation, GraspSetup::Orientation::axis);
  EXPECT_EQ(p.approach->plan->starts, 3);
  EXPECT_EQ(p.approach->straight_in->stand_off, 0.2);
  EXPECT_THAT(*p.approach->waypoints.at(0).rates, ElementsAre(0, 0.5));
  EXPECT_EQ(p.approach->tracking.noise->seed, 7u);
  EXPECT_EQ(p.approach->base_control->limit[1], 4);
  EXPECT_EQ(p.approach->capture_at, ApproachSetup::CaptureAt::envelope);
  EXPECT_EQ(p.post_impact->base_control->kd[2], 6);
  EXPECT_EQ(p.loads.at(0).profile.end, 2);
  EXPECT_EQ(p.loads.at(0).amplitude.linear[2], 3);
  EXPECT_FALSE(p.clearance.enabled);
  EXPECT_EQ(p.clearance.ignore.at(0).second, "lower");

  // A path in an override is relative to the scenario's folder too.
  const CaptureProblem sampled = load({{"approach", "{trajectory: motion.csv}"}});
  EXPECT_EQ(sampled.approach->duration, 8);
  EXPECT_THAT(faults("approach={trajectory: motion.cvs}"),
              ElementsAre(testing::EndsWith("no such file; did you mean 'motion.csv'?")));
}

TEST_F(Overrides, LaterOnesWin) {
  EXPECT_EQ(load({{"approach.duration", "10"}, {"approach.duration", "11"}}).approach->duration, 11);
}

TEST_F(Overrides, ReplaceTheRobot) {
  folder_.write("heavy.yaml", edited(small_robot(), {{"mass: 100", "mass: 1000"}}));
  EXPECT_EQ(load({{"robot", "heavy.yaml"}}).robot.bodies[0].mass, 1000);
  EXPECT_EQ(
      load({{"robot.base.mass", "1"}, {"robot", "heavy.yaml"}, {"robot.links.upper.mass", "7"}}).robot.bodies[0].mass,
      1000);
}

TEST_F(Overrides, NamesMayHoldDots) {
  const auto path = folder_.write(
      "dots.yaml", edited(kSmallScenario, {{"name: ball", "name: ball.v2"}, {"target: ball", "target: ball.v2"}}));
  const std::vector<Override> overrides{{"targets.ball.v2.mass", "3"}};
  EXPECT_EQ(load_scenario(path, overrides).targets[0].mass, 3);
}

TEST_F(Overrides, FaultsNameTheOverride) {
  EXPECT_THAT(
      faults("approach.duraton=10"),
      ElementsAre("--set approach.duraton=10: error: unknown key 'duraton' in approach; did you mean 'duration'?"));
  EXPECT_THAT(
      faults("aproach.duration=10"),
      ElementsAre("--set aproach.duration=10: error: unknown key 'aproach' in the scenario; did you mean 'approach'?"));
  EXPECT_THAT(
      faults("approach.duration=long"),
      ElementsAre("--set approach.duration=long: error: approach.duration must be a number [s], not the text 'long'"));
  EXPECT_THAT(faults("approach.duration="),
              ElementsAre("--set approach.duration=: error: approach.duration is empty, must be a number [s]"));
  EXPECT_THAT(faults("approach.duration.x=1"),
              ElementsAre("--set approach.duration.x=1: error: approach.duration is a value without keys"));
  EXPECT_THAT(faults("targets.bal.mass=1"),
              ElementsAre("--set targets.bal.mass=1: error: no item 'bal' in targets; did you mean 'ball'?"));
  EXPECT_THAT(faults("targets[1].mass=1"),
              ElementsAre("--set targets[1].mass=1: error: targets has 1 item, so there is no [1]"));
  EXPECT_THAT(faults("targets[-1].mass=1"),
              ElementsAre("--set targets[-1].mass=1: error: '[-1].mass' is not an index such as [0]"));
  EXPECT_THAT(faults("approach[0]=1"), ElementsAre("--set approach[0]=1: error: approach is not a list"));
  EXPECT_THAT(faults("robot.base.mas=1"),
              ElementsAre("--set robot.base.mas=1: error: unknown key 'mas' in robot.base; did you mean 'mass'?"));
  EXPECT_THAT(faults("robot.base.mass=0"),
              ElementsAre("--set robot.base.mass=0: error: robot.base.mass is 0, must be greater than 0 [kg]"));
  EXPECT_THAT(faults("name=[1"), ElementsAre(testing::StartsWith("--set name=[1: error: ")));
  EXPECT_THAT(faults("name=\xff"), ElementsAre(testing::EndsWith("error: the file is not UTF-8 (byte 0xff)")));
  EXPECT_THAT(faults("approach..duration=1"),
              ElementsAre("--set approach..duration=1: error: the path has an empty name"));
}

TEST_F(Overrides, NeedAnEqualsSign) {
  for (const char* argument : {"approach.duration", "=3", ""}) {
    try {
      parse_override(argument);
      FAIL() << argument;
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(),
                "--set " + std::string(argument) + ": error: must be path=value, such as approach.duration=10");
    }
  }
  EXPECT_EQ(parse_override("name=a=b").value, "a=b");
}

TEST_F(Overrides, OddPathsAreRefused) {
  std::string deep;
  for (int i = 0; i < 10'000; ++i) deep += "a.";
  for (const std::string& path :
       {deep + "b", std::string("["), std::string("[0"), std::string("[0]x"), std::string("."), std::string("a..b"),
        std::string("targets[99999999999999999999]"), std::string("targets.[0]"), std::string(100000, 'x')}) {
    EXPECT_FALSE(faults_of_file(path_, {{path, "1"}}).empty()) << path.substr(0, 40);
  }
}

}  // namespace overrides_test
}  // namespace grapnel::test
