#include "grapnel/impact/published_impact.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>

#include "grapnel/dynamics/free_floating.hpp"

namespace grapnel {
namespace {

std::string reason_undefined(const Model& model, int root, std::span<const Grasp> grasps) {
  if (grasps.empty()) return "no grasps";
  if (!model.has_free_root(root)) return "the base is fixed";
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    if (grasps[i].model != GraspModel::rigid) return "the formulas are for rigid grasps";
    for (std::size_t k = 0; k < i; ++k) {
      if (grasps[k].target_body == grasps[i].target_body) return "two arms grip one target";
    }
  }
  return {};
}

Eigen::VectorXd as_eigen(const Twistd& V) {
  Eigen::VectorXd x(6);
  x << V.angular[0], V.angular[1], V.angular[2], V.linear[0], V.linear[1], V.linear[2];
  return x;
}
Twistd as_twist(const Eigen::VectorXd& x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}; }

// J_t (2.15) with its lower-left block -[r x], and I_t (2.15) about the target's centre of mass, in W.
struct TargetTerms {
  Eigen::MatrixXd J_t, I_t;
  Twistd twist_com;
};
TargetTerms target_terms(const Model& model, const Kinematics& kinematics, const Grasp& g) {
  const BodyDescription& d = model.bodies()[g.target_body].description;
  const Posed& X_WT = kinematics.X_WB[g.target_body];
  const Vector3d r = g.p_WC - X_WT * d.com;
  const Symmetric3d I = rotate(X_WT.R, d.inertia);
  TargetTerms t;
  t.J_t = Eigen::MatrixXd::Identity(6, 6);
  t.J_t.bottomLeftCorner(3, 3) << 0, r[2], -r[1], -r[2], 0, r[0], r[1], -r[0], 0;
  t.I_t = Eigen::MatrixXd::Identity(6, 6) * d.mass;
  t.I_t.topLeftCorner(3, 3) << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
  t.twist_com = shift(kinematics.V_WB[g.target_body], X_WT.R * d.com);
  return t;
}

}  // namespace

PublishedImpact published_impact(const Model& model, const State& state, int root, std::span<const Grasp> grasps) {
  PublishedImpact result;
  result.undefined = reason_undefined(model, root, grasps);
  if (!result.undefined.empty()) return result;
  const Kinematics kinematics = forward_kinematics(model, state);
  const std::vector<int> joints = joint_velocities(model, root);
  const Eigen::Index n = static_cast<Eigen::Index>(joints.size()), r = static_cast<Eigen::Index>(grasps.size());
  Eigen::VectorXd rates(n);
  for (Eigen::Index i = 0; i < n; ++i) rates[i] = state.v[joints[i]];

  const Eigen::MatrixXd I = generalized_inertia(model, state, root);
  Eigen::MatrixXd J(6 * r, n);
  Eigen::MatrixXd G = I;          // (3.12)
  Eigen::VectorXd H = I * rates;  // (3.12)
  std::vector<TargetTerms> terms;
  for (Eigen::Index k = 0; k < r; ++k) {
    const Grasp& g = grasps[k];
    terms.push_back(target_terms(model, kinematics, g));
    const TargetTerms& t = terms.back();
    const Eigen::MatrixXd J_k = generalized_jacobian(model, state, root, g.robot_body, g.p_WC);
    J.middleRows(6 * k, 6) = J_k;
    const Eigen::MatrixXd C = t.J_t.partialPivLu().solve(J_k);  // J_t^-1 J
    G += C.transpose() * t.I_t * C;
    H += C.transpose() * t.I_t * as_eigen(t.twist_com);
  }
  const Eigen::VectorXd final_rates = G.llt().solve(H);  // (3.11)
  result.joint_rates.assign(final_rates.begin(), final_rates.end());

  // (3.8): J^T F = I (thetadot_f - thetadot_i).
  const Eigen::VectorXd dh = I * (final_rates - rates);
  const Eigen::VectorXd F = J.transpose().completeOrthogonalDecomposition().solve(dh);
  if ((J.transpose() * F - dh).norm() > 1e-9 * dh.norm()) {
    result.undefined = "I (thetadot_f - thetadot_i) is not in the range of J^T (3.8)";
    return result;
  }
  for (Eigen::Index k = 0; k < r; ++k) {
    const Eigen::VectorXd P = F.segment(6 * k, 6);
    result.contacts.push_back({{{P[0], P[1], P[2]}, {P[3], P[4], P[5]}}, {}});
  }

  // The momentum these velocities have: the base by (3.13) with the robot's momentum before, the targets by (3.10).
  const int roots[] = {root};
  const Vector3d com = center_of_mass(model, kinematics, roots);
  const Momentumd robot = momentum_about(model, kinematics, com, roots);
  State after = state;
  for (Eigen::Index i = 0; i < n; ++i) after.v[joints[i]] = final_rates[i];
  set_root_twist(model, root, base_twist_from_momentum(model, after, root, robot), after);
  for (Eigen::Index k = 0; k < r; ++k) {
    const Grasp& g = grasps[k];
    const Eigen::VectorXd t_f = terms[k].J_t.partialPivLu().solve(J.middleRows(6 * k, 6) * final_rates);  // (3.10)
    const Vector3d com_arm = kinematics.X_WB[g.target_body].R * model.bodies()[g.target_body].description.com;
    set_root_twist(model, g.target_body, shift(as_twist(t_f), -com_arm), after);
  }
  const Kinematics k_after = forward_kinematics(model, after);
  result.momentum_error =
      momentum_about(model, k_after, Vector3d::zero()) - momentum_about(model, kinematics, Vector3d::zero());
  return result;
}

}  // namespace grapnel
