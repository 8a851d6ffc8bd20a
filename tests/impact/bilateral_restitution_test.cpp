/// Restitution at bilateral grasps: u+ = -E u-.

#include "grapnel/impact/bilateral_restitution.hpp"
#include "grapnel/spatial/decompositions.hpp"

#include <gtest/gtest.h>

#include "impact/impact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace bilateral_restitution_test {

// Coefficients of all rows: equal to `all`, or random if `all` is negative.
std::vector<std::vector<double>> coefficients(const ImpactCase& c, Random& random, double all = -1) {
  std::vector<std::vector<double>> E;
  for (const Grasp& g : c.grasps) {
    E.emplace_back();
    for (int r = 0; r < row_count(g.model); ++r) E.back().push_back(all >= 0 ? all : random.uniform(0, 1));
  }
  return E;
}

// Equal coefficients are always consistent. Different coefficients are consistent if no row is redundant.
TEST(BilateralRestitution, ReboundAndEnergyIdentity) {
  Worst law("|u+ + E u-| over |u-|"), energy("energy identity over T-");
  int redundant = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    Random random(50000 + i);
    const bool deficient =
        plastic_impact(c.model, c.state, c.grasps).rank < plastic_impact(c.model, c.state, c.grasps).rows;
    redundant += deficient;
    const auto E = coefficients(c, random, deficient ? random.uniform(0, 1) : -1);
    const ImpactSolution b = bilateral_restitution(c.model, c.state, c.grasps, E);
    EXPECT_EQ(b.inconsistent, "");
    const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
    const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps);
    const Eigen::VectorXd u = J * eigen(c.state.v);
    Eigen::VectorXd e(u.size());
    for (Eigen::Index row = 0; const auto& grasp : E) {
      for (double x : grasp) e[row++] = x;
    }
    const Eigen::VectorXd thrown = e.cwiseProduct(u);
    EXPECT_LT(law.note((J * eigen(b.velocity) + thrown).norm() / u.norm(), i), 1e-10);  // measured 5.3e-14
    // (u + E u)^T W^+ (u - E u) / 2 with W = K K^T, K = J L^-T, M = L L^T. The pseudo-inverse is computed from K, whose
    // condition number is the square root of that of W. With W itself, nearly dependent rows (condition number 2e6 of
    // W) lose three more digits.
    const Eigen::MatrixXd K = M.llt().matrixL().solve(J.transpose()).transpose();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> pseudo_inverse;
    pseudo_inverse.setThreshold(1e-9);
    pseudo_inverse.compute(K);
    const double lost = 0.5 * pseudo_inverse.solve(u + thrown).dot(pseudo_inverse.solve(u - thrown));
    const double change = b.kinetic_energy_after - b.kinetic_energy_before;
    EXPECT_LT(energy.note(std::abs(change + lost) / b.kinetic_energy_before, i), 1e-10);  // measured 2.7e-13
  }
  EXPECT_GT(redundant, 20);
}

TEST(BilateralRestitution, ZeroEqualsPlasticImpact) {
  for (int i = 0; i < 100; ++i) {
    const ImpactCase c = random_impact(i);
    Random random(i);
    const ImpactSolution b = bilateral_restitution(c.model, c.state, c.grasps, coefficients(c, random, 0));
    EXPECT_EQ(b.velocity, plastic_impact(c.model, c.state, c.grasps).velocity);
  }
}

TEST(BilateralRestitution, NamesContradictoryRows) {
  int named = 0;
  for (int i = 0; i < kImpacts; ++i) {
    const ImpactCase c = random_impact(i);
    const ImpactSolution plastic = plastic_impact(c.model, c.state, c.grasps);
    if (plastic.rank == plastic.rows) continue;
    Random random(50000 + i);
    const ImpactSolution b = bilateral_restitution(c.model, c.state, c.grasps, coefficients(c, random));
    named += b.inconsistent.find("grasp ") != std::string::npos;
  }
  EXPECT_GT(named, 20);
}

TEST(BilateralRestitution, RejectsInvalidCoefficients) {
  const ImpactCase c = random_impact(7);
  Random random(7);
  auto E = coefficients(c, random);
  E[0][0] = 1.5;
  EXPECT_THROW(bilateral_restitution(c.model, c.state, c.grasps, E), std::invalid_argument);
  E[0].pop_back();
  EXPECT_THROW(bilateral_restitution(c.model, c.state, c.grasps, E), std::invalid_argument);
  E.clear();
  EXPECT_THROW(bilateral_restitution(c.model, c.state, c.grasps, E), std::invalid_argument);
}

}  // namespace bilateral_restitution_test
}  // namespace grapnel::testing
