/// Mass matrix, Jacobian and metric of an impact by dual numbers: values against the ordinary kernels, derivatives
/// against their differences.

#include "grapnel/impact/impulse_sensitivity.hpp"

#include <gtest/gtest.h>

#include "impact/impact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace varied_impact_test {

// What the derivatives are made of: values are those of the ordinary kernels, bit for bit or to rounding.
TEST(VariedImpact, ValuesMatchPlainKernels) {
  Worst worst("M, J and D from dual numbers");
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const VariedImpact d = vary_impact(c.model, c.state, c.grasps, {}, ImpactVariation(c.model));
    const Kinematics k = forward_kinematics(c.model, c.state);
    EXPECT_LT(worst.note(relative_difference(d.M.value, mass_matrix(c.model, c.state)), i),
              1e-14);  // measured 5e-16, all three
    EXPECT_LT(worst.note(relative_difference(d.J.value, grasp_jacobian(c.model, k, c.grasps)), i), 1e-14);
    const Eigen::MatrixXd D = target_mobility(c.model, k, c.grasps[0]);
    EXPECT_LT(worst.note(relative_difference(d.D.value.topLeftCorner(D.rows(), D.cols()), D), i), 1e-12);
    EXPECT_EQ(d.M.derivative.norm() + d.J.derivative.norm() + d.D.derivative.norm(), 0);
  }
}

// Mass matrix and Jacobian along a motion of all coordinates, spherical joints and free roots included.
TEST(VariedImpact, DerivativesOfTheKernels) {
  Worst mass("M'"), jacobian("J'");
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    Random random(5000 + i);
    ImpactVariation variation(c.model);
    variation.configuration = random.values(c.model.velocities(), 1);
    const VariedImpact d = vary_impact(c.model, c.state, c.grasps, {}, variation);
    std::vector<double> rates(c.state.q.size());
    coordinate_rates(c.model, c.state.q, variation.configuration, rates);
    const auto moved = [&](double step) {
      State s = c.state;
      for (std::size_t n = 0; n < s.q.size(); ++n) s.q[n] += step * rates[n];
      return s;  // quaternions lose their unit length in second order only
    };
    const double h = 1e-5;
    const State up = moved(h), down = moved(-h);
    const Eigen::MatrixXd dM = (mass_matrix(c.model, up) - mass_matrix(c.model, down)) / (2 * h);
    const Eigen::MatrixXd dJ = (grasp_jacobian(c.model, forward_kinematics(c.model, up), c.grasps) -
                                grasp_jacobian(c.model, forward_kinematics(c.model, down), c.grasps)) /
                               (2 * h);
    EXPECT_LT(mass.note((d.M.derivative - dM).norm() / mass_matrix(c.model, c.state).norm(), i),
              1e-8);                                                                     // measured 1.2e-10
    EXPECT_LT(jacobian.note((d.J.derivative - dJ).norm() / d.J.value.norm(), i), 1e-8);  // measured 1.1e-10
  }
}

}  // namespace varied_impact_test
}  // namespace grapnel::testing
