/// Attitude control of a free root: closed forms, limits, half turns.

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace attitude_control_test {

State turned(const Model& model, const Rotationd& R_WB) {
  State state = zero_state(model);
  set_root_pose(model, 0, {R_WB, {1, 2, 3}}, state);
  return state;
}

// Rotation about one principal axis: a linear damped oscillation with the centre of mass at rest.
TEST(AttitudeControl, IsTheDampedOscillatorAboutOneAxis) {
  const Vector3d com{0.3, -0.2, 0.1};
  const Model model = one_body(Symmetric3d::diagonal(2, 3, 4), com);
  const Rotationd R_WD = rotation_about({0.6, 0, 0.8}, 2);
  for (int axis = 0; axis < 3; ++axis) {
    const double inertia = 2 + axis, kp = 5, kd = 1.5, angle = 0.4;
    const State start = turned(model, R_WD * rotation_about(Vector3d::unit(axis), angle));
    PhaseSetup setup;
    setup.attitude = {0, R_WD, {kp, kp, kp}, {kd, kd, kd}};
    PhaseDynamics dynamics(model, setup);
    const Vector3d at = root_pose(model, start, 0) * com;
    double off = 0, lost = 0;
    const PhaseOutcome o =
        simulate_phase(dynamics, {start, 0, 6, 0.25}, {}, {.observe = [&](const PhaseSample& s) {
                         const Posed X = root_pose(model, s.state, 0);
                         const Vector3d phi = rotation_vector(transpose(R_WD) * X.R);
                         const double expected = damped_oscillation(angle, kd / (2 * inertia), kp / inertia, s.time);
                         off = std::max({off, norm(phi - expected * Vector3d::unit(axis)), norm(X * com - at)});
                         lost = std::max(lost, std::abs(totals(model, s.state).energy - s.integrals.external_work));
                       }});
    ASSERT_TRUE(o.finished);
    std::printf("[ measured ] attitude against the oscillator: %.3g, energy %.3g\n", off, lost);
    EXPECT_LT(off, 1e-11);   // measured 1.1e-12
    EXPECT_LT(lost, 1e-12);  // measured 4.1e-13
    EXPECT_EQ(o.integrals.motor_work, 0);
    EXPECT_GT(o.end_state.v[axis] * o.end_state.v[axis], 1e-6);  // the body still rotates
  }
}

TEST(AttitudeControl, SaturatesByAxis) {
  const Model model = one_body(Symmetric3d::diagonal(2, 3, 4));
  PhaseSetup setup;
  setup.attitude = {0, Rotationd::identity(), {50, 50, 50}, {1, 1, 1}, {0.1, AttitudeControl::kNone, 0.1}};
  const AttitudeControl& control = *setup.attitude;
  const Quaterniond q = quaternion_from(rotation_about({0.6, 0.8, 0}, 1));
  const Vector3d torque = attitude_torque(control, q, {0, 0.5, 3});
  EXPECT_EQ(torque[0], -0.1);
  EXPECT_NEAR(torque[1], -50 * 0.8 - 0.5, 1e-13);
  EXPECT_EQ(torque[2], -0.1);
  PhaseDynamics dynamics(model, setup);
  const State start = turned(model, rotation_about({1, 0, 0}, 0.5));
  simulate_phase(dynamics, {start, 0, 2, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                   EXPECT_NEAR(s.state.v[0], -0.1 / 2 * s.time, 1e-14);
                   EXPECT_NEAR(s.integrals.external_impulse.angular[0], -0.1 * s.time, 1e-14);
                 }});
}

// The torque acts along the shorter rotation, also slightly below and above half a turn, for either sign of q.
TEST(AttitudeControl, TakesShorterRotationUpToHalfTurn) {
  AttitudeControl control;
  control.R_WD = rotation_about({0.48, 0.6, 0.64}, 2.5);
  control.kp = {2, 2, 2};
  const Vector3d axis{2.0 / 3, -1.0 / 3, 2.0 / 3};
  for (double angle : {0.0, 1e-160, 1e-9, 1.0, M_PI - 1e-9, M_PI, M_PI + 1e-9, 5.0}) {
    const Quaterniond q_DB{std::cos(angle / 2), std::sin(angle / 2) * axis[0], std::sin(angle / 2) * axis[1],
                           std::sin(angle / 2) * axis[2]};
    const Quaterniond q = quaternion_from(control.R_WD) * q_DB;
    const double shorter = angle <= M_PI ? angle : angle - 2 * M_PI;
    for (double scale : {1.0, -1.0, 1.25}) {  // an integrator's stages are not of unit norm
      const Vector3d torque = attitude_torque(control, {scale * q.w, scale * q.x, scale * q.y, scale * q.z}, {0, 0, 0});
      const double along = std::abs(angle - M_PI) < 1e-12 ? std::copysign(shorter, -dot(torque, axis)) : shorter;
      EXPECT_LT(norm(torque + 2 * along * axis), 1e-14) << angle;
    }
  }
}

// From rest at nearly half a turn, a stiff and well-damped controller returns any body to the reference attitude.
TEST(AttitudeControl, ReturnsFromHalfTurn) {
  for (int i = 0; i < 5; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const Model model = one_body(random_inertia(3, 1, random), random.vector(0.3));
    PhaseSetup setup;
    setup.attitude = {0, random.rotation(), {4, 4, 4}, {3, 3, 3}};
    PhaseDynamics dynamics(model, setup);
    const State start = turned(model, setup.attitude->R_WD * rotation_about(random.direction(), M_PI - 1e-6));
    const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 60});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_LT(rotation_angle(transpose(setup.attitude->R_WD) * root_pose(model, o.end_state, 0).R), 1e-9);
  }
}

TEST(AttitudeControl, NeedsFreeRoot) {
  const Model wheel = flywheel({});
  PhaseSetup setup;
  setup.attitude = AttitudeControl{};
  setup.attitude->root = 0;
  EXPECT_THROW(PhaseDynamics(wheel, setup), std::invalid_argument);
  const Model body = one_body(Symmetric3d::diagonal(1, 1, 1));
  EXPECT_NO_THROW(PhaseDynamics(body, setup));
  setup.held_root = 0;
  EXPECT_THROW(PhaseDynamics(body, setup), std::invalid_argument);
}

}  // namespace attitude_control_test
}  // namespace grapnel::testing
