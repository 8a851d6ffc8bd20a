#include "grapnel/impact/published_impact.hpp"

#include <algorithm>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

std::string reason_undefined(const Model& model, int root, std::span<const Grasp> grasps) {
  if (grasps.empty()) return "no grasps";
  if (!model.has_free_root(root)) return "the base is fixed";
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    if (grasps[i].model != GraspModel::rigid) return "the formulas are for rigid grasps";
  }
  return {};
}

Eigen::VectorXd as_eigen(const Twistd& V) {
  Eigen::VectorXd x(6);
  x << V.angular[0], V.angular[1], V.angular[2], V.linear[0], V.linear[1], V.linear[2];
  return x;
}
Twistd as_twist(const Eigen::VectorXd& x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}; }

// One target with all its grasps: J_t (2.15) of each with its lower-left block -[r x], stacked, and I_t (2.15) about
// the target's centre of mass, in W.
struct TargetTerms {
  int body = -1;
  std::vector<Eigen::Index> grasps;
  Eigen::MatrixXd J_t, I_t;
  Twistd twist_com;
};

Eigen::MatrixXd grasp_map(const Vector3d& r) {
  Eigen::MatrixXd J_t = Eigen::MatrixXd::Identity(6, 6);
  J_t.bottomLeftCorner(3, 3) << 0, r[2], -r[1], -r[2], 0, r[0], r[1], -r[0], 0;
  return J_t;
}

// Grasps => per target its grasps, stacked J_t about the centre of mass, 6 x 6 inertia there and twist of the centre of
// mass, in W, T(2.15).
std::vector<TargetTerms> target_terms(const Model& model, const Kinematics& kinematics, std::span<const Grasp> grasps) {
  std::vector<TargetTerms> all;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Grasp& g = grasps[i];
    const BodyDescription& d = model.bodies()[g.target_body].description;
    const Posed& X_WT = kinematics.X_WB[g.target_body];
    auto t = std::find_if(all.begin(), all.end(), [&](const TargetTerms& x) { return x.body == g.target_body; });
    if (t == all.end()) {
      const Symmetric3d I = rotate(X_WT.R, d.inertia);
      TargetTerms terms;
      terms.body = g.target_body;
      terms.J_t = Eigen::MatrixXd(0, 6);
      terms.I_t = Eigen::MatrixXd::Identity(6, 6) * d.mass;
      terms.I_t.topLeftCorner(3, 3) << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
      terms.twist_com = shift(kinematics.V_WB[g.target_body], X_WT.R * d.com);
      t = all.insert(all.end(), std::move(terms));
    }
    t->grasps.push_back(static_cast<Eigen::Index>(i));
    t->J_t.conservativeResize(t->J_t.rows() + 6, 6);
    t->J_t.bottomRows(6) = grasp_map(g.p_WC - X_WT * d.com);
  }
  return all;
}

// J_t^-1 x; with several grasps J_t has more rows than columns, and the inverse is the least-squares one.
Eigen::MatrixXd divide_by(const Eigen::MatrixXd& J_t, const Eigen::MatrixXd& x) {
  if (J_t.rows() == 6) return lu_solution(J_t, x);
  return least_squares_solution(J_t, x);
}

// Velocities after, impulses F of (3.8) => rank, velocity residual, and the balances that they violate.
void evaluate_balances(const Model& model, const State& state, std::span<const Grasp> grasps, const Eigen::VectorXd& F,
                       ImpactSolution& s) {
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const Eigen::MatrixXd J = grasp_jacobian(model, forward_kinematics(model, state), grasps);
  const Eigen::Index n = model.velocities();
  const Eigen::VectorXd before = Eigen::Map<const Eigen::VectorXd>(state.v.data(), n);
  const Eigen::VectorXd after = Eigen::Map<const Eigen::VectorXd>(s.velocity.data(), n);
  s.status = ImpactSolution::Status::solved;
  s.rows = static_cast<int>(J.rows());
  s.rank = rank_of(J);
  const Eigen::VectorXd u = J * before, left = J * after, part = taking_part(model, J);
  s.constraint_residual =
      left.lpNorm<Eigen::Infinity>() /
      std::max({u.lpNorm<Eigen::Infinity>(), before.cwiseProduct(part).lpNorm<Eigen::Infinity>(), 1e-300});
  static_cast<ImpactChecks&>(s) = impact_checks(M, Cholesky(M), part, before, after, J.transpose() * F, 0.5 * F.dot(u));
}

}  // namespace

// State before, rigid grasps => joint rates, impulses and velocities by the formulas of the thesis (7.11), (7.12), and
// the balances that they violate. `message` states why the formulas do not apply. For comparison only.
ImpactSolution published_impact(const Model& model, const State& state, int root, std::span<const Grasp> grasps) {
  ImpactSolution result;
  result.message = reason_undefined(model, root, grasps);
  if (!result.message.empty()) return result;
  const Kinematics kinematics = forward_kinematics(model, state);
  const std::vector<int> joints = joint_velocities(model, root);
  const Eigen::Index n = static_cast<Eigen::Index>(joints.size()), r = static_cast<Eigen::Index>(grasps.size());
  Eigen::VectorXd rates(n);
  for (Eigen::Index i = 0; i < n; ++i) rates[i] = state.v[joints[i]];

  const Eigen::MatrixXd I = generalized_inertia(model, state, root);
  Eigen::MatrixXd J(6 * r, n);
  Eigen::MatrixXd G = I;          // (3.12)
  Eigen::VectorXd H = I * rates;  // (3.12)
  for (Eigen::Index k = 0; k < r; ++k) {
    J.middleRows(6 * k, 6) = generalized_jacobian(model, state, root, grasps[k].robot_body, grasps[k].p_WC);
  }
  const std::vector<TargetTerms> terms = target_terms(model, kinematics, grasps);
  std::vector<Eigen::MatrixXd> maps;  // J_t^-1 J of each target
  for (const TargetTerms& t : terms) {
    Eigen::MatrixXd J_k(t.J_t.rows(), n);
    for (std::size_t i = 0; i < t.grasps.size(); ++i) {
      J_k.middleRows(6 * static_cast<Eigen::Index>(i), 6) = J.middleRows(6 * t.grasps[i], 6);
    }
    maps.push_back(divide_by(t.J_t, J_k));
    const Eigen::MatrixXd& C = maps.back();
    G += C.transpose() * t.I_t * C;
    H += C.transpose() * t.I_t * as_eigen(t.twist_com);
  }
  const Eigen::VectorXd final_rates = cholesky_solution(Cholesky(G), H);  // (3.11)

  // (3.8): J^T F = I (thetadot_f - thetadot_i).
  const Eigen::VectorXd dh = I * (final_rates - rates);
  const Eigen::VectorXd F = least_norm_solution(J.transpose(), dh);
  if ((J.transpose() * F - dh).norm() > 1e-9 * dh.norm()) {
    result.message = "I (thetadot_f - thetadot_i) is not in the range of J^T (3.8)";
    return result;
  }
  for (Eigen::Index k = 0; k < r; ++k) {
    const Eigen::VectorXd P = F.segment(6 * k, 6);
    result.contacts.push_back({{{P[0], P[1], P[2]}, {P[3], P[4], P[5]}}, std::vector<bool>(6, true)});
  }

  // The base by (3.13) with the robot's momentum before, the targets by (3.10).
  const int roots[] = {root};
  const Vector3d com = center_of_mass(model, kinematics, roots);
  const Momentumd robot = momentum_about(model, kinematics, com, roots);
  State after = state;
  for (Eigen::Index i = 0; i < n; ++i) after.v[joints[i]] = final_rates[i];
  set_root_twist(model, root, base_twist_from_momentum(model, after, root, robot), after);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Eigen::VectorXd t_f = maps[i] * final_rates;  // (3.10)
    const int body = terms[i].body;
    const Vector3d com_arm = kinematics.X_WB[body].R * model.bodies()[body].description.com;
    set_root_twist(model, body, shift(as_twist(t_f), -com_arm), after);
  }
  result.velocity = after.v;
  evaluate_balances(model, state, grasps, F, result);
  return result;
}

}  // namespace grapnel
