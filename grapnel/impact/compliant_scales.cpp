#include "grapnel/impact/compliant_scales.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/impact/compliant_system.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Rounding error of coordinates of order one.
constexpr double kAngleRounding = 2e-15;
// Minimum scale of errors at any contact or grasp, relative to the fastest one.
constexpr double kMinShare = 1e-3;

// One interface: relative Jacobian over the free velocities, and the response to a rigid impact.
struct Interface {
  Eigen::MatrixXd response;                   // M^-1 J^T, velocities x 6
  Eigen::MatrixXd half;                       // L^-1 J^T of the Cholesky factor
  double speed = 0, turn = 0;                 // relative [m/s, rad/s]
  double mobility = 0, angular_mobility = 0;  // [1/kg, 1/(kg m^2)]
  double time = 0, angular_time = 0;          // of the springs; 0: none [s]
  double impulse() const { return speed / mobility; }
  double angular_impulse() const { return turn / angular_mobility; }
};

Eigen::MatrixXd relative_jacobian(const Model& model, const Kinematics& k, const CompliantSystem& system, int robot,
                                  int target, const Vector3d& p_WC) {
  Eigen::MatrixXd J_E(6, model.velocities()), J_T(6, model.velocities());
  point_jacobian(model, k, robot, p_WC, J_E);
  point_jacobian(model, k, target, p_WC, J_T);
  J_E -= J_T;
  for (int v = 0; v < model.velocities(); ++v) {
    if (system.is_held(v)) J_E.col(v).setZero();  // held velocities do not respond
  }
  return J_E;
}

// Mass matrix => its factors with unit rows for held velocities, which do not respond.
Cholesky free_inertia(Eigen::MatrixXd M, const CompliantSystem& system) {
  for (int v = 0; v < static_cast<int>(M.rows()); ++v) {
    if (system.is_held(v)) M.row(v).setZero(), M.col(v).setZero(), M(v, v) = 1;
  }
  return Cholesky(M);
}

// Projects responses L^-1 J^T onto the motions that loop closures leave free.
class FreeMotions {
 public:
  FreeMotions(const Model& model, const Kinematics& k, const CompliantSystem& system, const Cholesky& inertia) {
    if (system.loops().empty()) return;
    Eigen::MatrixXd J = grasp_jacobian(model, k, system.closed_grasps(k));
    for (int v = 0; v < model.velocities(); ++v) {
      if (system.is_held(v)) J.col(v).setZero();
    }
    Y_ = lower_solution(inertia, J.transpose());
    inverse_ = pseudo_inverse(Y_.transpose() * Y_, 1e-11);
  }
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& half) const {
    if (Y_.size() == 0) return half;
    return half - Y_ * (inverse_ * (Y_.transpose() * half));
  }
  bool any() const { return Y_.size() > 0; }

 private:
  Eigen::MatrixXd Y_, inverse_;
};

// Rotation and translation are coupled: each has at least the energy of the other as its scale.
void share_speeds(Interface& i, double turn, double speed) {
  const double radius = std::sqrt(i.mobility / i.angular_mobility);
  i.turn = turn + speed / radius;
  i.speed = speed + turn * radius;
}

Interface contact_interface(const CompliantContact& c, const Eigen::MatrixXd& W, const Twistd& u, double speed,
                            const Interface& floors) {
  Interface i;
  const Eigen::Vector3d n(c.n_W[0], c.n_W[1], c.n_W[2]);
  i.mobility = std::max(n.dot(W.bottomRightCorner<3, 3>() * n), floors.mobility);
  i.angular_mobility = std::max(W.topLeftCorner<3, 3>().trace() / 3, floors.angular_mobility);
  const double approach = std::max(-dot(u.linear, c.n_W), 1e-3 * speed);
  i.time = largest_deformation(c, 1 / i.mobility, approach) / approach;
  share_speeds(i, 0, c.friction > 0 ? norm(u.linear) : approach);
  return i;
}

Interface grasp_interface(const CompliantGrasp& g, const Eigen::MatrixXd& W, const Twistd& u, const Interface& floors) {
  Interface i;
  i.mobility = std::max(W.bottomRightCorner<3, 3>().trace() / 3, floors.mobility);
  i.angular_mobility = std::max(W.topLeftCorner<3, 3>().trace() / 3, floors.angular_mobility);
  const bool turns = g.grasp.model != GraspModel::point;
  i.time = 1 / std::sqrt(g.linear_stiffness * i.mobility);
  i.angular_time = turns ? 1 / std::sqrt(g.angular_stiffness * i.angular_mobility) : 0;
  share_speeds(i, turns ? norm(u.angular) : 0, norm(u.linear));
  return i;
}

// An interface that barely moves alone is moved by the others, since M^-1 is common to all. The remaining ones use a
// fraction of the fastest as scale, since velocities have the rounding errors of the bodies' velocities.
void share_among(std::vector<Interface>& interfaces) {
  const std::vector<Interface> alone = interfaces;
  double speed = 0, turn = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    double induced = 0, induced_turn = 0;
    for (std::size_t j = 0; j < alone.size(); ++j) {
      if (i == j) continue;
      const Eigen::Matrix<double, 6, 6> W = alone[i].half.transpose() * alone[j].half;
      const double P = alone[j].impulse(), L = alone[j].angular_impulse();
      induced += W.bottomRightCorner<3, 3>().norm() * P + W.bottomLeftCorner<3, 3>().norm() * L;
      induced_turn += W.topRightCorner<3, 3>().norm() * P + W.topLeftCorner<3, 3>().norm() * L;
    }
    interfaces[i].speed = std::max(interfaces[i].speed, induced);
    interfaces[i].turn = std::max(interfaces[i].turn, induced_turn);
    speed = std::max(speed, interfaces[i].speed), turn = std::max(turn, interfaces[i].turn);
  }
  for (Interface& i : interfaces) {
    i.speed = std::max(i.speed, kMinShare * speed), i.turn = std::max(i.turn, kMinShare * turn);
  }
}

// Relative inertia of the stacked twists in the grasps' directions, in W: A^T (A W A^T)^+ A.
Eigen::MatrixXd relative_inertia(std::span<const CompliantGrasp> grasps, std::span<const Interface> of_grasps) {
  const Eigen::Index count = static_cast<Eigen::Index>(grasps.size());
  if (count == 0) return {};
  Eigen::MatrixXd Y(of_grasps[0].half.rows(), 6 * count);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6 * count, 6 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    Y.middleCols(6 * i, 6) = of_grasps[i].half;
    const Eigen::MatrixXd a = constrained_directions(grasps[i].grasp);
    A.block(6 * i, 6 * i, a.rows(), 6) = a;
  }
  return A.transpose() * pseudo_inverse(A * Y.transpose() * Y * A.transpose(), 1e-11) * A;
}

// Interfaces with their rigid impulses => scales.of_y, the largest change of each integrated quantity in a rigid
// impact. Velocities: |M^-1 J^T| P; displacements: velocities times the shortest spring time; energies: u P / 2
// (docs/theory, section 12, Error control).
void fill_sizes(const Model& model, const CompliantSystem& system, std::span<const Interface> interfaces,
                CompliantScales& scales) {
  std::vector<double>& size = scales.of_y;
  size.assign(system.size(), 0.0);
  const double time = scales.shortest_time;
  Eigen::VectorXd v = Eigen::VectorXd::Zero(model.velocities());
  double energy = 0, impulse = 0, moment = 0;
  for (const Interface& i : interfaces) {
    v += i.response.rightCols(3).rowwise().norm() * i.impulse() +
         i.response.leftCols(3).rowwise().norm() * i.angular_impulse();
    energy += 0.5 * (i.speed * i.impulse() + i.turn * i.angular_impulse());
    impulse += i.impulse(), moment += i.angular_impulse();
  }
  if (v.size() > 0) v = v.cwiseMax(1e-6 * v.maxCoeff());
  for (const TreeLink<double>& link : model.tree().links) {
    const JointTraits& joint = traits_of(link.joint);
    if (joint.quaternion < 0) {
      for (int k = 0; k < joint.velocities; ++k) size[link.q + k] = time * v[link.v + k];
      continue;
    }
    for (int k = 0; k < 4; ++k) size[link.q + joint.quaternion + k] = 0.5 * time * v.segment(link.v, 3).norm();
    if (joint.position >= 0) {
      // For the centre of mass, or a held root.
      for (int k = 0; k < 3; ++k)
        size[link.q + joint.position + k] = time * std::max(impulse / model.mass(), v.segment(link.v + 3, 3).norm());
    }
  }
  for (std::size_t r = 0; r < system.integrated_rates().size(); ++r) {
    size[system.rate_offset() + r] = v[system.integrated_rates()[r]];
  }
  for (int i = 0; i < system.interfaces(); ++i) {
    for (int k = 0; k < 3; ++k) {
      size[system.impulse_offset(i) + k] = interfaces[i].angular_impulse();
      size[system.impulse_offset(i) + 3 + k] = interfaces[i].impulse();
    }
    size[system.loss_offset(i)] = energy;
  }
  const Kinematics at_start = forward_kinematics(model, system.now());
  for (std::size_t l = 0; l < system.loops().size(); ++l) {
    const LoopClosure& loop = system.loops()[l];
    const double arm = norm((at_start.X_WB[loop.body_a] * loop.X_AC).p - system.channel_point());
    for (int n = 0; n < 3; ++n) {
      size[system.loop_offset(static_cast<int>(l)) + n] = moment + arm * impulse;
      size[system.loop_offset(static_cast<int>(l)) + 3 + n] = impulse;
    }
  }
  for (int h = system.held_offset(0); h < system.work_offset(); ++h) size[h] = impulse;
  for (int w = system.work_offset(); w < system.size(); ++w) size[w] = energy;
}

// Changes of velocities => sizes of coordinates and rates that are at least theirs, with the time of (12.15).
void raise_motion_sizes(const Model& model, const CompliantSystem& system, const Eigen::VectorXd& v, double time,
                        std::vector<double>& size) {
  const auto raise = [&](int index, double value) { size[index] = std::max(size[index], value); };
  for (const TreeLink<double>& link : model.tree().links) {
    const JointTraits& joint = traits_of(link.joint);
    if (joint.quaternion < 0) {
      for (int k = 0; k < joint.velocities; ++k) raise(link.q + k, time * v[link.v + k]);
      continue;
    }
    for (int k = 0; k < 4; ++k) raise(link.q + joint.quaternion + k, 0.5 * time * v.segment(link.v, 3).norm());
    for (int k = 0; joint.position >= 0 && k < 3; ++k)
      raise(link.q + joint.position + k, time * v.segment(link.v + 3, 3).norm());
  }
  for (std::size_t r = 0; r < system.integrated_rates().size(); ++r)
    raise(system.rate_offset() + static_cast<int>(r), v[system.integrated_rates()[r]]);
}

}  // namespace

// State, contacts, grasps => speeds [m/s], spring times [s], relative inertia of the grasps and scales of all
// integrated quantities. Each interface is estimated alone with W = J M^-1 J^T, held velocities removed; then speeds
// caused by the other interfaces are included.
CompliantScales compliant_scales(const Model& model, const State& state, const CompliantSystem& system,
                                 std::span<const CompliantContact> contacts, std::span<const CompliantGrasp> grasps) {
  CompliantScales scales;
  const Kinematics k = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const Cholesky held_out = free_inertia(M, system);
  for (const InterfaceLoad& load : system.loads()) scales.speed = std::max(scales.speed, norm(load.u.linear));
  const FreeMotions free_motions(model, k, system, held_out);
  std::vector<Interface> interfaces;
  const auto add = [&](int robot, int target, const Vector3d& p_WC, auto&& estimate) {
    const Eigen::MatrixXd J = relative_jacobian(model, k, system, robot, target, p_WC);
    const Eigen::MatrixXd half = free_motions(lower_solution(held_out, J.transpose()));
    const Eigen::MatrixXd response =
        free_motions.any() ? upper_solution(held_out, half) : cholesky_solution(held_out, J.transpose());
    Interface floors;
    // Reached only if no free body is pushed: a free target alone has a larger mobility.
    floors.mobility = 1 / model.mass();
    floors.angular_mobility = 1 / std::max(M.trace(), model.mass());
    Interface i = estimate(Eigen::MatrixXd(J * response), floors);
    i.response = response;
    i.half = half;
    interfaces.push_back(std::move(i));
  };
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    add(contacts[c].robot_body, contacts[c].target_body, contacts[c].p_WC, [&](const auto& W, const Interface& floors) {
      return contact_interface(contacts[c], W, system.loads()[c].u, scales.speed, floors);
    });
    scales.longest_contact_time = std::max(scales.longest_contact_time, interfaces.back().time);
  }
  for (std::size_t g = 0; g < grasps.size(); ++g) {
    const Grasp& grasp = grasps[g].grasp;
    add(grasp.robot_body, grasp.target_body, grasp.p_WC, [&](const auto& W, const Interface& floors) {
      return grasp_interface(grasps[g], W, system.loads()[contacts.size() + g].u, floors);
    });
    scales.longest_grasp_time =
        std::max({scales.longest_grasp_time, interfaces.back().time, interfaces.back().angular_time});
  }
  share_among(interfaces);
  scales.shortest_time = std::numeric_limits<double>::infinity();
  for (const Interface& i : interfaces) {
    scales.speed = std::max(scales.speed, i.speed);
    scales.shortest_time = std::min(scales.shortest_time, i.time);
    if (i.angular_time > 0) scales.shortest_time = std::min(scales.shortest_time, i.angular_time);
  }
  scales.grasp_inertia = relative_inertia(grasps, std::span(interfaces).subspan(contacts.size()));
  fill_sizes(model, system, interfaces, scales);
  return scales;
}

// Touching pairs => sizes that are at least those of an impact at each pair alone, at its relative speed or the largest
// one of the interfaces. Obstacles do not respond.
void CompliantScales::add_shapes(const Model& model, const CompliantSystem& system, const ContactSet& contacts) {
  const State& state = system.now();
  const Kinematics k = forward_kinematics(model, state);
  const Cholesky inertia = free_inertia(mass_matrix(model, state), system);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(model.velocities());
  for (std::size_t pair = 0; pair < contacts.size(); ++pair) {
    if (contacts.mode(pair) != ContactSet::Mode::touching) continue;
    const auto [a, b] = contacts.bodies_of(pair);
    const ShapeSeparation at = contacts.separation(pair, k);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, model.velocities());
    for (const int body : {a, b}) {
      if (body < 0) continue;
      Eigen::MatrixXd J_P(6, model.velocities());
      point_jacobian(model, k, body, at.point_a, J_P);
      J += (body == b ? 1.0 : -1.0) * J_P;
    }
    for (int i = 0; i < model.velocities(); ++i) {
      if (system.is_held(i)) J.col(i).setZero();
    }
    const Eigen::MatrixXd response = cholesky_solution(inertia, J.transpose());
    const Eigen::MatrixXd W = J * response;
    const double mobility = std::max(W.bottomRightCorner<3, 3>().trace() / 3, 1 / model.mass());
    const Eigen::Map<const Eigen::VectorXd> rates(state.v.data(), static_cast<Eigen::Index>(state.v.size()));
    const double P = std::max(speed, Eigen::VectorXd(J * rates).tail<3>().norm()) / mobility;
    v = v.cwiseMax(response.rightCols(3).rowwise().norm() * P);
    shape_impulse = std::max(shape_impulse, P);
    shape_moment = std::max(shape_moment, P * norm(at.point_a - system.channel_point()));
  }
  if (!(shape_impulse > 0)) shape_impulse = speed * model.mass();  // no pair touches yet
  shape_moment = std::max(shape_moment, 1e-3 * shape_impulse);
  raise_motion_sizes(model, system, v, shortest_time, of_y);
}

std::vector<double> absolute_tolerances(const Model& model, const CompliantScales& scales, double relative) {
  std::vector<double> tolerance(scales.of_y);
  for (double& x : tolerance) x = x > 0 ? x * relative : relative;  // zero: never changes
  for (int q = 0; q < model.coordinates(); ++q) tolerance[q] = std::max(tolerance[q], 1e-19);
  const auto floor = [&](int q, int count) {
    for (int k = 0; k < count; ++k) tolerance[q + k] = std::max(tolerance[q + k], kAngleRounding);
  };
  for (int offset : model.quaternions()) floor(offset, 4);
  for (int joint : model.joints()) floor(model.bodies()[joint].q, 1);
  return tolerance;
}

}  // namespace grapnel
