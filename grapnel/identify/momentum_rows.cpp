#include "grapnel/identify/momentum_rows.hpp"

#include <cmath>

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

Eigen::Vector3d eigen_vector(const Vector3d& v) { return {v[0], v[1], v[2]}; }
Vector3d vector_of(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

// Visits the bodies of the held body's tree except the held body.
template <class Visit>
void for_known(const IdentificationTask& task, Visit visit) {
  const std::vector<Body>& bodies = task.model.bodies();
  const int held = task.model.frames()[task.frame].body;
  for (int i = 0; i < static_cast<int>(bodies.size()); ++i)
    if (bodies[i].root == bodies[held].root && i != held) visit(i);
}

Vector3d known_com(const IdentificationTask& task, const Kinematics& k, double mass) {
  Vector3d moment = Vector3d::zero();
  for_known(task, [&](int i) {
    const BodyMomentum body = body_momentum(task.model, k, i);
    moment += task.model.bodies()[i].description.mass * body.p_WC;
  });
  return (1 / mass) * moment;
}

// Momentum of the known bodies per velocity, [angular about `p_W`; linear] in W.
Eigen::MatrixXd known_momentum(const IdentificationTask& task, const Kinematics& k, const Vector3d& p_W) {
  const int n = task.model.velocities();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(6, n), J(6, n);
  for_known(task, [&](int i) {
    point_jacobian(task.model, k, i, k.X_WB[i].p, J);
    const RigidBodyInertiad I = world_inertia(task.model, k, i);
    for (int j = 0; j < n; ++j) {
      const Twistd V{vector_of(J.col(j).head<3>()), vector_of(J.col(j).tail<3>())};
      const Momentumd h = shift(I * V, p_W - k.X_WB[i].p);
      sum.col(j).head<3>() += eigen_vector(h.angular);
      sum.col(j).tail<3>() += eigen_vector(h.linear);
    }
  });
  // Rotors of the known bodies have their own spin, (19.6).
  const std::vector<Body>& bodies = task.model.bodies();
  const int root = bodies[task.model.frames()[task.frame].body].root;
  for (const int rotor : task.model.rotors()) {
    if (bodies[rotor].root == root)
      sum.col(bodies[rotor].v).head<3>() += eigen_vector(rotor_momentum(task.model, k, rotor));
  }
  return sum;
}

}  // namespace

KnownBodies known_bodies(const IdentificationTask& task) {
  KnownBodies known;
  known.rows = task.base == MeasuredBase::twist ? 6 : 3;
  const Kinematics k = forward_kinematics(task.model, task.samples.front().state);
  for_known(task, [&](int i) { known.mass += task.model.bodies()[i].description.mass; });
  const Vector3d com = known_com(task, k, known.mass);
  double second_moment = 0;
  for_known(task, [&](int i) {
    const RigidBodyInertiad I = shift_origin(world_inertia(task.model, k, i), k.X_WB[i].p - com);
    second_moment += (I.rotational.xx + I.rotational.yy + I.rotational.zz) / 2;
  });
  known.radius = std::sqrt(second_moment / known.mass);
  known.p_WO = frame_pose(task.model, k, task.frame).p;
  return known;
}

MomentumRows momentum_rows(const IdentificationTask& task, const KnownBodies& known, const MotionSample& sample) {
  const Kinematics k = forward_kinematics(task.model, sample.state);
  const Posed X_WT = frame_pose(task.model, k, task.frame);
  const bool whole = task.base == MeasuredBase::twist;
  const Vector3d reference = whole ? known.p_WO : known_com(task, k, known.mass);
  const Eigen::MatrixXd momentum = known_momentum(task, k, reference);
  MomentumRows rows{
      X_WT.R, X_WT.p - reference, momentum.topRows(known.rows), frame_jacobian(task.model, k, task.frame), {}, {}};
  if (!whole) rows.J.bottomRows(3) -= momentum.bottomRows(3) / known.mass;  // (16.5)
  for (int j = 0; j < rows.J.cols(); ++j) {
    rows.J.col(j).head<3>() = eigen_vector(transposed_times(X_WT.R, vector_of(rows.J.col(j).head<3>())));
    rows.J.col(j).tail<3>() = eigen_vector(transposed_times(X_WT.R, vector_of(rows.J.col(j).tail<3>())));
  }
  rows.velocity = Eigen::Map<const Eigen::VectorXd>(sample.state.v.data(), task.model.velocities());
  const Impulsed impulse = shift(sample.impulse, reference);
  rows.impulse = Eigen::VectorXd::Zero(known.rows);
  rows.impulse.head<3>() = eigen_vector(whole ? impulse.angular : sample.impulse.angular);
  if (whole) rows.impulse.tail<3>() = eigen_vector(impulse.linear);
  return rows;
}

// (16.2)
Eigen::MatrixXd regressor(const MomentumRows& rows, const Eigen::VectorXd& twist) {
  const Vector3d w = vector_of(twist.head<3>()), v = vector_of(twist.tail<3>());
  Eigen::MatrixXd Y(rows.known.rows(), kInertialParameters);
  const auto put = [&](int column, const Momentumd& in_T) {
    const Momentumd h = shift(rows.R_WT * in_T, -rows.p);
    Y.col(column).head<3>() = eigen_vector(h.angular);
    if (Y.rows() == 6) Y.col(column).tail<3>() = eigen_vector(h.linear);
  };
  put(0, {Vector3d::zero(), v});
  for (int i = 0; i < 3; ++i) {
    Vector3d e = Vector3d::zero();
    e[i] = 1;
    put(1 + i, {cross(e, v), cross(w, e)});
  }
  for (int i = 0; i < 6; ++i) {
    double of[6] = {};
    of[i] = 1;
    const Symmetric3d unit{of[0], of[1], of[2], of[3], of[4], of[5]};
    put(4 + i, {unit * w, Vector3d::zero()});
  }
  return Y;
}

Eigen::MatrixXd momentum_matrix(const MomentumRows& rows, const LinearParameters& x) {
  const RigidBodyInertiad I{x[0], {x[1], x[2], x[3]}, {x[4], x[5], x[6], x[7], x[8], x[9]}};
  Eigen::MatrixXd A = rows.known;
  for (int j = 0; j < A.cols(); ++j) {
    const Twistd V{vector_of(rows.J.col(j).head<3>()), vector_of(rows.J.col(j).tail<3>())};
    const Momentumd h = shift(rows.R_WT * (I * V), -rows.p);
    A.col(j).head<3>() += eigen_vector(h.angular);
    if (A.rows() == 6) A.col(j).tail<3>() += eigen_vector(h.linear);
  }
  return A;
}

}  // namespace grapnel
