/// Planned final joint values, simulated with ideal tracking: the end-effectors arrive. Deviations are computed here
/// from the time series.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/recorded.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace planned_capture_test {

using Orientation = GraspSetup::Orientation;
using ::testing::HasSubstr;

// Replaces the given final values by a plan.
CaptureProblem plan_of(CaptureProblem p, PlanSetup::Objective measure = PlanSetup::Objective::excursion) {
  p.approach->tracking = {};
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  p.approach->plan->objective = measure;
  p.post_impact.reset();
  return p;
}

class ThesisPlan : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Cases, ThesisPlan, ::testing::Values(1, 2, 3, 4));

TEST_P(ThesisPlan, ArrivesWithRequiredMotion) {
  if (GetParam() > 1) SKIP_UNDER_SANITIZERS();
  for (int rates = 0; rates < 4; ++rates) {
    SCOPED_TRACE("rates " + std::to_string(rates));
    CaptureProblem p = plan_of(load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/thesis/open-loop-case-" +
                                             std::to_string(GetParam()) + ".yaml"));
    p.approach->match.reset();
    if (rates < 3) p.approach->match = static_cast<RateMatch>(rates);
    if (rates == 3) p.approach->final_rates = std::vector<double>{0.01, -0.02, 0.03, 0, 0.01, 0.02};
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    EXPECT_TRUE(r.warnings.empty());
    EXPECT_TRUE(r.plan->searched && r.plan->found);
    const std::size_t end = last_sample(r, "approach");
    EXPECT_EQ(r.series.time[end], p.approach->duration);
    double closest = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const GraspError m = grasp_error(p, r, i, end);
      EXPECT_LT(m.distance(), 1e-9);
      closest = std::max(closest, m.distance());
      if (rates < 3) {
        EXPECT_LT(norm(m.relative_velocity()), 1e-9);
      }
      if (rates == static_cast<int>(RateMatch::velocity)) {
        EXPECT_LT(norm(m.V_WE.angular), 1e-9);
      }
      if (rates == static_cast<int>(RateMatch::twist)) {
        EXPECT_LT(norm(m.relative_spin()), 1e-9);
      }
      EXPECT_EQ(norm(m.V_WG.linear) > 0.05, GetParam() % 2 == 1 || (GetParam() == 4 && i == 1)) << i;
    }
    if (rates == 3) {
      EXPECT_EQ(joints_at(r, "joints/velocity", end), *p.approach->final_rates);
    }
    EXPECT_EQ(joints_at(r, "joints/position", end), r.plan->final_position);
    EXPECT_EQ(joints_at(r, "joints/velocity", end), r.plan->final_rates);
    std::printf("[ measured ] distance %.2g m\n", closest);
  }
}

// The spin of motor rotors also rotates the base; the plan includes it.
TEST(PlanWithRotors, Arrives) {
  CaptureProblem p = plan_of(load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1.yaml"));
  for (BodyDescription& body : p.robot.bodies) {
    if (!has_one_axis(body.joint.type)) continue;
    body.joint.rotor_inertia = 1e-2, body.joint.gear_ratio = 100, body.joint.rotor_axis = Vector3d{0, 0, 1};
  }
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  const std::size_t end = last_sample(r, "approach");
  for (std::size_t i = 0; i < 2; ++i) {
    const double distance = grasp_error(p, r, i, end).distance();
    std::printf("[ measured ] distance %.2g m\n", distance);
    EXPECT_LT(distance, 1e-9);  // measured 5.1e-15; 0.036 m for a plan without rotors
  }
}

TEST(RandomPlan, ArrivesAtPlacesOrientationsAndRates) {
  SKIP_UNDER_SANITIZERS();
  Worst distance("distance"), angle("angle"), velocity("velocity"), spin("spin");
  int simulated = 0, planned = 0, unmet = 0;
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Orientation orientation = i % 3 == 0 ? Orientation::free : i % 3 == 1 ? Orientation::axis : Orientation::pose;
    std::optional<RateMatch> match;
    if (i % 4 > 0) match = static_cast<RateMatch>(i % 4 - 1);
    std::optional<CaptureProblem> planned_problem = random_plan(i, orientation, match, [&](CaptureProblem& q) {
      if (i % 5 == 4) q.approach->profile = JointProfile::cycloidal;
    });
    if (!planned_problem) continue;
    CaptureProblem& p = *planned_problem;
    const CaptureResult r = simulate_capture(p);
    ++simulated;
    if (r.status != CaptureStatus::completed) {
      // More conditions than joints, near a singularity: Newton's method converges slowly and reports it.
      EXPECT_THAT(r.failure, ::testing::StartsWith("planning the approach: end-effector 'hand"));
      EXPECT_LT(p.joint_position.size(), 10u);
      continue;
    }
    for (const LedgerEntry& e : r.ledger.entries)
      EXPECT_TRUE(e.pass() || e.kind == LedgerEntry::Kind::feasibility) << e.name;
    ++planned;
    const std::size_t end = last_sample(r, "approach");
    EXPECT_GT(norm(vector_at(r, "base/position", end) - vector_at(r, "base/position", 0)), 1e-3);
    unmet += warns(r, "no joint rates give");
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const GraspError m = grasp_error(p, r, g, end);
      EXPECT_LT(distance.note(m.distance(), i), 1e-9);
      if (orientation == Orientation::axis) {
        EXPECT_LT(angle.note(m.axis_angle(), i), 1e-9);
      }
      if (orientation == Orientation::pose) {
        EXPECT_LT(angle.note(m.pose_angle(), i), 1e-9);
      }
      if (match && !warns(r, "no joint rates give")) {
        EXPECT_LT(velocity.note(norm(m.relative_velocity()), i), 1e-9);
        if (*match == RateMatch::twist) {
          EXPECT_LT(spin.note(norm(m.relative_spin()), i), 1e-9);
        }
        if (*match == RateMatch::velocity) {
          EXPECT_LT(spin.note(norm(m.V_WE.angular), i), 1e-9);
        }
      }
    }
    if (!match) {
      EXPECT_EQ(joints_at(r, "joints/velocity", end), *p.approach->final_rates);
    }
  }
  std::printf("[ measured ] %d of %d planned, %d with demands that no rates meet\n", planned, simulated, unmet);
  EXPECT_GE(planned, simulated - 1);
  EXPECT_GE(simulated, 20);
}

// Two arms with seven joints each: complete poses and twists in three dimensions, tumbling targets.
TEST(SevenJointPlan, ReachesPosesWithWholeTwists) {
  CaptureProblem p = load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/seven-joint-dual-capture.yaml");
  p.impact.reset(), p.post_impact.reset();
  p.output_interval = 1;
  p.V_WB.reset();
  p.momentum = Momentumd{{1, -2, 3}, {2, 1, -2}};
  p.approach->match = RateMatch::twist;
  // Grasp points get the end-effectors' orientations at the file's joint values, rotated by 0.1 rad.
  const CaptureResult simulated = simulate_capture(p);
  ASSERT_TRUE(simulated.approach_end) << simulated.failure;
  for (std::size_t g = 0; g < 2; ++g) {
    const GraspError m = grasp_error(p, simulated, g, last_sample(simulated, "approach"));
    p.targets[g].grasp_points[0].X_TG.R =
        transpose(p.targets[g].X_WT.R) * m.X_WE.R * rotation_about({0.6, 0, 0.8}, 0.1);
    p.grasps[g].orientation = Orientation::pose;
    EXPECT_GT(m.distance(), 1e-3);
  }
  p.approach->plan.emplace();
  p.approach->plan->objective = PlanSetup::Objective::as_found;
  p.approach->plan->guess = p.approach->final_position;
  p.approach->final_position.clear();
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  EXPECT_TRUE(r.warnings.empty());
  for (std::size_t g = 0; g < 2; ++g) {
    const GraspError m = grasp_error(p, r, g, last_sample(r, "approach"));
    EXPECT_LT(m.distance(), 1e-9);
    EXPECT_LT(m.pose_angle(), 1e-9);
    EXPECT_LT(norm(m.relative_velocity()), 1e-9);
    EXPECT_LT(norm(m.relative_spin()), 1e-9);
    EXPECT_GT(norm(m.V_WG.angular), 0.05);
    std::printf("[ measured ] %.2g m, %.2g rad, %.2g m/s\n", m.distance(), m.pose_angle(), norm(m.relative_velocity()));
  }
}

// --- Bases, gravity -------------------------------------------------------------------------------------------------

TEST(RandomPlan, ArrivesWithBasesHeldAndFixedAndUnderGravity) {
  Worst distance("distance"), velocity("velocity");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    const std::optional<CaptureProblem> planned_problem =
        random_plan(i, Orientation::free, i % 2 ? std::optional(RateMatch::velocity_least_rates) : std::nullopt,
                    [&](CaptureProblem& q) {
                      if (i % 3 != 2) q.V_WB.reset(), q.momentum.reset();
                      if (i % 3 == 0) q.robot.base_mode = RobotSetup::Base::held;
                      if (i % 3 == 1) q.robot.base_mode = RobotSetup::Base::fixed;
                      if (i % 4 > 0) q.gravity = {0.3, -0.2, -1.6};
                    });
    if (!planned_problem) continue;
    const CaptureProblem& p = *planned_problem;
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    for (const LedgerEntry& e : r.ledger.entries)
      EXPECT_TRUE(e.pass() || e.kind == LedgerEntry::Kind::feasibility) << e.name << e.value;
    const std::size_t end = last_sample(r, "approach");
    EXPECT_EQ(norm(vector_at(r, "base/position", end) - vector_at(r, "base/position", 0)) > 1e-6, i % 3 == 2);
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const GraspError m = grasp_error(p, r, g, end);
      EXPECT_LT(distance.note(m.distance(), i), 1e-9);
      if (p.approach->match && !warns(r, "no joint rates give")) {
        EXPECT_LT(velocity.note(norm(m.relative_velocity()), i), 1e-9);
      }
    }
  }
}

// --- Measures -------------------------------------------------------------------------------------------------------

double excursion(const CaptureProblem& p, const CaptureResult& r) {
  double sum = 0;
  for (std::size_t j = 0; j < p.joint_position.size(); ++j) {
    const double travel = r.plan->final_position[j] - p.joint_position[j];
    sum += travel * travel;
  }
  return sum;
}

TEST(Objective, MinimumForItsOwnPlan) {
  std::vector<CaptureProblem> problems;
  std::vector<CaptureResult> results;
  for (PlanSetup::Objective m :
       {PlanSetup::Objective::excursion, PlanSetup::Objective::nearest, PlanSetup::Objective::limits,
        PlanSetup::Objective::manipulability, PlanSetup::Objective::as_found}) {
    CaptureProblem p = plan_of(thesis_case(), m);
    p.impact.reset();
    p.approach->match = RateMatch::velocity_least_rates;
    p.approach->plan->guess = {-0.2, -1.0, -0.9, 2.9, -1.2, -0.6};
    for (BodyDescription& b : p.robot.bodies) {
      if (b.parent.empty()) continue;
      b.joint.limits.lower = -3.1,
      b.joint.limits.upper = b.name == "arm-1-link-2" || b.name == "arm-2-link-2" ? 1.7 : 3.1;
    }
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    for (std::size_t g = 0; g < 2; ++g) EXPECT_LT(grasp_error(p, r, g, last_sample(r, "approach")).distance(), 1e-9);
    problems.push_back(p), results.push_back(r);
  }
  const auto nearest = [&](const CaptureResult& r) {
    double sum = 0;
    for (std::size_t j = 0; j < 6; ++j)
      sum += std::pow(r.plan->final_position[j] - problems[0].approach->plan->guess[j], 2);
    return sum;
  };
  const auto limits = [&](const CaptureResult& r) {
    double sum = 0;
    for (std::size_t j = 0; j < 6; ++j) {
      const double upper = j == 1 || j == 4 ? 1.7 : 3.1;
      sum += std::pow((r.plan->final_position[j] - 0.5 * (upper - 3.1)) / (upper + 3.1), 2);
    }
    return sum;
  };
  for (const CaptureResult& r : results) {
    EXPECT_LE(excursion(problems[0], results[0]), excursion(problems[0], r) + 1e-6);
    EXPECT_LE(nearest(results[1]), nearest(r) + 1e-6);
    EXPECT_LE(limits(results[2]), limits(r) + 1e-6);
  }
  EXPECT_LT(excursion(problems[0], results[0]), 0.99 * excursion(problems[0], results[2]));
}

// --- One target for several end-effectors ---------------------------------------------------------------------------

CaptureProblem closed_loop(const std::string& name, const std::vector<Override>& overrides = {}) {
  CaptureProblem p = load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/thesis/" + name + ".yaml", overrides);
  p.post_impact.reset();
  return p;
}

double end_effector_distance(const CaptureResult& r) {
  const auto& end_effectors = r.approach_end->end_effectors;
  return norm(end_effectors.at(1).position - end_effectors.at(0).position);
}

// Reference angles and impulses of a rigid plastic impact come from two models independent of this project.
TEST(ClosedLoop, MatchesReferenceSolutionAndImpulses) {
  const CaptureProblem p = closed_loop("closed-loop");
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  const double theta[] = {0.360186, 1.523012, 1.164168, 2.504549, -1.390707, -1.208070};
  for (std::size_t j = 0; j < 6; ++j) EXPECT_NEAR(r.plan->final_position[j], theta[j], 6e-7);
  const BodyMotion& base = r.approach_end->base;
  EXPECT_NEAR(base.position[0], -0.000786, 6e-7);
  EXPECT_NEAR(base.position[1], -0.054439, 6e-7);
  EXPECT_NEAR(2 * std::atan2(base.quaternion_wxyz.z, base.quaternion_wxyz.w), 0.094227, 6e-7);
  EXPECT_EQ(r.impact()->rows, 12);
  EXPECT_EQ(r.impact()->rank, 9);
  const double impulses[2][3] = {{-0.012102, -0.293517, 0.189564}, {-0.010657, 0.292606, 0.190930}};
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_NEAR(r.impact()->grasps[g].impulse[0], impulses[g][0], 6e-7);
    EXPECT_NEAR(r.impact()->grasps[g].impulse[1], impulses[g][1], 6e-7);
    EXPECT_NEAR(r.impact()->grasps[g].angular_impulse[2], impulses[g][2], 6e-7);
  }
  EXPECT_NEAR(r.impact()->kinetic_energy_before, 0.354328, 6e-7);
  EXPECT_NEAR(r.impact()->kinetic_energy_after, 0.316278, 6e-7);
}

// Four target motions: the end-effectors arrive radially, at the grasp points' velocities, without spin.
TEST(ClosedLoop, ArrivesForEveryMotionOfTheTarget) {
  const Vector3d velocities[4][2] = {
      {{0, 0.1, 0}, {0, -0.1, 0}}, {{0, 0, 0}, {0, 0, 0}}, {{0, -0.1, 0}, {0, 0.1, 0}}, {{0, 0, 0}, {0, -0.2, 0}}};
  const char* names[] = {"closed-loop", "closed-loop-case-2", "closed-loop-case-3", "closed-loop-case-4"};
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(names[i]);
    const CaptureProblem p = closed_loop(names[i]);
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    EXPECT_TRUE(r.ledger.feasible());
    for (const MinimumClearance& c : r.clearance) EXPECT_GT(c.distance, 0.05) << c.body_a << ", " << c.body_b;
    EXPECT_NEAR(end_effector_distance(r), 1, 1e-11);  // measured 3e-14
    for (std::size_t g = 0; g < 2; ++g) {
      const GraspError m = grasp_error(p, r, g, last_sample(r, "approach"));
      EXPECT_LT(m.distance(), 1e-10);  // measured 7e-13
      EXPECT_LT(m.axis_angle(), 1e-10);
      EXPECT_LT(norm(m.V_WE.linear - velocities[i][g]), 1e-10);
      EXPECT_LT(norm(m.V_WE.angular), 1e-10);
    }
  }
}

TEST(ClosedLoop, PublishedAnglesLeavePublishedGap) {
  const CaptureResult r = simulate_capture(closed_loop("closed-loop-published-angles"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_NEAR(end_effector_distance(r), 1.064, 5e-4);  // measured 1.06387: a sphere of 1 m
}

// The bodies of each fork together equal the third link of Table 4.1.
TEST(ClosedLoop, ThirdLinksMatchTable) {
  const CaptureProblem p = closed_loop("closed-loop");
  for (const std::string arm : {"arm-1", "arm-2"}) {
    double mass = 0, first = 0, second = 0;  // moments about the joint
    for (const BodyDescription& b : p.robot.bodies) {
      if (b.name == arm + "-link-1" || b.name == arm + "-link-2" || !b.name.starts_with(arm)) continue;
      double along = b.com[0];
      for (std::string name = b.name; name != arm + "-link-3";) {
        const BodyDescription& at = *std::find_if(p.robot.bodies.begin(), p.robot.bodies.end(),
                                                  [&](const auto& other) { return other.name == name; });
        along += at.X_PF.p[0], name = at.parent;
      }
      mass += b.mass, first += b.mass * along, second += b.inertia.zz + b.mass * along * along;
    }
    EXPECT_NEAR(mass, 10, 1e-14);
    EXPECT_NEAR(first / mass, 0.5, 1e-15);
    EXPECT_NEAR(second - first * first / mass, 1.05, 1e-14);
  }
}

TEST(ClosedLoop, InfeasibleClosureReportsGap) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult far =
      simulate_capture(closed_loop("closed-loop", {{"targets.sphere.grasp_points.right.position", "[3, 0, 0]"},
                                                   {"targets.sphere.grasp_points.left.position", "[-3.4, 0, 0]"}}));
  EXPECT_EQ(far.status, CaptureStatus::failed);
  EXPECT_THAT(
      far.failure,
      HasSubstr("end-effectors 'tip-1' and 'tip-2' cannot reach grasp points 'right' and 'left' of target 'sphere' "
                "simultaneously for any base pose: the grasp points are 6.4 m apart, the end-effectors come at most 6 "
                "m apart; a gap of 0.4 m remains between 'tip-2' and 'left' when 'tip-1' is at 'right'"));
  const CaptureResult aside =
      simulate_capture(closed_loop("closed-loop", {{"targets.sphere.grasp_points.right.position", "[0, 0, 0.5]"}}));
  EXPECT_THAT(aside.failure, HasSubstr("end-effector 'tip-1' comes no closer than 0.5 m and 0 rad to grasp point "
                                       "'right' of target 'sphere'"));
}

// --- Robots of other kinds ------------------------------------------------------------------------------------------

// A torso carries both arms: both goals share its joint.
CaptureProblem with_torso() {
  CaptureProblem p = thesis_case();
  BodyDescription torso;
  torso.name = "torso", torso.parent = "base";
  torso.joint.name = "torso-joint", torso.joint.type = JointType::revolute;
  torso.X_PF.p = {0, 0.2, 0};
  torso.mass = 40, torso.com = {0, 0.05, 0}, torso.inertia = Symmetric3d::diagonal(3, 3, 3);
  for (BodyDescription& b : p.robot.bodies) {
    if (b.parent == "base") b.parent = "torso", b.X_PF.p[1] -= 0.2;
  }
  p.robot.bodies.insert(p.robot.bodies.begin() + 1, torso);
  p.joint_position.insert(p.joint_position.begin(), 0.1);
  p.approach->final_position.insert(p.approach->final_position.begin(), 0);
  return p;
}

TEST(Torso, ServesBothArms) {
  for (int kind = 0; kind < 2; ++kind) {
    CaptureProblem p = plan_of(with_torso());
    if (kind == 1) p.robot.bodies[1].joint.type = JointType::prismatic, p.robot.bodies[1].joint.axis = {0, 1, 0};
    p.approach->match = RateMatch::twist;
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    for (std::size_t g = 0; g < 2; ++g) {
      const GraspError m = grasp_error(p, r, g, last_sample(r, "approach"));
      EXPECT_LT(m.distance(), 1e-9);
      EXPECT_LT(norm(m.relative_velocity()) + norm(m.relative_spin()), 1e-9);
    }
    EXPECT_GT(std::abs(r.plan->final_position[0] - p.joint_position[0]), 1e-3);
  }
}

TEST(IdleArm, HeldOrUsedWhileOtherArrives) {
  CaptureProblem p = plan_of(thesis_case());
  p.targets.pop_back(), p.grasps.pop_back();
  p.approach->match = RateMatch::twist;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  const GraspError m = grasp_error(p, r, 0, last_sample(r, "approach"));
  EXPECT_LT(m.distance(), 1e-9);
  EXPECT_LT(norm(m.relative_velocity()) + norm(m.relative_spin()), 1e-9);
}

// The end-effector is on the base, which only the arms' reaction moves.
TEST(EndEffectorOnTheBase, MovedByReactionOrReportsError) {
  CaptureProblem p = plan_of(thesis_case());
  p.impact.reset(), p.approach->match.reset();
  p.robot.end_effectors = {{{"nose", "base", {Rotationd::identity(), {0.5, 0.4, 0}}}}};
  p.targets.pop_back(), p.grasps.pop_back();
  p.grasps[0].end_effector = "nose";
  p.approach->final_rates = std::vector<double>(6, 0.0);
  // Position of the nose after a simulated motion of 20 s.
  CaptureProblem stated = p;
  stated.approach->plan.reset();
  stated.approach->final_position = {0.3, -1.2, 0.7, 2.0, 1.9, -0.8};
  const CaptureResult there = simulate_capture(stated);
  const Vector3d nose = there.approach_end->end_effectors.at(0).position;
  ASSERT_GT(norm(nose - Vector3d{0.5, 0.4, 0}), 0.005);
  p.targets[0].X_WT.p = nose - p.targets[0].grasp_points[0].X_TG.p;
  const CaptureResult near = simulate_capture(p);
  ASSERT_EQ(near.status, CaptureStatus::completed) << near.failure;
  EXPECT_LT(grasp_error(p, near, 0, last_sample(near, "approach")).distance(), 1e-9);
  p.targets[0].X_WT.p = {3, 0, 0};
  const CaptureResult far = simulate_capture(p);
  EXPECT_EQ(far.status, CaptureStatus::failed);
  EXPECT_THAT(far.failure, HasSubstr("'nose'"));
}

TEST(NoJoints, ArrivesByDriftOrReportsError) {
  for (bool straight : {false, true}) {
    CaptureProblem p = plan_of(thesis_case());
    p.impact.reset(), p.approach->match.reset();
    p.robot.bodies.resize(1);
    p.joint_position.clear();
    p.robot.end_effectors = {{{"nose", "base", {Rotationd::identity(), {0.5, 0.4, 0}}}}};
    p.targets.pop_back(), p.grasps.pop_back();
    p.grasps[0].end_effector = "nose";
    p.targets[0].grasp_points[0].approach_direction = Vector3d{1, 0, 0};
    p.targets[0].X_WT.p = {2.5, -0.1, 0};
    if (straight) p.approach->straight_in = StraightIn{0.1, 2, 0.1};
    const CaptureResult stays = simulate_capture(p);
    EXPECT_EQ(stays.status, CaptureStatus::failed);
    EXPECT_THAT(stays.failure, HasSubstr("'nose'"));
    if (straight) continue;
    p.V_WB = Twistd{{0, 0, 0}, {0.1, 0, 0}};  // 20 s: 2 m; grasp point at (2.5, 0.4)
    const CaptureResult drifts = simulate_capture(p);
    ASSERT_EQ(drifts.status, CaptureStatus::completed) << drifts.failure;
    EXPECT_LT(grasp_error(p, drifts, 0, last_sample(drifts, "approach")).distance(), 1e-9);
  }
}

TEST(Failure, AfterPlanningRetainsPlanAndSamples) {
  CaptureProblem p = plan_of(thesis_case());
  p.output_interval = 0.1;
  const CaptureResult whole = simulate_capture(p);
  ASSERT_EQ(whole.status, CaptureStatus::completed);
  p.approach->tracking.mode = JointControl::pd;
  p.approach->tracking.kp.assign(6, 49), p.approach->tracking.kd.assign(6, 14);
  for (TargetSetup& t : p.targets) t.given_at = TargetSetup::Instant::capture;
  p.integration.max_step = 0.01, p.integration.max_steps = 1000;  // sufficient for each integration of the planner
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, ::testing::StartsWith("approach: "));
  ASSERT_TRUE(r.plan);
  EXPECT_TRUE(r.plan->found);
  EXPECT_EQ(r.plan->final_position, whole.plan->final_position);
  EXPECT_GT(r.series.time.size(), 1u);
  EXPECT_LT(r.series.time.back(), 20);
  EXPECT_TRUE(r.approach_start);
  EXPECT_FALSE(r.approach_end || r.impact() || !r.grasps.empty());

  CaptureProblem refused = plan_of(thesis_case());
  refused.approach->tracking.mode = JointControl::pd;
  refused.approach->tracking.kp.assign(6, 49), refused.approach->tracking.kd.assign(6, 14);
  refused.contact.gap = ContactSetup::Gap::refuse;
  refused.contact.refuse_beyond = 1e-3;
  const CaptureResult gap = simulate_capture(refused);
  EXPECT_EQ(gap.status, CaptureStatus::failed);
  EXPECT_THAT(gap.failure, HasSubstr("contact refused: end-effector 'tip-1' misses"));
  EXPECT_TRUE(gap.plan->found && gap.approach_end);
  EXPECT_EQ(gap.grasps.size(), 2u);
  EXPECT_FALSE(gap.impact());
}

TEST(NothingToPlan, ReportedBeforeRun) {
  CaptureProblem p = plan_of(thesis_case());
  p.impact.reset(), p.approach->match.reset(), p.grasps.clear();
  EXPECT_THROW(
      {
        try {
          simulate_capture(p);
        } catch (const CaptureProblemError& error) {
          EXPECT_THAT(error.what(), HasSubstr("approach.plan needs 'grasps'"));
          throw;
        }
      },
      CaptureProblemError);
}

}  // namespace planned_capture_test
}  // namespace grapnel::testing
