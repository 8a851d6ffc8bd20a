/// Grasps of all kinds hold, recomputed from the poses that results report.

#include <gtest/gtest.h>

#include "capture/capture_case.hpp"
#include "grapnel/constraint/grasp.hpp"

namespace grapnel::testing {
namespace grasps_test {

// A random 3D capture with targets tumbling about any axis, then 6 s free.
CaptureProblem grasp_case(GraspModel model, int index) {
  CaptureProblem p = random_capture(index);
  p.approach->tracking.mode = JointControl::prescribed;
  p.contact.gap = ContactSetup::Gap::weld_as_found;
  p.post_impact->joints = PostImpactSetup::Joints::free;
  p.post_impact->duration = 6;
  for (GraspSetup& g : p.grasps) g.model = model;
  return p;
}

struct Closure {
  double position = 0, angle = 0, turned = 0;
};

// Point and axis, fixed to end-effector and target at the contact, compared over all later samples.
Closure closure(const CaptureProblem& p, const CaptureResult& r) {
  Closure worst;
  const std::size_t contact = first_sample(r, "contact");
  for (const GraspSetup& g : p.grasps) {
    const Posed X_WE = pose_at(r, "end_effectors/" + g.end_effector, contact),
                X_WT = pose_at(r, "targets/" + g.target, contact);
    const Vector3d point = inverse(X_WT) * X_WE.p, axis = transposed_times(X_WT.R, X_WE.R * g.hinge_axis);
    const Rotationd relative = transpose(X_WT.R) * X_WE.R;
    for (std::size_t s = contact; s < r.series.time.size(); ++s) {
      const Posed E = pose_at(r, "end_effectors/" + g.end_effector, s), T = pose_at(r, "targets/" + g.target, s);
      worst.position = std::max(worst.position, norm(E.p - T * point));
      worst.turned = std::max(worst.turned, rotation_angle(transpose(relative) * (transpose(T.R) * E.R)));
      if (g.model == GraspModel::hinge)
        worst.angle = std::max(worst.angle, norm(cross(E.R * g.hinge_axis, T.R * axis)));
      if (g.model == GraspModel::rigid) worst.angle = worst.turned;
    }
  }
  return worst;
}

class Grasp : public ::testing::TestWithParam<GraspModel> {};
INSTANTIATE_TEST_SUITE_P(Models, Grasp, ::testing::Values(GraspModel::rigid, GraspModel::hinge, GraspModel::point),
                         [](const auto& test) {
                           return test.param == GraspModel::rigid   ? "rigid"
                                  : test.param == GraspModel::hinge ? "hinge"
                                                                    : "point";
                         });

TEST_P(Grasp, StaysClosedAndLedgerPasses) {
  double turned = 0;
  for (int i = 100; i < 106; ++i) {
    SCOPED_TRACE(seed_note(i));
    const CaptureProblem p = grasp_case(GetParam(), i);
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    ASSERT_TRUE(r.post_impact_end);
    const Closure c = closure(p, r);
    EXPECT_LT(c.position, 1e-12);  // measured 5.2e-15
    EXPECT_LT(c.angle, 1e-12);     // measured 2e-15
    turned = std::max(turned, c.turned);
    std::printf("[ measured ] closure %.3g m, %.3g rad; turned %.3g rad\n", c.position, c.angle, c.turned);
    EXPECT_EQ(r.impact()->rows, 2 * row_count(GetParam()));
    // Non-zero momentum is conserved through the contact: two samples at one time.
    const std::size_t s = first_sample(r, "contact");
    ASSERT_EQ(r.series.time[s], r.series.time[s + 1]);
    const Vector3d p0 = vector_at(r, "system/linear_momentum", s), p1 = vector_at(r, "system/linear_momentum", s + 1);
    const Vector3d l0 = vector_at(r, "system/angular_momentum", s), l1 = vector_at(r, "system/angular_momentum", s + 1);
    ASSERT_GT(norm(p0), 0.1);
    ASSERT_GT(norm(l0), 0.1);
    EXPECT_LT(norm(p1 - p0), 1e-11 * r.ledger.scale.linear_momentum);
    EXPECT_LT(norm(l1 - l0), 1e-11 * r.ledger.scale.angular_momentum);
    // Energy decreases in the impact and is constant afterwards.
    EXPECT_LT(r.impact()->kinetic_energy_after, r.impact()->kinetic_energy_before);
    EXPECT_NEAR(value_at(r, "system/kinetic_energy", s), r.impact()->kinetic_energy_before,
                1e-14 * r.ledger.scale.energy);
    EXPECT_NEAR(value_at(r, "system/kinetic_energy", s + 1), r.impact()->kinetic_energy_after,
                1e-12 * r.ledger.scale.energy);
    EXPECT_TRUE(row(r, "energy_drift").applies);
    // Point grasps transmit no moment; hinge grasps transmit none about their axis.
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const GraspImpulse& impulse = r.impact()->grasps[g];
      if (GetParam() == GraspModel::point) {
        EXPECT_EQ(norm(impulse.angular_impulse), 0);
      }
      if (GetParam() == GraspModel::hinge) {
        const Vector3d axis = pose_at(r, "end_effectors/" + p.grasps[g].end_effector, s).R * p.grasps[g].hinge_axis;
        EXPECT_LT(std::abs(dot(axis, impulse.angular_impulse)), 1e-12 * (1 + norm(impulse.angular_impulse)));
      }
    }
  }
  EXPECT_EQ(turned > 0.1, GetParam() != GraspModel::rigid);  // the targets rotate in their grasps
}

// The target receives the opposite impulse at the same point: checked by its change of momentum.
TEST(Impulses, TargetsReceiveOppositeImpulse) {
  for (int i = 110; i < 116; ++i) {
    SCOPED_TRACE(seed_note(i));
    const CaptureProblem p = random_capture(i);
    const CaptureResult r = simulate_capture(p);
    ASSERT_TRUE(r.impact()) << r.failure;
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const TargetSetup& t = p.targets[g];
      const BodyMotion &before = r.impact()->targets_before[g], &after = r.impact()->targets_after[g];
      const Rotationd R = rotation_matrix(before.quaternion_wxyz);
      const Vector3d com = R * t.com;
      const Symmetric3d I = rotate(R, t.inertia);
      const auto v_com = [&](const BodyMotion& m) { return m.velocity + cross(m.angular_velocity, com); };
      const Vector3d linear = t.mass * (v_com(after) - v_com(before));
      const Vector3d spin = I * (after.angular_velocity - before.angular_velocity);
      const GraspImpulse& impulse = r.impact()->grasps[g];
      const Vector3d arm = impulse.contact_point - (before.position + com);
      const double size = norm(impulse.impulse) + norm(impulse.angular_impulse);
      EXPECT_LT(norm(linear + impulse.impulse), 1e-11 * size);
      EXPECT_LT(norm(spin + impulse.angular_impulse + cross(arm, impulse.impulse)), 1e-11 * size * (1 + norm(arm)));
      EXPECT_NEAR(impulse.impulse_magnitude, norm(impulse.impulse), 1e-15 * size);
      EXPECT_NEAR(impulse.mean_force, norm(impulse.impulse) / p.impact->duration, 1e-12 * size / p.impact->duration);
    }
  }
}

}  // namespace grasps_test
}  // namespace grapnel::testing
