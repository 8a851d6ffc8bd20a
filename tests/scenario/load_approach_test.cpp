// What the keys of planned and sampled approaches, external wrenches and clearances become.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace load_approach_test {

using testing::ElementsAre;

std::vector<double> list(const Vector3d& v) { return {v[0], v[1], v[2]}; }

CaptureProblem load(const std::vector<Edit>& edits) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", edited(kSmallScenario, edits)));
}

const char* const kAxis = "approach_axis: [0, 0.6, 0.8]";
const char* const kDirection = "approach_direction: [0, -1, 0]";

TEST(LoadApproach, DefaultsAreThoseOfThePlainStructs) {
  const CaptureProblem p = load({way("plan: {}\n  straight_in: {stand_off: 1, duration: 2}\n  tracking: {noise: "
                                     "{position: 0.1}}\n  base_control: {kp: 1, kd: 2}"),
                                 with_tip(kAxis), with_point(kDirection), with_wrench("{body: base}")});
  const ApproachSetup& a = *p.approach;
  EXPECT_EQ(a.plan->objective, PlanSetup{}.objective);
  EXPECT_EQ(a.plan->starts, PlanSetup{}.starts);
  EXPECT_EQ(a.plan->seed, PlanSetup{}.seed);
  EXPECT_EQ(a.straight_in->final_speed, StraightIn{}.final_speed);
  EXPECT_EQ(a.tracking.noise->bandwidth, TrackingNoise{}.bandwidth);
  EXPECT_EQ(a.tracking.noise->seed, TrackingNoise{}.seed);
  EXPECT_THAT(list(a.base_control->limit),
              ElementsAre(AttitudeControl::kNone, AttitudeControl::kNone, AttitudeControl::kNone));
  EXPECT_FALSE(a.base_control->R_WD);
  EXPECT_EQ(a.capture_at, ApproachSetup{}.capture_at);
  EXPECT_TRUE(a.waypoints.empty());
  EXPECT_EQ(p.clearance.enabled, ClearanceSetup{}.enabled);
  EXPECT_EQ(p.clearance.required, ClearanceSetup{}.required);
  EXPECT_TRUE(p.clearance.ignore.empty());
  const LoadSetup& load = p.loads.at(0);
  EXPECT_EQ(load.frame, LoadSetup{}.frame);
  EXPECT_EQ(load.profile.shape, LoadProfile{}.shape);
  EXPECT_EQ(load.profile.start, LoadProfile{}.start);
  EXPECT_EQ(load.profile.end, LoadProfile{}.end);
  EXPECT_THAT(list(load.p_BP), ElementsAre(0, 0, 0));
  EXPECT_THAT(list(load.amplitude.linear), ElementsAre(0, 0, 0));
}

TEST(LoadApproach, EndEffectorsAndShapes) {
  const CaptureProblem p =
      load({with_tip("approach_axis: [0, 0.6, 0.8], envelope: {position: 0.05, angle: 0.1, velocity: 0.02, "
                     "angular_velocity: 0.03}"),
            {"    grasp_points", "    geometry: {shape: capsule, radius: 0.25, length: 1.5}\n    grasp_points"}});
  const EndEffectorSetup& tip = p.robot.end_effectors.at(0);
  EXPECT_THAT(list(*tip.approach_axis), ElementsAre(0, 0.6, 0.8));
  EXPECT_EQ(tip.envelope->position, 0.05);
  EXPECT_EQ(tip.envelope->angle, 0.1);
  EXPECT_EQ(tip.envelope->velocity, 0.02);
  EXPECT_EQ(tip.envelope->angular_velocity, 0.03);
  EXPECT_EQ(p.targets[0].geometry.at(0).shape, Geometry::Shape::capsule);
  EXPECT_THAT(list(p.targets[0].geometry.at(0).size), ElementsAre(0.25, 1.5, 0));

  const CaptureProblem partly = load({with_tip("envelope: {velocity: 0.02}")});
  EXPECT_EQ(partly.robot.end_effectors[0].envelope->velocity, 0.02);
  EXPECT_EQ(partly.robot.end_effectors[0].envelope->position, CaptureEnvelope::kAny);
  EXPECT_FALSE(partly.robot.end_effectors[0].approach_axis);
  EXPECT_FALSE(load({}).robot.end_effectors[0].envelope);
}

TEST(LoadApproach, OrientationOfAGrasp) {
  using Orientation = GraspSetup::Orientation;
  EXPECT_EQ(load({}).grasps[0].orientation, Orientation::free);
  EXPECT_EQ(load({with_grasp("orientation: pose")}).grasps[0].orientation, Orientation::pose);
  const CaptureProblem p = load({with_tip(kAxis), with_point(kDirection)});
  EXPECT_EQ(p.grasps[0].orientation, Orientation::axis);
  EXPECT_THAT(list(*p.targets[0].grasp_points[0].approach_direction), ElementsAre(0, -1, 0));
  EXPECT_EQ(load({with_tip(kAxis), with_point(kDirection), with_grasp("orientation: axis")}).grasps[0].orientation,
            Orientation::axis);
  EXPECT_EQ(load({with_point(kDirection), with_grasp("orientation: free")}).grasps[0].orientation, Orientation::free);
  EXPECT_EQ(load({with_tip(kAxis)}).grasps[0].orientation, Orientation::free);
}

TEST(LoadApproach, Plan) {
  const CaptureProblem p =
      load({way("plan: {objective: nearest, guess: {elbow: 1, shoulder: -1}, starts: 7, seed: 42}")});
  const ApproachSetup& a = *p.approach;
  ASSERT_TRUE(a.plan);
  EXPECT_EQ(a.plan->objective, PlanSetup::Objective::nearest);
  EXPECT_THAT(a.plan->guess, ElementsAre(-1, 1));
  EXPECT_EQ(a.plan->starts, 7);
  EXPECT_EQ(a.plan->seed, 42u);
  EXPECT_TRUE(a.final_position.empty());
  EXPECT_FALSE(a.sampled);
  using Objective = PlanSetup::Objective;
  EXPECT_EQ(load({way("plan: {objective: limits}")}).approach->plan->objective, Objective::limits);
  EXPECT_EQ(load({way("plan: {objective: manipulability}")}).approach->plan->objective, Objective::manipulability);
  EXPECT_EQ(load({way("plan: {objective: as_found}")}).approach->plan->objective, Objective::as_found);
  EXPECT_EQ(load({way("plan: {seed: 9007199254740991}")}).approach->plan->seed, 9007199254740991u);
}

// A plan matches the grasp points' motion by default; given joint values end at rest.
TEST(LoadApproach, RatesAtTheEnd) {
  const auto approach = [](const std::string& lines) { return *load({way(lines)}).approach; };
  EXPECT_EQ(approach("plan: {}").match, RateMatch::twist);
  EXPECT_FALSE(approach("plan: {}").final_rates);
  EXPECT_EQ(approach("plan: {}\n  final_rates: {match: velocity}").match, RateMatch::velocity);
  const ApproachSetup given = approach("plan: {}\n  final_rates: {elbow: 0.5}");
  EXPECT_FALSE(given.match);
  EXPECT_THAT(*given.final_rates, ElementsAre(0, 0.5));
  EXPECT_FALSE(approach("final_joints: [0.2, -0.4]").match);
  const CaptureProblem straight =
      load({way("plan: {}\n  straight_in: {stand_off: 1, duration: 2}"), with_tip(kAxis), with_point(kDirection)});
  EXPECT_FALSE(straight.approach->match);
  EXPECT_FALSE(straight.approach->final_rates);
}

TEST(LoadApproach, WaypointsAndStraightIn) {
  const CaptureProblem p =
      load({way("plan: {}\n  profile: quintic\n  straight_in: {stand_off: 0.5, duration: 4, final_speed: 0.02}\n"
                "  waypoints:\n"
                "    - {time: 3, joints: [0.1, 0.2]}\n"
                "    - {time: 5, joints: {shoulder: 0.3, elbow: 0.4}, rates: {elbow: 0.5}}\n"
                "    - time: 15.5\n"
                "      end_effectors:\n"
                "        tip: {position: [1, 2, 3], target: ball, velocity: [4, 5, 6]}\n"
                "    - {time: 15.75, end_effectors: {tip: {position: [7, 8, 9]}}}"),
            with_tip(kAxis), with_point(kDirection)});
  const ApproachSetup& a = *p.approach;
  EXPECT_EQ(a.straight_in->stand_off, 0.5);
  EXPECT_EQ(a.straight_in->duration, 4);
  EXPECT_EQ(a.straight_in->final_speed, 0.02);
  ASSERT_EQ(a.waypoints.size(), 4u);
  EXPECT_EQ(a.waypoints[0].time, 3);
  EXPECT_THAT(a.waypoints[0].joints, ElementsAre(0.1, 0.2));
  EXPECT_FALSE(a.waypoints[0].rates);
  EXPECT_THAT(a.waypoints[1].joints, ElementsAre(0.3, 0.4));
  EXPECT_THAT(*a.waypoints[1].rates, ElementsAre(0, 0.5));
  EXPECT_TRUE(a.waypoints[2].joints.empty());
  const Waypoint::Place& place = a.waypoints[2].places.at(0);
  EXPECT_EQ(place.end_effector, "tip");
  EXPECT_EQ(place.target, "ball");
  EXPECT_THAT(list(place.position), ElementsAre(1, 2, 3));
  EXPECT_THAT(list(place.velocity), ElementsAre(4, 5, 6));
  EXPECT_EQ(a.waypoints[3].places.at(0).target, "");
  EXPECT_THAT(list(a.waypoints[3].places[0].velocity), ElementsAre(0, 0, 0));
}

// The quartic profile starts from rest, which these waypoints do not ask it to leave.
TEST(LoadApproach, QuarticMayPassWaypointsAtRest) {
  const CaptureProblem p =
      load({with_approach("waypoints: [{time: 5, joints: [0, 0]}, {time: 6, joints: [0, 0], rates: [0, 0]}]")});
  EXPECT_EQ(p.approach->profile, JointProfile::quartic);
  EXPECT_EQ(p.approach->waypoints.size(), 2u);
}

TEST(LoadApproach, TrackingAndControl) {
  const CaptureProblem p = load(
      {with_approach("tracking: {mode: computed_torque, kp: 1, kd: [2, 3], noise: {position: 1e-3, bandwidth: 2, seed: "
                     "9}}\n  base_control: {kp: 4, kd: [5, 6, 7], limit: 8, rpy: [0, 0, 0.3]}\n  capture_at: envelope"),
       with_post_impact("base_control: {kp: [1, 2, 3], kd: 0, limit: [4, 5, 6], quaternion_wxyz: [0, 1, 0, 0]}"),
       with_tip("envelope: {position: 0.1}")});
  const ApproachSetup& a = *p.approach;
  EXPECT_EQ(a.tracking.mode, JointControl::computed_torque);
  EXPECT_THAT(a.tracking.kp, ElementsAre(1, 1));
  EXPECT_THAT(a.tracking.kd, ElementsAre(2, 3));
  EXPECT_EQ(a.tracking.noise->position, 1e-3);
  EXPECT_EQ(a.tracking.noise->bandwidth, 2);
  EXPECT_EQ(a.tracking.noise->seed, 9u);
  EXPECT_THAT(list(a.base_control->kp), ElementsAre(4, 4, 4));
  EXPECT_THAT(list(a.base_control->kd), ElementsAre(5, 6, 7));
  EXPECT_THAT(list(a.base_control->limit), ElementsAre(8, 8, 8));
  EXPECT_EQ((*a.base_control->R_WD)(1, 0), rotation_from_rpy(0.0, 0.0, 0.3)(1, 0));
  EXPECT_EQ(a.capture_at, ApproachSetup::CaptureAt::envelope);
  const BaseControlSetup& post = *p.post_impact->base_control;
  EXPECT_THAT(list(post.kp), ElementsAre(1, 2, 3));
  EXPECT_THAT(list(post.kd), ElementsAre(0, 0, 0));
  EXPECT_THAT(list(post.limit), ElementsAre(4, 5, 6));
  EXPECT_EQ((*post.R_WD)(1, 1), -1);
}

// A held base is released at the impact.
TEST(LoadApproach, HeldBaseMayBeControlledAfterTheImpact) {
  EXPECT_TRUE(
      load({{"base: {mass: 100,", "base: {mode: held, mass: 100,"}, with_post_impact("base_control: {kp: 1, kd: 1}")})
          .post_impact->base_control);
}

// Only joints that follow the quartic exactly must start as it does.
TEST(LoadApproach, QuarticFromRestIsForIdealTrackingOnly) {
  for (const char* mode : {"pd", "computed_torque"}) {
    const CaptureProblem p = load({{"  joints: {", "  joint_rates: {elbow: 0.1}\n  joints: {"},
                                   with_approach("tracking: {mode: " + std::string(mode) + ", kp: 1, kd: 1}")});
    EXPECT_THAT(p.joint_rate, ElementsAre(0, 0.1)) << mode;
  }
}

TEST(LoadLoads, WrenchesOrderedAngularThenLinear) {
  const CaptureProblem p = load({with_top(R"(external_wrenches:
  - {body: upper, position: [1, 2, 3], frame: body, force: [4, 5, 6], torque: [7, 8, 9], time: {shape: half_sine, start: 1, end: 3}}
  - {target: ball, force: [1, 0, 0], time: {shape: sine, frequency: 2, phase: 0.5, end: 9}}
  - {body: base, torque: [0, 0, 1], time: {shape: constant, start: -1}}
  - body: base
    time: {shape: table, values: [[0.5, 1, 2, 3, 4, 5, 6], [0.75, 0, 0, 0, 0, 0, 0]]})")});
  ASSERT_EQ(p.loads.size(), 4u);
  const LoadSetup& half = p.loads[0];
  EXPECT_EQ(half.body, "upper");
  EXPECT_EQ(half.frame, LoadFrame::body);
  EXPECT_THAT(list(half.p_BP), ElementsAre(1, 2, 3));
  EXPECT_THAT(list(half.amplitude.linear), ElementsAre(4, 5, 6));
  EXPECT_THAT(list(half.amplitude.angular), ElementsAre(7, 8, 9));
  EXPECT_EQ(half.profile.shape, LoadProfile::Shape::half_sine);
  EXPECT_EQ(half.profile.start, 1);
  EXPECT_EQ(half.profile.end, 3);
  const LoadSetup& sine = p.loads[1];
  EXPECT_EQ(sine.body, "target:ball");
  EXPECT_EQ(sine.frame, LoadFrame::world);
  EXPECT_EQ(sine.profile.shape, LoadProfile::Shape::sine);
  EXPECT_EQ(sine.profile.frequency, 2);
  EXPECT_EQ(sine.profile.phase, 0.5);
  EXPECT_EQ(sine.profile.end, 9);
  EXPECT_EQ(p.loads[2].profile.shape, LoadProfile::Shape::constant);
  EXPECT_EQ(p.loads[2].profile.start, -1);
  const LoadProfile& table = p.loads[3].profile;
  EXPECT_EQ(table.shape, LoadProfile::Shape::table);
  EXPECT_THAT(table.times, ElementsAre(0.5, 0.75));
  ASSERT_EQ(table.values.size(), 2u);
  EXPECT_THAT(list(table.values[0].linear), ElementsAre(1, 2, 3));
  EXPECT_THAT(list(table.values[0].angular), ElementsAre(4, 5, 6));
}

TEST(LoadLoads, StreamsAndTheOrbitsAxes) {
  const CaptureProblem p = load({with_top(R"(external_wrenches:
  - {body: base, frame: orbit, force: [0, -1 mN, 0], stream: {direction: [0, -1, 0], pressure: 2e-4, area: 10 m^2, normal: [0, 0.6, 0.8]}}
  - target: ball
    stream: {direction: [1, 0, 0], pressure: 5 mN/m^2, area: 2, normal: [0, 1, 0], both_sides: true, specular: 0.25, diffuse: 0.5}
orbit: {altitude: 400 km})")});
  ASSERT_EQ(p.loads.size(), 2u);
  EXPECT_EQ(p.loads[0].frame, LoadFrame::orbit);
  EXPECT_THAT(list(p.loads[0].amplitude.linear), ElementsAre(0, -1e-3, 0));
  ASSERT_TRUE(p.loads[0].stream);
  EXPECT_THAT(list(p.loads[0].stream->direction), ElementsAre(0, -1, 0));
  EXPECT_EQ(p.loads[0].stream->pressure, 2e-4);
  EXPECT_EQ(p.loads[0].stream->area, 10);
  EXPECT_EQ(p.loads[0].stream->specular, 0);
  EXPECT_FALSE(p.loads[0].stream->both_sides);
  EXPECT_THAT(list(p.loads[1].stream->normal), ElementsAre(0, 1, 0));
  EXPECT_EQ(p.loads[1].stream->pressure, 5e-3);
  EXPECT_EQ(p.loads[1].stream->specular, 0.25);
  EXPECT_EQ(p.loads[1].stream->diffuse, 0.5);
  EXPECT_TRUE(p.loads[1].stream->both_sides);
}

TEST(LoadOrbit, ByAltitudeOrByItsElements) {
  EXPECT_FALSE(load({}).orbit);
  const OrbitSetup low = *load({with_top("orbit: {altitude: 400 km}")}).orbit;
  EXPECT_EQ(low.body, OrbitSetup::Body::earth);
  EXPECT_EQ(low.altitude, 400e3);
  const ReferenceOrbit circle = reference_orbit(low);
  EXPECT_EQ(circle.mu, 3.986004418e14);
  EXPECT_EQ(circle.semi_major_axis, 6778137);
  EXPECT_EQ(circle.eccentricity, 0);
  EXPECT_THAT(list(circle.radial), ElementsAre(1, 0, 0));
  EXPECT_THAT(list(circle.along_track), ElementsAre(0, 1, 0));
  const OrbitSetup setup =
      *load({with_top("orbit: {body: mars, semi_major_axis: 9000 km, eccentricity: 0.5, true_anomaly: 90 "
                      "deg, radial: [0, 0, 1], along_track: [0.6, 0.8, 0]}")})
           .orbit;
  const ReferenceOrbit ellipse = reference_orbit(setup);
  EXPECT_EQ(ellipse.mu, 4.282837e13);
  EXPECT_EQ(ellipse.semi_major_axis, 9e6);
  EXPECT_EQ(ellipse.eccentricity, 0.5);
  EXPECT_DOUBLE_EQ(ellipse.true_anomaly, M_PI / 2);
  EXPECT_THAT(list(ellipse.along_track), ElementsAre(0.6, 0.8, 0));
  EXPECT_EQ(reference_orbit(*load({with_top("orbit: {mu: 62.6 km^3/s^2, semi_major_axis: 300 km}")}).orbit).mu, 62.6e9);
}

TEST(LoadLoads, ClearanceNamesBodiesOfTheModel) {
  const CaptureProblem p =
      load({with_top("clearance: {enabled: false, required: 0.05, ignore: [[base, upper], [ball, lower]]}")});
  EXPECT_FALSE(p.clearance.enabled);
  EXPECT_EQ(p.clearance.required, 0.05);
  using Pair = std::pair<std::string, std::string>;
  EXPECT_THAT(p.clearance.ignore, ElementsAre(Pair("base", "upper"), Pair("target:ball", "lower")));
  EXPECT_TRUE(load({with_top("clearance: {enabled: True}")}).clearance.enabled);

  // A target named like a link stays behind the link.
  const CaptureProblem same = load({{"name: ball", "name: upper"},
                                    {"target: ball", "target: upper"},
                                    with_top("clearance: {ignore: [[upper, base]]}")});
  EXPECT_THAT(same.clearance.ignore, ElementsAre(Pair("upper", "base")));
}

}  // namespace load_approach_test
}  // namespace grapnel::test
