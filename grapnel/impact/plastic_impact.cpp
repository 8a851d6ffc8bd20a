#include "grapnel/impact/plastic_impact.hpp"

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/impact/bilateral_rows.hpp"

namespace grapnel {

ImpactSolution plastic_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                              std::span<const HeldRate> held) {
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const BilateralRows rows = bilateral_rows(model, kinematics, M, grasps, held);
  return solve_rows(M, rows, state, rows.held_after, grasps, held);
}

}  // namespace grapnel
