#include "grapnel/dynamics/free_floating.hpp"

#include <stdexcept>

#include "grapnel/dynamics/workspace.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

bool free_root(const Model& model, int root) {
  if (model.bodies().at(root).parent >= 0)
    throw std::invalid_argument("free-floating functions: 'root' must be a root body");
  return model.has_free_root(root);
}

Eigen::MatrixXd select(const Eigen::MatrixXd& A, const std::vector<int>& rows, const std::vector<int>& columns) {
  return A(rows, columns);
}

std::vector<int> base_velocities(const Model& model, int root) {
  std::vector<int> indices;
  if (free_root(model, root)) {
    for (int k = 0; k < 6; ++k) indices.push_back(model.bodies()[root].v + k);
  }
  return indices;
}

// Momentum of the tree in B at B's origin, for which I_b V + I_bm rate = h.
Eigen::VectorXd momentum_in_base(const Model& model, const Kinematics& kinematics, int root,
                                 const Momentumd& momentum) {
  const Posed& X_WB = kinematics.X_WB[root];
  const int roots[] = {root};
  const Vector3d p_WC = center_of_mass(model, kinematics, roots);
  const Momentumd h = transposed_times(X_WB.R, shift(momentum, X_WB.p - p_WC));
  Eigen::VectorXd result(6);
  result << h.angular[0], h.angular[1], h.angular[2], h.linear[0], h.linear[1], h.linear[2];
  return result;
}

// I_b^-1 I_bm, the base's response to joint rates (2.6). For a robot without joints it has no columns, which Eigen's
// solver does not accept.
Eigen::MatrixXd base_response(const MassBlocks& blocks) {
  if (blocks.I_bm.cols() == 0) return blocks.I_bm;
  return blocks.I_b.llt().solve(blocks.I_bm);
}

}  // namespace

std::vector<int> joint_velocities(const Model& model, int root) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& b = model.bodies()[i];
    if (b.root != root || static_cast<int>(i) == root) continue;
    for (int k = 0; k < velocity_count(b.description.joint.type); ++k) indices.push_back(b.v + k);
  }
  return indices;
}

MassBlocks mass_blocks(const Model& model, const State& state, int root) {
  return mass_blocks(model, mass_matrix(model, state), root);
}

MassBlocks mass_blocks(const Model& model, const Eigen::MatrixXd& mass_matrix, int root) {
  const std::vector<int> b = base_velocities(model, root), m = joint_velocities(model, root);
  return {select(mass_matrix, b, b), select(mass_matrix, b, m), select(mass_matrix, m, m)};
}

Eigen::MatrixXd generalized_jacobian(const Model& model, const State& state, int root, int body, const Vector3d& p_WP) {
  return generalized_jacobian(model, forward_kinematics(model, state), mass_blocks(model, state, root), root, body,
                              p_WP);
}

Eigen::MatrixXd generalized_jacobian(const Model& model, const Kinematics& kinematics, const MassBlocks& blocks,
                                     int root, int body, const Vector3d& p_WP) {
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, kinematics, body, p_WP, J);
  const Eigen::MatrixXd J_m = J(Eigen::all, joint_velocities(model, root));
  if (!free_root(model, root)) return J_m;
  return J_m - J(Eigen::all, base_velocities(model, root)) * base_response(blocks);  // (2.5)
}

Eigen::MatrixXd generalized_jacobian(const Model& model, const State& state, int root, int frame) {
  const Kinematics kinematics = forward_kinematics(model, state);
  return generalized_jacobian(model, state, root, model.frames().at(frame).body,
                              frame_pose(model, kinematics, frame).p);
}

Eigen::VectorXd momentum_twist(const Model& model, const State& state, int root, int body, const Vector3d& p_WP,
                               const Momentumd& momentum) {
  if (!free_root(model, root)) return Eigen::VectorXd::Zero(6);
  const Kinematics kinematics = forward_kinematics(model, state);
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, kinematics, body, p_WP, J);
  const MassBlocks blocks = mass_blocks(model, state, root);
  return J(Eigen::all, base_velocities(model, root)) *
         blocks.I_b.llt().solve(momentum_in_base(model, kinematics, root, momentum));  // (2.3)
}

Twistd base_twist_from_momentum(const Model& model, const State& state, int root, const Momentumd& momentum) {
  return base_twist_from_momentum(model, state, forward_kinematics(model, state), mass_blocks(model, state, root), root,
                                  momentum);
}

Twistd base_twist_from_momentum(const Model& model, const State& state, const Kinematics& kinematics,
                                const MassBlocks& blocks, int root, const Momentumd& momentum) {
  if (!free_root(model, root)) throw std::invalid_argument("base_twist_from_momentum: the root is fixed to the world");
  const std::vector<int> joints = joint_velocities(model, root);
  Eigen::VectorXd rates(joints.size());
  for (std::size_t i = 0; i < joints.size(); ++i) rates[i] = state.v[joints[i]];
  const Eigen::VectorXd V_B =
      blocks.I_b.llt().solve(momentum_in_base(model, kinematics, root, momentum) - blocks.I_bm * rates);
  return kinematics.X_WB[root].R * Twistd{{V_B[0], V_B[1], V_B[2]}, {V_B[3], V_B[4], V_B[5]}};
}

Eigen::MatrixXd generalized_inertia(const Model& model, const State& state, int root) {
  return generalized_inertia(mass_blocks(model, state, root));
}

Eigen::MatrixXd generalized_inertia(const MassBlocks& blocks) {
  if (blocks.I_b.size() == 0) return blocks.I_m;
  return blocks.I_m - blocks.I_bm.transpose() * base_response(blocks);
}

// State and generalized forces => I, c and tau of (2.8), from the blocks of the mass matrix and the bias.
ReducedEquation reduced_equation(const Model& model, const State& state, int root,
                                 const std::vector<double>& generalized, const Vector3d& gravity) {
  Workspace workspace(model);
  std::vector<double> c;
  bias(model, state, gravity, workspace, c);
  const std::vector<int> b = base_velocities(model, root), m = joint_velocities(model, root);
  const auto part = [](const std::vector<double>& all, const std::vector<int>& indices) {
    Eigen::VectorXd result(indices.size());
    for (std::size_t i = 0; i < indices.size(); ++i) result[i] = all.empty() ? 0.0 : all[indices[i]];
    return result;
  };
  ReducedEquation reduced{mass_blocks(model, state, root).I_m, part(c, m), part(generalized, m)};
  if (b.empty()) return reduced;
  const MassBlocks blocks = mass_blocks(model, state, root);
  const Eigen::MatrixXd X = base_response(blocks);  // I_b^-1 I_bm
  reduced.I -= blocks.I_bm.transpose() * X;
  reduced.c -= X.transpose() * part(c, b);
  reduced.tau -= X.transpose() * part(generalized, b);
  return reduced;
}

}  // namespace grapnel
