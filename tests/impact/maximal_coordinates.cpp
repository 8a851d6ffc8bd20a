#include "impact/maximal_coordinates.hpp"

#include <Eigen/Geometry>

#include "grapnel/spatial/decompositions.hpp"
#include "support/eigen_values.hpp"

namespace grapnel::testing {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& p) {
  Eigen::Matrix3d m;
  m << 0, -p[2], p[1], p[2], 0, -p[0], -p[1], p[0], 0;
  return m;
}

// Twist at a point p from the velocities [w; v] of a body with its centre of mass at c: v_p = v + w x (p - c).
Matrix twist_at(const Eigen::Vector3d& p, const Eigen::Vector3d& c) {
  Matrix X = Matrix::Identity(6, 6);
  X.bottomLeftCorner(3, 3) = -cross_matrix(p - c);
  return X;
}

// Orthonormal rows that vanish on the unit vector `axis`, 2 x 3.
Matrix normal_rows(const Eigen::Vector3d& axis) {
  const Eigen::Vector3d other = std::abs(axis[0]) < 0.6 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  Matrix N(2, 3);
  N.row(0) = axis.cross(other).normalized().transpose();
  N.row(1) = axis.cross(Eigen::Vector3d(N.row(0).transpose())).transpose();
  return N;
}

// Rows that constrain a relative twist: all linear parts, and the angular parts except along `hinge` (free_turn 1) or
// none of them (3).
Matrix twist_rows(int free_turn, const Eigen::Vector3d& hinge) {
  Matrix A = Matrix::Zero(6 - free_turn, 6);
  A.bottomRightCorner(3, 3).setIdentity();
  if (free_turn == 0) A.topLeftCorner(3, 3).setIdentity();
  if (free_turn == 1) A.topLeftCorner(2, 3) = normal_rows(hinge);
  return A;
}

Matrix joint_rows(const JointDescription& joint, const Eigen::Vector3d& axis) {
  switch (joint.type) {
    case JointType::fixed:
      return twist_rows(0, axis);
    case JointType::spherical:
      return twist_rows(3, axis);
    case JointType::prismatic: {
      Matrix A = Matrix::Zero(5, 6);
      A.topLeftCorner(3, 3).setIdentity();
      A.bottomRightCorner(2, 3) = normal_rows(axis);
      return A;
    }
    case JointType::free:
      return Matrix(0, 6);
    default:
      return twist_rows(1, axis);
  }
}

struct System {
  const Model& model;
  Kinematics k;
  std::vector<Eigen::Vector3d> com;
  Matrix M;
  Vector v;
  std::vector<Matrix> rows;  // one block per body's joint, then one per grasp; columns for all velocities
  std::vector<Matrix> directions;
  std::vector<Vector> rate_row;  // per body with a rotor: s; else empty

  System(const Model& m, const State& state) : model(m), k(forward_kinematics(m, state)) {
    const Eigen::Index n = 6 * static_cast<Eigen::Index>(model.bodies().size());
    M = Matrix::Zero(n, n);
    v = Vector(n);
    rate_row.resize(model.bodies().size());
    for (std::size_t i = 0; i < model.bodies().size(); ++i) add_body(static_cast<Eigen::Index>(i));
    for (std::size_t i = 0; i < model.bodies().size(); ++i) add_joint(static_cast<int>(i));
  }
  void add_body(Eigen::Index i) {
    const BodyDescription& d = model.bodies()[i].description;
    const Eigen::Matrix3d R = eigen(k.X_WB[i].R);
    com.push_back(eigen(k.X_WB[i].p) + R * eigen(d.com));
    M.block(6 * i, 6 * i, 3, 3) = R * eigen(d.inertia) * R.transpose();
    M.block(6 * i + 3, 6 * i + 3, 3, 3) = d.mass * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d w = eigen(k.V_WB[i].angular);
    v.segment(6 * i, 3) = w;
    v.segment(6 * i + 3, 3) = eigen(k.V_WB[i].linear) + w.cross(R * eigen(d.com));
  }
  // Relative twist at p of body a against body b (-1: the world).
  Matrix relative(int a, int b, const Eigen::Vector3d& p) const {
    Matrix X = Matrix::Zero(6, v.size());
    X.middleCols(6 * a, 6) = twist_at(p, com[a]);
    if (b >= 0) X.middleCols(6 * b, 6) -= twist_at(p, com[b]);
    return X;
  }
  void add_joint(int i) {
    const Body& body = model.bodies()[i];
    const JointDescription& joint = body.description.joint;
    const Eigen::Vector3d axis = eigen(k.X_WB[i].R * joint.axis);
    const Matrix X = relative(i, body.parent, eigen(k.X_WB[i].p));
    directions.push_back(joint_rows(joint, axis));
    rows.push_back(directions.back() * X);
    if (velocity_count(joint.type) != 1 || joint.reflected_inertia() == 0) return;
    Vector along = Vector::Zero(6);
    along.segment(joint.type == JointType::prismatic ? 3 : 0, 3) = axis;
    rate_row[i] = X.transpose() * along;
    M += joint.reflected_inertia() * rate_row[i] * rate_row[i].transpose();
  }
  void add_grasp(const Grasp& g) {
    directions.push_back(twist_rows(g.model == GraspModel::rigid   ? 0
                                    : g.model == GraspModel::hinge ? 1
                                                                   : 3,
                                    eigen(g.hinge_W)));
    rows.push_back(directions.back() * relative(g.robot_body, g.target_body, eigen(g.p_WC)));
  }
};

}  // namespace

MaximalSolution maximal_impact(const Model& model, const State& state, std::span<const Grasp> grasps) {
  System s(model, state);
  for (const Grasp& g : grasps) s.add_grasp(g);
  Eigen::Index count = 0;
  for (const Matrix& r : s.rows) count += r.rows();
  const Eigen::Index n = s.v.size();
  // The same system in dimensionless form: velocities L^T v with M = L L^T, rows of unit length.
  const Eigen::LLT<Matrix> mass(s.M);
  Matrix A(count, n);
  for (Eigen::Index at = 0; const Matrix& r : s.rows) {
    if (r.rows() == 0) continue;  // Eigen's triangular solver does not accept empty matrices
    A.middleRows(at, r.rows()) = mass.matrixL().solve(r.transpose()).transpose();
    at += r.rows();
  }
  const Vector length = A.rowwise().norm();
  A = length.cwiseInverse().asDiagonal() * A;
  Matrix K = Matrix::Identity(n + count, n + count);
  K.bottomRightCorner(count, count).setZero();
  K.bottomLeftCorner(count, n) = A;
  K.topRightCorner(n, count) = A.transpose();
  Vector b = Vector::Zero(n + count);
  b.head(n) = mass.matrixU() * s.v;
  Eigen::CompleteOrthogonalDecomposition<Matrix> solver;
  solver.setThreshold(1e-12);
  Vector x = solver.compute(K).solve(b);
  const double residual = (K * x - b).norm() / b.norm();
  x.head(n) = mass.matrixU().solve(x.head(n)).eval();
  x.tail(count) = x.tail(count).cwiseQuotient(length).eval();

  MaximalSolution result;
  result.residual = residual;
  std::vector<Impulsed> impulse;
  Eigen::Index at = n;
  for (std::size_t i = 0; i < s.rows.size(); ++i) {
    const Vector P = s.directions[i].transpose() * -x.segment(at, s.rows[i].rows());
    impulse.push_back({{P[0], P[1], P[2]}, {P[3], P[4], P[5]}});
    at += s.rows[i].rows();
  }
  const std::size_t bodies = model.bodies().size();
  result.joint.assign(impulse.begin(), impulse.begin() + static_cast<std::ptrdiff_t>(bodies));
  result.contact.assign(impulse.begin() + static_cast<std::ptrdiff_t>(bodies), impulse.end());
  for (std::size_t i = 0; i < bodies; ++i) {
    const Eigen::Vector3d w = x.segment(6 * static_cast<Eigen::Index>(i), 3),
                          vc = x.segment(6 * static_cast<Eigen::Index>(i) + 3, 3);
    const Eigen::Vector3d vo = vc + w.cross(eigen(s.k.X_WB[i].p) - s.com[i]);
    result.V_WB.push_back({{w[0], w[1], w[2]}, {vo[0], vo[1], vo[2]}});
    if (s.rate_row[i].size() == 0) continue;
    // The impulse that accelerates the rotor does not act on the link.
    const JointDescription& joint = model.bodies()[i].description.joint;
    const double spun = joint.reflected_inertia() * s.rate_row[i].dot(x.head(n) - s.v);
    const Vector3d axis = s.k.X_WB[i].R * joint.axis;
    (joint.type == JointType::prismatic ? result.joint[i].linear : result.joint[i].angular) -= spun * axis;
  }
  return result;
}

}  // namespace grapnel::testing
