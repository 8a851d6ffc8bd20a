#pragma once

/// @file
/// Arms at rest on one base that hold one target, with sticking friction at every joint: closed loops, planar and
/// spatial, or a tree. Reference solutions by other convex programs from the mass matrix.

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/simulate/thruster_allocation.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "simulate/phase_case.hpp"

namespace grapnel::testing {

struct ArmsOptions {
  int arms = 2, joints = 3;
  bool planar = true, ground = false;
  GraspModel grasp = GraspModel::rigid;
  double static_share = 1;  // breakaway over Coulomb's friction
};

/// Description of a scene, for equivalent scenes: rotated, with another carrying arm, or in other units.
struct Arms {
  struct Joint {
    JointType type;
    Vector3d axis;
    Posed mount;
    double angle, mass, coulomb;
    Vector3d com;
    Symmetric3d inertia;
  };
  ArmsOptions options;
  std::vector<std::vector<Joint>> arms;
  std::vector<Posed> tips;  // in the last link
  double target_mass;
  Symmetric3d base_inertia, target_inertia;
  Wrenchd load;  // on the target at its centre of mass, in W, with the base in the origin
};

struct Scene {
  Model model;
  State state;
  std::vector<LoopClosure> closures;
  ExternalLoad load;
  std::vector<std::string> joints;  // joint order, equal for equivalent scenes
  PhaseSetup setup() const {
    PhaseSetup s;
    s.closures = closures, s.loads = {load};
    return s;
  }
};

inline Arms random_arms(const ArmsOptions& options, Random& random) {
  Arms a{options, {}, {}, random.log_uniform(20, 400), {}, {}, Wrenchd::zero()};
  const Vector3d z{0, 0, 1};
  for (int k = 0; k < options.arms; ++k) {
    a.arms.emplace_back();
    for (int i = 0; i < options.joints; ++i) {
      Arms::Joint j;
      j.type = !options.planar && random.chance(0.15) ? JointType::prismatic : JointType::revolute;
      j.axis = options.planar ? z : random.direction();
      const double length = random.uniform(0.3, 0.9), around = 2 * M_PI * k / options.arms;
      j.mount.R = Rotationd::identity();
      j.mount.p = i == 0 ? Vector3d{0.7 * std::cos(around), 0.7 * std::sin(around), 0} : Vector3d{length, 0, 0};
      if (!options.planar) j.mount.R = random.rotation(), j.mount.p += random.vector(0.3);
      j.angle = random.uniform(-1.2, 1.2);
      j.mass = random.log_uniform(2, 20);
      j.com = {random.uniform(0.1, 0.4), random.uniform(-0.05, 0.05), 0};
      j.inertia = random_inertia(j.mass, 0.4, random);
      j.coulomb = random.log_uniform(0.2, 5);
      a.arms.back().push_back(j);
    }
    a.tips.push_back({Rotationd::identity(), {random.uniform(0.3, 0.7), 0.02, options.planar ? 0 : 0.1}});
  }
  a.base_inertia = random_inertia(300, 1, random), a.target_inertia = random_inertia(a.target_mass, 1, random);
  a.load = {random.vector(40), random.vector(20)};
  if (options.planar) a.load.angular[0] = a.load.angular[1] = a.load.linear[2] = 0;
  return a;
}

inline Symmetric3d times(double x, const Symmetric3d& I) {
  return {x * I.xx, x * I.yy, x * I.zz, x * I.xy, x * I.xz, x * I.yz};
}

/// The scene of a description, rotated by `R`, in units of length and mass. The arm `carrier` comes first and carries
/// the target.
inline Scene scene_of(const Arms& a, const Rotationd& R = Rotationd::identity(), int carrier = 0, double length = 1,
                      double mass = 1) {
  const double effort = mass * length * length;
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = a.options.ground ? JointType::fixed : JointType::free;
  if (a.options.ground) base.X_PF.R = R;
  base.mass = 300 * mass, base.inertia = times(effort, a.base_inertia);
  ModelBuilder builder;
  builder.add(base);
  const auto name = [](int k, int i) { return "a" + std::to_string(k) + "j" + std::to_string(i); };
  const auto scaled = [&](Posed X) { return Posed{X.R, length * X.p}; };
  for (int n = 0; n < a.options.arms; ++n) {
    const int k = (n + carrier) % a.options.arms;
    for (int i = 0; i < a.options.joints; ++i) {
      const Arms::Joint& j = a.arms[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)];
      BodyDescription b;
      b.name = b.joint.name = name(k, i), b.parent = i == 0 ? "base" : name(k, i - 1);
      b.joint.type = j.type, b.joint.axis = j.axis;
      b.X_PF = scaled(j.mount);
      b.mass = mass * j.mass, b.com = length * j.com, b.inertia = times(effort, j.inertia);
      b.joint.friction.model = JointFriction::Model::sticking;
      b.joint.friction.coulomb = j.coulomb * (j.type == JointType::prismatic ? mass * length : effort);
      b.joint.friction.static_effort = a.options.static_share * b.joint.friction.coulomb;
      builder.add(b);
    }
    if (n > 0) continue;
    BodyDescription target;
    target.name = target.joint.name = "target", target.parent = name(k, a.options.joints - 1);
    target.joint.type = JointType::fixed;
    target.X_PF = scaled(a.tips[static_cast<std::size_t>(k)]);
    if (carrier != 0) {  // at its pose with the first arm as carrier
      const Scene by_first = scene_of(a, R, 0, length, mass);
      const Kinematics there = forward_kinematics(by_first.model, by_first.state);
      target.X_PF = inverse(there.X_WB[by_first.model.body_index(target.parent)]) *
                    there.X_WB[by_first.model.body_index("target")];
    }
    target.mass = mass * a.target_mass, target.inertia = times(effort, a.target_inertia);
    builder.add(target);
  }
  Scene s{builder.build(), {}, {}, {}, {}};
  s.state = zero_state(s.model);
  if (!a.options.ground) set_root_pose(s.model, s.model.body_index("base"), {R, Vector3d::zero()}, s.state);
  for (int k = 0; k < a.options.arms; ++k) {
    for (int i = 0; i < a.options.joints; ++i) {
      const Body& body = s.model.bodies()[s.model.body_index(name(k, i))];
      const Arms::Joint& j = a.arms[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)];
      s.state.q[body.q] = (j.type == JointType::prismatic ? 0.1 * length : 1) * j.angle;
      s.joints.push_back(name(k, i));
    }
  }
  const int target = s.model.body_index("target");
  const Kinematics kinematics = forward_kinematics(s.model, s.state);
  for (int k = 0; k < a.options.arms; ++k) {
    if (k == carrier) continue;
    LoopClosure c;
    c.name = "a" + std::to_string(k), c.model = a.options.grasp;
    c.body_a = s.model.body_index(name(k, a.options.joints - 1)), c.X_AC = scaled(a.tips[static_cast<std::size_t>(k)]);
    c.body_b = target;
    c.X_BD = inverse(kinematics.X_WB[target]) * kinematics.X_WB[c.body_a] * c.X_AC;
    s.closures.push_back(c);
  }
  s.load.body = target;
  s.load.amplitude = {effort * (R * a.load.angular), (mass * length) * (R * a.load.linear)};
  return s;
}

/// The scene at rest in the null space of its closures, from the dense mass matrix and Jacobians: a = A f + b at the
/// joints under their friction f.
struct DenseRest {
  Eigen::MatrixXd A;
  Eigen::VectorXd b, coulomb, breakaway;  // b under the load
  Eigen::VectorXd alone;                  // diagonal of A with the loops open

  explicit DenseRest(const Scene& s) {
    const Kinematics k = forward_kinematics(s.model, s.state);
    const int nv = s.model.velocities();
    const auto jacobian = [&](int body, const Vector3d& p) {
      Eigen::MatrixXd J(6, nv);
      point_jacobian(s.model, k, body, p, J);
      return J;
    };
    Eigen::MatrixXd J(0, nv);
    for (const LoopClosure& c : s.closures) {
      const Vector3d p = k.X_WB[c.body_a] * c.X_AC.p;
      const Eigen::MatrixXd all = jacobian(c.body_a, p) - jacobian(c.body_b, p);
      const Eigen::Index rows = c.model == GraspModel::rigid ? 6 : 3;
      J.conservativeResize(J.rows() + rows, nv);
      J.bottomRows(rows) = all.bottomRows(rows);
    }
    Eigen::MatrixXd Z = Eigen::MatrixXd::Identity(nv, nv);
    if (J.rows() > 0) {
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeFullV);
      Eigen::Index rank = 0;
      while (rank < svd.singularValues().size() && svd.singularValues()[rank] > 1e-9) ++rank;
      Z = svd.matrixV().rightCols(nv - rank);
    }
    Eigen::VectorXd F(6);
    const Wrenchd& w = s.load.amplitude;
    F << w.angular[0], w.angular[1], w.angular[2], w.linear[0], w.linear[1], w.linear[2];
    const Eigen::VectorXd Q = jacobian(s.load.body, k.X_WB[s.load.body] * s.load.p_BP).transpose() * F;
    const auto count = static_cast<Eigen::Index>(s.joints.size());
    Eigen::MatrixXd E = Eigen::MatrixXd::Zero(nv, count);
    coulomb = breakaway = Eigen::VectorXd(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Body& body = s.model.bodies()[s.model.body_index(s.joints[static_cast<std::size_t>(i)])];
      E(body.v, i) = 1;
      coulomb[i] = body.description.joint.friction.coulomb, breakaway[i] = body.description.joint.friction.breakaway();
    }
    const Eigen::LDLT<Eigen::MatrixXd> M(Z.transpose() * mass_matrix(s.model, s.state) * Z);
    A = E.transpose() * Z * M.solve(Z.transpose() * E);
    b = E.transpose() * Z * M.solve(Z.transpose() * Q);
    alone = (E.transpose() * Eigen::LDLT<Eigen::MatrixXd>(mass_matrix(s.model, s.state)).solve(E)).diagonal();
  }

  /// Minimum over all admissible friction of the largest share of breakaway, by a linear program in the directions in
  /// which the joints can move. 0: no friction is required.
  double least_share() const {
    const Eigen::Index n = b.size();
    // In units in which the mobility of each joint alone is 1.
    const Eigen::VectorXd unit = alone.cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        Eigen::MatrixXd(unit.asDiagonal() * A * unit.asDiagonal()));
    Eigen::Index first = 0;
    while (first < n && eigen.eigenvalues()[first] <= 1e-10) ++first;
    const Eigen::MatrixXd V = eigen.eigenvectors().rightCols(n - first).transpose();
    // Columns for shares of breakaway.
    const Eigen::MatrixXd U = V * (breakaway.cwiseQuotient(unit)).asDiagonal();
    const Eigen::VectorXd g = V * unit.cwiseProduct(b);
    const Eigen::VectorXd right = -eigen.eigenvalues().tail(n - first).cwiseInverse().cwiseProduct(g);
    if (first == n || right.norm() == 0) return 0;
    // x = p - m, p + m + rest = share.
    const Eigen::Index rows = U.rows() + n;
    Eigen::MatrixXd L = Eigen::MatrixXd::Zero(rows, 3 * n + 1);
    L.topLeftCorner(U.rows(), n) = U, L.block(0, n, U.rows(), n) = -U;
    for (Eigen::Index i = 0; i < n; ++i) {
      L(U.rows() + i, i) = L(U.rows() + i, n + i) = L(U.rows() + i, 2 * n + i) = 1;
      L(U.rows() + i, 3 * n) = -1;
    }
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(rows), cost = Eigen::VectorXd::Zero(3 * n + 1);
    rhs.head(U.rows()) = right, cost[3 * n] = 1;
    return min_cost(L, rhs, cost).value()[3 * n];
  }

  /// Accelerations of the convex program min 1/2 (a - a_free)^T M (a - a_free) + sum c |a| in its dual, by accelerated
  /// projected gradients with restarts.
  Eigen::VectorXd accelerations() const {
    const Eigen::MatrixXd S = coulomb.asDiagonal() * A * coulomb.asDiagonal();
    const Eigen::VectorXd g = coulomb.cwiseProduct(b);
    const double step = 1 / std::max(S.norm(), 1e-300);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(g.size()), y = x;
    double t = 1;
    for (int i = 0; i < 400'000; ++i) {
      const Eigen::VectorXd next = (y - step * (S * y + g)).cwiseMax(-1).cwiseMin(1);
      const Eigen::VectorXd change = next - x;
      if ((y - next).dot(change) > 0) {
        t = 1, y = next;
      } else {
        const double after = 0.5 * (1 + std::sqrt(1 + 4 * t * t));
        y = next + ((t - 1) / after) * change, t = after;
      }
      x = next;
      if (i > 100 && change.cwiseAbs().maxCoeff() < 1e-16) break;
    }
    return A * coulomb.cwiseProduct(x) + b;
  }
};

/// Grapnel's solution of a scene.
struct RestAnswer {
  Eigen::VectorXd acceleration, friction, sense;  // sense 0: held
  bool held = true;                               // all joints
};

inline RestAnswer answer_of(const Scene& s) {
  PhaseDynamics dynamics(s.model, s.setup());
  const std::vector<double> y = dynamics.initial(s.state, 0);
  dynamics.begin_control(0, 1);
  dynamics.choose_modes(0, y);
  std::vector<double> motor(s.model.joints().size()), friction(motor);
  dynamics.efforts(0, y, motor, friction);
  const auto count = static_cast<Eigen::Index>(s.joints.size());
  RestAnswer answer{Eigen::VectorXd(count), Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const int body = s.model.body_index(s.joints[static_cast<std::size_t>(i)]);
    const auto at = std::find(s.model.joints().begin(), s.model.joints().end(), body) - s.model.joints().begin();
    const JointModes::Joint& j = *dynamics.joint_modes().of(static_cast<std::size_t>(at));
    answer.acceleration[i] = dynamics.acceleration()[s.model.bodies()[body].v];
    answer.friction[i] = friction[static_cast<std::size_t>(at)];
    answer.sense[i] = j.mode == JointModes::Mode::held ? 0 : j.sense;
    answer.held = answer.held && answer.sense[i] == 0;
  }
  return answer;
}

}  // namespace grapnel::testing
