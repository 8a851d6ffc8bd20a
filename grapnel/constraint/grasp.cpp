#include "grapnel/constraint/grasp.hpp"

#include <cmath>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

// Grasp => rows of a twist [angular; linear] in W that it prevents: the three translations, except for `orientation`
// and `axis`; for `rigid` and `orientation` all rotations, for `hinge` and `axis` two normal to the axis.
Eigen::MatrixXd constrained_directions(const Grasp& grasp) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(row_count(grasp.model), 6);
  const int linear = linear_row_count(grasp.model), first = row_count(grasp.model) - linear;
  for (int k = 0; k < linear; ++k) A(first + k, 3 + k) = 1;
  if (grasp.model == GraspModel::rigid || grasp.model == GraspModel::orientation) {
    for (int k = 0; k < 3; ++k) A(k, k) = 1;
  } else if (turns_about_axis(grasp.model)) {
    // Two directions normal to the axis.
    const Rotationd R = rotation_between({0, 0, 1}, grasp.hinge_W);
    for (int k = 0; k < 3; ++k) A(0, k) = R.column(0)[k], A(1, k) = R.column(1)[k];
  }
  return A;
}

// Grasps => stacked J, rows x velocities: constrained components of the relative point Jacobian.
Eigen::MatrixXd grasp_jacobian(const Model& model, const Kinematics& kinematics, std::span<const Grasp> grasps) {
  int rows = 0;
  for (const Grasp& g : grasps) rows += row_count(g.model);
  Eigen::MatrixXd J(rows, model.velocities());
  Eigen::MatrixXd J_E(6, model.velocities()), J_T(6, model.velocities());
  int row = 0;
  for (const Grasp& g : grasps) {
    point_jacobian(model, kinematics, g.robot_body, g.p_WC, J_E);
    point_jacobian(model, kinematics, g.target_body, g.p_WC, J_T);
    J.middleRows(row, row_count(g.model)) = constrained_directions(g) * (J_E - J_T);
    row += row_count(g.model);
  }
  return J;
}

// Grasp => J_t M_t^-1 J_t^T of the free target, rows x rows, by (2.15).
Eigen::MatrixXd target_mobility(const Model& model, const Kinematics& kinematics, const Grasp& grasp) {
  // About the centre of mass M_t = diag(I_c, m 1) and J_t = [1 0; -[r x] 1] (2.15), so that
  // J_t M_t^-1 J_t^T = [I_c^-1, I_c^-1 [r x]; -[r x] I_c^-1, 1/m - [r x] I_c^-1 [r x]].
  const BodyDescription& d = model.bodies().at(grasp.target_body).description;
  const Posed& X_WT = kinematics.X_WB[grasp.target_body];
  const Symmetric3d I = rotate(X_WT.R, d.inertia);
  Eigen::Matrix3d I_c;
  I_c << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
  const Vector3d r = grasp.p_WC - X_WT * d.com;
  Eigen::Matrix3d r_cross;
  r_cross << 0, -r[2], r[1], r[2], 0, -r[0], -r[1], r[0], 0;
  Eigen::MatrixXd J_t = Eigen::MatrixXd::Identity(6, 6);
  J_t.bottomLeftCorner<3, 3>() = -r_cross;
  Eigen::MatrixXd M_inverse = Eigen::MatrixXd::Zero(6, 6);
  M_inverse.topLeftCorner<3, 3>() = I_c.inverse();
  M_inverse.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() / d.mass;
  const Eigen::MatrixXd A = constrained_directions(grasp) * J_t;
  return A * M_inverse * A.transpose();
}

}  // namespace grapnel
