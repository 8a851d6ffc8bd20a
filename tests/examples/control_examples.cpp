// Control of the base and of the arms, with actuators and sensors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "capture/capture_case.hpp"
#include "examples/example_checks.hpp"
#include "examples/shipped_scenarios.hpp"
#include "grapnel/problem/problem_conflicts.hpp"

namespace grapnel::testing::examples_test {
namespace {

// The wheels absorb the target's momentum, and the base returns to its attitude.
void expect_wheels_take_the_momentum(const CaptureProblem& p, const CaptureResult& r) {
  EXPECT_TRUE(r.captured());
  EXPECT_TRUE(r.ledger.feasible());
  ASSERT_EQ(r.wheels.size(), 4u);
  Vector3d stored = Vector3d::zero();
  for (std::size_t w = 0; w < 4; ++w) {
    stored += r.wheels[w].momentum_after() * p.robot.wheels[w].axis;
    EXPECT_LT(r.wheels[w].largest_rate, r.wheels[w].rate_limit);
    EXPECT_LE(r.wheels[w].largest_torque, r.wheels[w].torque_limit * (1 + 1e-12));
  }
  const BodyMotion& base = r.post_impact_end->base;
  EXPECT_LT(norm(base.angular_velocity), 1e-6);
  EXPECT_NEAR(std::abs(base.quaternion_wxyz.w), 1, 1e-9);
  const auto total = std::find_if(r.series.series.begin(), r.series.series.end(),
                                  [](const Series& s) { return s.path == "system/angular_momentum"; });
  ASSERT_NE(total, r.series.series.end());
  const std::size_t last = total->data.size() - 3;
  const Vector3d L{total->data[last], total->data[last + 1], total->data[last + 2]};
  std::printf("[ measured ] momentum %.4g N m s, of which the wheels lack %.2g\n", norm(L), norm(L - stored));
  EXPECT_LT(norm(L - stored), 1e-3 * norm(L));
}

// The gyros absorb the target's momentum and rotate the base, with motors of low torque.
void expect_gyros_take_the_momentum(const CaptureProblem& p, const CaptureResult& r) {
  EXPECT_TRUE(r.captured());
  EXPECT_TRUE(r.ledger.feasible());
  EXPECT_TRUE(r.warnings.empty());
  ASSERT_TRUE(r.gyros && r.gyros->steered);
  ASSERT_EQ(r.gyros->each.size(), 4u);
  EXPECT_TRUE(r.gyros->hazards.empty());
  EXPECT_GT(r.gyros->least_singularity_measure, r.gyros->near);
  const auto last = [&](const char* path) {
    for (const Series& s : r.series.series) {
      const std::size_t at = s.data.size();
      if (s.path == path) return Vector3d{s.data[at - 3], s.data[at - 2], s.data[at - 1]};
    }
    throw std::runtime_error(path);
  };
  double most = 0, on_base = 0;
  Vector3d stored = Vector3d::zero();
  for (std::size_t g = 0; g < 4; ++g) {
    const GyroReport& gyro = r.gyros->each[g];
    const MomentGyroSetup& setup = p.robot.gyros[g];
    stored += gyro.momentum * (std::cos(gyro.angle_after) * setup.spin_axis +
                               std::sin(gyro.angle_after) * cross(setup.gimbal_axis, setup.spin_axis));
    EXPECT_LE(gyro.largest_rate, gyro.rate_limit);
    EXPECT_LT(gyro.largest_torque, gyro.torque_limit);
    most = std::max(most, gyro.largest_torque);
  }
  for (const Series& s : r.series.series) {
    if (s.path != "base/control_torque") continue;
    for (std::size_t i = 0; i + 2 < s.data.size(); i += 3)
      on_base = std::max(on_base, norm(Vector3d{s.data[i], s.data[i + 1], s.data[i + 2]}));
  }
  EXPECT_LT(norm(stored - last("gyros/momentum")), 1e-12);
  const BodyMotion& base = r.post_impact_end->base;
  EXPECT_LT(norm(base.angular_velocity), 1e-6);
  EXPECT_NEAR(base.quaternion_wxyz.y / base.quaternion_wxyz.w, std::tan(M_PI / 9), 1e-6);  // 40 deg about y
  const Vector3d L = last("system/angular_momentum");
  const double lacking = norm(L - rotation_matrix(base.quaternion_wxyz) * stored);
  std::printf(
      "[ measured ] momentum %.4g N m s, of which the gyros lack %.2g; %.3g N m on the base by motors of %.3g\n",
      norm(L), lacking, on_base, most);
  EXPECT_GT(norm(L), 5);
  EXPECT_LT(lacking, 1e-3 * norm(L));
  EXPECT_GT(on_base, 20 * most);
}

// The final momentum of the wheels equals their initial momentum plus the target's angular momentum.
void expect_bias_is_reversed(const CaptureProblem& p, const CaptureResult& r) {
  expect_wheels_take_the_momentum(p, r);
  Vector3d before = Vector3d::zero(), after = Vector3d::zero();
  for (std::size_t w = 0; w < r.wheels.size(); ++w) {
    before += p.robot.wheels[w].inertia * p.wheel_rate[w] * p.robot.wheels[w].axis;
    after += r.wheels[w].momentum_after() * p.robot.wheels[w].axis;
  }
  const TargetSetup& target = p.targets[0];
  const Vector3d& w = target.V_WT.angular;
  const Vector3d brought{target.inertia.xx * w[0], target.inertia.yy * w[1], target.inertia.zz * w[2]};
  std::printf("[ measured ] brought %.4g N m s, held before %.4g, after %.4g\n", norm(brought), norm(before),
              norm(after));
  EXPECT_LT(norm(before + brought - after), 1e-3 * norm(brought));
  EXPECT_LT(norm(after), 0.51 * norm(brought));
}

// The estimate improves during the approach, and the identified values of the satellite are better than the assumed
// ones.
void expect_sensing(const CaptureResult& r) {
  ASSERT_GE(r.navigation.size(), 4u);
  EXPECT_NEAR(r.navigation.front().estimates[0].position_error, 0.0707, 1e-3);
  for (const NavigationReport& n : r.navigation) EXPECT_TRUE(n.found) << n.failure;
  EXPECT_LT(r.navigation.back().estimates[0].position_error, 0.03);
  EXPECT_LT(r.grasps[0].distance, 0.05);
  ASSERT_TRUE(r.identification);
  EXPECT_EQ(r.identification->rank, 10);
  EXPECT_TRUE(r.identification->used_from);
  ASSERT_FALSE(r.identification->parameters.empty());
  const IdentifiedParameter& mass = r.identification->parameters[0];
  std::printf("[ measured ] gap %.3g m, mass %.6g of %.6g kg\n", r.grasps[0].distance, mass.value.value(), mass.truth);
  EXPECT_LT(std::abs(mass.error().value()), 600);  // the initial guess is 3000 kg too low
}

// The torque bound holds in orbit as well, up to the gravity gradient; the external torque does not vanish.
void expect_detumbling_in_orbit(const CaptureResult& r) {
  expect_closed_loops(r, 12, {0.025, 0.018}, 1, 2);
  const LawReport* law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->ended, LawEnd::at_rest);
  EXPECT_LT(law->largest_torque, 1.01 * law->torque_bound);
  EXPECT_NEAR(law->end - law->begin, law->expected_duration, 0.1);
  const auto torque = std::find_if(r.series.series.begin(), r.series.series.end(),
                                   [](const Series& s) { return s.path == "base/control_torque"; });
  ASSERT_NE(torque, r.series.series.end());
  const std::size_t last = torque->data.size() - 3;
  const double held = std::hypot(torque->data[last], torque->data[last + 1], torque->data[last + 2]);
  std::printf("[ measured ] control torque at the end %.2g N m\n", held);
  EXPECT_GT(held, 1e-4);
  EXPECT_LT(held, 1e-2);
}

// The logged torques of a controller bring joints and base nearly to rest.
void expect_torques_brake(const CaptureResult& r) {
  ASSERT_TRUE(r.impact() && r.post_impact_end);
  double before = 0, after = 0;
  for (const Series& series : r.series.series) {
    if (series.path != "joints/velocity") continue;
    for (std::size_t i = 0; i < r.series.time.size(); ++i) {
      if (r.series.phases[r.series.phase[i]] != "post_impact") continue;
      for (std::size_t j = 0; j < 6; ++j) before = std::max(before, std::abs(series.data[6 * i + j]));
    }
  }
  for (const double rate : r.post_impact_end->joints.velocity) after = std::max(after, std::abs(rate));
  std::printf("[ measured ] joint rates %.3g to %.3g rad/s, the base's %.3g rad/s\n", before, after,
              norm(r.post_impact_end->base.angular_velocity));
  EXPECT_GT(before, 0.2);                                           // measured 0.219
  EXPECT_LT(after, 0.04);                                           // measured 0.0359
  EXPECT_LT(norm(r.post_impact_end->base.angular_velocity), 5e-4);  // measured 3.2e-4
}

// Captured, braked and held by wheels; thrusters unload the momentum of the target.
void expect_a_stack_at_rest(const CaptureResult& r) {
  const double turning = norm(r.post_impact_end->base.angular_velocity);
  double fullest = 0;
  for (const WheelReport& wheel : r.wheels) fullest = std::max(fullest, wheel.largest_rate / wheel.rate_limit);
  ASSERT_TRUE(r.thrusters && r.thrusters->dumping);
  std::printf("[ measured ] base %.3g rad/s, wheels to %.3g of their largest rates, %.3g kg of propellant\n", turning,
              fullest, r.thrusters->propellant);
  EXPECT_LT(turning, 1e-9);  // measured 6e-12
  EXPECT_GT(fullest, 0.5);
  EXPECT_LT(fullest, 1.0);  // measured 0.954
  EXPECT_GE(r.thrusters->dumping->begun, 1);
  EXPECT_FALSE(r.thrusters->dumping->active);
  EXPECT_GT(r.thrusters->propellant, 0.1);  // measured 0.204
  EXPECT_EQ(r.thrusters->excess(), 0);
  EXPECT_FALSE(r.thrusters->hazards.empty());
}

// The force between the grasps follows its reference, and the satellite remains in place.
void expect_a_squeeze(const CaptureResult& r) {
  expect_closed_loops(r, 12, {1.1, 0.8}, 1);
  const LawReport* law = r.law(LawReport::Law::grasp_force);
  ASSERT_TRUE(law && law->pairs.size() == 1);
  const LawReport& g = *law;
  std::printf("[ measured ] squeeze %.9g N, off by %.2g N at most; target off by %.2g m, %.2g rad\n", g.pairs[0].force,
              g.pairs[0].largest_error, g.largest_distance, g.largest_angle);
  EXPECT_EQ(g.ended, LawEnd::running);
  EXPECT_EQ(g.rank, 6);
  EXPECT_NEAR(g.pairs[0].force, 20, 1e-9);
  EXPECT_LT(g.pairs[0].largest_error, 1e-9);
}

// A run without a capture: no capture verdict, and the gravity gradient rotates the servicer.
void expect_a_coast(const CaptureResult& r) {
  EXPECT_FALSE(r.impact());
  ASSERT_EQ(r.phases.size(), 1u);
  EXPECT_EQ(r.phases[0].end, 1450);
  EXPECT_EQ(r.phases[0].ended, MotionPhaseReport::End::duration);
  const double turn =
      rotation_angle(transpose(pose_at(r, "base", 0).R) * pose_at(r, "base", r.series.time.size() - 1).R);
  std::printf("[ measured ] the base turns by %.4f rad\n", turn);
  EXPECT_GT(turn, 0.1);
}

// Thrusters end their phase at the stated rate; the wheels rotate the base by 60 deg and hold it.
void expect_a_manoeuvre(const CaptureResult& r) {
  EXPECT_FALSE(r.impact());
  ASSERT_EQ(r.phases.size(), 3u);
  EXPECT_EQ(r.phases[0].ended, MotionPhaseReport::End::condition);
  const double rate = norm(r.phases[0].at_end->base.angular_velocity);
  EXPECT_NEAR(rate, 0.2 * std::acos(-1.0) / 180, 1e-9);
  EXPECT_EQ(r.phases[1].ended, MotionPhaseReport::End::duration);
  const Rotationd R = pose_at(r, "base", r.series.time.size() - 1).R;
  const double turn = rotation_angle(R), left = norm(r.phases[2].at_end->base.angular_velocity);
  std::printf("[ measured ] rate %.9g rad/s after despinning; turn %.9g rad, rate %.2g rad/s at the end\n", rate, turn,
              left);
  EXPECT_NEAR(turn, std::acos(-1.0) / 3, 1e-6);
  EXPECT_LT(left, 1e-9);
}

// The values of a series with three components.
std::vector<Vector3d> vectors(const CaptureResult& r, const std::string& path) {
  std::vector<Vector3d> values;
  for (const Series& s : r.series.series) {
    for (std::size_t k = 0; s.path == path && 3 * k < s.data.size(); ++k)
      values.push_back({s.data[3 * k], s.data[3 * k + 1], s.data[3 * k + 2]});
  }
  return values;
}

// Magnetic torquers only brake: their torque m x B is perpendicular to the field and takes power at every instant. The
// error of a scenario without a field names the place.
void expect_magnetic_detumbling(const CaptureProblem& p, const CaptureResult& r) {
  const std::vector<Vector3d> m = vectors(r, "magnetic_torquers/dipole"), B = vectors(r, "magnetic_torquers/field");
  const std::vector<Vector3d> tau = vectors(r, "base/control_torque"), w = vectors(r, "base/angular_velocity");
  ASSERT_EQ(m.size(), r.series.time.size());
  double wrong = 0, along_field = 0, given = 0, least_power = 0;
  for (std::size_t k = 0; k < m.size(); ++k) {
    const double power = dot(pose_at(r, "base", k).R * tau[k], w[k]);
    EXPECT_LE(power, 1e-20);
    least_power = std::min(least_power, power);
    wrong = std::max(wrong, norm(tau[k] - cross(m[k], B[k])));
    along_field = std::max(along_field, std::abs(dot(tau[k], B[k])) / norm(B[k]));
    EXPECT_NEAR(norm(B[k]), 35e-6, 13e-6);  // [T], 500 km above the ground: B_0 (a/r)^3 to twice that
  }
  for (const Vector3d& torque : tau) given = std::max(given, norm(torque));
  std::printf("[ measured ] largest torque %.3g N m, %.2g along the field, off by %.2g; rate %.3g to %.3g rad/s\n",
              given, along_field, wrong, norm(w.front()), norm(w.back()));
  EXPECT_GT(given, 1e-4);
  EXPECT_LT(least_power, -1e-6);
  EXPECT_LT(wrong, 1e-17);
  EXPECT_LT(along_field, 1e-15 * given * 10);
  EXPECT_LT(norm(w.back()), 0.25 * norm(w.front()));
  ASSERT_EQ(r.actuators.size(), 3u);
  double saturated = 0;
  for (const ActuatorUse& use : r.actuators) {
    EXPECT_EQ(use.quantity, "magnetic_torquers/dipole");
    EXPECT_LE(use.largest, 20 * (1 + 1e-12));
    saturated = std::max(saturated, use.saturated);
  }
  std::printf("[ measured ] at the maximum dipole for up to %.4g s\n", saturated);
  EXPECT_GT(saturated, 10);
  // The external impulse, by which the ledger balances a change of the angular momentum.
  const std::vector<Vector3d> h = vectors(r, "system/angular_momentum");
  EXPECT_GT(norm(h.front()) - norm(h.back()), 0.1);  // [N m s]
  CaptureProblem without = p;
  without.orbit->magnetic_field.reset();
  const std::vector<ProblemFault> faults = problem_conflicts(without);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].path, "motion.base_control.actuators");
  EXPECT_THAT(faults[0].message, ::testing::HasSubstr("state orbit.magnetic_field"));
}

}  // namespace

ExampleChecks control_checks() {
  return {
      {"coast", of_result(expect_a_coast)},
      {"attitude-manoeuvre", of_result(expect_a_manoeuvre)},
      {"magnetic-detumble", expect_magnetic_detumbling},
      {"wheels-keep-attitude", expect_wheels_take_the_momentum},
      {"control-moment-gyros", expect_gyros_take_the_momentum},
      {"bias-momentum", expect_bias_is_reversed},
      {"orbit-detumble", of_result(expect_detumbling_in_orbit)},
      {"own-controller", of_result(expect_torques_brake)},
      {"detumble-envisat", of_result(expect_a_stack_at_rest)},
      {"noisy-sensors", of_result(expect_sensing)},
      {"dual-arm-squeeze", of_result(expect_a_squeeze)},
  };
}

// Without gravity gradient, as of one body with equal moments of inertia, the kinetic energy decreases monotonically.
TEST(MagneticTorquers, EnergyDecreasesMonotonically) {
  CaptureProblem p = load("magnetic-detumble");
  p.robot.bodies[0].inertia = Symmetric3d::diagonal(4.5, 4.5, 4.5);
  p.robot.bodies.resize(1), p.robot.geometry.clear();  // without its panels
  p.post_impact->duration = 600;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  const std::vector<Vector3d> w = vectors(r, "base/angular_velocity");
  for (std::size_t k = 1; k < w.size(); ++k) EXPECT_LT(norm(w[k]), norm(w[k - 1]));
}

}  // namespace grapnel::testing::examples_test
