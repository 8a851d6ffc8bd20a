/// Constraints and objectives of plans, checked in simulated trajectories: distances by the run's checks, efforts and
/// rates from its time series, impulses from its impact.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "capture/recorded.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/target_motion.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace planned_path_test {

using Objective = PlanSetup::Objective;
using ::testing::HasSubstr;

// One arm reaches the grip of a sphere; the other arm is idle.
CaptureProblem first_plan() {
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/first-plan.yaml");
  p.post_impact.reset();
  p.output_interval = 0.02;
  return p;
}
PlanSetup& plan_of(CaptureProblem& p) { return *p.approach->plan; }

CaptureResult simulated(const CaptureProblem& p) {
  CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.plan && r.plan->found);
  for (std::size_t g = 0; g < p.grasps.size(); ++g) {
    EXPECT_LT(grasp_error(p, r, g, last_sample(r, "approach")).distance(), 1e-9);
  }
  return r;
}

double minimum_of(const CaptureResult& r) {
  for (const MinimumClearance& c : r.clearance) {
    if (c.phase == "approach") return c.distance;
  }
  ADD_FAILURE() << "clearance was not watched";
  return 0;
}

// Largest rotation of the base from its initial attitude.
double largest_turn(const CaptureResult& r) {
  double largest = 0;
  const Rotationd R = pose_at(r, "base", 0).R;
  for (std::size_t i = 0; i <= last_sample(r, "approach"); ++i)
    largest = std::max(largest, rotation_angle(transpose(R) * pose_at(r, "base", i).R));
  return largest;
}

double term_of(const CaptureResult& r, Objective objective) {
  for (const PlanTerm& t : r.plan->terms) {
    if (t.name == name_of(objective)) return t.value;
  }
  ADD_FAILURE() << "no term " << name_of(objective);
  return 0;
}

// --- Clearance

// The minimum clearance is an active constraint; near_grasp exempts the end-effector near its grasp point.
TEST(PlannedClearance, HoldsAndIsActive) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = first_plan();
  plan_of(p).idle_joints = PlanSetup::IdleJoints::held;
  const double direct = minimum_of(simulated(p));
  EXPECT_LT(direct, 0.59);
  for (const double clearance : {0.6, 0.65, 0.7}) {
    SCOPED_TRACE(clearance);
    plan_of(p).clearance = clearance, plan_of(p).near_grasp = 1.2, plan_of(p).knots = 0;
    const CaptureResult r = simulated(p);
    const double least = minimum_of(r);
    std::printf("[ measured ] %.7f m\n", least);
    EXPECT_GT(least, clearance - 1e-6);
    EXPECT_LT(least, clearance + 1e-4);
    ASSERT_TRUE(r.plan->path && r.plan->path->clearance);
    EXPECT_NEAR(*r.plan->path->clearance, least, 1e-5);
    EXPECT_EQ(r.plan->path->body_a, "base");
    EXPECT_EQ(r.plan->path->body_b, "arm-1-link-2");
  }
}

// Beyond near_grasp from the grasp point, the end-effector's distance from its own target is checked and meets the
// minimum.
TEST(PlannedClearance, IncludesEndEffectorUntilNearGrasp) {
  CaptureProblem p = first_plan();
  plan_of(p).clearance = 0.2, plan_of(p).near_grasp = 0.3;
  const CaptureResult r = simulated(p);
  ASSERT_TRUE(r.plan->path && r.plan->path->clearance);
  EXPECT_EQ(r.plan->path->body_a, "arm-1-link-3");
  EXPECT_EQ(r.plan->path->body_b, "debris");
  EXPECT_GE(*r.plan->path->clearance, 0.2 - 1e-6);
  if (test::kSanitized) return;  // a failing search takes a minute with sanitizers
  plan_of(p).clearance = 0.31;   // the last link is within 0.3 m when its end is this close to the grasp point
  const CaptureResult none = simulate_capture(p);
  EXPECT_EQ(none.status, CaptureStatus::failed);
  EXPECT_THAT(none.failure, HasSubstr("'arm-1-link-3' and 'debris' come within 0."));
  EXPECT_THAT(none.failure, HasSubstr("the minimum is 0.31 m"));
}

// The arm must pass around a box on the debris: splines succeed, single polynomials do not.
TEST(PlannedClearance, FindsTrajectoryAroundBox) {
  struct Box {
    Vector3d size, p_TB;
  };
  for (const Box& box : {Box{{0.3081, 0.3081, 0.2259}, {-1.22817, 1.92089, -0.07101}},
                         Box{{0.2500, 0.2500, 0.1527}, {-1.43749, 1.86247, -0.01982}},
                         Box{{0.3123, 0.3123, 0.2887}, {-1.09010, 1.87920, 0.13707}},
                         Box{{0.1512, 0.1512, 0.1966}, {-1.11649, 1.74857, 0.02830}}}) {
    if (test::kSanitized && box.size[0] != 0.25) continue;
    SCOPED_TRACE(box.size[0]);
    CaptureProblem p = first_plan();
    plan_of(p).clearance = 0.01, plan_of(p).near_grasp = 0.4;
    Geometry shape{Geometry::Shape::box, box.size};
    const Vector3d z = {0.8, -0.6, 0}, x = {0, 0, 1}, y = cross(z, x);
    const TargetMotion at = plan_targets(p).capture[0];
    shape.X_BG = inverse(at.X_WT) *
                 Posed{Rotationd{{{x[0], y[0], z[0]}, {x[1], y[1], z[1]}, {x[2], y[2], z[2]}}}, at.X_WT * box.p_TB};
    p.targets[0].geometry.push_back(shape);
    const CaptureResult r = simulated(p);
    ASSERT_TRUE(r.plan->path && r.plan->path->clearance);
    EXPECT_EQ(r.plan->path->knots, 4);
    EXPECT_GE(*r.plan->path->clearance, 0.01 - 1e-6);
    EXPECT_GE(minimum_of(r), 0.01 - 1e-5);
  }
}

// The distance at the start bounds the clearance of every plan; the best one reaches it.
TEST(PlannedClearance, ObjectiveReachesInitialClearance) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = first_plan();
  plan_of(p).idle_joints = PlanSetup::IdleJoints::held;
  const CaptureResult direct = simulated(p);
  const std::string distance = "clearance/minimum";
  const double at_start = value_at(direct, distance, 0);
  EXPECT_LT(minimum_of(direct), at_start - 0.1);
  plan_of(p).objective = Objective::clearance;
  for (const int knots : {0, 3}) {
    plan_of(p).clearance = 0.3, plan_of(p).near_grasp = 10;
    plan_of(p).knots = knots;
    const CaptureResult r = simulated(p);
    std::printf("[ measured ] %.6f m, %.6f m at the start\n", *r.plan->path->clearance, at_start);
    EXPECT_NEAR(*r.plan->path->clearance, at_start, 1e-4);
    EXPECT_NEAR(minimum_of(r), at_start, 1e-4);
    EXPECT_DOUBLE_EQ(r.plan->objective_value, -*r.plan->path->clearance);
  }
}

// Terms that were not evaluated have no value: a search that ends early has none of the trajectory's terms.
TEST(PlannedObjective, UnknownWithoutPlan) {
  CaptureProblem p = first_plan();
  p.targets[0].X_WT.p = {9, -2, 0};
  plan_of(p).objective = Objective::base_motion;
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  ASSERT_TRUE(r.plan);
  EXPECT_TRUE(std::isnan(r.plan->objective_value));
  EXPECT_TRUE(std::isnan(term_of(r, Objective::base_motion)));
}

TEST(PlannedClearance, FailsWithoutShapes) {
  CaptureProblem p = first_plan();
  plan_of(p).clearance = 0.1;
  p.robot.geometry.clear();
  for (TargetSetup& t : p.targets) t.geometry.clear();
  const CaptureResult r = simulate_capture(p);
  EXPECT_THAT(r.failure, HasSubstr("there is no pair of bodies to check"));
}

// --- Limits during the approach

double largest_share(const CaptureResult& r, const std::string& path, std::size_t joints, double limit) {
  double largest = 0;
  const std::size_t end = last_sample(r, "approach");
  for (std::size_t i = 0; i <= end; ++i) {
    for (std::size_t j = 0; j < joints; ++j) {
      largest = std::max(largest, std::abs(value_at(r, path, i, static_cast<int>(j))) / limit);
    }
  }
  return largest;
}

void limit_joints(CaptureProblem& p, double rate, double effort) {
  for (BodyDescription& body : p.robot.bodies) {
    if (!has_one_axis(body.joint.type)) continue;
    body.joint.limits.rate = rate, body.joint.limits.effort = effort;
  }
}

TEST(PlannedLimits, HoldInSimulation) {
  CaptureProblem p = first_plan();
  p.impact.reset();
  p.targets[0].V_WT.angular = Vector3d::zero();  // from rest to rest: no final rate is required
  limit_joints(p, 1e6, 1e6);
  const CaptureResult free = simulated(p);
  const std::size_t n = free.plan->joints.size();
  const double fastest = largest_share(free, "joints/velocity", n, 1),
               strongest = largest_share(free, "joints/effort", n, 1);
  limit_joints(p, 0.8 * fastest, 1e6);
  plan_of(p).limits = PlanSetup::Limits::during_approach;
  const CaptureResult rates = simulated(p);
  const double rate = largest_share(rates, "joints/velocity", n, 0.8 * fastest);
  limit_joints(p, 1e6, 0.8 * strongest);
  const CaptureResult efforts = simulated(p);
  const double effort = largest_share(efforts, "joints/effort", n, 0.8 * strongest);
  std::printf("[ measured ] rate %.7f, effort %.7f of the limit\n", rate, effort);
  EXPECT_LT(rate, 1 + 1e-5);
  EXPECT_NEAR(*rates.plan->path->rate_share, rate, 1e-3);
  EXPECT_LT(effort, 1 + 1e-4);
  EXPECT_NEAR(*efforts.plan->path->effort_share, effort, 1e-2);
}

// --- Attitude of the base

TEST(PlannedAttitude, StaysWithinAngle) {
  CaptureProblem p = first_plan();
  p.impact.reset();
  EXPECT_GT(largest_turn(simulated(p)), 0.1);
  for (const double turn : {1e-2, 1e-4}) {
    plan_of(p).base_turn = turn;
    const CaptureResult r = simulated(p);
    const double measured = largest_turn(r);
    std::printf("[ measured ] turned by %.3g rad, %d knots\n", measured, r.plan->path->knots);
    EXPECT_LT(measured, turn + 2e-6);
    EXPECT_NEAR(r.plan->path->base_turn, measured, 0.02 * turn);
  }
}

TEST(PlannedAttitude, ObjectiveReachesInitialAttitude) {
  CaptureProblem p = first_plan();
  plan_of(p).objective = Objective::base_attitude;
  const CaptureResult r = simulated(p);
  const Rotationd turn = transpose(pose_at(r, "base", 0).R) * pose_at(r, "base", last_sample(r, "approach")).R;
  EXPECT_LT(rotation_angle(turn), 1e-8);
}

// Splines shorten the trajectories of joints with required final rates.
TEST(Splines, ShortenTrajectory) {
  CaptureProblem p = first_plan();
  const double simple = simulated(p).plan->objective_value;
  plan_of(p).knots = 4;
  const CaptureResult r = simulated(p);
  EXPECT_EQ(r.plan->path->knots, 4);
  EXPECT_LT(r.plan->objective_value, 0.7 * simple);
}

// A quiet base among many other requirements. The search needs starts other than the minimum joint motion, and
// evaluation between nodes. Without either, it returns a single polynomial with the objective 74.
TEST(PlannedObjective, NeedsOtherStartsAndFinerSampling) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/quiet-approach.yaml");
  p.approach->tracking = {};
  p.impact.reset(), p.post_impact.reset();
  plan_of(p).weights->base_motion = 3000;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  std::printf("[ measured ] %.3f, %d knots, clearance %.6f m\n", r.plan->objective_value, r.plan->path->knots,
              *r.plan->path->clearance);
  EXPECT_EQ(r.plan->path->knots, 3);
  EXPECT_LT(r.plan->objective_value, 40);  // measured 20.2
  EXPECT_GT(*r.plan->path->clearance, *plan_of(p).clearance - 1e-6);
}

// The objective leads away from every feasible trajectory: the search succeeds only from a trajectory that is feasible
// without the objective.
TEST(PlannedObjective, StartsFromFeasibleTrajectory) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = first_plan();
  p.impact.reset();
  plan_of(p).objective = Objective::nearest;
  plan_of(p).guess = {-1.08, 2.37, 0, 2.2, -0.53, 1.77};
  plan_of(p).base_turn = 0.005, plan_of(p).clearance = 0.3, plan_of(p).near_grasp = 1.2, plan_of(p).knots = 2;
  const CaptureResult r = simulated(p);
  std::printf("[ measured ] %.5f, turned by %.6f rad, clearance %.4f m\n", r.plan->objective_value, largest_turn(r),
              minimum_of(r));
  EXPECT_LT(largest_turn(r), 0.005 + 2e-6);
  EXPECT_GT(minimum_of(r), 0.3 - 1e-6);
}

// --- Impulses

// Energy that each impulse alone would give its free target, from the simulated impact.
double energy_of_impulses(const CaptureProblem& p, const CaptureResult& r) {
  double energy = 0;
  for (const GraspImpulse& g : r.impact()->grasps) {
    const auto at = std::find_if(p.grasps.begin(), p.grasps.end(),
                                 [&](const GraspSetup& s) { return s.end_effector == g.end_effector; });
    const TargetSetup& target = p.targets[target_index(p, at->target)];
    const Posed X_WT = pose_at(r, "targets/" + target.name, last_sample(r, "approach"));
    const Vector3d about = g.angular_impulse + cross(g.contact_point - X_WT * target.com, g.impulse);
    const Vector3d l = transposed_times(X_WT.R, about);
    const Symmetric3d& I = target.inertia;
    Eigen::Matrix3d inertia;
    inertia << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
    const Eigen::Vector3d column{l[0], l[1], l[2]};
    energy += 0.5 * dot(g.impulse, g.impulse) / target.mass + 0.5 * column.dot(inertia.inverse() * column);
  }
  return energy;
}

TEST(PlannedImpulse, MatchesImpactAndIsReduced) {
  SKIP_UNDER_SANITIZERS();
  for (const ImpactSetup::Joints joints :
       {ImpactSetup::Joints::free, ImpactSetup::Joints::braked, ImpactSetup::Joints::driven}) {
    SCOPED_TRACE(static_cast<int>(joints));
    CaptureProblem p = first_plan();
    p.approach->match.reset(), p.approach->final_rates = std::vector<double>(6, 0.0);
    p.approach->tracking = {};
    p.impact->joints = joints;
    const double direct = energy_of_impulses(p, simulated(p));
    plan_of(p).objective = Objective::impulse;
    const CaptureResult r = simulated(p);
    const double energy = energy_of_impulses(p, r);
    std::printf("[ measured ] %.6g J, %.6g J where joints move least\n", energy, direct);
    EXPECT_NEAR(energy, r.plan->objective_value, 1e-8 * energy);
    EXPECT_LT(energy, 0.999 * direct);
  }
}

TEST(PlannedImpulse, IndexIsReduced) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = first_plan();
  plan_of(p).weights.emplace();
  plan_of(p).weights->excursion = 1, plan_of(p).weights->impulse_index = 1e-9;
  const CaptureResult direct = simulated(p);
  plan_of(p).weights.reset();
  plan_of(p).objective = Objective::impulse_index;
  const CaptureResult r = simulated(p);
  EXPECT_LT(term_of(r, Objective::impulse_index), 0.996 * term_of(direct, Objective::impulse_index));
  // The mean lies between the extremes in the impact's measures.
  EXPECT_LT(term_of(r, Objective::impulse_index), r.impact()->measures->largest_impulse);
  EXPECT_GT(term_of(r, Objective::impulse_index), r.impact()->measures->smallest_impulse);
}

// --- Idle joints and roll

TEST(IdleJoints, HeldOrUsed) {
  CaptureProblem p = first_plan();
  const CaptureResult used = simulated(p);
  plan_of(p).idle_joints = PlanSetup::IdleJoints::held;
  for (const bool spline : {false, true}) {
    if (spline) plan_of(p).knots = 3, plan_of(p).objective = Objective::base_motion;
    const CaptureResult held = simulated(p);
    EXPECT_EQ(held.plan->path.has_value(), spline);
    for (std::size_t i = 0; i <= last_sample(held, "approach"); ++i) {
      for (int j = 3; j < 6; ++j) {
        EXPECT_NEAR(value_at(held, "joints/position", i, j), p.joint_position[static_cast<std::size_t>(j)], 1e-14);
        EXPECT_NEAR(value_at(held, "joints/velocity", i, j), 0, 1e-14);
      }
    }
    if (!spline) {
      EXPECT_GT(held.plan->objective_value, used.plan->objective_value * 1.05);
    }
  }
  EXPECT_GT(std::abs(used.plan->final_position[3] - p.joint_position[3]), 0.01);
}

// A plan corrected by simulations also holds idle joints.
TEST(IdleJoints, HeldUnderDisturbance) {
  CaptureProblem p = first_plan();
  plan_of(p).idle_joints = PlanSetup::IdleJoints::held;
  LoadSetup push;
  push.body = "arm-1-link-1", push.amplitude = {{0, 0, 0.2}, {0, 0.3, 0}};
  p.loads.push_back(push);
  const CaptureResult r = simulated(p);
  for (std::size_t j = 3; j < 6; ++j) {
    EXPECT_EQ(r.plan->final_position[j], p.joint_position[j]);
    EXPECT_EQ(r.plan->final_rates[j], 0);
  }
}

TEST(StraightIn, MatchedRollFollowsTarget) {
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/dual-arm-satellite-handles.yaml");
  p.approach->tracking = {};
  p.impact.reset(), p.post_impact.reset();
  p.clearance.enabled = false;
  const auto rolls = [&](StraightIn::Roll roll) {
    p.approach->straight_in->roll = roll;
    const CaptureResult r = simulated(p);
    double largest = 0;
    const std::size_t begin = sample_at(r, "approach", 30), end = last_sample(r, "approach");
    for (std::size_t i = begin; i <= end; ++i) {
      for (std::size_t g = 0; g < 2; ++g) {
        const GraspError m = grasp_error(p, r, g, i);
        largest = std::max(largest, std::abs(dot(m.relative_spin(), m.direction_W)));
        EXPECT_LT(m.axis_angle(), 1e-7);
      }
    }
    return largest;
  };
  const double free = rolls(StraightIn::Roll::free), matched = rolls(StraightIn::Roll::matched);
  std::printf("[ measured ] %.3g rad/s free, %.3g rad/s matched\n", free, matched);
  EXPECT_GT(free, 0.01);
  EXPECT_LT(matched, 1e-9);
}

// --- Flexible robots

// The plan is for the rigid robot, with final values that bring the flexible robot to its grasp points. The flexible
// robot satisfies the path constraints up to the effect of its deflections.
TEST(PlannedPath, HoldsForFlexibleRobots) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1-flexible.yaml");
  p.post_impact.reset();
  p.output_interval = 0.02;
  for (BodyDescription& body : p.robot.bodies) {
    if (body.beam) body.beam->modes = 1;
  }
  plan_of(p).objective = Objective::excursion;
  const double free = largest_turn(simulated(p));
  plan_of(p).base_turn = 0.5 * free, plan_of(p).knots = 2;
  const CaptureResult r = simulated(p);
  std::printf("[ measured ] turned by %.6f rad, %.6f allowed, %.6f without that\n", largest_turn(r), 0.5 * free, free);
  EXPECT_NEAR(largest_turn(r), 0.5 * free, 5e-3);  // measured 1.5e-3 less, due to the flexible links
  EXPECT_THAT(r.warnings, ::testing::Contains(HasSubstr("path constraints for a robot that is rigid")));
}

// Final straight approach: the planner corrects the rigid robot's references until the flexible end-effectors reach the
// grasp points with the required orientation and velocity.
TEST(StraightIn, FlexibleEndEffectorsReachPoints) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1-flexible.yaml");
  p.post_impact.reset();
  for (BodyDescription& body : p.robot.bodies) {
    if (body.beam) body.beam->modes = 1;
  }
  p.approach->match.reset();
  p.approach->straight_in = StraightIn{0.1, 5, 0.01};
  p.targets[0].grasp_points[0].approach_direction = Vector3d{0, -1, 0};
  p.targets[1].grasp_points[0].approach_direction = Vector3d{0, 1, 0};
  for (GraspSetup& grasp : p.grasps) grasp.orientation = GraspSetup::Orientation::free;
  const auto arrives = [&](const CaptureResult& r) {
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const GraspError::Deviation m =
          grasp_error(p, r, g, last_sample(r, "approach")).deviation(p.grasps[g].orientation, *p.approach->straight_in);
      std::printf("[ measured ] missed in the end: %.2g m, %.2g rad, %.2g m/s, %.2g rad/s\n", m.distance, m.angle,
                  m.velocity, m.spin);
      EXPECT_LT(m.largest(), 1e-8);
      EXPECT_NEAR(r.plan->miss[g].velocity.value(), m.velocity, 1e-9);
      EXPECT_NEAR(r.plan->miss[g].angular_velocity.value(), m.spin, 1e-9);
    }
    EXPECT_THAT(
        r.warnings,
        ::testing::Contains(HasSubstr(
            "straight_in brings the end-effectors of the flexible robot to the demanded poses and velocities")));
  };
  const CaptureResult r = simulated(p);
  arrives(r);
  const char* const of_limits = "the same holds for joint limits and other path constraints, which the run checks";
  EXPECT_THAT(r.warnings, ::testing::Not(::testing::Contains(HasSubstr(of_limits))));

  plan_of(p).limits = PlanSetup::Limits::during_approach;
  EXPECT_THAT(simulated(p).warnings, ::testing::Contains(HasSubstr(of_limits)));

  // The required orientation is the one reached without the requirement; the targets rotate slowly.
  plan_of(p).limits = {};
  for (TargetSetup& target : p.targets) target.V_WT.angular = {0, 0, 0.02};
  const CaptureResult by_itself = simulated(p);
  for (std::size_t g = 0; g < p.grasps.size(); ++g) {
    const GraspError m = grasp_error(p, by_itself, g, last_sample(by_itself, "approach"));
    Rotationd& R_TG = p.targets[g].grasp_points[0].X_TG.R;
    R_TG = R_TG * transpose(m.X_WG.R) * m.X_WE.R;
    p.grasps[g].orientation = GraspSetup::Orientation::pose;
  }
  plan_of(p).guess = by_itself.plan->final_position;
  arrives(simulated(p));
}

// --- Base attitude control and external loads

void control_base(CaptureProblem& p, bool feedforward) {
  BaseControlSetup& control = p.approach->base_control.emplace();
  control.kp = {400, 400, 400}, control.kd = {2000, 2000, 2000}, control.feedforward = feedforward;
}

// With feedforward of the joints' reaction torque the base holds its attitude exactly, as planned.
TEST(PlannedPath, HoldsWithControlledBase) {
  CaptureProblem p = first_plan();
  p.impact.reset();
  control_base(p, true);
  const double direct = minimum_of(simulated(p));
  plan_of(p).clearance = direct + 0.05, plan_of(p).near_grasp = 1.2, plan_of(p).knots = 0;
  const CaptureResult r = simulated(p);
  std::printf("[ measured ] %.7f m, %.7f m asked for, %.7f m without that; the base turns by %.3g rad\n", minimum_of(r),
              direct + 0.05, direct, largest_turn(r));
  EXPECT_TRUE(r.plan->path->attitude_held);
  EXPECT_LT(largest_turn(r), 1e-9);
  EXPECT_NEAR(minimum_of(r), direct + 0.05, 1e-5);
  EXPECT_THAT(r.warnings,
              ::testing::Contains(HasSubstr("a robot that holds its base's attitude exactly; the simulated")));
  // Efforts are those on a base that does not rotate.
  plan_of(p).clearance.reset(), plan_of(p).near_grasp.reset();
  limit_joints(p, 1e6, 1e6);
  const std::size_t n = r.plan->joints.size();
  const double strongest = largest_share(simulated(p), "joints/effort", n, 1);
  limit_joints(p, 1e6, 0.8 * strongest);
  plan_of(p).limits = PlanSetup::Limits::during_approach;
  const CaptureResult efforts = simulated(p);
  const double effort = largest_share(efforts, "joints/effort", n, 0.8 * strongest);
  std::printf("[ measured ] effort %.7f of the limit\n", effort);
  EXPECT_LT(effort, 1 + 1e-4);
  EXPECT_NEAR(*efforts.plan->path->effort_share, effort, 1e-2);
}

// Without feedforward the base lags, and constraints are violated by the lag.
TEST(PlannedPath, HoldsUpToLagOfControlledBase) {
  CaptureProblem p = first_plan();
  p.impact.reset();
  control_base(p, false);
  const double direct = minimum_of(simulated(p));
  plan_of(p).clearance = direct + 0.05, plan_of(p).near_grasp = 1.2, plan_of(p).knots = 0;
  const CaptureResult r = simulated(p);
  std::printf("[ measured ] %.5f m, %.5f m asked for; the base turns by %.3g rad\n", minimum_of(r), direct + 0.05,
              largest_turn(r));
  EXPECT_GT(largest_turn(r), 1e-4);
  EXPECT_NEAR(minimum_of(r), direct + 0.05, 5e-3);
}

TEST(PlannedPath, ControlledBaseHasNoRotation) {
  CaptureProblem p = first_plan();
  control_base(p, false);
  plan_of(p).base_turn = 0.1, plan_of(p).objective = Objective::base_motion;
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, HasSubstr("base_turn, base_motion: no base rotation is planned"));
  // With control too weak to hold the attitude the base floats, and the planner includes its rotation.
  for (Vector3d* gains : {&p.approach->base_control->kp, &p.approach->base_control->kd}) *gains = {1e-3, 1e-3, 1e-3};
  const CaptureResult weak = simulated(p);
  EXPECT_FALSE(weak.plan->path->attitude_held);
  EXPECT_NEAR(largest_turn(weak), weak.plan->path->base_turn, 5e-3);
  EXPECT_LT(largest_turn(weak), 0.1 + 5e-3);
  EXPECT_THAT(weak.warnings, ::testing::Contains(HasSubstr("too weak to hold the attitude")));
}

TEST(PlannedPath, CorrectsPlanForLoads) {
  CaptureProblem p = first_plan();
  p.impact.reset();
  LoadSetup push;
  push.body = "arm-1-link-1", push.amplitude = {{0, 0, 0.05}, {0, 0.05, 0}};
  p.loads.push_back(push);
  const double direct = minimum_of(simulated(p));
  plan_of(p).clearance = direct + 0.05, plan_of(p).near_grasp = 1.2, plan_of(p).knots = 0;
  const CaptureResult r = simulated(p);
  std::printf("[ measured ] %.5f m, %.5f m asked for, %.5f m without that\n", minimum_of(r), direct + 0.05, direct);
  EXPECT_NEAR(minimum_of(r), direct + 0.05, 1e-2);
  EXPECT_THAT(r.warnings, ::testing::Contains(HasSubstr("a robot that has no loads; the simulated")));
}

}  // namespace planned_path_test
}  // namespace grapnel::testing
