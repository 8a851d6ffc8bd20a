#include "oracle/maximal_system.hpp"

#include "grapnel/spatial/decompositions.hpp"
#include "support/eigen_values.hpp"

namespace grapnel::oracle {
namespace {

using grapnel::testing::eigen;
using Matrix = Eigen::MatrixXd;
using Matrix3 = Eigen::Matrix3d;
using Vector = Eigen::VectorXd;
using Vector3 = Eigen::Vector3d;

// Rank thresholds for rows of length one. During integration, the stages of a step violate the constraints by the
// square of the step, and so do redundant rows.
constexpr double kRankThreshold = 1e-10, kRankThresholdDuringIntegration = 1e-4;

Matrix3 cross_matrix(const Vector3& p) {
  Matrix3 m;
  m << 0, -p[2], p[1], p[2], 0, -p[0], -p[1], p[0], 0;
  return m;
}

// Orthonormal rows that vanish on the unit vector `axis`, 2 x 3.
Matrix normal_rows(const Vector3& axis) {
  const Vector3 other = std::abs(axis[0]) < 0.6 ? Vector3::UnitX() : Vector3::UnitY();
  Matrix N(2, 3);
  N.row(0) = axis.cross(other).normalized().transpose();
  N.row(1) = axis.cross(Vector3(N.row(0).transpose())).transpose();
  return N;
}

Matrix angular_rows(const Matrix& A) {
  Matrix rows = Matrix::Zero(A.rows(), 6);
  rows.leftCols(3) = A;
  return rows;
}
Matrix linear_rows(const Matrix& A) {
  Matrix rows = Matrix::Zero(A.rows(), 6);
  rows.rightCols(3) = A;
  return rows;
}
Matrix stacked(const Matrix& above, const Matrix& below) {
  Matrix rows(above.rows() + below.rows(), above.cols());
  rows << above, below;
  return rows;
}

// Coordinates of a joint as a pose of B in F.
void joint_motion(const JointDescription& joint, const double* q, Matrix3& R, Vector3& p) {
  R.setIdentity(), p.setZero();
  switch (joint.type) {
    case JointType::fixed:
      return;
    case JointType::free:
      p << q[0], q[1], q[2];
      R = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).toRotationMatrix();
      return;
    case JointType::spherical:
      R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
      return;
    case JointType::prismatic:
      p = q[0] * eigen(joint.axis);
      return;
    default:
      R = Eigen::AngleAxisd(q[0], eigen(joint.axis)).toRotationMatrix();
  }
}

// Velocities of a joint as [angular velocity; velocity of B's origin] against F, in W.
Wrench6 joint_velocity(const JointDescription& joint, const double* v, const Matrix3& R_WB) {
  Wrench6 V = Wrench6::Zero();
  switch (joint.type) {
    case JointType::fixed:
      break;
    case JointType::free:
      V << R_WB * Vector3(v[0], v[1], v[2]), R_WB * Vector3(v[3], v[4], v[5]);
      break;
    case JointType::spherical:
      V.head<3>() = R_WB * Vector3(v[0], v[1], v[2]);
      break;
    case JointType::prismatic:
      V.tail<3>() = v[0] * (R_WB * eigen(joint.axis));
      break;
    default:
      V.head<3>() = v[0] * (R_WB * eigen(joint.axis));
  }
  return V;
}

// The state of the bodies at one instant.
struct Snapshot {
  const Model& model;
  const MaximalState& state;
  std::vector<Matrix3> R;
  std::vector<Vector3> origin;

  Snapshot(const Model& m, const MaximalState& s) : model(m), state(s) {
    for (std::size_t i = 0; i < m.bodies().size(); ++i) {
      R.push_back(s.R[i].toRotationMatrix());
      origin.push_back(s.com[i] - R[i] * eigen(m.bodies()[i].description.com));
    }
  }
  Eigen::Index size() const { return state.V.size(); }
  Vector3 w(int body) const { return state.V.segment<3>(6 * body); }
  Vector3 velocity(int body, const Vector3& p) const {
    return state.V.segment<3>(6 * body + 3) + w(body).cross(p - state.com[body]);
  }
  // Velocity-dependent acceleration of the body's point at p, in addition to a_c + alpha x (p - c).
  Vector3 centripetal(int body, const Vector3& p) const { return w(body).cross(w(body).cross(p - state.com[body])); }
};

// Linear in the bodies' velocities, X V, and in their accelerations, X Vdot + bias.
struct Rows {
  Matrix X;
  Vector bias;
};

// Motion of body a at its point p relative to body b (-1: the world), as observed on b, in W's axes: alpha_a - alpha_b
// - w_b x w_rel and a_a - a_b(at p) - 2 w_b x v_rel.
Rows relative_motion(const Snapshot& s, int a, int b, const Vector3& p) {
  Rows r{Matrix::Zero(6, s.size()), Vector::Zero(6)};
  const auto add = [&](int body, double sign) {
    r.X.block<3, 3>(0, 6 * body) += sign * Matrix3::Identity();
    r.X.block<3, 3>(3, 6 * body) -= sign * cross_matrix(p - s.state.com[body]);
    r.X.block<3, 3>(3, 6 * body + 3) += sign * Matrix3::Identity();
    r.bias.tail<3>() += sign * s.centripetal(body, p);
  };
  add(a, 1);
  if (b < 0) return r;
  add(b, -1);
  const Vector3 w = s.w(b);
  r.bias.head<3>() -= w.cross(s.w(a) - w);
  r.bias.tail<3>() -= 2 * w.cross(s.velocity(a, p) - s.velocity(b, p));
  return r;
}

// Components of a joint's relative motion: its rates, and the constrained ones.
struct JointRows {
  Matrix free, forbidden;
};
JointRows joint_rows(const JointDescription& joint, const Matrix3& R_WB) {
  const Matrix3 one = Matrix3::Identity();
  const Vector3 axis = R_WB * eigen(joint.axis);
  switch (joint.type) {
    case JointType::fixed:
      return {Matrix(0, 6), Matrix::Identity(6, 6)};
    case JointType::free:
      return {stacked(angular_rows(R_WB.transpose()), linear_rows(R_WB.transpose())), Matrix(0, 6)};
    case JointType::spherical:
      return {angular_rows(R_WB.transpose()), linear_rows(one)};
    case JointType::prismatic:
      return {linear_rows(axis.transpose()), stacked(angular_rows(one), linear_rows(normal_rows(axis)))};
    default:
      return {angular_rows(axis.transpose()), stacked(angular_rows(normal_rows(axis)), linear_rows(one))};
  }
}

Matrix closure_rows_in_C(const LoopClosure& c) {
  const Matrix3 one = Matrix3::Identity();
  if (c.model == GraspModel::point) return linear_rows(one);
  return stacked(angular_rows(c.model == GraspModel::rigid ? Matrix(one) : normal_rows(eigen(c.hinge_C))),
                 linear_rows(one));
}

// System (1) without the loads.
struct Assembly {
  Snapshot s;
  Matrix M;
  Vector h;
  Rows rates;                        // all velocities of the model
  std::vector<Rows> constraints;     // joints, closures
  std::vector<Matrix> directions_C;  // per closure
  std::vector<double> armature;      // per velocity of the model

  Assembly(const Model& model, std::span<const LoopClosure> closures, const MaximalState& state)
      : s(model, state), M(Matrix::Zero(s.size(), s.size())), h(Vector::Zero(s.size())) {
    rates = {Matrix::Zero(model.velocities(), s.size()), Vector::Zero(model.velocities())};
    armature.assign(model.velocities(), 0);
    for (int i = 0; i < static_cast<int>(model.bodies().size()); ++i) add_body(i), add_joint(i);
    for (const LoopClosure& c : closures) add_closure(c);
    for (int k = 0; k < model.velocities(); ++k) {
      M += armature[k] * rates.X.row(k).transpose() * rates.X.row(k);
      h += armature[k] * rates.bias[k] * rates.X.row(k).transpose();
    }
  }
  void add_body(int i) {
    const BodyDescription& d = s.model.bodies()[i].description;
    const Matrix3 I = s.R[i] * eigen(d.inertia) * s.R[i].transpose();
    M.block<3, 3>(6 * i, 6 * i) = I;
    M.block<3, 3>(6 * i + 3, 6 * i + 3) = d.mass * Matrix3::Identity();
    h.segment<3>(6 * i) = s.w(i).cross(I * s.w(i));
  }
  void add_joint(int i) {
    const Body& body = s.model.bodies()[i];
    const JointDescription& joint = body.description.joint;
    const Rows motion = relative_motion(s, i, body.parent, s.origin[i]);
    const JointRows rows = joint_rows(joint, s.R[i]);
    const int count = velocity_count(joint.type);
    rates.X.middleRows(body.v, count) = rows.free * motion.X;
    rates.bias.segment(body.v, count) = rows.free * motion.bias;
    // A free root's velocities are components in rotating axes.
    if (joint.type == JointType::free) {
      rates.bias.segment<3>(body.v + 3) -= s.R[i].transpose() * s.w(i).cross(s.velocity(i, s.origin[i]));
    }
    if (count == 1) armature[body.v] = joint.reflected_inertia();
    constraints.push_back({rows.forbidden * motion.X, rows.forbidden * motion.bias});
  }
  void add_closure(const LoopClosure& c) {
    const Matrix3 R_WC = s.R[c.body_a] * eigen(c.X_AC.R);
    const Vector3 p = s.origin[c.body_a] + s.R[c.body_a] * eigen(c.X_AC.p);
    const Rows motion = relative_motion(s, c.body_a, c.body_b, p);
    directions_C.push_back(closure_rows_in_C(c));
    Matrix to_C = Matrix::Zero(6, 6);
    to_C.topLeftCorner(3, 3) = to_C.bottomRightCorner(3, 3) = R_WC.transpose();
    const Matrix rows = directions_C.back() * to_C;
    constraints.push_back({rows * motion.X, rows * motion.bias});
  }
};

bool is_prescribed(const std::vector<std::uint8_t>& prescribed, int k) {
  return !prescribed.empty() && prescribed[static_cast<std::size_t>(k)] != 0;
}

// Applied forces f + s^T tau of (1).
Vector applied(const Assembly& a, const MaximalLoads& loads) {
  Vector f = Vector::Zero(a.s.size());
  for (std::size_t i = 0; i < a.s.R.size(); ++i) {
    f.segment<3>(6 * static_cast<Eigen::Index>(i) + 3) = a.s.model.bodies()[i].description.mass * eigen(loads.gravity);
  }
  for (const ExternalWrench& e : loads.external) {
    const Vector3 force = eigen(e.F_W.linear);
    f.segment<3>(6 * e.body) += eigen(e.F_W.angular) + (eigen(e.p_WP) - a.s.state.com[e.body]).cross(force);
    f.segment<3>(6 * e.body + 3) += force;
  }
  for (int k = 0; k < static_cast<int>(loads.tau.size()); ++k) {
    if (!is_prescribed(loads.prescribed, k)) f += loads.tau[k] * a.rates.X.row(k).transpose();
  }
  return f;
}

// Solution (2) with C y + c = 0, whose rows are those of the joints, the closures and then the prescribed velocities, X
// V = target - bias. `free` is the load of y_f = L^-1 free.
struct Projected {
  Vector y, multipliers;
  double residual;
  int rank;
};
Projected project(const Matrix& M, const Vector& free, const Matrix& C, const Vector& target, double threshold) {
  const Eigen::LLT<Matrix> mass(M);
  Matrix A = C;
  if (C.rows() > 0) A = mass.matrixL().solve(C.transpose()).transpose();
  Vector length = A.rowwise().norm();
  for (double& l : length) l = l > 0 ? l : 1;
  A = length.cwiseInverse().asDiagonal() * A;
  const Vector b = target.cwiseQuotient(length), y_free = mass.matrixL().solve(free);
  Projected r{y_free, Vector::Zero(C.rows()), 0, 0};
  if (C.rows() > 0) {
    Eigen::CompleteOrthogonalDecomposition<Matrix> solver;
    solver.setThreshold(threshold);
    const Vector change = solver.compute(A).solve(b - A * y_free);
    r.y += change;
    r.rank = static_cast<int>(solver.rank());
    r.residual = (A * r.y - b).norm() / std::max(1e-300, b.norm() + y_free.norm());
    r.multipliers = solver.compute(A.transpose()).solve(change).cwiseQuotient(length);
  }
  r.y = mass.matrixU().solve(r.y).eval();
  return r;
}

// Both problems: accelerations with biases, impulses without.
MaximalSolution solve(const Assembly& a, const Vector& free, bool accelerations,
                      const std::vector<std::uint8_t>& prescribed, const Vector& prescribed_value, double threshold) {
  Eigen::Index rows = 0;
  for (const Rows& r : a.constraints) rows += r.X.rows();
  const Eigen::Index own_rows = rows;
  for (int k = 0; k < a.rates.X.rows(); ++k) rows += is_prescribed(prescribed, k);
  Matrix C(rows, a.s.size());
  Vector target(rows);
  Eigen::Index at = 0;
  for (const Rows& r : a.constraints) {
    C.middleRows(at, r.X.rows()) = r.X;
    target.segment(at, r.X.rows()) = accelerations ? Vector(-r.bias) : Vector(Vector::Zero(r.X.rows()));
    at += r.X.rows();
  }
  for (int k = 0; k < a.rates.X.rows(); ++k) {
    if (!is_prescribed(prescribed, k)) continue;
    C.row(at) = a.rates.X.row(k);
    target[at++] = prescribed_value[k] - (accelerations ? a.rates.bias[k] : 0);
  }
  const Projected p = project(a.M, free, C, target, threshold);
  MaximalSolution result;
  result.bodies = p.y, result.residual = p.residual, result.rank = p.rank;
  Vector joints = a.rates.X * p.y;
  if (accelerations) joints += a.rates.bias;
  result.joints = testing::values(joints);
  at = own_rows;
  for (const Matrix& directions : a.directions_C) at -= directions.rows();
  for (const Matrix& directions : a.directions_C) {
    result.closures.push_back(directions.transpose() * p.multipliers.segment(at, directions.rows()));
    at += directions.rows();
  }
  result.force.assign(static_cast<std::size_t>(a.rates.X.rows()), 0);
  for (int k = 0; k < a.rates.X.rows(); ++k) {
    if (is_prescribed(prescribed, k)) result.force[k] = p.multipliers[at++];
  }
  return result;
}

// Positions, quaternions (w, x, y, z) and velocities in one vector for the integrator.
Vector packed(const MaximalState& s) {
  const Eigen::Index n = static_cast<Eigen::Index>(s.com.size());
  Vector x(13 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    x.segment<3>(7 * i) = s.com[i];
    x.segment<4>(7 * i + 3) << s.R[i].w(), s.R[i].vec();
  }
  x.tail(6 * n) = s.V;
  return x;
}
MaximalState unpacked(const Vector& x) {
  const Eigen::Index n = x.size() / 13;
  MaximalState s;
  for (Eigen::Index i = 0; i < n; ++i) {
    s.com.emplace_back(x.segment<3>(7 * i));
    s.R.push_back(Eigen::Quaterniond(x[7 * i + 3], x[7 * i + 4], x[7 * i + 5], x[7 * i + 6]).normalized());
  }
  s.V = x.tail(6 * n);
  return s;
}

}  // namespace

Eigen::Vector3d MaximalState::origin(const Model& model, int body) const {
  return com[body] - R[body] * eigen(model.bodies()[body].description.com);
}

MaximalState maximal_state(const Model& model, const State& state) {
  MaximalState s;
  s.V = Vector::Zero(6 * static_cast<Eigen::Index>(model.bodies().size()));
  std::vector<Matrix3> R;
  std::vector<Vector3> origin;
  for (int i = 0; i < static_cast<int>(model.bodies().size()); ++i) {
    const Body& body = model.bodies()[i];
    const BodyDescription& d = body.description;
    Matrix3 R_WF = eigen(d.X_PF.R), R_FB;
    Vector3 p_WF = eigen(d.X_PF.p), p_FB, w = Vector3::Zero(), v = Vector3::Zero();
    if (body.parent >= 0) {
      R_WF = R[body.parent] * R_WF;
      p_WF = origin[body.parent] + R[body.parent] * p_WF;
    }
    joint_motion(d.joint, state.q.data() + body.q, R_FB, p_FB);
    R.push_back(R_WF * R_FB);
    origin.push_back(p_WF + R_WF * p_FB);
    if (body.parent >= 0) {
      w = s.V.segment<3>(6 * body.parent);
      v = s.V.segment<3>(6 * body.parent + 3) + w.cross(origin[i] - s.com[body.parent]);
    }
    const Wrench6 own = joint_velocity(d.joint, state.v.data() + body.v, R[i]);
    w += own.head<3>(), v += own.tail<3>();
    s.com.push_back(origin[i] + R[i] * eigen(d.com));
    s.R.emplace_back(R[i]);
    s.V.segment<3>(6 * i) = w;
    s.V.segment<3>(6 * i + 3) = v + w.cross(s.com[i] - origin[i]);
  }
  return s;
}

MaximalSystem::MaximalSystem(const Model& model, std::span<const LoopClosure> closures)
    : model_(model), closures_(closures.begin(), closures.end()) {}

MaximalSolution MaximalSystem::accelerations(const MaximalState& state, const MaximalLoads& loads) const {
  return accelerations(state, loads, kRankThreshold);
}

MaximalSolution MaximalSystem::accelerations(const MaximalState& state, const MaximalLoads& loads,
                                             double threshold) const {
  const Assembly a(model_, closures_, state);
  Vector value = Vector::Zero(model_.velocities());
  if (!loads.acceleration.empty()) value = eigen(loads.acceleration);
  MaximalSolution result = solve(a, applied(a, loads) - a.h, true, loads.prescribed, value, threshold);
  for (std::size_t k = 0; k < loads.tau.size(); ++k) {
    if (!is_prescribed(loads.prescribed, static_cast<int>(k))) result.force[k] = loads.tau[k];
  }
  return result;
}

MaximalSolution MaximalSystem::close_velocities(const MaximalState& state,
                                                const std::vector<std::uint8_t>& prescribed) const {
  const Assembly a(model_, closures_, state);
  return solve(a, a.M * state.V, false, prescribed, a.rates.X * state.V, kRankThreshold);
}

MaximalState MaximalSystem::integrate(MaximalState state, const MaximalLoads& loads, double duration, int steps) const {
  const auto derivative = [&](const Vector& x) {
    const MaximalState s = unpacked(x);
    const Eigen::Index n = static_cast<Eigen::Index>(s.com.size());
    Vector rate(x.size());
    for (Eigen::Index i = 0; i < n; ++i) {
      // q' = (0, w) o q / 2 for w in W.
      const Vector3 w = s.V.segment<3>(6 * i);
      const Eigen::Quaterniond q(x[7 * i + 3], x[7 * i + 4], x[7 * i + 5], x[7 * i + 6]);
      const Eigen::Quaterniond turn = Eigen::Quaterniond(0, w[0] / 2, w[1] / 2, w[2] / 2) * q;
      rate.segment<3>(7 * i) = s.V.segment<3>(6 * i + 3);
      rate.segment<4>(7 * i + 3) << turn.w(), turn.vec();
    }
    rate.tail(6 * n) = accelerations(s, loads, kRankThresholdDuringIntegration).bodies;
    return rate;
  };
  const double h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    const Vector x = packed(state), k1 = derivative(x), k2 = derivative(x + h / 2 * k1),
                 k3 = derivative(x + h / 2 * k2), k4 = derivative(x + h * k3);
    state = unpacked(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
  }
  return state;
}

}  // namespace grapnel::oracle
