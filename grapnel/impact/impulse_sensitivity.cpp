#include "grapnel/impact/impulse_sensitivity.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/impact/varied_impact.hpp"
#include "grapnel/impact/yielding_drives.hpp"

namespace grapnel {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// What the arm follows, and what rows ask of each other, to this fraction of the largest.
constexpr double kFollows = 1e-9;
constexpr double kConsistent = 1e-7;
// Singular values of an arm's Jacobian below this fraction of the largest are zero.
constexpr double kArmTolerance = 1e-9;

const char* const kAxisNames[] = {" x", " y", " z"};

Eigen::VectorXd as_vector(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}
Vector3d as_vector3(const Eigen::VectorXd& x, Eigen::Index first) { return {x[first], x[first + 1], x[first + 2]}; }

// One parameter: what it is called, and in which direction it changes the problem.
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
    const std::vector<bool> gave_way = which_gave_way(model, held, solution.velocity);
    contradiction_ = std::find(gave_way.begin(), gave_way.end(), true) != gave_way.end();
  }

  // Derivatives of v+ and of the impulses in all rows; empty where they do not exist.
  struct Derivative {
    Eigen::VectorXd velocity, impulse;
    std::vector<DualMatrix> directions;
  };
  std::optional<Derivative> along(const ImpactVariation& variation, std::string& undefined) const {
    if (contradiction_) {
      undefined = "the held rates ask for velocities that the grasps do not allow";
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
        mass_.matrixL().solve(impact_.M.value * dv - d.M.derivative * change_ + d.J.derivative.transpose() * impulse_);
    const Eigen::VectorXd g = metric_.matrixL().solve(rate_after(variation) - d.J.derivative * after_);
    const Eigen::VectorXd wanted = (rows_.transpose() * g).cwiseQuotient(sigma_);
    const Eigen::VectorXd along_rows = range_.transpose() * c;
    Eigen::VectorXd y = rows_ * (wanted - along_rows).cwiseQuotient(sigma_);
    if (null_.cols() > 0) y += null_ * least_stress(d, dA);
    return Derivative{mass_.matrixU().solve(c + range_ * (wanted - along_rows)), metric_.matrixU().solve(y),
                      d.directions};
  }
  // P as it is, in the rows of one grasp from `row` on.
  Eigen::VectorXd impulse(Eigen::Index row, Eigen::Index rows) const { return impulse_.segment(row, rows); }

 private:
  // L^-1 J^T G^-T.
  Eigen::MatrixXd scaled(const Eigen::MatrixXd& J) const {
    const Eigen::MatrixXd Y = mass_.matrixL().solve(J.transpose());
    return metric_.matrixL().solve(Y.transpose()).transpose();
  }

  void decompose(int rank) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled(impact_.J.value), Eigen::ComputeThinU | Eigen::ComputeFullV);
    range_ = svd.matrixU().leftCols(rank);
    sigma_ = svd.singularValues().head(rank);
    rows_ = svd.matrixV().leftCols(rank);
    null_ = svd.matrixV().rightCols(impact_.J.value.rows() - rank);
  }

  // w': a brake's rate is a constant, a drive that keeps its rate follows it.
  Eigen::VectorXd rate_after(const ImpactVariation& variation) const {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(impact_.J.value.rows());
    for (std::size_t i = 0; i < held_.size(); ++i) {
      const int k = held_[i].velocity;
      const Eigen::Index row = w.size() - static_cast<Eigen::Index>(held_.size() - i);
      if (held_[i].after != 0 && held_[i].after == state_.v[k]) w[row] = variation.velocity[k];
    }
    return w;
  }

  // Z_0^T y': what keeps P the least in D as D and the self-stresses change (13.13).
  Eigen::VectorXd least_stress(const VariedImpact& d, const Eigen::MatrixXd& dA) const {
    const Eigen::VectorXd y = metric_.matrixU() * impulse_;
    const Eigen::VectorXd through = range_ * (rows_.transpose() * y).cwiseQuotient(sigma_);
    return null_.transpose() * (dA.transpose() * through - metric_.matrixL().solve(d.D.derivative * impulse_));
  }

  const Model& model_;
  const State& state_;
  std::span<const Grasp> grasps_;
  std::span<const HeldRate> held_;
  VariedImpact impact_;
  Eigen::LLT<Eigen::MatrixXd> mass_, metric_;
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

// Relative motion, as the target's (end-effector minus target, hence the signs), and its direction.
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

// The joints between the grasping bodies and the base, and the least-squares inverse of the Jacobian of these bodies.
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
    // Rows scaled by what the free target would do, so that the rank does not depend on units.
    const Eigen::Index rows = 6 * static_cast<Eigen::Index>(grasps.size());
    scale_ = Eigen::MatrixXd::Zero(rows, rows);
    for (Eigen::Index row = 0; Grasp g : grasps) {
      g.model = GraspModel::rigid;
      const Eigen::LLT<Eigen::MatrixXd> metric(target_mobility(model, kinematics, g));
      scale_.block<6, 6>(row, row) = metric.matrixL().solve(Eigen::MatrixXd::Identity(6, 6));
      row += 6;
    }
    if (joints_.empty()) return;
    const std::vector<double> still(static_cast<std::size_t>(model.velocities()), 0.0);
    const Eigen::MatrixXd J = vary_end_effectors(model, state, grasps, still).value(Eigen::all, joints_);
    svd_.compute(scale_ * J, Eigen::ComputeThinU | Eigen::ComputeThinV);
    svd_.setThreshold(kArmTolerance);
  }

  // Turns the end-effector of a grasp; false if the arm cannot, or cannot go on moving it as it does.
  bool turn(int grasp, const Vector3d& axis, ImpactVariation& variation) const {
    Eigen::VectorXd motion = Eigen::VectorXd::Zero(scale_.rows());
    for (int k = 0; k < 3; ++k) motion[6 * grasp + k] = axis[k];
    if (!follow(motion, variation.configuration)) return false;
    // Twists J v stay: J_m v' = -J' v (13.16).
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

// d P of every grasp in six components: the directions may turn.
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

std::vector<ImpulseSensitivity> impulse_sensitivities(const Model& model, const State& state, int root,
                                                      std::span<const Grasp> grasps, std::span<const HeldRate> held) {
  for (const Grasp& g : grasps) {
    if (model.bodies().at(g.target_body).description.joint.type != JointType::free)
      throw std::invalid_argument("impulse_sensitivities: body '" + model.bodies()[g.target_body].description.name +
                                  "' is no free target");
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
      // The base's own velocity before the impact is no parameter's: d (V+ - V-) = d V+.
      if (floats) s.base = R_WB * Twistd{as_vector3(d->velocity, base), as_vector3(d->velocity, base + 3)};
    } else {
      s.impulse.assign(grasps.size(), Impulsed{unknown, unknown});
      s.base = Twistd{unknown, unknown};
    }
    sensitivities.push_back(std::move(s));
  }
  return sensitivities;
}

}  // namespace grapnel
