#include "grapnel/control/grasp_force.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/control/detumbling.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Singular values below these parts of the largest: directions in which efforts do not move the target, or do not load
// it.
constexpr double kImmovable = 1e-12, kUnloaded = 1e-9;

using Wrench6 = Eigen::Matrix<double, 6, 1>;

Wrench6 six(const Vector3d& angular, const Vector3d& linear) {
  Wrench6 v;
  v << angular[0], angular[1], angular[2], linear[0], linear[1], linear[2];
  return v;
}

Eigen::Matrix3d crossing(const Vector3d& r) {
  Eigen::Matrix3d m;
  m << 0, -r[2], r[1], r[2], 0, -r[0], -r[1], r[0], 0;
  return m;
}

// Transformation of a wrench to a point at -r from its point of application: [N + r x F; F].
Eigen::Matrix<double, 6, 6> moved(const Vector3d& r) {
  Eigen::Matrix<double, 6, 6> m = Eigen::Matrix<double, 6, 6>::Identity();
  m.topRightCorner<3, 3>() = crossing(r);
  return m;
}

LoopClosure as_closure(const GraspForceLaw::Hold& hold) {
  LoopClosure closure;
  closure.model = hold.model, closure.hinge_C = hold.hinge_C;
  return closure;
}

double gyration_radius(const BodyDescription& body) {
  return std::sqrt((body.inertia.xx + body.inertia.yy + body.inertia.zz) / (2 * body.mass));
}

Eigen::Matrix3d as_matrix(const Symmetric3d& I) {
  return Eigen::Matrix3d{{I.xx, I.xy, I.xz}, {I.xy, I.yy, I.yz}, {I.xz, I.yz, I.zz}};
}

// The minimum-norm solution, from a singular value decomposition.
struct Solved {
  Eigen::VectorXd x;
  Eigen::MatrixXd directions;  // orthonormal directions of x
  Eigen::VectorXd singular_values;
};
Solved shortest(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold, double scale) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Solved solved{{}, {}, svd.singularValues()};
  const double least = threshold * std::max(scale, solved.singular_values.size() > 0 ? solved.singular_values[0] : 0.0);
  Eigen::Index rank = 0;
  while (rank < solved.singular_values.size() && solved.singular_values[rank] > least) ++rank;
  Eigen::VectorXd along = svd.matrixU().leftCols(rank).transpose() * b;
  along = along.cwiseQuotient(solved.singular_values.head(rank));
  solved.directions = svd.matrixV().leftCols(rank);
  solved.x = solved.directions * along;
  return solved;
}

}  // namespace

double squeeze_at(const GraspForceLaw::Pair& pair, double time) {
  if (time < pair.begin) return 0;
  const double s = pair.ramp > 0 ? std::min(1.0, (time - pair.begin) / pair.ramp) : 1;
  return pair.force * s * s * s * (10 + s * (6 * s - 15));
}

// Poses => grasp map: transmitted directions, projector onto internal wrenches (21.11), and unit squeezes of all pairs.
GraspMap grasp_map(const GraspForceLaw& law, const Model& model, const Kinematics& kinematics) {
  const auto count = static_cast<Eigen::Index>(law.holds.size());
  const Posed& X_WT = kinematics.X_WB[law.target];
  const Vector3d com = X_WT * model.bodies()[law.target].description.com;
  GraspMap map;
  // Directions that the grasps transmit: forces, and moments about the constrained axes.
  std::vector<Eigen::VectorXd> columns;
  Eigen::MatrixXd G(6, 6 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const GraspForceLaw::Hold& hold = law.holds[i];
    const Posed X_WC = X_WT * hold.X_TC;
    G.middleCols(6 * i, 6) = moved(X_WC.p - com);
    G.middleCols(6 * i, 3) *= law.moment_length;
    Vector3d axes[3];
    const int turns = forbidden_turns(as_closure(hold), axes);
    for (int k = 0; k < turns + 3; ++k) {
      Eigen::VectorXd column = Eigen::VectorXd::Zero(6 * count);
      if (k < turns) {
        const Vector3d n = X_WC.R * axes[k];
        column.segment<3>(6 * i) = Eigen::Vector3d(n[0], n[1], n[2]);
      } else {
        column[6 * i + k - turns + 3] = 1;
      }
      columns.push_back(std::move(column));
    }
  }
  map.passes.resize(6 * count, columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c) map.passes.col(c) = columns[c];
  const Eigen::MatrixXd passed = G * map.passes;
  map.internal = Eigen::MatrixXd::Identity(passed.cols(), passed.cols()) -
                 passed.transpose() * pseudo_inverse(passed * passed.transpose(), 1e-12) * passed;
  map.pairs.resize(passed.cols(), law.pairs.size());
  for (std::size_t p = 0; p < law.pairs.size(); ++p) {
    const auto a = static_cast<Eigen::Index>(law.pairs[p].a), b = static_cast<Eigen::Index>(law.pairs[p].b);
    const Vector3d offset = X_WT * law.holds[law.pairs[p].b].X_TC.p - X_WT * law.holds[law.pairs[p].a].X_TC.p;
    const Vector3d u = (1 / norm(offset)) * offset;
    Eigen::VectorXd f = Eigen::VectorXd::Zero(6 * count);
    f.segment<3>(6 * a + 3) = Eigen::Vector3d(u[0], u[1], u[2]);
    f.segment<3>(6 * b + 3) = -Eigen::Vector3d(u[0], u[1], u[2]);
    map.pairs.col(p) = map.passes.transpose() * f;
  }
  return map;
}

HoldDeviation hold_deviation(const GraspForceLaw& law, const Model& model, const Kinematics& kinematics) {
  const Posed X_BT = inverse(kinematics.X_WB[law.base]) * kinematics.X_WB[law.target];
  const Vector3d& com = model.bodies()[law.target].description.com;
  return {norm(X_BT * com - law.X_BT * com), norm(rotation_vector(transpose(law.X_BT.R) * X_BT.R))};
}

// The target's acceleration A tau + free, and its demanded value, rows multiplied by `size`.
struct GraspForce::Motion {
  Eigen::MatrixXd A;
  Wrench6 free, wanted, size;
};

// Response of the robot => rows of the target's acceleration and its demanded value: braking (15.3), (15.5), or
// critically damped motion relative to the base (21.13).
GraspForce::Motion GraspForce::target_motion_rows() const {
  const Model& model = response_.model();
  const Kinematics& k = response_.kinematics();
  const BodyDescription& target = model.bodies()[law_.target].description;
  const Posed& X_WT = k.X_WB[law_.target];
  const Vector3d w = k.V_WB[law_.target].angular, arm = X_WT.R * target.com, com = X_WT.p + arm;
  const BodyAcceleration& terms = response_.velocity_terms()[law_.target];
  Motion motion;
  motion.size = Wrench6::Ones();
  motion.size.head<3>().setConstant(gyration_radius(target));
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, k, law_.target, com, J);
  motion.free = six(terms.angular, terms.linear + cross(terms.angular, arm) + cross(w, cross(w, arm)));
  if (law_.brakes) {  // (15.3), (15.5)
    const int bodies[] = {law_.target};
    const TargetMotion3d now = target_motion(model, k, bodies);
    const double L = norm(now.angular_momentum);
    const double rate = L > 0 ? std::min(law_.rate, law_.torque / L) : law_.rate;
    const Vector3d w_T = transposed_times(X_WT.R, w), gyroscopic = cross(w_T, target.inertia * w_T);
    const Eigen::Vector3d turning =
        as_matrix(target.inertia).llt().solve(Eigen::Vector3d(gyroscopic[0], gyroscopic[1], gyroscopic[2]));
    const Vector3d falls = model.has_free_root(law_.target) ? gravity_ : Vector3d::zero();
    motion.wanted = six(X_WT.R * Vector3d{-turning[0], -turning[1], -turning[2]}, falls) - rate * six(w, now.velocity);
  } else {  // relative to the base, in its axes (21.13)
    const Posed& X_WB = k.X_WB[law_.base];
    const Vector3d w_B = k.V_WB[law_.base].angular, r = com - X_WB.p;
    const BodyAcceleration& carried = response_.velocity_terms()[law_.base];
    const Twistd V_T = shift(k.V_WB[law_.target], arm), V_B = shift(k.V_WB[law_.base], r);
    const Vector3d turning = V_T.angular - V_B.angular, moving = V_T.linear - V_B.linear;
    motion.free -= six(carried.angular + cross(w_B, turning), carried.linear + cross(carried.angular, r) +
                                                                  cross(w_B, cross(w_B, r)) + 2.0 * cross(w_B, moving));
    Eigen::MatrixXd J_B(6, model.velocities());
    point_jacobian(model, k, law_.base, com, J_B);
    J -= J_B;
    const Rotationd R_WD = X_WB.R * law_.X_BT.R;
    const Vector3d apart = com - X_WB * (law_.X_BT * target.com),
                   turn = R_WD * rotation_vector(transpose(R_WD) * X_WT.R);
    motion.wanted = -2 * law_.rate * six(turning, moving) - law_.rate * law_.rate * six(turn, apart);
  }
  motion.free += J * response_.free();
  motion.A = J * response_.response();
  return motion;
}

// Stacked wrenches of the grasps on the target, moments divided by the metric's length: free + A tau (21.12).
struct GraspForce::Wrenches {
  Eigen::MatrixXd A;
  Eigen::VectorXd free;
};

// Response of the robot => stacked grasp wrenches free + A tau (21.12); that of a grasp in the tree from the target's
// equation of motion.
GraspForce::Wrenches GraspForce::wrenches() const {
  const Model& model = response_.model();
  const Kinematics& k = response_.kinematics();
  const BodyDescription& target = model.bodies()[law_.target].description;
  const Posed& X_WT = k.X_WB[law_.target];
  const Vector3d w = k.V_WB[law_.target].angular, arm = X_WT.R * target.com, com = X_WT.p + arm;
  const auto n = static_cast<Eigen::Index>(joints().size()), count = static_cast<Eigen::Index>(law_.holds.size());
  // The sum of all, about the centre of mass, from the motion of the target.
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, k, law_.target, com, J);
  const BodyAcceleration& terms = response_.velocity_terms()[law_.target];
  Wrench6 a = six(terms.angular, terms.linear + cross(terms.angular, arm) + cross(w, cross(w, arm)));
  a += J * response_.free() - six(Vector3d::zero(), gravity_);
  const Symmetric3d I_W = rotate(X_WT.R, target.inertia);
  Eigen::Matrix<double, 6, 6> inertia = target.mass * Eigen::Matrix<double, 6, 6>::Identity();
  inertia.topLeftCorner<3, 3>() = as_matrix(I_W);
  Wrench6 all = inertia * a + six(cross(w, I_W * w), Vector3d::zero());
  Eigen::MatrixXd all_A = inertia * (J * response_.response());

  Wrenches f{Eigen::MatrixXd::Zero(6 * count, n), Eigen::VectorXd::Zero(6 * count)};
  std::vector<Eigen::Index> first_row;
  Eigen::Index row = 0;
  for (const LoopClosure& closure : response_.closures()) first_row.push_back(row), row += row_count(closure.model);
  Eigen::Index in_tree = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const GraspForceLaw::Hold& hold = law_.holds[i];
    if (hold.closure < 0) {
      in_tree = i;
      continue;
    }
    const LoopClosure& closure = response_.closures()[hold.closure];
    const Posed X_WC = k.X_WB[closure.body_a] * closure.X_AC;
    Vector3d axes[3];
    const int turns = forbidden_turns(closure, axes);
    Eigen::MatrixXd of_rows = Eigen::MatrixXd::Zero(6, turns + 3);
    for (int r = 0; r < turns + 3; ++r) {
      const Vector3d d = r < turns ? X_WC.R * axes[r] : X_WC.R.column(r - turns);
      of_rows.block<3, 1>(r < turns ? 0 : 3, r) = Eigen::Vector3d(d[0], d[1], d[2]);
    }
    const Eigen::Index at = first_row[hold.closure];
    f.free.segment<6>(6 * i) = of_rows * response_.free_multipliers().segment(at, turns + 3);
    f.A.middleRows(6 * i, 6) = of_rows * response_.multiplier_response().middleRows(at, turns + 3);
    const Eigen::Matrix<double, 6, 6> to_com = moved(X_WC.p - com);
    all -= to_com * f.free.segment<6>(6 * i), all_A -= to_com * f.A.middleRows(6 * i, 6);
  }
  // The remainder is the wrench of the first grasp.
  const Posed X_WC = X_WT * law_.holds[in_tree].X_TC;
  const Eigen::Matrix<double, 6, 6> from_com = moved(com - X_WC.p);
  f.free.segment<6>(6 * in_tree) = from_com * all, f.A.middleRows(6 * in_tree, 6) = from_com * all_A;
  for (Eigen::Index i = 0; i < count; ++i)
    f.free.segment<3>(6 * i) /= law_.moment_length, f.A.middleRows(6 * i, 3) /= law_.moment_length;
  return f;
}

// State and time => efforts: minimum-norm solution for the target's motion, then for the internal wrenches in its null
// space (21.14), then damping; internal force and damping are scaled to the effort limits.
JointLawCommand GraspForce::at(double time, const State& state, std::span<const double> force) {
  response_.update(state, force, gravity_);
  const auto n = static_cast<Eigen::Index>(joints().size());
  const Eigen::VectorXd root = as_vector(law_.damping).cwiseSqrt();  // tau = root x with minimum |x|
  const Motion motion = target_motion_rows();
  const Eigen::MatrixXd A = motion.size.asDiagonal() * motion.A * root.asDiagonal();
  const Solved moving = shortest(A, motion.size.cwiseProduct(motion.wanted - motion.free), kImmovable, 0);

  // Internal part of the wrenches, by efforts that do not move the target (21.14).
  const GraspMap map = grasp_map(law_, response_.model(), response_.kinematics());
  const Wrenches f = wrenches();
  Eigen::VectorXd reference = Eigen::VectorXd::Zero(map.internal.rows());
  for (std::size_t p = 0; p < law_.pairs.size(); ++p) reference += squeeze_at(law_.pairs[p], time) * map.pairs.col(p);
  const Eigen::MatrixXd inside = map.internal * (map.passes.transpose() * f.A) * root.asDiagonal();
  const Eigen::VectorXd missing = map.internal * reference - map.internal_part(f.free) - inside * moving.x;
  Eigen::MatrixXd beside = inside;
  beside -= (inside * moving.directions) * moving.directions.transpose();
  const Solved squeezing = shortest(beside, missing, kUnloaded, inside.norm());
  internal_rank_ = static_cast<int>(squeezing.directions.cols());

  // The remaining motion is damped.
  Eigen::VectorXd still(n);
  for (Eigen::Index j = 0; j < n; ++j) still[j] = -root[j] * state.v[response_.velocity(static_cast<std::size_t>(j))];
  still -= moving.directions * (moving.directions.transpose() * still);
  still -= squeezing.directions * (squeezing.directions.transpose() * still);

  JointLawCommand command;
  const Eigen::VectorXd& s = moving.singular_values;
  command.condition = n >= 6 && s[0] > 0 ? s[5] / s[0] : 0;
  const std::vector<double>& limits = response_.limits();
  command.effort = root.cwiseProduct(moving.x);
  const auto share = largest_share(command.effort, root.cwiseProduct(squeezing.x), limits, 1);
  command.within_limits = share.has_value(), command.scale = share.value_or(0);
  command.effort += command.scale * root.cwiseProduct(squeezing.x);
  const Eigen::VectorXd damping = root.cwiseProduct(still);
  if (share) command.effort += largest_share(command.effort, damping, limits, 1).value_or(0) * damping;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double limit = limits[j];
    command.effort[j] = std::clamp(command.effort[j], -limit, limit);
  }
  return command;
}

}  // namespace grapnel
