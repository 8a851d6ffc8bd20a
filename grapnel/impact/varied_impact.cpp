#include "grapnel/impact/varied_impact.hpp"

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/dynamics/composite_body.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {
namespace {

// The system in dual numbers: kernels' tree, coordinates, and where its links are.
struct DualSystem {
  Tree<Dual> tree;
  std::vector<Dual> q;
  std::vector<LinkMotion<Dual>> motion;
};

Vector3<Dual> dual(const Vector3d& value, const Vector3d& derivative = Vector3d::zero()) {
  return {Dual{value[0], derivative[0]}, Dual{value[1], derivative[1]}, Dual{value[2], derivative[2]}};
}
Rotation<Dual> dual(const Rotationd& R) {
  Rotation<Dual> result;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result(i, j) = R(i, j);
  }
  return result;
}
Symmetric3<Dual> dual(const Symmetric3d& I, const Symmetric3d& d) {
  return {Dual{I.xx, d.xx}, Dual{I.yy, d.yy}, Dual{I.zz, d.zz}, Dual{I.xy, d.xy}, Dual{I.xz, d.xz}, Dual{I.yz, d.yz}};
}

DualSystem make_system(const Model& model, const State& state, const std::vector<double>& configuration) {
  DualSystem system{convert_tree<Dual>(model.tree()), {}, {}};
  std::vector<double> rates(state.q.size());
  coordinate_rates(model, state.q, configuration, rates);
  for (std::size_t i = 0; i < rates.size(); ++i) system.q.push_back({state.q[i], rates[i]});
  system.motion.resize(system.tree.links.size());
  link_motion<Dual>(system.tree, system.q, {}, system.motion);
  return system;
}

// Gives the link of the varied target the derivatives of its inertia.
void vary_target(const Model& model, const ImpactVariation& variation, Tree<Dual>& tree) {
  if (variation.target < 0) return;
  const Body& body = model.bodies()[variation.target];
  const BodyDescription& d = body.description;
  const Pose<Dual> X_LB{dual(body.placement.X_LB.R), dual(body.placement.X_LB.p)};
  const RigidBodyInertia<Dual> own = X_LB * RigidBodyInertia<Dual>::about_com(Dual{d.mass, variation.mass}, dual(d.com),
                                                                              dual(d.inertia, variation.inertia));
  // Values stay: the link may have other bodies merged into it.
  RigidBodyInertia<Dual>& link = tree.links[body.placement.link].inertia;
  link.mass.derivative = own.mass.derivative;
  for (int i = 0; i < 3; ++i) {
    link.first_moment[i].derivative = own.first_moment[i].derivative;
    for (int j = i; j < 3; ++j) link.rotational(i, j).derivative = own.rotational(i, j).derivative;
  }
}

void write_column(DualMatrix& J, int column, const Vector3<Dual>& angular, const Vector3<Dual>& linear) {
  for (int k = 0; k < 3; ++k) {
    J.value(k, column) = angular[k].value, J.derivative(k, column) = angular[k].derivative;
    J.value(3 + k, column) = linear[k].value, J.derivative(3 + k, column) = linear[k].derivative;
  }
}

// (1.4), (1.5) on the kernels' links: the twist of the body at the point p_WP per velocity, 6 x velocities.
DualMatrix body_jacobian(const Model& model, const DualSystem& system, int body, const Vector3<Dual>& p_WP) {
  DualMatrix J{Eigen::MatrixXd::Zero(6, model.velocities()), Eigen::MatrixXd::Zero(6, model.velocities())};
  for (int n = model.bodies()[body].placement.link; n >= 0; n = system.tree.links[n].parent) {
    const TreeLink<Dual>& link = system.tree.links[n];
    const Pose<Dual>& X = system.motion[n].X_WL;
    const Vector3<Dual> arm = p_WP - X.p;
    const auto turning = [&](int velocity, const Vector3<Dual>& axis) {
      write_column(J, velocity, axis, cross(axis, arm));
    };
    const auto travelling = [&](int velocity, const Vector3<Dual>& axis) {
      write_column(J, velocity, Vector3<Dual>::zero(), axis);
    };
    each_direction(link.joint, link.v, X.R, Dual(link.sign) * X.R.column(link.axis), turning, travelling);
  }
  return J;
}

// Product of a matrix with A from the left, by the rule of products.
DualMatrix multiply(const DualMatrix& A, const DualMatrix& B) {
  return {A.value * B.value, A.derivative * B.value + A.value * B.derivative};
}

DualMatrix vary_directions(const Grasp& grasp, const Vector3d& turn) {
  DualMatrix A{constrained_directions(grasp), {}};
  A.derivative = Eigen::MatrixXd::Zero(A.value.rows(), 6);
  if (grasp.model != GraspModel::hinge) return A;  // the others hold in all angular directions or in none
  for (int row = 0; row < 2; ++row) {
    const Vector3d change = cross(turn, Vector3d{A.value(row, 0), A.value(row, 1), A.value(row, 2)});
    for (int k = 0; k < 3; ++k) A.derivative(row, k) = change[k];
  }
  return A;
}

// J_t M_t^-1 J_t^T of one grasp's free target (5.2), 6 x 6: column by column the twist at the contact that a unit
// impulse there brings. The target itself does not move.
DualMatrix vary_mobility(const Model& model, const Kinematics& kinematics, const Grasp& grasp,
                         const Vector3<Dual>& p_WC, const ImpactVariation& variation) {
  const BodyDescription& d = model.bodies()[grasp.target_body].description;
  const bool varied = grasp.target_body == variation.target;
  const Posed& X_WT = kinematics.X_WB[grasp.target_body];
  const Dual mass{d.mass, varied ? variation.mass : 0.0};
  const SymmetricFactor3<Dual> I_c(
      rotate(dual(X_WT.R), dual(d.inertia, varied ? variation.inertia : Symmetric3d::zero())));
  const Vector3<Dual> r = p_WC - dual(X_WT * d.com);
  DualMatrix mobility{Eigen::MatrixXd(6, 6), Eigen::MatrixXd(6, 6)};
  for (int column = 0; column < 6; ++column) {
    const Vector3<Dual> couple = column < 3 ? Vector3<Dual>::unit(column) : Vector3<Dual>::zero();
    const Vector3<Dual> push = column < 3 ? Vector3<Dual>::zero() : Vector3<Dual>::unit(column - 3);
    const Vector3<Dual> w = I_c.solve(couple + cross(r, push));
    write_column(mobility, column, w, (Dual(1) / mass) * push + cross(w, r));
  }
  return mobility;
}

// M by the composite-body kernel.
DualMatrix vary_mass_matrix(const DualSystem& system) {
  const int n = system.tree.velocities;
  DynamicsWorkspace<Dual> workspace(system.tree);
  std::vector<Dual> M(static_cast<std::size_t>(n) * n);
  composite_body<Dual>(system.tree, system.q, workspace, M);
  DualMatrix result{Eigen::MatrixXd(n, n), Eigen::MatrixXd(n, n)};
  for (Eigen::Index i = 0; i < result.value.size(); ++i) {
    result.value.data()[i] = M[i].value;
    result.derivative.data()[i] = M[i].derivative;
  }
  return result;
}

// Rows of held rates: unit entries of J, and in D the diagonal of J M^-1 J^T, whose derivative is that of the inverse.
void vary_held(std::span<const HeldRate> held, Eigen::Index first_row, VariedImpact& impact) {
  if (held.empty()) return;
  const Eigen::LLT<Eigen::MatrixXd> mass(impact.M.value);
  for (std::size_t i = 0; i < held.size(); ++i) {
    const Eigen::Index row = first_row + static_cast<Eigen::Index>(i);
    impact.J.value(row, held[i].velocity) = 1;
    const Eigen::VectorXd alone = mass.solve(impact.J.value.row(row).transpose());
    impact.D.value(row, row) = alone[held[i].velocity];
    impact.D.derivative(row, row) = -alone.dot(impact.M.derivative * alone);
  }
}

}  // namespace

VariedImpact vary_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                         std::span<const HeldRate> held, const ImpactVariation& variation) {
  DualSystem system = make_system(model, state, variation.configuration);
  vary_target(model, variation, system.tree);
  const Kinematics kinematics = forward_kinematics(model, state);
  Eigen::Index rows = static_cast<Eigen::Index>(held.size());
  for (const Grasp& g : grasps) rows += row_count(g.model);

  VariedImpact impact;
  impact.M = vary_mass_matrix(system);
  const Eigen::MatrixXd empty_J = Eigen::MatrixXd::Zero(rows, model.velocities());
  const Eigen::MatrixXd empty_D = Eigen::MatrixXd::Zero(rows, rows);
  impact.J = {empty_J, empty_J};
  impact.D = {empty_D, empty_D};
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Grasp& g = grasps[i];
    const bool varied = static_cast<int>(i) == variation.grasp;
    const Vector3<Dual> p_WC = dual(g.p_WC, varied ? variation.contact : Vector3d::zero());
    const DualMatrix A = vary_directions(g, varied ? variation.turn : Vector3d::zero());
    DualMatrix relative = body_jacobian(model, system, g.robot_body, p_WC);
    const DualMatrix J_T = body_jacobian(model, system, g.target_body, p_WC);
    relative.value -= J_T.value, relative.derivative -= J_T.derivative;
    const DualMatrix J = multiply(A, relative);
    const DualMatrix A_transposed{A.value.transpose(), A.derivative.transpose()};
    const DualMatrix D = multiply(multiply(A, vary_mobility(model, kinematics, g, p_WC, variation)), A_transposed);
    const Eigen::Index count = A.value.rows();
    impact.J.value.middleRows(row, count) = J.value;
    impact.J.derivative.middleRows(row, count) = J.derivative;
    impact.D.value.block(row, row, count, count) = D.value;
    impact.D.derivative.block(row, row, count, count) = D.derivative;
    impact.directions.push_back(A);
    row += count;
  }
  vary_held(held, row, impact);
  return impact;
}

DualMatrix vary_end_effectors(const Model& model, const State& state, std::span<const Grasp> grasps,
                              const std::vector<double>& configuration) {
  const DualSystem system = make_system(model, state, configuration);
  const Eigen::MatrixXd empty = Eigen::MatrixXd::Zero(6 * static_cast<Eigen::Index>(grasps.size()), model.velocities());
  DualMatrix stacked{empty, empty};
  for (Eigen::Index row = 0; const Grasp& g : grasps) {
    const DualMatrix J = body_jacobian(model, system, g.robot_body, dual(g.p_WC));
    stacked.value.middleRows<6>(row) = J.value;
    stacked.derivative.middleRows<6>(row) = J.derivative;
    row += 6;
  }
  return stacked;
}

}  // namespace grapnel
