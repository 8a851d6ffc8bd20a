/// The approach: waypoints, the final straight approach, motions from samples. Passing points are computed here from
/// the time series.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "capture/recorded.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace waypoints_test {

using ::testing::HasSubstr;

// The thesis's robot with targets that turn and drift, a plan for the end and quintic pieces.
CaptureProblem on_the_way() {
  CaptureProblem p = thesis_case();
  p.impact.reset();
  p.approach->profile = JointProfile::quintic;
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  p.approach->match = RateMatch::twist;
  p.targets[0].V_WT.linear = {0.01, -0.02, 0};
  p.momentum = Momentumd{{0, 0, 2}, {1, -2, 0}};
  p.output_interval = 0.5;
  return p;
}

// Positions and rates of the joints do not jump: over an interval h a joint moves by h times its mean rate, less than
// its curvature allows.
void expect_continuous(const CaptureResult& r) {
  const double eps = 1e-9;
  for (std::size_t s = 1; s < r.series.time.size(); ++s) {
    const double h = r.series.time[s] - r.series.time[s - 1];
    if (h < eps) continue;
    for (std::size_t j = 0; j < 6; ++j) {
      const int c = static_cast<int>(j);
      const double rate0 = value_at(r, "joints/velocity", s - 1, c), rate1 = value_at(r, "joints/velocity", s, c);
      const double step = value_at(r, "joints/position", s, c) - value_at(r, "joints/position", s - 1, c);
      EXPECT_NEAR(step, 0.5 * h * (rate0 + rate1), 0.1 * h * h * h) << "t = " << r.series.time[s];
      EXPECT_NEAR(rate0, rate1, 0.4 * h);
    }
  }
}

TEST(Waypoints, JointWaypointsPassedWithRates) {
  CaptureProblem p = on_the_way();
  p.output_interval = 0.05;
  p.approach->waypoints.resize(2);
  p.approach->waypoints[0].time = 6, p.approach->waypoints[1].time = 13.5;
  p.approach->waypoints[0].joints = {0.5, -1.2, 0.8, 2.2, 1.2, -0.7};
  p.approach->waypoints[0].rates = std::vector<double>{0.05, -0.02, 0.01, 0.03, -0.04, 0.02};
  p.approach->waypoints[1].joints = {-0.2, -1.3, 0.4, 2.5, -0.4, -0.5};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  expect_continuous(r);
  for (const Waypoint& w : p.approach->waypoints) {
    const std::size_t s = sample_at(r, "approach", w.time);
    const std::vector<double> rates = w.rates ? *w.rates : std::vector<double>(6, 0.0);
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_NEAR(joints_at(r, "joints/position", s)[j], w.joints[j], 1e-14);
      EXPECT_NEAR(joints_at(r, "joints/velocity", s)[j], rates[j], 1e-14);
    }
  }
  for (std::size_t g = 0; g < 2; ++g) {
    const Meeting m = meeting(p, r, g, last_sample(r, "approach"));
    EXPECT_LT(m.distance(), 1e-9);
    EXPECT_LT(norm(m.relative_velocity()) + norm(m.relative_spin()), 1e-9);
  }
}

// Where an end-effector is and how fast it moves in a target's frame.
struct Place {
  Vector3d position, velocity;
};
Place in_target(const CaptureResult& r, const std::string& hand, const std::string& target, std::size_t s) {
  const Posed X_WT = pose_at(r, "targets/" + target, s);
  const Twistd V_WT = twist_at(r, "targets/" + target, s);
  const Vector3d arm = vector_at(r, "end_effectors/" + hand + "/position", s) - X_WT.p;
  const Vector3d v = vector_at(r, "end_effectors/" + hand + "/velocity", s) - V_WT.linear - cross(V_WT.angular, arm);
  return {transposed_times(X_WT.R, arm), transposed_times(X_WT.R, v)};
}

CaptureProblem places() {
  CaptureProblem p = on_the_way();
  for (int w = 0; w < 3; ++w) {
    Waypoint point;
    point.time = 5 + 4.5 * w;
    if (w == 0) {  // one arm alone, in the world; the other is free
      point.places = {{"tip-1", "", {2.5, -0.6, 0}, {-0.03, -0.05, 0}}};
    } else if (w == 1) {  // both, each in its target's frame
      point.places = {{"tip-1", "target-1", {-0.676, -0.627, 0}, {0.02, -0.03, 0}},
                      {"tip-2", "target-2", {0.676, 0.627, 0}, {0, 0.04, 0}}};
    } else {  // one in the world, the other in the other's target's frame
      point.places = {{"tip-2", "", {-2.2, 0.9, 0}, {0.01, 0.03, 0}},
                      {"tip-1", "target-1", {-0.911, 0.14, 0}, {0, -0.02, 0}}};
    }
    p.approach->waypoints.push_back(point);
  }
  return p;
}

void expect_places(const CaptureProblem& p, const CaptureResult& r, double tolerance) {
  Worst position("position"), velocity("velocity");
  for (const Waypoint& w : p.approach->waypoints) {
    const std::size_t s = sample_at(r, "approach", w.time);
    for (const Waypoint::Place& place : w.places) {
      Place at{vector_at(r, "end_effectors/" + place.end_effector + "/position", s),
               vector_at(r, "end_effectors/" + place.end_effector + "/velocity", s)};
      if (!place.target.empty()) at = in_target(r, place.end_effector, place.target, s);
      EXPECT_LT(position.note(norm(at.position - place.position), static_cast<int>(w.time)), tolerance) << w.time;
      EXPECT_LT(velocity.note(norm(at.velocity - place.velocity), static_cast<int>(w.time)), tolerance) << w.time;
    }
  }
}

TEST(Waypoints, PositionWaypointsPassedInTheirFrames) {
  CaptureProblem p = places();
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  EXPECT_TRUE(r.warnings.empty());
  expect_places(p, r, 1e-9);
  for (std::size_t g = 0; g < 2; ++g) EXPECT_LT(meeting(p, r, g, last_sample(r, "approach")).distance(), 1e-9);
  p.output_interval = 0.05;
  expect_continuous(simulate_capture(p));
}

TEST(Waypoints, UnreachableNamedWithTime) {
  CaptureProblem p = on_the_way();
  Waypoint w;
  w.time = 6.5;
  w.places = {{"tip-1", "", {9, 9, 0}, {0, 0, 0}}};
  p.approach->waypoints = {w};
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, HasSubstr("planning the approach, waypoint at t = 6.5 s: "));
  EXPECT_THAT(r.failure, HasSubstr("'tip-1'"));
  EXPECT_TRUE(r.plan);
}

// Loads and attitude control disturb the whole way, not only its end.
TEST(Waypoints, PositionWaypointsUnderAttitudeControlAndLoads) {
  SKIP_UNDER_SANITIZERS();
  for (double gain : {2.0, 30.0}) {
    CaptureProblem p = places();
    p.approach->base_control = BaseControlSetup{};
    p.approach->base_control->kp = {gain, gain, gain}, p.approach->base_control->kd = {5 * gain, 5 * gain, 5 * gain};
    LoadSetup load;
    load.body = "arm-2-link-1", load.p_BP = {0.3, 0, 0}, load.amplitude = {{0, 0, 0.02}, {0.05, 0.1, 0}};
    load.profile.start = 2, load.profile.end = 11;
    p.loads = {load};
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    EXPECT_TRUE(r.warnings.empty());
    expect_places(p, r, 1e-9);
    for (std::size_t g = 0; g < 2; ++g) EXPECT_LT(meeting(p, r, g, last_sample(r, "approach")).distance(), 1e-9);
  }
}

TEST(MatchWithoutPlan, HoldsUnderAttitudeControlOrReportsError) {
  int held = 0;
  for (double gain : {0.5, 3.0, 100.0}) {
    CaptureProblem p = thesis_case();
    p.impact.reset();
    p.approach->match = RateMatch::twist;
    p.approach->base_control = BaseControlSetup{};
    p.approach->base_control->kp = {gain, gain, gain}, p.approach->base_control->kd = {3 * gain, 3 * gain, 3 * gain};
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    double off = 0;
    for (std::size_t g = 0; g < 2; ++g) {
      const Meeting m = meeting(p, r, g, last_sample(r, "approach"));
      off = std::max(off, norm(m.relative_velocity()) + norm(m.relative_spin()));
    }
    std::printf("[ measured ] gain %g: rates off by %.3g, warnings %zu\n", gain, off, r.warnings.size());
    EXPECT_EQ(off < 1e-9, r.warnings.empty());
    held += off < 1e-9;
  }
  EXPECT_GE(held, 1);
}

// --- Straight in ----------------------------------------------------------------------------------------------------

CaptureProblem straight(GraspSetup::Orientation orientation) {
  CaptureProblem p = on_the_way();
  p.approach->match.reset();
  p.approach->straight_in = StraightIn{0.3, 6, 0.02};
  p.targets[0].grasp_points[0].approach_direction = Vector3d{0.8, -0.6, 0};
  p.targets[1].grasp_points[0].approach_direction = Vector3d{-0.6, 0.8, 0};
  // The targets tumble a little faster, one of them with its centre of mass off its frame.
  p.targets[0].V_WT.angular = {0, 0, 0.12};
  p.targets[1].V_WT.angular = {0, 0, -0.1};
  p.targets[1].com = {0.1, 0.05, 0};
  p.approach->plan->objective = PlanSetup::Objective::as_found;
  for (std::size_t g = 0; g < 2; ++g) {
    p.grasps[g].orientation = orientation;
    p.robot.end_effectors[g].approach_axis = Vector3d{1, 0, 0};
  }
  p.output_interval = 0.25;
  return p;
}

void expect_straight(const CaptureProblem& p, const CaptureResult& r) {
  const StraightIn& in = *p.approach->straight_in;
  const double begin = p.approach->duration - in.duration;
  const std::size_t first = sample_at(r, "approach", begin), last = last_sample(r, "approach");
  ASSERT_GT(last, first + 10);
  Worst line("off the line"), axis("axis");
  for (std::size_t g = 0; g < 2; ++g) {
    const GraspPoint& point = p.targets[g].grasp_points[0];
    const Vector3d direction = *point.approach_direction;
    double before = in.stand_off + 1e-9;
    for (std::size_t s = first; s <= last; ++s) {
      const Place at = in_target(r, p.grasps[g].end_effector, p.targets[g].name, s);
      const Vector3d way = point.X_TG.p - at.position;
      const double distance = dot(way, direction);
      EXPECT_LT(line.note(norm(way - distance * direction), static_cast<int>(s)), 1e-8);
      EXPECT_LT(norm(at.velocity - dot(at.velocity, direction) * direction), 1e-8);
      EXPECT_LE(distance, before + 1e-9);
      before = distance;
      if (s == first) {
        EXPECT_NEAR(distance, in.stand_off, 1e-9);
        EXPECT_LT(norm(at.velocity), 1e-9);
      }
      if (s == last) {
        EXPECT_NEAR(distance, 0, 1e-8);
        EXPECT_LT(norm(at.velocity - in.final_speed * direction), 1e-8);
      }
      if (p.grasps[g].orientation == GraspSetup::Orientation::axis) {
        EXPECT_LT(axis.note(meeting(p, r, g, s).axis_angle(), static_cast<int>(s)), 1e-8);
      }
      if (p.grasps[g].orientation == GraspSetup::Orientation::pose) {
        EXPECT_LT(axis.note(meeting(p, r, g, s).pose_angle(), static_cast<int>(s)), 1e-8);
      }
    }
  }
}

TEST(StraightInPiece, FollowsLineInTargetFrame) {
  SKIP_UNDER_SANITIZERS();
  for (GraspSetup::Orientation o :
       {GraspSetup::Orientation::free, GraspSetup::Orientation::axis, GraspSetup::Orientation::pose}) {
    CaptureProblem p = straight(o);
    if (o == GraspSetup::Orientation::pose) {
      for (std::size_t g = 0; g < 2; ++g) {
        const Vector3d d = *p.targets[g].grasp_points[0].approach_direction;
        p.targets[g].grasp_points[0].X_TG.R = rotation_about({0, 0, 1}, std::atan2(d[1], d[0]));
      }
    }
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    EXPECT_TRUE(r.warnings.empty()) << r.warnings[0];
    expect_passes(r);
    expect_straight(p, r);
    ASSERT_TRUE(r.plan->straight_in);
    EXPECT_LT(r.plan->straight_in->unmet, 1e-9);
  }
}

TEST(StraightInPiece, UnderGravityWithHeldBaseAndAfterAWaypoint) {
  CaptureProblem p = straight(GraspSetup::Orientation::free);
  p.gravity = {0.001, -0.002, 0};
  p.momentum.reset();
  Waypoint w;
  w.time = 4;
  w.places = {{"tip-1", "", {2.5, -0.6, 0}, {0, 0, 0}}};
  p.approach->waypoints = {w};
  CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  expect_straight(p, r);
  EXPECT_GT(norm(vector_at(r, "system/linear_momentum", last_sample(r, "approach"))), 1);
  p.gravity = Vector3d::zero();
  p.robot.base_mode = RobotSetup::Base::held;
  r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_straight(p, r);
}

// A target that a load turns and pushes: the piece is planned for the motion that it then has, or it is said that not.
TEST(StraightInPiece, StraightToLoadedTargetOrReportsDeviation) {
  CaptureProblem p = straight(GraspSetup::Orientation::free);
  LoadSetup load;
  load.body = "target:target-1";
  load.amplitude = {{0, 0, 0.004}, {0.02, 0, 0}};
  p.loads = {load};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const double miss = meeting(p, r, 0, last_sample(r, "approach")).distance();
  std::printf("[ measured ] miss %.3g m, %zu warnings\n", miss, r.warnings.size());
  EXPECT_TRUE(miss < 1e-8 || !r.warnings.empty());
}

TEST(StraightInPiece, PastASingularityWarns) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = straight(GraspSetup::Orientation::free);
  p.targets[0].V_WT = p.targets[1].V_WT = Twistd::zero();
  p.momentum.reset();
  // Arm 1 is 3 m long from (0.5, 0): the grasp point is just within its reach, and the trajectory to it leads outwards.
  p.targets[0].grasp_points[0].X_TG.p = {0, 0, 0};
  p.targets[0].grasp_points[0].approach_direction = Vector3d{0.8, -0.6, 0};
  int near = 0, beyond = 0;
  for (double reach : {2.9, 2.99, 3.0, 3.03, 3.04, 3.05}) {
    p.targets[0].X_WT.p = Vector3d{0.5, 0, 0} + reach * Vector3d{0.8, -0.6, 0};
    const CaptureResult r = simulate_capture(p);
    if (r.status == CaptureStatus::failed) {
      EXPECT_NE(r.failure.find("end-effector 'tip-1' ends 0.0"), std::string::npos) << r.failure;
      EXPECT_NE(r.failure.find("reaches a singularity"), std::string::npos) << r.failure;
      EXPECT_GT(r.plan->miss.at(0).distance, 1e-3);
      EXPECT_FALSE(r.plan->found);
      ++beyond;
      continue;
    }
    expect_passes(r);
    const double miss = meeting(p, r, 0, last_sample(r, "approach")).distance();
    std::printf("[ measured ] reach %.2f m: miss %.3g m, singular value %.3g\n", reach, miss,
                r.plan->straight_in->smallest_singular_value);
    EXPECT_EQ(warns(r, "singularity"), r.plan->straight_in->damped);
    EXPECT_TRUE(miss < 1e-8 || !r.warnings.empty());
    near += warns(r, "singularity");
  }
  EXPECT_GE(near, 1);
  EXPECT_GE(beyond, 1);
}

// --- Samples --------------------------------------------------------------------------------------------------------

TEST(SampledWay, FollowsSamplesWithRates) {
  for (bool with_rates : {false, true}) {
    CaptureProblem p = thesis_case();
    p.impact.reset();
    p.approach->match.reset(), p.approach->final_position.clear();
    p.approach->duration = 10;
    SampledMotion m;
    const auto at = [](int j, double t) { return 0.3 * std::sin(0.4 * t + j) + 0.05 * j; };
    const auto rate = [](int j, double t) { return 0.12 * std::cos(0.4 * t + j); };
    for (int k = 0; k <= 16; ++k) m.times.push_back(k == 16 ? 10 : 0.6 * k + 0.1 * (k % 3));
    for (int j = 0; j < 6; ++j) {
      m.positions.emplace_back();
      if (with_rates) m.rates.emplace_back();
      for (double t : m.times) {
        m.positions.back().push_back(at(j, t));
        if (with_rates) m.rates.back().push_back(rate(j, t));
      }
      p.joint_position[static_cast<std::size_t>(j)] = at(j, m.times[0]);
    }
    p.approach->sampled = m;
    p.output_interval = 0.1;
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    for (std::size_t k = 0; k < m.times.size(); ++k) {
      const std::size_t s = sample_at(r, "approach", m.times[k]);
      for (std::size_t j = 0; j < 6; ++j) {
        EXPECT_NEAR(joints_at(r, "joints/position", s)[j], m.positions[j][k], 1e-13);
        if (with_rates) {
          EXPECT_NEAR(joints_at(r, "joints/velocity", s)[j], m.rates[j][k], 1e-13);
        }
        if (!with_rates) {
          EXPECT_NEAR(joints_at(r, "joints/velocity", s)[j], rate(static_cast<int>(j), m.times[k]), 2e-3);
        }
      }
    }
    Worst between("between the samples");  // order h^4
    for (std::size_t s = 0; s < r.series.time.size(); ++s) {
      for (std::size_t j = 0; j < 6; ++j) {
        EXPECT_LT(
            between.note(std::abs(joints_at(r, "joints/position", s)[j] - at(static_cast<int>(j), r.series.time[s])),
                         static_cast<int>(s)),
            2e-4);
      }
    }
  }
}

}  // namespace waypoints_test
}  // namespace grapnel::testing
