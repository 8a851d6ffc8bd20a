#include "grapnel/impact/impulse_sensitivity.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include "grapnel/dynamics/composite_body.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"
#include "grapnel/impact/yielding_drives.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Relative tolerance for motions that the arm can follow, and for consistency of rows.
constexpr double kFollows = 1e-9;
constexpr double kConsistent = 1e-7;
// Singular values of an arm's Jacobian below this fraction of the largest are zero.
constexpr double kArmTolerance = 1e-9;

const char* const kAxisNames[] = {" x", " y", " z"};

// Vector, index => its components first to first + 2.
Vector3d as_vector3(const Eigen::VectorXd& x, Eigen::Index first) { return {x[first], x[first + 1], x[first + 2]}; }

// One parameter: its name, and its direction of change of the problem.
struct Parameter {
  std::string name, unit;
  int grasp;
  ImpactVariation variation;
};

// --- The solution's derivative. -------------------------------------------------------------------------------------

// The solved impact, decomposed once as in (7.5), and its derivative along variations.
class SolvedImpact {
 public:
  SolvedImpact(const Model& model, const State& state, std::span<const Grasp> grasps, std::span<const HeldRate> held)
      : model_(model),
        state_(state),
        grasps_(grasps),
        held_(held),
        impact_(vary_impact(model, state, grasps, held, ImpactVariation(model))),
        mass_(impact_.M.value),
        metric_(impact_.D.value) {
    const ImpactSolution solution = plastic_impact(model, state, grasps, held);
    after_ = as_vector(solution.velocity);
    change_ = after_ - as_vector(state.v);
    impulse_.resize(solution.rows);
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < grasps.size(); ++i) {
      const Impulsed& P = solution.contacts[i].P_WC;
      Eigen::Matrix<double, 6, 1> P6;
      P6 << P.angular[0], P.angular[1], P.angular[2], P.linear[0], P.linear[1], P.linear[2];
      const Eigen::MatrixXd& A = impact_.directions[i].value;
      impulse_.segment(row, A.rows()) = A * P6;
      row += A.rows();
    }
    for (double P : solution.held_impulses) impulse_[row++] = P;
    decompose(solution.rank);
    const std::vector<bool> was_overpowered = which_was_overpowered(model, held, solution.velocity);
    contradiction_ = std::find(was_overpowered.begin(), was_overpowered.end(), true) != was_overpowered.end();
  }

  // Derivatives of v+ and of the impulses in all rows; empty where they do not exist.
  struct Derivative {
    Eigen::VectorXd velocity, impulse;
    std::vector<DualMatrix> directions;
  };
  std::optional<Derivative> along(const ImpactVariation& variation, std::string& undefined) const {
    if (contradiction_) {
      undefined = "the held rates contradict the grasps";
      return {};
    }
    const VariedImpact d = vary_impact(model_, state_, grasps_, held_, variation);
    // A' = L^-1 J'^T G^-T; (1 - Q Q^T) A' Z_0 = 0 keeps the rank (13.14).
    const Eigen::MatrixXd dA = scaled(d.J.derivative);
    const Eigen::MatrixXd lost = dA * null_;
    if ((lost - range_ * (range_.transpose() * lost)).norm() > kConsistent * std::max(dA.norm(), 1e-300)) {
      undefined = "the rank of the constraints changes with this parameter";
      return {};
    }
    // L^T v+' = c + A y' with c = L^-1 (M v-' - M' dv + J'^T P), A^T L^T v+' = g = G^-1 (w' - J' v+): (13.11), solved
    // as (7.6) and (7.7) are.
    const Eigen::VectorXd dv = as_vector(variation.velocity);
    const Eigen::VectorXd c =
        lower_solution(mass_, impact_.M.value * dv - d.M.derivative * change_ + d.J.derivative.transpose() * impulse_);
    const Eigen::VectorXd g = lower_solution(metric_, rate_after(variation) - d.J.derivative * after_);
    const Eigen::VectorXd wanted = (rows_.transpose() * g).cwiseQuotient(sigma_);
    const Eigen::VectorXd along_rows = range_.transpose() * c;
    Eigen::VectorXd y = rows_ * (wanted - along_rows).cwiseQuotient(sigma_);
    if (null_.cols() > 0) y += null_ * least_stress(d, dA);
    return Derivative{upper_solution(mass_, c + range_ * (wanted - along_rows)), upper_solution(metric_, y),
                      d.directions};
  }
  // Current P, in the rows of one grasp from `row` on.
  Eigen::VectorXd impulse(Eigen::Index row, Eigen::Index rows) const { return impulse_.segment(row, rows); }

 private:
  // L^-1 J^T G^-T.
  Eigen::MatrixXd scaled(const Eigen::MatrixXd& J) const {
    const Eigen::MatrixXd Y = lower_solution(mass_, J.transpose());
    return lower_solution(metric_, Y.transpose()).transpose();
  }

  void decompose(int rank) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled(impact_.J.value), Eigen::ComputeThinU | Eigen::ComputeFullV);
    range_ = svd.matrixU().leftCols(rank);
    sigma_ = svd.singularValues().head(rank);
    rows_ = svd.matrixV().leftCols(rank);
    null_ = svd.matrixV().rightCols(impact_.J.value.rows() - rank);
  }

  // w': a brake's rate is constant; a drive that keeps its rate follows it.
  Eigen::VectorXd rate_after(const ImpactVariation& variation) const {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(impact_.J.value.rows());
    for (std::size_t i = 0; i < held_.size(); ++i) {
      const int k = held_[i].velocity;
      const Eigen::Index row = w.size() - static_cast<Eigen::Index>(held_.size() - i);
      if (held_[i].after != 0 && held_[i].after == state_.v[k]) w[row] = variation.velocity[k];
    }
    return w;
  }

  // Z_0^T y': keeps P minimum-norm in D as D and the self-stresses change (13.13).
  Eigen::VectorXd least_stress(const VariedImpact& d, const Eigen::MatrixXd& dA) const {
    const Eigen::VectorXd y = metric_.matrixU() * impulse_;
    const Eigen::VectorXd through = range_ * (rows_.transpose() * y).cwiseQuotient(sigma_);
    return null_.transpose() * (dA.transpose() * through - lower_solution(metric_, d.D.derivative * impulse_));
  }

  const Model& model_;
  const State& state_;
  std::span<const Grasp> grasps_;
  std::span<const HeldRate> held_;
  VariedImpact impact_;
  Cholesky mass_, metric_;
  Eigen::VectorXd after_, change_, impulse_;
  Eigen::MatrixXd range_, rows_, null_;  // Q, Z, Z_0 of (7.5)
  Eigen::VectorXd sigma_;
  bool contradiction_ = false;
};

// --- The parameters. ------------------------------------------------------------------------------------------------

// The target's velocities for a twist of it at the contact point, in W.
void set_target_twist(const Model& model, const Kinematics& kinematics, const Grasp& grasp, const Twistd& V_WC,
                      ImpactVariation& variation) {
  const Posed& X_WT = kinematics.X_WB[grasp.target_body];
  const Twistd V = transposed_times(X_WT.R, shift(V_WC, X_WT.p - grasp.p_WC));
  const int v = model.bodies()[grasp.target_body].v;
  for (int k = 0; k < 3; ++k) variation.velocity[v + k] = V.angular[k], variation.velocity[v + 3 + k] = V.linear[k];
}

// Relative motion, as the target's (end-effector minus target, so the signs), and its direction.
void add_relative_motion(const Model& model, const Kinematics& kinematics, const Grasp& g, int grasp,
                         std::vector<Parameter>& parameters) {
  const Twistd V_E = shift(kinematics.V_WB[g.robot_body], g.p_WC - kinematics.X_WB[g.robot_body].p);
  const Twistd V_T = shift(kinematics.V_WB[g.target_body], g.p_WC - kinematics.X_WB[g.target_body].p);
  const Vector3d u = V_E.linear - V_T.linear;
  const auto add = [&](const std::string& name, const char* unit, const Twistd& relative) {
    Parameter p{name, unit, grasp, ImpactVariation(model)};
    set_target_twist(model, kinematics, g, {-relative.angular, -relative.linear}, p.variation);
    parameters.push_back(std::move(p));
  };
  const Vector3d none = Vector3d::zero();
  for (int k = 0; k < 3; ++k) add(std::string("relative velocity") + kAxisNames[k], "m/s", {none, Vector3d::unit(k)});
  for (int k = 0; k < 3; ++k)
    add(std::string("relative angular velocity") + kAxisNames[k], "rad/s", {Vector3d::unit(k), none});
  for (int k = 0; k < 3; ++k)
    add(std::string("angle of attack") + kAxisNames[k], "rad", {none, cross(Vector3d::unit(k), u)});
}

// The joints between the grasping bodies and the base, and the pseudo-inverse of the Jacobian of these bodies.
class GraspingArms {
 public:
  GraspingArms(const Model& model, const State& state, const Kinematics& kinematics, int root,
               std::span<const Grasp> grasps)
      : model_(model), state_(state), grasps_(grasps) {
    std::vector<bool> moves(static_cast<std::size_t>(model.velocities()), false);
    for (const Grasp& g : grasps) {
      for (int i = g.robot_body; i >= 0 && i != root; i = model.bodies()[i].parent) {
        const Body& b = model.bodies()[i];
        for (int k = 0; k < velocity_count(b.description.joint.type); ++k) moves[b.v + k] = true;
      }
    }
    for (int i = 0; i < model.velocities(); ++i) {
      if (moves[i]) joints_.push_back(i);
    }
    // Rows scaled by the response of the free target, so that the rank does not depend on units.
    const Eigen::Index rows = 6 * static_cast<Eigen::Index>(grasps.size());
    scale_ = Eigen::MatrixXd::Zero(rows, rows);
    for (Eigen::Index row = 0; Grasp g : grasps) {
      g.model = GraspModel::rigid;
      const Cholesky metric(target_mobility(model, kinematics, g));
      scale_.block<6, 6>(row, row) = lower_solution(metric, Eigen::MatrixXd::Identity(6, 6));
      row += 6;
    }
    if (joints_.empty()) return;
    const std::vector<double> still(static_cast<std::size_t>(model.velocities()), 0.0);
    const Eigen::MatrixXd J = vary_end_effectors(model, state, grasps, still).value(Eigen::all, joints_);
    svd_.compute(scale_ * J, Eigen::ComputeThinU | Eigen::ComputeThinV);
    svd_.setThreshold(kArmTolerance);
  }

  // Turns the end-effector of a grasp; false if the arm cannot, or cannot keep its motion.
  bool turn(int grasp, const Vector3d& axis, ImpactVariation& variation) const {
    Eigen::VectorXd motion = Eigen::VectorXd::Zero(scale_.rows());
    for (int k = 0; k < 3; ++k) motion[6 * grasp + k] = axis[k];
    if (!follow(motion, variation.configuration)) return false;
    // Twists J v are kept: J_m v' = -J' v (13.16).
    const DualMatrix J = vary_end_effectors(model_, state_, grasps_, variation.configuration);
    if (!follow(-J.derivative * as_vector(state_.v), variation.velocity)) return false;
    variation.grasp = grasp;
    variation.turn = axis;
    return true;
  }

 private:
  // Velocities of the joints that give the grasping bodies these twists.
  bool follow(const Eigen::VectorXd& twists, std::vector<double>& velocities) const {
    const Eigen::VectorXd wanted = scale_ * twists;
    if (wanted.norm() == 0) return true;
    if (joints_.empty()) return false;
    const Eigen::VectorXd rates = svd_.solve(wanted);
    const Eigen::VectorXd reached =
        svd_.matrixU() * svd_.singularValues().cwiseProduct(svd_.matrixV().transpose() * rates);
    if ((reached - wanted).norm() > kFollows * wanted.norm()) return false;
    for (std::size_t i = 0; i < joints_.size(); ++i) velocities[joints_[i]] = rates[static_cast<Eigen::Index>(i)];
    return true;
  }

  const Model& model_;
  const State& state_;
  std::span<const Grasp> grasps_;
  std::vector<int> joints_;
  Eigen::MatrixXd scale_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
};

// Target and grasp => parameters mass [kg] and principal inertias [kg m^2] about the centre of mass, in the target's
// axes, with unit directions of change.
void add_target(const Model& model, int target, int grasp, std::vector<Parameter>& parameters) {
  const auto add = [&](const char* name, const char* unit, double mass, const Symmetric3d& inertia) {
    Parameter p{name, unit, grasp, ImpactVariation(model)};
    p.variation.target = target;
    p.variation.mass = mass;
    p.variation.inertia = inertia;
    parameters.push_back(std::move(p));
  };
  add("target mass", "kg", 1, Symmetric3d::zero());
  add("target inertia xx", "kg m^2", 0, Symmetric3d::diagonal(1, 0, 0));
  add("target inertia yy", "kg m^2", 0, Symmetric3d::diagonal(0, 1, 0));
  add("target inertia zz", "kg m^2", 0, Symmetric3d::diagonal(0, 0, 1));
}

// State and grasps => all parameters with their directions of change, in the order of impulse_sensitivities(). Approach
// angles that the arm cannot follow are omitted (13.15), (13.16); each target contributes once.
std::vector<Parameter> list_parameters(const Model& model, const State& state, int root,
                                       std::span<const Grasp> grasps) {
  const Kinematics kinematics = forward_kinematics(model, state);
  const GraspingArms arms(model, state, kinematics, root, grasps);
  std::vector<Parameter> parameters;
  std::vector<int> targets;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const int grasp = static_cast<int>(i);
    add_relative_motion(model, kinematics, grasps[i], grasp, parameters);
    for (int k = 0; k < 3; ++k) {
      Parameter p{std::string("approach angle") + kAxisNames[k], "rad", grasp, ImpactVariation(model)};
      if (arms.turn(grasp, Vector3d::unit(k), p.variation)) parameters.push_back(std::move(p));
    }
    for (int k = 0; k < 3; ++k) {
      Parameter p{std::string("contact offset") + kAxisNames[k], "m", grasp, ImpactVariation(model)};
      p.variation.grasp = grasp;
      p.variation.contact = Vector3d::unit(k);
      parameters.push_back(std::move(p));
    }
    const int target = grasps[i].target_body;
    if (std::find(targets.begin(), targets.end(), target) != targets.end()) continue;
    targets.push_back(target);
    add_target(model, target, grasp, parameters);
  }
  return parameters;
}

// d P of every grasp in six components: the directions may rotate.
std::vector<Impulsed> impulses_of(const SolvedImpact& solved, const SolvedImpact::Derivative& d) {
  std::vector<Impulsed> impulses;
  for (Eigen::Index row = 0; const DualMatrix& A : d.directions) {
    const Eigen::Index rows = A.value.rows();
    const Eigen::VectorXd P =
        A.value.transpose() * d.impulse.segment(row, rows) + A.derivative.transpose() * solved.impulse(row, rows);
    impulses.push_back({as_vector3(P, 0), as_vector3(P, 3)});
    row += rows;
  }
  return impulses;
}

}  // namespace

// State, grasps, held rates => derivatives of impulses and base twist, in W, with respect to each parameter, (13.10) to
// (13.14), (13.17). NaN and a reason where they are undefined; throws std::invalid_argument if a target is not a free
// body.
std::vector<ImpulseSensitivity> impulse_sensitivities(const Model& model, const State& state, int root,
                                                      std::span<const Grasp> grasps, std::span<const HeldRate> held) {
  for (const Grasp& g : grasps) {
    if (model.bodies().at(g.target_body).description.joint.type != JointType::free)
      throw std::invalid_argument("impulse_sensitivities: body '" + model.bodies()[g.target_body].description.name +
                                  "' is not a free target");
  }
  if (grasps.empty()) return {};
  const SolvedImpact solved(model, state, grasps, held);
  const bool floats = model.has_free_root(root);
  const Rotationd R_WB = root_pose(model, state, root).R;
  const int base = model.bodies()[root].v;
  const Vector3d unknown{kNaN, kNaN, kNaN};

  std::vector<ImpulseSensitivity> sensitivities;
  for (const Parameter& p : list_parameters(model, state, root, grasps)) {
    ImpulseSensitivity s{p.name, p.unit, p.grasp, {}, {}, Twistd::zero()};
    if (const auto d = solved.along(p.variation, s.undefined)) {
      s.impulse = impulses_of(solved, *d);
      // No parameter changes the base's own velocity before the impact: d (V+ - V-) = d V+.
      if (floats) s.base = R_WB * Twistd{as_vector3(d->velocity, base), as_vector3(d->velocity, base + 3)};
    } else {
      s.impulse.assign(grasps.size(), Impulsed{unknown, unknown});
      s.base = Twistd{unknown, unknown};
    }
    sensitivities.push_back(std::move(s));
  }
  return sensitivities;
}

namespace {

// The system in dual numbers: kernels' tree, coordinates, and poses of its links.
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
  // Values remain: the link may contain other merged bodies.
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
  project_columns(model.tree(), J.value);
  project_columns(model.tree(), J.derivative);
  return J;
}

// Product of a matrix with A from the left, by the rule of products.
DualMatrix multiply(const DualMatrix& A, const DualMatrix& B) {
  return {A.value * B.value, A.derivative * B.value + A.value * B.derivative};
}

DualMatrix vary_directions(const Grasp& grasp, const Vector3d& turn) {
  DualMatrix A{constrained_directions(grasp), {}};
  A.derivative = Eigen::MatrixXd::Zero(A.value.rows(), 6);
  if (!turns_about_axis(grasp.model)) return A;  // the others constrain all angular directions or none
  for (int row = 0; row < 2; ++row) {
    const Vector3d change = cross(turn, Vector3d{A.value(row, 0), A.value(row, 1), A.value(row, 2)});
    for (int k = 0; k < 3; ++k) A.derivative(row, k) = change[k];
  }
  return A;
}

// J_t M_t^-1 J_t^T of one grasp's free target (5.2), 6 x 6: column by column the twist at the contact due to a unit
// impulse there. The target itself does not move.
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
DualMatrix vary_mass_matrix(const Model& model, const DualSystem& system) {
  const int n = system.tree.velocities;
  DynamicsWorkspace<Dual> workspace(system.tree);
  std::vector<Dual> M(static_cast<std::size_t>(n) * n);
  composite_body<Dual>(system.tree, system.q, workspace, M);
  DualMatrix result{Eigen::MatrixXd(n, n), Eigen::MatrixXd(n, n)};
  for (Eigen::Index i = 0; i < result.value.size(); ++i) {
    result.value.data()[i] = M[i].value;
    result.derivative.data()[i] = M[i].derivative;
  }
  project_mass_matrix(model.tree(), result.value);
  // Only the effect of its derivative on existing velocities is used.
  return result;
}

// Rows of held rates: unit entries of J, and in D the diagonal of J M^-1 J^T, whose derivative is that of the inverse.
void vary_held(std::span<const HeldRate> held, Eigen::Index first_row, VariedImpact& impact) {
  if (held.empty()) return;
  const Cholesky mass(impact.M.value);
  for (std::size_t i = 0; i < held.size(); ++i) {
    const Eigen::Index row = first_row + static_cast<Eigen::Index>(i);
    impact.J.value(row, held[i].velocity) = 1;
    const Eigen::VectorXd alone = cholesky_solution(mass, impact.J.value.row(row).transpose());
    impact.D.value(row, row) = alone[held[i].velocity];
    impact.D.derivative(row, row) = -alone.dot(impact.M.derivative * alone);
  }
}

}  // namespace

// State, grasps, held rates, direction of change => M, J, D and constrained directions with their derivatives along it,
// by dual numbers through the kernels (docs/theory, section 13.5).
VariedImpact vary_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                         std::span<const HeldRate> held, const ImpactVariation& variation) {
  DualSystem system = make_system(model, state, variation.configuration);
  vary_target(model, variation, system.tree);
  const Kinematics kinematics = forward_kinematics(model, state);
  Eigen::Index rows = static_cast<Eigen::Index>(held.size());
  for (const Grasp& g : grasps) rows += row_count(g.model);

  VariedImpact impact;
  impact.M = vary_mass_matrix(model, system);
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

// Grasps, change of configuration => Jacobians of the grasping bodies at the contact points, fixed in W, 6 rows per
// grasp, with their derivatives along the change (13.15), (13.16).
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
