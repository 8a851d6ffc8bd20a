#include "grapnel/integrate/runge_kutta_4.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "integrate/problems.hpp"

namespace grapnel {
namespace runge_kutta_4_test {

using problems::Coupled;
using problems::largest_difference;
using problems::RigidBody;
using problems::Vector;

struct Errors {
  double end;
  double dense;
};

Errors errors_with(double h) {
  RungeKutta4<double> stepper({.size = Coupled::kSize}, h);
  const Coupled rhs;
  stepper.start(rhs, 0.0, Coupled::exact(0.0), 4.0);
  Errors errors{0.0, 0.0};
  Vector y(2);
  while (stepper.status() == StepStatus::running) {
    stepper.step(rhs);
    const double t = 0.5 * (stepper.previous_time() + stepper.time());
    stepper.interpolate(rhs, t, y);
    errors.dense = std::max(errors.dense, largest_difference(y, Coupled::exact(t)));
  }
  EXPECT_EQ(stepper.statistics().rhs_evaluations, 4 * stepper.statistics().accepted + 1);
  errors.end = largest_difference(stepper.state(), Coupled::exact(4.0));
  return errors;
}

TEST(RungeKutta4, ConvergesWithOrder4) {
  const Errors coarse = errors_with(0.02), fine = errors_with(0.01);
  EXPECT_NEAR(std::log2(coarse.end / fine.end), 4.0, 0.1) << fine.end;  // measured 4 to within 0.02
  EXPECT_NEAR(std::log2(coarse.dense / fine.dense), 4.0, 0.2)
      << fine.dense;  // measured 4 to within 0.01, within a step
}

TEST(RungeKutta4, EndsExactlyOnItsGrid) {
  RungeKutta4<double> stepper({.size = Coupled::kSize}, 0.1);
  const Coupled rhs;
  stepper.start(rhs, 0.0, Coupled::exact(0.0), 0.35);
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_EQ(stepper.time(), 0.35);
  EXPECT_EQ(stepper.statistics().accepted, 4);
  stepper.set_end_time(1.0);  // back to the grid: 0.4, 0.5, … 1
  EXPECT_EQ(stepper.step(rhs), StepStatus::running);
  EXPECT_DOUBLE_EQ(stepper.time(), 0.4);
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_EQ(stepper.time(), 1.0);
  EXPECT_EQ(stepper.statistics().accepted, 11);
  stepper.start(rhs, 1.0, Coupled::exact(1.0), 0.0);  // and backwards
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_EQ(stepper.time(), 0.0);
  EXPECT_EQ(stepper.statistics().accepted, 10);
  EXPECT_LT(largest_difference(stepper.state(), Coupled::exact(0.0)), 1e-4);  // measured 1.5e-5
}

TEST(RungeKutta4, QuaternionsStayNormalized) {
  const RigidBody body{{3.0, 2.0, 1.0}};
  RungeKutta4<double> stepper(RigidBody::manifold(), 0.02);
  const Vector y0 = {1, 0, 0, 0, 1.1, 0.1, 0.4};
  stepper.start(body, 0.0, y0, 20.0);
  Vector y(7);
  while (stepper.status() == StepStatus::running) {
    stepper.step(body);
    stepper.interpolate(body, 0.5 * (stepper.previous_time() + stepper.time()), y);
    for (const double* q : {stepper.state().data(), static_cast<const double*>(y.data())}) {
      EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1.0, 1e-15);
    }
  }
  EXPECT_GT(stepper.statistics().largest_quaternion_defect, 0.0);
  EXPECT_LT(stepper.statistics().largest_quaternion_defect, 1e-9);  // measured 1.2e-13
  EXPECT_LT(largest_difference(body.angular_momentum(stepper.state()), body.angular_momentum(y0)),
            1e-6);  // measured 8.3e-9
}

TEST(RungeKutta4, FailuresAreReported) {
  EXPECT_THROW(RungeKutta4<double>({.size = 1}, 0.0), std::invalid_argument);
  RungeKutta4<double> stepper({.size = 1}, 0.1);
  Vector y(1);
  EXPECT_THROW(stepper.interpolate(0.0, y), std::logic_error);
  const auto rhs = [](double t, std::span<const double>, std::span<double> dydt) {
    dydt[0] = t < 0.75 ? 1.0 : std::nan("");
  };
  stepper.start(rhs, 0.0, Vector{0.0}, 2.0);
  while (stepper.step(rhs) == StepStatus::running) {
  }
  EXPECT_EQ(stepper.status(), StepStatus::non_finite);
  EXPECT_DOUBLE_EQ(stepper.time(), 0.7);
  RungeKutta4<double> tiny({.size = 1}, 1e-20);
  tiny.start(rhs, 0.5, Vector{0.0}, 0.6);
  EXPECT_EQ(tiny.step(rhs), StepStatus::step_too_small);
}

}  // namespace runge_kutta_4_test
}  // namespace grapnel
