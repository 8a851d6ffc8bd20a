// Torque-free rotation against exact solutions: the quaternion on its manifold.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "integrate/problems.hpp"

namespace grapnel {
namespace rigid_body_test {

using problems::largest_difference;
using problems::multiply;
using problems::RigidBody;
using problems::Vector;

// Axisymmetric top (I1 = I2): the body turns about its axis at the constant rate (1 − I3/I1) ω3 against a frame that
// precesses about the angular momentum at |h|/I1 (Goldstein, Classical Mechanics, 5.6).
Vector axisymmetric_top(const std::array<double, 3>& inertia, const Vector& y0, double t) {
  const std::array<double, 4> q0 = {y0[0], y0[1], y0[2], y0[3]};
  const std::array<double, 3> h = {inertia[0] * y0[4], inertia[0] * y0[5], inertia[2] * y0[6]};  // in B at t = 0
  const double magnitude = std::hypot(h[0], h[1], h[2]);
  const double precession = 0.5 * magnitude / inertia[0] * t;
  const double spin = (1.0 - inertia[2] / inertia[0]) * y0[6] * t;
  const double s = std::sin(precession) / magnitude;
  const std::array<double, 4> about_h = {std::cos(precession), s * h[0], s * h[1], s * h[2]};
  const std::array<double, 4> about_axis = {std::cos(0.5 * spin), 0.0, 0.0, std::sin(0.5 * spin)};
  const std::array<double, 4> q = multiply(q0, multiply(about_h, about_axis));
  // ω in B is the initial one turned back by the spin.
  const double c = std::cos(spin), d = std::sin(spin);
  return {q[0], q[1], q[2], q[3], c * y0[4] + d * y0[5], c * y0[5] - d * y0[4], y0[6]};
}

TEST(RigidBodyMotion, AxisymmetricTopAgainstClosedForm) {
  for (const double axial : {0.5, 1.7}) {  // prolate, oblate
    const RigidBody body{{1.0, 1.0, axial}};
    const Vector y0 = {0.5, 0.5, -0.5, 0.5, 0.4, -0.3, 0.8};
    const Tolerances tolerances{.rtol = 1e-12, .atol = 1e-12};
    DormandPrince853<double> stepper(RigidBody::manifold(), tolerances);
    stepper.start(body, 0.0, y0, 100.0);
    double error = 0.0, dense_error = 0.0, dense_norm = 0.0;
    Vector y(RigidBody::kSize);
    while (stepper.status() == StepStatus::running) {
      stepper.step(body);
      error = std::max(error, largest_difference(stepper.state(), axisymmetric_top(body.inertia, y0, stepper.time())));
      const double t = 0.4 * stepper.previous_time() + 0.6 * stepper.time();
      stepper.interpolate(body, t, y);
      dense_error = std::max(dense_error, largest_difference(y, axisymmetric_top(body.inertia, y0, t)));
      dense_norm = std::max(dense_norm, std::abs(std::hypot(std::hypot(y[0], y[1]), std::hypot(y[2], y[3])) - 1.0));
    }
    ASSERT_EQ(stepper.status(), StepStatus::finished);
    EXPECT_LT(error, 1e-10);        // measured at most 2e-11
    EXPECT_LT(dense_error, 1e-10);  // measured at most 2e-11
    EXPECT_LT(dense_norm, 1e-15);   // measured 2.2e-16
  }
}

// Triaxial body, I1 > I2 > I3, with h² > 2 T I2: ω = (A dn, B sn, C cn) of λt (Landau & Lifshitz, Mechanics, §37).
TEST(RigidBodyMotion, TriaxialBodyAgainstEllipticFunctions) {
  const RigidBody body{{3.0, 2.0, 1.0}};
  const auto& [i1, i2, i3] = body.inertia;
  const double w1 = 1.1, w3 = 0.4;  // at t = 0, where ω2 = 0
  const double energy2 = i1 * w1 * w1 + i3 * w3 * w3;
  const double momentum2 = i1 * i1 * w1 * w1 + i3 * i3 * w3 * w3;
  ASSERT_GT(momentum2, energy2 * i2);
  const double rate = std::sqrt((i1 - i2) * (momentum2 - energy2 * i3) / (i1 * i2 * i3));
  const double m = (i2 - i3) * (energy2 * i1 - momentum2) / ((i1 - i2) * (momentum2 - energy2 * i3));
  const double b = std::sqrt((energy2 * i1 - momentum2) / (i2 * (i1 - i2)));
  ASSERT_GT(m, 0.01);  // far from the axisymmetric limit
  ASSERT_LT(m, 1.0);

  const Vector y0 = {0.5, 0.5, -0.5, 0.5, w1, 0.0, w3};
  DormandPrince853<double> stepper(RigidBody::manifold(), {.rtol = 1e-13, .atol = 1e-13});
  stepper.start(body, 0.0, y0, 200.0);
  const auto momentum0 = body.angular_momentum(y0);
  const double energy0 = body.kinetic_energy(y0);
  double rate_error = 0.0, momentum_error = 0.0, energy_error = 0.0;
  while (stepper.status() == StepStatus::running) {
    stepper.step(body);
    const auto y = stepper.state();
    const problems::Elliptic f = problems::jacobi_elliptic(rate * stepper.time(), m);
    // dω2/dt = (I3 − I1)/I2 ω3 ω1 < 0 at the start
    const Vector exact = {w1 * f.dn, -b * f.sn, w3 * f.cn};
    rate_error = std::max(rate_error, largest_difference(exact, y.last(3)));
    momentum_error = std::max(momentum_error, largest_difference(momentum0, body.angular_momentum(y)));
    energy_error = std::max(energy_error, std::abs(body.kinetic_energy(y) - energy0));
  }
  ASSERT_EQ(stepper.status(), StepStatus::finished);
  EXPECT_LT(rate_error, 1e-11);              // measured 1.3e-12
  ASSERT_GT(std::sqrt(momentum2), 3.0);      // what is conserved is not zero
  EXPECT_LT(momentum_error, 1e-11);          // measured 1.7e-12
  EXPECT_LT(energy_error / energy0, 1e-11);  // measured 3.3e-13
  const IntegrationStatistics& statistics = stepper.statistics();
  EXPECT_GT(statistics.largest_quaternion_defect, 0.0);
  EXPECT_LT(statistics.largest_quaternion_defect, 1e-13);  // measured 1.2e-15
  EXPECT_GE(statistics.sum_of_quaternion_corrections, statistics.largest_quaternion_defect);
  EXPECT_LT(statistics.sum_of_quaternion_corrections, 1e-11);  // measured 5.4e-13
}

// The norm error removed by renormalization decreases with the tolerance.
TEST(RigidBodyMotion, QuaternionDefectFollowsTheTolerance) {
  const RigidBody body{{3.0, 2.0, 1.0}};
  double previous = 1.0;
  for (const double tolerance : {1e-5, 1e-8, 1e-11}) {
    DormandPrince853<double> stepper(RigidBody::manifold(), {.rtol = tolerance, .atol = tolerance});
    stepper.start(body, 0.0, Vector{1, 0, 0, 0, 1.1, 0.1, 0.4}, 50.0);
    while (stepper.step(body) == StepStatus::running) {
    }
    const double defect = stepper.statistics().largest_quaternion_defect;
    EXPECT_LT(defect, 10.0 * tolerance);  // measured 0.03 … 0.12 times
    EXPECT_LT(defect, 0.1 * previous);
    previous = defect;
  }
}

// The same motion in another inertial frame takes the same steps: the error norm is independent of orientation.
TEST(RigidBodyMotion, StepsDoNotDependOnTheInertialFrame) {
  const RigidBody body{{3.0, 2.0, 1.0}};
  const auto steps = [&](const Vector& y0) {
    DormandPrince853<double> stepper(RigidBody::manifold(), {.rtol = 1e-9, .atol = 1e-9});
    stepper.start(body, 0.0, y0, 20.0);
    std::vector<double> times;
    while (stepper.step(body) == StepStatus::running) times.push_back(stepper.time());
    return times;
  };
  const std::vector<double> a = steps({1, 0, 0, 0, 1.1, 0.1, 0.4});
  const std::vector<double> b = steps({0.1, -0.7, 0.5, 0.5, 1.1, 0.1, 0.4});
  ASSERT_EQ(a.size(), b.size());
  EXPECT_LT(largest_difference(a, b), 1e-8);  // measured 2e-9
}

}  // namespace rigid_body_test
}  // namespace grapnel
