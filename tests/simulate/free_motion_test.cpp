/// Motion without external forces: exact torque-free motion, recovered against integrated base velocities, backward
/// integration, limits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "oracle/free_body.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace free_motion_test {

TEST(FreeBody, SymmetricTopIsExact) {
  Worst worst("pose of a symmetric top against the closed form");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const double transverse = random.uniform(1, 5);
    const oracle::SymmetricTop top{transverse,
                                   random.uniform(0.2, 1.9) * transverse,
                                   {random.rotation(), random.vector(2)},
                                   random.vector(1.5),
                                   random.vector(0.5)};
    const Model model = one_body(Symmetric3d::diagonal(top.transverse, top.transverse, top.axial));
    State start = zero_state(model);
    set_root_pose(model, 0, top.X_WB, start);
    set_root_twist(model, 0, {top.X_WB.R * top.w_B, top.v_W}, start);
    PhaseDynamics dynamics(model, {});
    simulate_phase(dynamics, {start, 0, 20, 2}, {}, {.observe = [&](const PhaseSample& s) {
                     const Posed X = root_pose(model, s.state, 0), exact = top.pose(s.time);
                     EXPECT_LT(worst.note(norm(X.p - exact.p) + rotation_angle(transpose(exact.R) * X.R), i), 1e-9);
                   }});
  }
}

// Jacobi's sn, cn, dn by descending Landen (Gauss) transformations; parameter m = k^2.
struct Jacobi {
  double sn, cn, dn;
};
Jacobi jacobi(double u, double m) {
  double a[20], c[20];
  a[0] = 1, c[0] = std::sqrt(m);
  double b = std::sqrt(1 - m);
  int n = 0;
  while (std::abs(c[n]) > 1e-16 && n < 18) {
    a[n + 1] = 0.5 * (a[n] + b), c[n + 1] = 0.5 * (a[n] - b), b = std::sqrt(a[n] * b), ++n;
  }
  double phi = std::ldexp(a[n] * u, n);
  for (; n > 0; --n) phi = 0.5 * (phi + std::asin(c[n] / a[n] * std::sin(phi)));
  const double sn = std::sin(phi);
  return {sn, std::cos(phi), std::sqrt(1 - m * sn * sn)};
}

// A tumbling target with I1 > I2 > I3 and h^2 > 2 T I2, and a frame away from its centre of mass: w = (A dn, B sn, C
// cn) of l t (Landau & Lifshitz, Mechanics, section 37), h constant.
TEST(FreeBody, TriaxialTargetIsJacobis) {
  const double I1 = 3, I2 = 2, I3 = 1.3, A = 1.1, C = 0.4;
  const double l = A * std::sqrt((I1 - I2) * (I1 - I3) / (I2 * I3));
  const double B = -C * std::sqrt(I3 * (I1 - I3) / (I2 * (I1 - I2)));
  const double m = (I2 - I3) * I3 * C * C / ((I1 - I2) * I1 * A * A);
  ASSERT_LT(m, 1);
  const Vector3d com{0.2, -0.3, 0.1};
  const Model model = one_body(Symmetric3d::diagonal(I1, I2, I3), com);
  State start = zero_state(model);
  const Rotationd R = rotation_about({0.6, 0, 0.8}, 2);
  const Vector3d v_com{0.1, 0.2, -0.1};
  set_root_pose(model, 0, {R, {4, 5, 6}}, start);
  set_root_twist(model, 0, shift(Twistd{R * Vector3d{A, 0, C}, v_com}, R * (-com)), start);
  const Vector3d h = R * Vector3d{I1 * A, 0, I3 * C};
  PhaseDynamics dynamics(model, {});
  double rates = 0, momenta = 0, path = 0;
  simulate_phase(dynamics, {start, 0, 40, 1}, {}, {.observe = [&](const PhaseSample& s) {
                   const Jacobi j = jacobi(l * s.time, m);
                   const Posed X = root_pose(model, s.state, 0);
                   const Vector3d w{s.state.v[0], s.state.v[1], s.state.v[2]};
                   rates = std::max(rates, norm(w - Vector3d{A * j.dn, B * j.sn, C * j.cn}));
                   momenta = std::max(momenta, norm(X.R * Vector3d{I1 * w[0], I2 * w[1], I3 * w[2]} - h));
                   path = std::max(path, norm(X * com - (Vector3d{4, 5, 6} + R * com + s.time * v_com)));
                 }});
  std::printf("[ measured ] triaxial: rates %.3g, momentum %.3g, path %.3g\n", rates, momenta, path);
  EXPECT_LT(rates, 1e-9);
  EXPECT_LT(momenta, 1e-13);
  EXPECT_LT(path, 1e-10);
}

struct Robot {
  Model model;
  State state;
  std::vector<JointDrive> drives;
};
Robot random_robot(int i, JointControl control = JointControl::free) {
  Random random(i);
  RobotOptions options;
  options.max_bodies = 8;
  options.targets = i % 2;
  Model model = random_model(options, random);
  State state = random_state(model, random, 0.4);
  std::vector<JointDrive> drives = random_drives(model, state, control, 5, random);
  return {std::move(model), std::move(state), std::move(drives)};
}

// Momentum of every tree about its centre of mass, summed over bodies. (About a fixed point the integration error of
// the centre of mass would contribute.)
std::vector<Momentumd> tree_momenta(const Model& model, const State& state) {
  const Kinematics k = forward_kinematics(model, state);
  std::vector<Momentumd> momenta;
  for (int b = 0; b < static_cast<int>(model.bodies().size()); ++b) {
    if (model.bodies()[b].parent >= 0) continue;
    const int roots[] = {b};
    momenta.push_back(momentum_about(model, k, center_of_mass(model, k, roots), roots));
  }
  return momenta;
}

struct Drift {
  double linear = 0, angular = 0;
};
Drift drift(const Robot& r, bool recover, const IntegrationSetup& integration, State& end, MomentumDefect& correction) {
  PhaseSetup setup;
  setup.drives = r.drives;
  setup.recover_roots = recover;
  PhaseDynamics dynamics(r.model, setup);
  const std::vector<Momentumd> before = tree_momenta(r.model, r.state);
  Drift d;
  const PhaseOutcome o = simulate_phase(
      dynamics, {r.state, 0, 5, 0.5}, integration, {.observe = [&](const PhaseSample& s) {
        const std::vector<Momentumd> now = tree_momenta(r.model, s.state);
        for (std::size_t i = 0; i < now.size(); ++i) {
          EXPECT_GT(norm(before[i].linear), 0.01);
          EXPECT_GT(norm(before[i].angular), 0.001);
          d.linear = std::max(d.linear, norm(now[i].linear - before[i].linear) / norm(before[i].linear));
          d.angular = std::max(d.angular, norm(now[i].angular - before[i].angular) / norm(before[i].angular));
        }
      }});
  EXPECT_TRUE(o.finished) << o.failure;
  end = o.end_state;
  correction = o.momentum_corrected;
  return d;
}

TEST(RecoveredRoots, RoundingLevelDriftAtLooseTolerance) {
  Worst recovered("recovered, tolerance 1e-6"), integrated("integrated, tolerance 1e-6");
  IntegrationSetup loose;
  loose.relative_tolerance = loose.absolute_tolerance = 1e-6;
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Robot r = random_robot(i, i % 3 == 0   ? JointControl::pd
                                    : i % 3 == 1 ? JointControl::prescribed
                                                 : JointControl::free);
    State end;
    MomentumDefect correction;
    const Drift with = drift(r, true, loose, end, correction);
    EXPECT_LT(recovered.note(std::max(with.linear, with.angular), i), 1e-12);
    EXPECT_GT(correction.linear + correction.angular, 0);
    const Drift without = drift(r, false, loose, end, correction);
    integrated.note(std::max(without.linear, without.angular), i);
    EXPECT_EQ(correction.linear + correction.angular, 0);
  }
  EXPECT_GT(integrated.value(), 1e-9);  // drift that recovery avoids
}

TEST(RecoveredRoots, AgreeWithIntegratedOnes) {
  Worst worst("end states, recovered against integrated");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Robot r = random_robot(i, i % 3 == 0   ? JointControl::pd
                                    : i % 3 == 1 ? JointControl::prescribed
                                                 : JointControl::free);
    State a, b;
    MomentumDefect correction;
    drift(r, true, {}, a, correction);
    drift(r, false, {}, b, correction);
    EXPECT_LT(worst.note(difference(a, b), i), 1e-7);
  }
}

TEST(Backwards, ReturnsToTheStart) {
  Worst worst("there and back");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Robot r = random_robot(i);
    PhaseDynamics dynamics(r.model, {});
    const PhaseOutcome there = simulate_phase(dynamics, {r.state, 0, 2});
    std::vector<double> times;
    const PhaseOutcome back = simulate_phase(dynamics, {there.end_state, 2, 0, 0.75}, {},
                                             {.observe = [&](const PhaseSample& s) { times.push_back(s.time); }});
    ASSERT_TRUE(back.finished);
    EXPECT_EQ(back.end_time, 0);
    EXPECT_THAT(times, ::testing::ElementsAre(2, 1.25, 0.5, 0));
    EXPECT_GT(difference(there.end_state, r.state), 0.1);
    EXPECT_LT(worst.note(difference(back.end_state, r.state), i), 1e-7);
  }
}

TEST(SimulatePhase, SamplesAtGridAndEnd) {
  const Robot r = random_robot(1);
  PhaseDynamics dynamics(r.model, {});
  std::vector<double> times;
  const auto note = [&](const PhaseSample& s) { times.push_back(s.time); };
  simulate_phase(dynamics, {r.state, 1, 2, 0.3}, {}, {.observe = note});
  EXPECT_THAT(times, ::testing::ElementsAre(1, 1.3, 1.6, 1.9, 2));
  times.clear();
  simulate_phase(dynamics, {r.state, 0, 1, 0.1}, {}, {.observe = note});
  ASSERT_EQ(times.size(), 11u);  // one sample at the end, although 10 * 0.1 rounds
  EXPECT_EQ(times.back(), 1);
  times.clear();
  simulate_phase(dynamics, {r.state, 0, 1}, {}, {.observe = note});
  EXPECT_THAT(times, ::testing::ElementsAre(0, 1));
  times.clear();
  simulate_phase(dynamics, {r.state, 4, 4, 0.1}, {}, {.observe = note});
  EXPECT_THAT(times, ::testing::ElementsAre(4));
}

TEST(SimulatePhase, Rk4ConvergesToTheAdaptiveResult) {
  const Robot r = random_robot(2);
  PhaseDynamics dynamics(r.model, {});
  const State fine = simulate_phase(dynamics, {r.state, 0, 1}).end_state;
  const auto error = [&](double step) {
    IntegrationSetup setup;
    setup.method = IntegrationSetup::Method::rk4;
    setup.step = step;
    return difference(simulate_phase(dynamics, {r.state, 0, 1}, setup).end_state, fine);
  };
  const double coarse = error(1.0 / 20), half = error(1.0 / 40);
  std::printf("[ measured ] RK4 errors %.3g, %.3g\n", coarse, half);
  EXPECT_NEAR(coarse / half, 16, 3);
}

TEST(SimulatePhase, ReportsFailureTime) {
  const Robot r = random_robot(1);
  PhaseDynamics dynamics(r.model, {});
  IntegrationSetup setup;
  setup.max_steps = 3;
  const PhaseOutcome o = simulate_phase(dynamics, {r.state, 0, 100, 1}, setup);
  EXPECT_FALSE(o.finished);
  EXPECT_THAT(o.failure, ::testing::HasSubstr("the limit on the number of steps is used up"));
  EXPECT_GT(o.end_time, 0);
  EXPECT_LT(o.end_time, 100);
  EXPECT_EQ(o.end_state.q.size(), r.state.q.size());
  EXPECT_EQ(o.steps + o.rejected, 3);
}

}  // namespace free_motion_test
}  // namespace grapnel::testing
