#include "grapnel/capture/internal_loads.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

// --- Joints ---

namespace {

// Rate of a body's momentum about its frame's origin: m a_C, and I alpha + w x I w about its centre of mass.
Wrenchd inertial_wrench(const Body& body, const Posed& X_WB, const Twistd& V_WB, const BodyAcceleration& A) {
  const Vector3d& w = V_WB.angular;
  const Vector3d r = X_WB.R * body.description.com;
  const Vector3d a_C = A.linear + cross(A.angular, r) + cross(w, cross(w, r));
  const auto times_inertia = [&](const Vector3d& v) {
    return X_WB.R * (body.description.inertia * (transpose(X_WB.R) * v));
  };
  const Vector3d force = body.description.mass * a_C;
  return {times_inertia(A.angular) + cross(w, times_inertia(w)) + cross(r, force), force};
}

}  // namespace

namespace {

// First row of every closure in the solver.
std::vector<int> first_rows(const CaptureSystem& system) {
  std::vector<int> first{0};
  for (const LoopClosure& c : system.closures) first.push_back(first.back() + row_count(c.model));
  return first;
}

// The wrench on the robot of the part of a slipping grasp that a closure holds, in W; zero without a closure.
Wrenchd wrench_of_closure(const CaptureSystem& system, const Kinematics& k, const PhaseDynamics& dynamics,
                          const SlippingGrasp& slip) {
  if (slip.closure < 0 || dynamics.setup().closures.empty()) return Wrenchd::zero();
  const Rotationd R_WC = (k.X_WB[slip.frames.body_a] * slip.frames.X_AC).R;
  const auto row = static_cast<std::size_t>(first_rows(system)[static_cast<std::size_t>(slip.closure)]);
  const auto count = static_cast<std::size_t>(row_count(slip.frames.model));
  return R_WC * closure_wrench(slip.frames, dynamics.loops()->multipliers().subspan(row, count));
}

}  // namespace

std::vector<Wrenchd> wrenches_of_slips(const CaptureSystem& system, const Kinematics& k, const PhaseSample& sample) {
  std::vector<Wrenchd> result;
  for (std::size_t i = 0; i < system.slips.size(); ++i) {
    const Wrenchd F_WC = sample.dynamics ? sample.dynamics->slips()[i].F_WC : Wrenchd::zero();
    result.push_back(sample.dynamics ? F_WC + wrench_of_closure(system, k, *sample.dynamics, system.slips[i]) : F_WC);
  }
  return result;
}

std::vector<Wrenchd> joint_wrenches(const Model& model, const Kinematics& k, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external) {
  std::vector<Wrenchd> through;
  joint_wrenches(model, k, vdot, external, through);
  return through;
}

void joint_wrenches(const Model& model, const Kinematics& k, std::span<const double> vdot,
                    std::span<const ExternalWrench> external, std::vector<Wrenchd>& needed) {
  const std::vector<BodyAcceleration> A = body_accelerations(model, k, vdot);
  needed.resize(model.bodies().size());
  for (std::size_t i = 0; i < needed.size(); ++i)
    needed[i] = inertial_wrench(model.bodies()[i], k.X_WB[i], k.V_WB[i], A[i]);
  for (int carried : model.rotors()) {  // rate of their angular momentum, in the link that carries them
    const Body& body = model.bodies()[carried];
    const Vector3d h = rotor_momentum(model, k, carried);
    needed[body.parent].angular +=
        vdot[body.v] * h + cross(k.V_WB[body.parent].angular, joint_rate(model, k, carried) * h);
  }
  for (const ExternalWrench& e : external) needed[e.body] -= shift(e.F_W, k.X_WB[e.body].p - e.p_WP);
  // From the tips inward: a joint transmits the wrenches on its body and all bodies beyond it.
  for (std::size_t i = model.bodies().size(); i-- > 0;) {
    const int parent = model.bodies()[i].parent;
    if (parent >= 0) needed[parent] += shift(needed[i], k.X_WB[parent].p - k.X_WB[i].p);
  }
}

std::vector<Wrenchd> joint_wrenches(const CaptureSystem& system, const Kinematics& k, const PhaseSample& sample,
                                    std::span<const Wrenchd> grasps) {
  const PhaseDynamics& dynamics = *sample.dynamics;
  std::vector<ExternalWrench> external(dynamics.external_wrenches().begin(), dynamics.external_wrenches().end());
  const std::vector<Body>& bodies = system.model.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyDescription& body = bodies[i].description;
    external.push_back({static_cast<int>(i), k.X_WB[i] * body.com, {Vector3d::zero(), body.mass * dynamics.gravity()}});
  }
  for (std::size_t g = 0; g < system.grasps.size(); ++g) {
    if (system.grasps[g].closure == HeldGrasp::kInTree) continue;  // a joint of the tree carries the target
    const Grasp grasp = grasp_of(system.grasps[g], k);
    external.push_back({grasp.robot_body, grasp.p_WC, grasps[g]});
    external.push_back({grasp.target_body, grasp.p_WC, -grasps[g]});
  }
  for (const SlippingGrasp& slip : system.slips) {  // their friction is among the external wrenches
    if (slip.closure < 0) continue;
    const Vector3d p_WC = (k.X_WB[slip.frames.body_a] * slip.frames.X_AC).p;
    const Wrenchd F_WC = wrench_of_closure(system, k, dynamics, slip);
    external.push_back({slip.frames.body_a, p_WC, F_WC});
    external.push_back({slip.frames.body_b, p_WC, -F_WC});
  }
  return joint_wrenches(system.model, k, dynamics.acceleration(), external);
}

// Changes of velocities and impulses => impulses at joints and grasps. An impulse causes at a system at rest the
// changes of velocities that a wrench causes as accelerations, so joint_wrenches() gives those of the joints.
InternalImpulses internal_impulses(const CaptureSystem& system, const HardImpact& impact) {
  State at_rest = impact.before;
  std::fill(at_rest.v.begin(), at_rest.v.end(), 0.0);
  const Kinematics k = forward_kinematics(system.model, at_rest);
  InternalImpulses result{{}, std::vector<Wrenchd>(system.grasps.size(), Wrenchd::zero())};
  std::vector<ExternalWrench> external = impact.impulses;
  for (std::size_t g = 0; g < system.grasps.size(); ++g) {
    const HeldGrasp& held = system.grasps[g];
    if (held.closure < 0 || impact.loop_impulses.empty()) continue;
    int row = 0;
    for (int c = 0; c < held.closure; ++c) row += row_count(system.closures[c].model);
    const std::span<const double> rows =
        std::span(impact.loop_impulses).subspan(row, row_count(system.closures[held.closure].model));
    const Grasp grasp = grasp_of(held, k);
    const Rotationd R_WC = (k.X_WB[held.frames.body_a] * held.frames.X_AC).R;
    const Wrenchd P = result.grasps[g] = R_WC * closure_wrench(held.frames, rows);
    external.push_back({grasp.robot_body, grasp.p_WC, P});
    external.push_back({grasp.target_body, grasp.p_WC, -P});
  }
  result.joints = joint_wrenches(system.model, k, impact.change, external);
  for (std::size_t g = 0; g < system.grasps.size(); ++g) {
    if (system.grasps[g].closure != HeldGrasp::kInTree) continue;  // a joint of the tree carries the target
    const Grasp grasp = grasp_of(system.grasps[g], k);
    result.grasps[g] = -shift(result.joints[grasp.target_body], grasp.p_WC - k.X_WB[grasp.target_body].p);
  }
  return result;
}

std::vector<int> carried_bodies(const CaptureSystem& system) {
  std::vector<int> bodies;
  for (int i = 0; i < static_cast<int>(system.model.bodies().size()); ++i) {
    if (i != system.base && !belongs_to_targets(system, i) && !is_inside_base(system, i)) bodies.push_back(i);
  }
  return bodies;
}

std::vector<int> loaded_bodies(const CaptureSystem& system) {
  std::vector<int> bodies = carried_bodies(system);
  std::erase_if(bodies, [&](int i) { return is_elastic_part(system.model.bodies()[i].description); });
  return bodies;
}

// --- Grasps ---

namespace {

// A component is undetermined if the unit self-stresses change it by more than this fraction of the maximum for unit
// size; rank decisions leave directions of up to 1e-6.
constexpr double kOpen = 1e-6;

Eigen::VectorXd as_eigen(const Wrenchd& F) {
  Eigen::VectorXd x(6);
  x << F.angular[0], F.angular[1], F.angular[2], F.linear[0], F.linear[1], F.linear[2];
  return x;
}
Wrenchd as_wrench(const Eigen::VectorXd& x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}; }

// The wrench, besides gravity and loads, that causes a body's motion, about p_W, in W.
Wrenchd needed_wrench(const Model& model, const Kinematics& k, const BodyAcceleration& A, int body,
                      const PhaseDynamics& dynamics, const Vector3d& p_W) {
  const BodyDescription& d = model.bodies()[body].description;
  const Vector3d arm = k.X_WB[body].R * d.com;
  const Vector3d& w = k.V_WB[body].angular;
  const Vector3d p_com = k.X_WB[body].p + arm;
  const Symmetric3d I = rotate(k.X_WB[body].R, d.inertia);
  const Vector3d a_com = A.linear + cross(A.angular, arm) + cross(w, cross(w, arm));
  const Wrenchd about_com{I * A.angular + cross(w, I * w), d.mass * (a_com - dynamics.gravity())};
  Wrenchd F = shift(about_com, p_W - p_com);
  for (const ExternalWrench& e : dynamics.external_wrenches()) {
    if (e.body == body) F -= shift(e.F_W, p_W - e.p_WP);
  }
  return F;
}

// Whether a body equals another, or hangs on it by any number of joints.
bool is_carried_by(const Model& model, int body, int carrier) {
  while (body > carrier) body = model.bodies()[body].parent;  // parents come first
  return body == carrier;
}

// All grasps of one target.
struct TargetGrasps {
  const CaptureSystem& system;
  const Kinematics& k;
  std::vector<std::size_t> held;  // in system.grasps; the first carries the target
  std::vector<Grasp> grasps;
  std::vector<Eigen::MatrixXd> directions, D;

  TargetGrasps(const CaptureSystem& s, const Kinematics& kinematics, int body) : system(s), k(kinematics) {
    for (std::size_t i = 0; i < s.grasps.size(); ++i) {
      if (s.grasps[i].frames.body_b != body) continue;
      held.push_back(i);
      grasps.push_back(grasp_of(s.grasps[i], k));
      directions.push_back(constrained_directions(grasps.back()));
      D.push_back(target_mobility(s.model, k, grasps.back()));
    }
  }
  int rows() const {
    int count = 0;
    for (const Eigen::MatrixXd& A : directions) count += static_cast<int>(A.rows());
    return count;
  }
};

// Self-stresses with an effect on closures, which have the first `rows` rows: stuck joints may be stressed against each
// other by their coupling alone.
Eigen::MatrixXd of_closures(const Eigen::MatrixXd& stresses, int rows) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index k = 0; k < stresses.cols(); ++k) {
    if (!stresses.col(k).head(rows).isZero(0)) columns.push_back(k);
  }
  return stresses(Eigen::all, columns);
}

// One solution of the equations of all targets, from the loop solver, and the contribution of each self-stress.
struct Balance {
  std::vector<TargetGrasps> targets;
  std::vector<Wrenchd> F;                    // per grasp, on the robot, in W
  std::vector<std::vector<Wrenchd>> stress;  // per self-stress and grasp
  std::vector<std::vector<Wrenchd>> open;    // likewise, including those borne by the friction of stuck joints
};

Balance balance_of(const CaptureSystem& system, const Kinematics& k, const PhaseSample& sample) {
  const Model& model = system.model;
  const std::vector<BodyAcceleration> A = body_accelerations(model, k, sample.dynamics->acceleration());
  const LoopSolver* solver = sample.dynamics->loops();
  if (solver && solver->closures().empty()) solver = nullptr;  // only couplings
  const std::vector<int> first = first_rows(system);
  const Eigen::MatrixXd null = solver ? of_closures(solver->self_stresses(), first.back()) : Eigen::MatrixXd(0, 0);
  const Eigen::MatrixXd open =
      solver ? of_closures(sample.dynamics->open_stresses(), first.back()) : Eigen::MatrixXd(0, 0);
  const std::vector<Wrenchd> nothing(system.grasps.size(), Wrenchd::zero());
  Balance result{
      {}, nothing, {static_cast<std::size_t>(null.cols()), nothing}, {static_cast<std::size_t>(open.cols()), nothing}};
  for (int frame : system.target_frames) {
    TargetGrasps t(system, k, model.frames()[frame].body);
    if (t.held.empty()) continue;
    const Vector3d p_1 = t.grasps[0].p_WC;
    const int body = t.grasps[0].target_body;
    Wrenchd& carried = result.F[t.held[0]];
    // the target, and the bodies that hang on it
    for (int i = body; i < static_cast<int>(model.bodies().size()); ++i) {
      if (is_carried_by(model, i, body)) carried -= needed_wrench(model, k, A[i], i, *sample.dynamics, p_1);
    }
    // Parts of slipping grasps that closures hold; their friction is an external wrench.
    for (const SlippingGrasp& slip : system.slips) {
      if (slip.frames.body_b != body || slip.closure < 0) continue;
      const Vector3d p_WC = (k.X_WB[slip.frames.body_a] * slip.frames.X_AC).p;
      carried -= shift(wrench_of_closure(system, k, *sample.dynamics, slip), p_1 - p_WC);
      // Its self-stress with the carrying grasp: the solver's solution is reported, but it is not the only one.
      const Rotationd R_WC = (k.X_WB[slip.frames.body_a] * slip.frames.X_AC).R;
      const int row = first[slip.closure], count = row_count(slip.frames.model);
      for (Eigen::Index s = 0; s < open.cols(); ++s) {
        const std::span<const double> column(open.col(s).data() + row, static_cast<std::size_t>(count));
        result.open[s][t.held[0]] -= shift(R_WC * closure_wrench(slip.frames, column), p_1 - p_WC);
      }
    }
    for (std::size_t i = 1; i < t.held.size(); ++i) {
      const HeldGrasp& grasp = system.grasps[t.held[i]];
      // The load carried by another grasp reduces that of the first.
      const auto share = [&](std::vector<Wrenchd>& F, const Wrenchd& other) {
        F[t.held[i]] = other;
        F[t.held[0]] -= shift(other, p_1 - t.grasps[i].p_WC);
      };
      if (grasp.closure == HeldGrasp::kRedundant) {
        for (Eigen::Index row = 0; row < t.directions[i].rows(); ++row) {
          for (auto* stresses : {&result.stress, &result.open})
            share(stresses->emplace_back(nothing), as_wrench(t.directions[i].row(row).transpose()));
        }
        continue;
      }
      if (!solver) continue;  // loops are cut
      const Rotationd R_WC = (k.X_WB[grasp.frames.body_a] * grasp.frames.X_AC).R;
      const int row = first[grasp.closure], count = row_count(grasp.frames.model);
      share(result.F, R_WC * closure_wrench(grasp.frames, solver->multipliers().subspan(row, count)));
      const auto share_all = [&](const Eigen::MatrixXd& basis, std::vector<std::vector<Wrenchd>>& stresses) {
        for (Eigen::Index s = 0; s < basis.cols(); ++s) {
          const std::span<const double> column(basis.col(s).data() + row, static_cast<std::size_t>(count));
          share(stresses[s], R_WC * closure_wrench(grasp.frames, column));
        }
      };
      share_all(null, result.stress), share_all(open, result.open);
    }
    result.targets.push_back(std::move(t));
  }
  // Those of slipping grasps alone.
  const auto is_zero = [](const std::vector<Wrenchd>& stress) {
    return std::ranges::all_of(stress, [](const Wrenchd& F) { return as_eigen(F).isZero(0); });
  };
  std::erase_if(result.stress, is_zero), std::erase_if(result.open, is_zero);
  return result;
}

// Per grasp and self-stress, in the metric f^T D f = |G^T f|^2, D = G G^T.
Eigen::MatrixXd in_metric(const Balance& balance, const std::vector<std::vector<Wrenchd>>& stresses) {
  int rows = 0;
  for (const TargetGrasps& t : balance.targets) rows += t.rows();
  Eigen::MatrixXd B(rows, static_cast<Eigen::Index>(stresses.size()));
  Eigen::Index row = 0;
  for (const TargetGrasps& t : balance.targets) {
    for (std::size_t i = 0; i < t.held.size(); ++i) {
      const Eigen::Index count = t.directions[i].rows();
      const Eigen::MatrixXd map = t.D[i].llt().matrixU() * t.directions[i];
      for (std::size_t s = 0; s < stresses.size(); ++s)
        B.col(static_cast<Eigen::Index>(s)).segment(row, count) = map * as_eigen(stresses[s][t.held[i]]);
      row += count;
    }
  }
  return B;
}

Eigen::MatrixXd columns_of(const std::vector<std::vector<Wrenchd>>& stresses, std::size_t grasp) {
  Eigen::MatrixXd N(6, static_cast<Eigen::Index>(stresses.size()));
  for (std::size_t s = 0; s < stresses.size(); ++s) N.col(static_cast<Eigen::Index>(s)) = as_eigen(stresses[s][grasp]);
  return N;
}

// Adds the self-stresses that minimize the sum of f^T D f over all grasps.
void relieve(const Balance& balance, std::vector<GraspWrench>& result) {
  if (balance.stress.empty()) return;
  const Eigen::VectorXd f = in_metric(balance, {balance.F});
  const Eigen::VectorXd z = least_squares_solution(in_metric(balance, balance.stress), -f);
  for (const TargetGrasps& t : balance.targets) {
    for (const std::size_t g : t.held) {
      result[g].beyond_solver = as_wrench(columns_of(balance.stress, g) * z);
      result[g].F_WC += result[g].beyond_solver;
    }
  }
}

// Finds the components that no self-stress changes.
void find_determined(const Balance& balance, std::vector<GraspWrench>& result) {
  for (GraspWrench& grasp : result) grasp.determined.assign(6, true);
  if (balance.open.empty()) return;
  // Stresses of unit size in the metric: B = Q R.
  const Eigen::MatrixXd R = thin_qr(in_metric(balance, balance.open)).R;
  for (const TargetGrasps& t : balance.targets) {
    for (std::size_t i = 0; i < t.held.size(); ++i) {
      const std::size_t g = t.held[i];
      const Eigen::MatrixXd N = columns_of(balance.open, g);
      const Eigen::MatrixXd unit = R.transpose().triangularView<Eigen::Lower>().solve(N.transpose()).transpose();
      const Eigen::MatrixXd largest =
          t.directions[i].transpose() * cholesky_solution(Cholesky(t.D[i]), t.directions[i]);
      for (int c = 0; c < 6; ++c) result[g].determined[c] = unit.row(c).norm() <= kOpen * std::sqrt(largest(c, c));
    }
  }
}

}  // namespace

std::vector<GraspWrench> wrenches_of_grasps(const CaptureSystem& system, const Kinematics& k, const PhaseSample& sample,
                                            bool with_determined) {
  std::vector<GraspWrench> result(system.grasps.size());
  if (system.grasps.empty() || !sample.dynamics) return result;
  const Balance balance = balance_of(system, k, sample);
  for (std::size_t g = 0; g < result.size(); ++g) {
    result[g].F_WC = balance.F[g];
  }
  relieve(balance, result);
  if (with_determined) find_determined(balance, result);
  return result;
}

void add_self_stress(const CaptureSystem& system, const Kinematics& k, std::span<const GraspWrench> wrenches,
                     std::span<double> motor) {
  const Model& model = system.model;
  Eigen::MatrixXd J_a(6, model.velocities()), J_b(6, model.velocities());
  for (std::size_t g = 0; g < system.grasps.size(); ++g) {
    if (system.grasps[g].closure < 0) continue;
    const Grasp grasp = grasp_of(system.grasps[g], k);
    point_jacobian(model, k, grasp.robot_body, grasp.p_WC, J_a);
    point_jacobian(model, k, grasp.target_body, grasp.p_WC, J_b);
    // Zero at joints with springs.
    const Eigen::VectorXd at_joints = (J_a - J_b).transpose() * as_eigen(wrenches[g].beyond_solver);
    for (std::size_t j = 0; j < model.joints().size(); ++j) motor[j] -= at_joints[model.bodies()[model.joints()[j]].v];
  }
}

}  // namespace grapnel
