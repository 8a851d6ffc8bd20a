// Experiments on Earth: air-bearing tables, arms on a fixed bench under gravity, stiffly controlled arms.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "capture/capture_case.hpp"
#include "examples/example_checks.hpp"
#include "examples/shipped_scenarios.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel::testing::examples_test {
namespace {

double impulse_of(const CaptureResult& r) { return r.impacts.at(0).grasps.at(0).impulse_magnitude; }
double impulse_with(const std::string& name, const std::vector<Override>& overrides) {
  const CaptureResult r = simulate_capture(load(name, overrides));
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  return impulse_of(r);
}

// Mass that a point of one rigid body, made of all links at their joint values, opposes to an impulse along n.
double composite_mass(const CaptureProblem& p, const Vector3d& n) {
  const CaptureSystem system = make_servicer(p);
  State state = zero_state(system.model);
  std::size_t joint = 0;
  for (const int body : system.model.joints())
    state.q[system.model.bodies()[static_cast<std::size_t>(body)].q] = p.joint_position.at(joint++);
  const Kinematics at = forward_kinematics(system.model, state);
  double mass = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d about_origin = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < system.model.bodies().size(); ++i) {
    const BodyDescription& body = system.model.bodies()[i].description;
    const Vector3d c = at.X_WB[i].p + at.X_WB[i].R * body.com;
    const Eigen::Vector3d com(c[0], c[1], c[2]);
    Eigen::Matrix3d R, I;
    for (int k = 0; k < 3; ++k) {
      const Vector3d column = at.X_WB[i].R * Vector3d{k == 0 ? 1. : 0., k == 1 ? 1. : 0., k == 2 ? 1. : 0.};
      R.col(k) << column[0], column[1], column[2];
    }
    const Symmetric3d& s = body.inertia;
    I << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
    mass += body.mass;
    first += body.mass * com;
    about_origin +=
        R * I * R.transpose() + body.mass * (com.squaredNorm() * Eigen::Matrix3d::Identity() - com * com.transpose());
  }
  const Eigen::Vector3d com = first / mass;
  const Eigen::Matrix3d inertia =
      about_origin - mass * (com.squaredNorm() * Eigen::Matrix3d::Identity() - com * com.transpose());
  const Vector3d tip = frame_pose(system.model, at, system.end_effectors.at(0)).p;
  const Eigen::Vector3d along(n[0], n[1], n[2]);
  const Eigen::Vector3d turning = (Eigen::Vector3d(tip[0], tip[1], tip[2]) - com).cross(along);
  return 1 / (1 / mass + turning.dot(inertia.llt().solve(turning)));
}

// With driven joints the arm and its base are one rigid body. Free joints give a third of its impulse, whether the base
// floats or not. Driven joints on a fixed base do not yield: the wall takes their speed.
void expect_a_composite_body(const CaptureProblem& p, const CaptureResult& r) {
  const double speed = 0.1;  // [m/s]
  const double wall = p.targets.at(0).mass, composite = composite_mass(p, {0, 0, 1});
  const double expected = speed / (1 / composite + 1 / wall);
  const double free = impulse_with("stiff-arm-impact", {{"impact.joints", "free"}});
  const double on_ground = impulse_with("stiff-arm-impact", {{"impact.joints", "free"}, {"robot.base.mode", "fixed"}});
  const double immovable = impulse_with("stiff-arm-impact", {{"robot.base.mode", "fixed"}});
  std::printf("[ measured ] composite %.6g kg, %.9g N s (closed form %.9g); free %.6g, fixed base %.6g and %.6g N s\n",
              composite, impulse_of(r), expected, free, on_ground, immovable);
  EXPECT_NEAR(impulse_of(r), expected, 1e-10 * expected);
  EXPECT_NEAR(free / impulse_of(r), 0.3314, 1e-3);
  EXPECT_GT(on_ground, free);
  EXPECT_NEAR(on_ground, free, 0.01 * free);  // measured 0.002
  EXPECT_NEAR(immovable, speed * wall, 1e-9 * speed * wall);
  for (const double change : r.impacts[0].joint_velocity_change) EXPECT_LT(std::abs(change), 1e-12);
}

// The tilt accelerates all bodies equally: the relative motion and the impulse are those of a level table.
void expect_a_tilt_without_effect(const CaptureProblem& p, const CaptureResult& r) {
  CaptureProblem level = p;
  level.gravity = Vector3d::zero();
  const CaptureResult other = simulate_capture(level);
  ASSERT_EQ(other.status, CaptureStatus::completed) << other.failure;
  const double free = impulse_with("air-bearing-spot", {{"impact.joints", "free"}});
  const double t = r.series.time.back();
  const Vector3d moved = r.post_impact_end->base.position - other.post_impact_end->base.position;
  std::printf("[ measured ] %.9g N s, level %.2g of it apart; base moved by %.6g m in %.3g s; free joints %.4g N s\n",
              impulse_of(r), impulse_of(other) / impulse_of(r) - 1, norm(moved), t, free);
  EXPECT_TRUE(r.captured());
  EXPECT_NEAR(impulse_of(other), impulse_of(r), 1e-10 * impulse_of(r));  // measured 2e-14
  EXPECT_NEAR(moved[0], p.gravity[0] * t * t / 2, 1e-9);                 // of 0.0315 m
  EXPECT_LT(free, 0.1 * impulse_of(r));                                  // measured 0.044
}

// Friction does not act in the impact; afterwards it brakes the robot with its block by the robot's friction.
void expect_braking_by_friction(const CaptureProblem& p, const CaptureResult& r) {
  CaptureProblem without = p;
  for (BodyDescription& body : without.robot.bodies) body.joint.friction = {};
  const CaptureResult smooth = simulate_capture(without);
  ASSERT_EQ(smooth.status, CaptureStatus::completed) << smooth.failure;
  const double on_table = 12.9 + 3 + 3 + 2e-6, block = p.targets.at(0).mass, total = on_table + block;
  const double impulse = 0.1 / (1 / on_table + 1 / block), speed = 0.1 * block / total;  // all in line
  const double lost = 1.854e-3 / total * r.series.time.back();
  const std::size_t end = r.series.time.size() - 1;
  const double at_end = -vector_at(r, "targets/block/velocity", end)[0];
  const double frictionless = -vector_at(smooth, "targets/block/velocity", smooth.series.time.size() - 1)[0];
  std::printf("[ measured ] %.9g N s (closed form %.9g); %.6g m/s, at the end %.6g m/s, without friction %.6g m/s\n",
              impulse_of(r), impulse, speed, at_end, frictionless);
  EXPECT_NEAR(impulse_of(r), impulse, 1e-10 * impulse);  // measured 1e-15
  EXPECT_EQ(impulse_of(r), impulse_of(smooth));
  EXPECT_NEAR(frictionless, speed, 1e-8 * speed);
  EXPECT_GT(lost, 0.05 * speed);                    // measured 0.093
  EXPECT_NEAR(at_end, speed - lost, 1e-6 * speed);  // measured 3e-9
}

// Both arms stop the box and hold it: each carries half of its weight, beside the commanded squeeze.
void expect_a_held_box(const CaptureProblem& p, const CaptureResult& r) {
  EXPECT_TRUE(r.captured());
  const LawReport* law = r.law(LawReport::Law::grasp_force);
  ASSERT_TRUE(law && law->pairs.size() == 1);
  const std::size_t end = r.series.time.size() - 1;
  const Vector3d left = vector_at(r, "grasps/left/force", end), right = vector_at(r, "grasps/right/force", end);
  const double weight = p.targets.at(0).mass * 9.81;
  std::printf(
      "[ measured ] impulses %.4g, %.4g N s; forces on the arms %.4g and %.4g N downwards, squeeze %.9g N; "
      "box off by %.3g m\n",
      impulse_of(r), r.impacts[0].grasps.at(1).impulse_magnitude, -left[2], -right[2], law->pairs[0].force,
      law->largest_distance);
  EXPECT_NEAR(-left[2] - right[2], weight, 0.02 * weight);
  EXPECT_NEAR(left[2], right[2], 0.05 * weight);
  EXPECT_NEAR(law->pairs[0].force, 30, 1e-6);
  EXPECT_LT(law->largest_distance, 0.02);  // measured 0.004
  EXPECT_GT(impulse_of(r), 0.3);           // measured 0.42
}

}  // namespace

ExampleChecks test_bed_checks() {
  return {
      {"stiff-arm-impact", expect_a_composite_body},
      {"air-bearing-spot", expect_a_tilt_without_effect},
      {"air-bearing-friction", expect_braking_by_friction},
      {"dual-panda-capture", expect_a_held_box},
  };
}

}  // namespace grapnel::testing::examples_test
