// The effect of quantities on a problem, checked by independent kinematics.
#include "grapnel/campaign/quantity.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "campaign/study_case.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace quantity_test {

using ::testing::HasSubstr;
using testing::Throws;

constexpr double kDegree = std::numbers::pi / 180;

CaptureProblem planned() { return load_scenario(test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml")); }
CaptureProblem closed() { return load_scenario(test::shipped("scenarios/thesis/closed-loop.yaml")); }

CaptureProblem at_once() {
  const test::Folder folder;
  return load_scenario(folder.write("at-once.yaml", test::impact_at_once()));
}

QuantityValue set(QuantityKind kind, double value, const std::string& of = {}) {
  QuantityValue s;
  s.quantity.kind = kind;
  s.quantity.of = of;
  s.value = value;
  return s;
}

CaptureProblem with(CaptureProblem problem, const std::vector<QuantityValue>& values) {
  apply_quantities(values, problem);
  return problem;
}

const GraspImpulse& grasp(const CaptureResult& r, const std::string& e) {
  for (const GraspImpulse& g : r.impact()->grasps) {
    if (g.end_effector == e) return g;
  }
  throw std::logic_error("no such grasp");
}

double distance(const Vector3d& a, const Vector3d& b) { return norm(a - b); }

std::string refusal(const CaptureProblem& problem, const std::vector<QuantityValue>& values) {
  try {
    with(problem, values);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(Quantity, RelativeSpeedOfAPlannedApproachArrivesIntoTheTarget) {
  const CaptureResult r = simulate_impact_only(with(planned(), {set(QuantityKind::relative_speed, 0.07, "tip-1")}));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  // The grasp point is above target 1's centre, so "into the target" is down; the other arm matches its target.
  EXPECT_LT(distance(grasp(r, "tip-1").relative_velocity_before, {0, -0.07, 0}), 1e-11);
  EXPECT_LT(norm(grasp(r, "tip-2").relative_velocity_before), 1e-11);
}

TEST(Quantity, RelativeDirectionTurnsAboutTheTargetsZ) {
  const CaptureResult r =
      simulate_impact_only(with(planned(), {set(QuantityKind::relative_direction, 90 * kDegree, "tip-1"),
                                            set(QuantityKind::relative_speed, 0.05, "tip-1")}));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_LT(distance(grasp(r, "tip-1").relative_velocity_before, {0.05, 0, 0}), 1e-11);  // down, turned left: +x
}

TEST(Quantity, AStatedDirectionIsInTheWorld) {
  QuantityValue speed = set(QuantityKind::relative_speed, 0.05, "tip-1");
  speed.quantity.direction = Vector3d{0.6, 0.8, 0};
  const CaptureResult r = simulate_impact_only(with(planned(), {speed}));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_LT(distance(grasp(r, "tip-1").relative_velocity_before, {0.03, 0.04, 0}), 1e-11);
}

// Without an approach the target's velocity is set: the velocity of the contact point is v_E - u, by rigid-body
// kinematics.
TEST(Quantity, RelativeSpeedWithoutAnApproachMovesTheTarget) {
  const CaptureProblem before = at_once();
  const CaptureProblem after = with(before, {set(QuantityKind::relative_speed, 0.03)});
  const CaptureResult r = simulate_impact_only(after);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  for (std::size_t i = 0; i < after.grasps.size(); ++i) {
    const TargetSetup &t = after.targets[i], &t0 = before.targets[i];
    const GraspImpulse& g = grasp(r, after.grasps[i].end_effector);
    const Vector3d to_com = t.com - t.grasp_points[0].X_TG.p;
    const Vector3d inward = t.X_WT.R * ((1 / norm(to_com)) * to_com);
    EXPECT_LT(distance(g.relative_velocity_before, 0.03 * inward), 1e-14);  // measured 9e-18
    EXPECT_EQ(distance(t.V_WT.angular, t0.V_WT.angular), 0);
    EXPECT_GT(distance(t.V_WT.linear, t0.V_WT.linear), 1e-3);
  }
}

TEST(Quantity, TargetSpinPreservesTheCentreOfMass) {
  const CaptureProblem before = at_once();
  const CaptureProblem after = with(before, {set(QuantityKind::target_spin, 0.5, "box-120")});
  const TargetSetup &t = after.targets[0], &t0 = before.targets[0];
  EXPECT_NEAR(norm(t.V_WT.angular), 0.5, 1e-15);
  EXPECT_LT(norm(cross(t.V_WT.angular, t0.V_WT.angular)), 1e-16);
  const auto v_C = [](const TargetSetup& s) { return s.V_WT.linear + cross(s.V_WT.angular, s.X_WT.R * s.com); };
  EXPECT_LT(distance(v_C(t), v_C(t0)), 1e-16);
  EXPECT_GT(distance(t.V_WT.linear, t0.V_WT.linear), 1e-3);  // the origin of its frame is not at the centre of mass
  EXPECT_EQ(norm(after.targets[1].V_WT.angular - before.targets[1].V_WT.angular), 0);
}

TEST(Quantity, TargetSpinNeedsAnAxis) {
  CaptureProblem still = at_once();
  still.targets[0].V_WT.angular = Vector3d::zero();
  EXPECT_THAT(refusal(still, {set(QuantityKind::target_spin, 0.1)}), HasSubstr("give 'axis'"));
  QuantityValue spin = set(QuantityKind::target_spin, 0.1);
  spin.quantity.axis = Vector3d{0, 1, 0};
  EXPECT_LT(distance(with(still, {spin}).targets[0].V_WT.angular, {0, 0.1, 0}), 1e-17);
}

TEST(Quantity, MassRatioScalesInertiaAlike) {
  const CaptureProblem before = planned();  // servicer: 500 + 6 * 10 kg
  const CaptureProblem after = with(before, {set(QuantityKind::mass_ratio, 0.5, "target-2")});
  EXPECT_DOUBLE_EQ(after.targets[1].mass, 280);
  EXPECT_DOUBLE_EQ(after.targets[1].inertia.zz, 28);
  EXPECT_EQ(after.targets[0].mass, 10);
}

// The planned angle of the third link, from the planar joint angles and the base's attitude, against the inward normal.
TEST(Quantity, ApproachAngleTurnsTheEndEffector) {
  for (const double degrees : {-25.0, 0.0, 25.0}) {
    CaptureProblem problem = with(closed(), {set(QuantityKind::approach_angle, degrees * kDegree)});
    problem.post_impact.reset();
    const CaptureResult r = simulate_capture(problem);
    ASSERT_EQ(r.status, CaptureStatus::completed) << degrees << ": " << r.failure;
    const Quaterniond& q = r.approach_end->base.quaternion_wxyz;
    const double base = 2 * std::atan2(q.z, q.w);
    const auto& angle = r.approach_end->joints.position;
    // Grasps: on the right of the sphere, approached leftwards (180 degrees), and on its left, rightwards (0 degrees).
    const double tip_1 = base + angle[0] + angle[1] + angle[2], tip_2 = base + angle[3] + angle[4] + angle[5];
    EXPECT_NEAR(std::remainder(tip_1 - (180 + degrees) * kDegree, 2 * std::numbers::pi), 0, 1e-9) << degrees;
    EXPECT_NEAR(std::remainder(tip_2 - degrees * kDegree, 2 * std::numbers::pi), 0, 1e-9) << degrees;
    for (const EndEffectorMotion& e : r.approach_end->end_effectors) EXPECT_LT(e.miss_distance, 1e-9);
  }
}

TEST(Quantity, ApproachAngleLeavesContactPointAndRelativeVelocity) {
  const auto at = [](double degrees) {
    return simulate_impact_only(with(
        closed(), {set(QuantityKind::approach_angle, degrees * kDegree), set(QuantityKind::relative_speed, 0.05)}));
  };
  const CaptureResult a = at(0), b = at(20);
  ASSERT_EQ(a.status, CaptureStatus::completed) << a.failure;
  ASSERT_EQ(b.status, CaptureStatus::completed) << b.failure;
  for (const char* tip : {"tip-1", "tip-2"}) {
    EXPECT_LT(distance(grasp(a, tip).contact_point, grasp(b, tip).contact_point), 1e-9);
    EXPECT_LT(distance(grasp(a, tip).relative_velocity_before, grasp(b, tip).relative_velocity_before), 1e-10);
    EXPECT_NEAR(norm(grasp(a, tip).relative_velocity_before), 0.05, 1e-10);
  }
}

TEST(Quantity, TheOrderInWhichAStudyNamesThemDoesNotMatter) {
  const std::vector<QuantityValue> one{set(QuantityKind::approach_angle, 0.2),
                                       set(QuantityKind::relative_direction, 0.3),
                                       set(QuantityKind::relative_speed, 0.05), set(QuantityKind::target_spin, 0.1)};
  const CaptureProblem a = with(closed(), one), b = with(closed(), {one.rbegin(), one.rend()});
  for (std::size_t g = 0; g < 2; ++g)
    EXPECT_EQ(distance(a.grasps[g].relative_velocity, b.grasps[g].relative_velocity), 0);
  EXPECT_EQ(distance(a.targets[0].V_WT.angular, b.targets[0].V_WT.angular), 0);
  EXPECT_EQ(a.targets[0].grasp_points.size(), 4u);
}

TEST(Quantity, MeaninglessQuantitiesAreRejectedWithAReason) {
  const CaptureProblem given = load_scenario(test::shipped("scenarios/seven-joint-dual-capture.yaml"));
  EXPECT_THAT(refusal(given, {set(QuantityKind::approach_angle, 0.1)}), HasSubstr("needs approach.plan"));
  EXPECT_THAT(refusal(given, {set(QuantityKind::mass_ratio, 0)}), HasSubstr("greater than 0"));
  EXPECT_THAT(refusal(given, {set(QuantityKind::mass_ratio, 1, "nobody")}), HasSubstr("unknown target 'nobody'"));
  EXPECT_THAT(refusal(given, {set(QuantityKind::relative_speed, 1, "nobody")}),
              HasSubstr("no grasp of end-effector 'nobody'"));
  CaptureProblem fixed_rates = planned();
  fixed_rates.approach->final_rates = std::vector<double>(6, 0.0);
  EXPECT_THAT(refusal(fixed_rates, {set(QuantityKind::relative_speed, 0.1)}), HasSubstr("needs 'match'"));
  CaptureProblem open = planned();
  open.approach->window = CaptureWindow{10, 20};
  open.targets[0].given_at = TargetSetup::Instant::start;
  EXPECT_THAT(refusal(open, {set(QuantityKind::relative_speed, 0.1)}),
              HasSubstr("approach.window does not fix the capture time of"));
  CaptureProblem blunt = planned();
  blunt.robot.end_effectors[0].approach_axis.reset();
  EXPECT_THAT(refusal(blunt, {set(QuantityKind::approach_angle, 0.1)}), HasSubstr("no approach_axis"));
  CaptureProblem shared = closed();
  shared.approach.reset();
  EXPECT_THAT(refusal(shared, {set(QuantityKind::relative_speed, 0.1)}), HasSubstr("grasped more than once"));
}

TEST(Quantity, InfoIsThatOfItsKind) {
  for (const Choice& choice : type_of<QuantityKind>().choices) {
    const auto kind = static_cast<QuantityKind>(choice.value);
    EXPECT_EQ(info(kind).kind, kind);
  }
}

}  // namespace quantity_test
}  // namespace grapnel
