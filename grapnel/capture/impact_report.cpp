#include "grapnel/capture/impact_report.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include "grapnel/capture/recorder.hpp"

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

const char* name_of(GraspModel model) {
  return model == GraspModel::rigid ? "rigid" : model == GraspModel::hinge ? "hinge" : "point";
}

GraspImpulse describe_grasp(const CaptureProblem& problem, const Contact& contact, const ImpactSolution& solution,
                            const Kinematics& k, std::size_t i) {
  const Grasp& grasp = contact.grasps[i];
  const GraspSetup& setup = problem.grasps[i];
  const Impulsed& P = solution.contacts[i].P_WC;
  GraspImpulse g;
  g.end_effector = setup.end_effector;
  g.target = setup.target;
  g.grasp_point = setup.grasp_point;
  g.model = name_of(setup.model);
  g.contact_point = grasp.p_WC;
  g.gap = contact.gaps[i].distance;
  g.gap_angle = contact.gaps[i].angle;
  g.target_displacement = contact.displacement[i];
  g.impulse = P.linear;
  g.angular_impulse = P.angular;
  g.impulse_magnitude = norm(P.linear);
  g.mean_force = g.impulse_magnitude / problem.impact->duration;
  g.determined = solution.contacts[i].determined;
  const Twistd V_E = shift(k.V_WB[grasp.robot_body], grasp.p_WC - k.X_WB[grasp.robot_body].p);
  const Twistd V_T = shift(k.V_WB[grasp.target_body], grasp.p_WC - k.X_WB[grasp.target_body].p);
  g.relative_velocity_before = V_E.linear - V_T.linear;
  g.relative_angular_velocity_before = V_E.angular - V_T.angular;
  return g;
}

// The grips' impulses, on both sides.
std::vector<ExternalImpulse> impulses_at(std::span<const Grasp> grasps, const ImpactSolution& solution) {
  std::vector<ExternalImpulse> external;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Impulsed& P = solution.contacts[i].P_WC;
    external.push_back({grasps[i].robot_body, grasps[i].p_WC, P});
    external.push_back({grasps[i].target_body, grasps[i].p_WC, -P});
  }
  return external;
}

// What the mount of a fixed base puts in, about the world's origin; `through`: of the joints.
Momentumd from_ground(const CaptureSystem& system, const Kinematics& k, const std::vector<Impulsed>& through) {
  if (system.model.has_free_root(system.base)) return Momentumd::zero();
  const Impulsed ground = shift(through[system.base], -k.X_WB[system.base].p);
  return {ground.angular, ground.linear};
}

// Impulses through the robot's joints, and the sum that reaches the base.
void describe_reactions(const CaptureSystem& system, const Contact& contact, const State& after,
                        ImpactOutcome& outcome) {
  const Model& model = system.model;
  const std::vector<ExternalImpulse> external = impulses_at(contact.grasps, outcome.solution);
  const std::vector<Impulsed> through = joint_impulses(model, contact.state, after, external);
  const Kinematics k = forward_kinematics(model, contact.state);
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    if (body.root != system.base || static_cast<int>(i) == system.base) continue;
    JointImpulse joint{body.description.joint.name, body.description.name, through[i].linear, through[i].angular, 0};
    const Vector3d axis = k.X_WB[i].R * body.description.joint.axis;
    if (body.description.joint.type == JointType::prismatic) {
      joint.along_axis = dot(axis, joint.impulse);
    } else if (velocity_count(body.description.joint.type) == 1) {
      joint.along_axis = dot(axis, joint.angular_impulse);
    }
    outcome.report.joints.push_back(joint);
    if (body.parent == system.base) {
      // The joint acts on the base with the opposite; about the base's origin.
      const Impulsed on_base = shift(-through[i], k.X_WB[system.base].p - k.X_WB[i].p);
      outcome.report.base_impulse += on_base.linear;
      outcome.report.base_angular_impulse += on_base.angular;
    }
  }
  outcome.from_ground = from_ground(system, k, through);
}

void describe_published(const CaptureSystem& system, const CaptureProblem& problem, const Contact& contact,
                        ImpactReport& report) {
  const PublishedImpact published = published_impact(system.model, contact.state, system.base, contact.grasps);
  if (!published.undefined.empty()) {
    report.as_published_absent = published.undefined;
    return;
  }
  AsPublished a;
  for (std::size_t i = 0; i < contact.grasps.size(); ++i) {
    const Impulsed& P = published.contacts[i].P_WC;
    a.grasps.push_back({problem.grasps[i].end_effector, P.linear, P.angular, norm(P.linear)});
  }
  a.joint_velocity_after = published.joint_rates;
  a.linear_momentum_error = norm(published.momentum_error.linear);
  const Vector3d com = center_of_mass(system.model, forward_kinematics(system.model, contact.state));
  a.angular_momentum_error = norm(shift(published.momentum_error, com).angular);
  report.as_published = a;
}

// Every further grip of a target against its first: distances that no motion of the target changes.
std::vector<LoopGap> loop_gaps(const CaptureProblem& problem, const Contact& contact) {
  std::vector<LoopGap> loops;
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const GraspSetup &first = problem.grasps[k], &other = problem.grasps[i];
      if (first.target != other.target) continue;
      loops.push_back({first.target,
                       {first.end_effector, other.end_effector},
                       {first.grasp_point, other.grasp_point},
                       norm(contact.gaps[i].X_WE.p - contact.gaps[k].X_WE.p),
                       norm(contact.gaps[i].X_WG.p - contact.gaps[k].X_WG.p)});
      break;
    }
  }
  return loops;
}

// The basis of self-stresses, each grip's part in W.
std::vector<SelfStress> describe_null_space(const Contact& contact, const ImpactSolution& solution) {
  std::vector<SelfStress> basis;
  for (Eigen::Index column = 0; column < solution.null_space.cols(); ++column) {
    SelfStress stress;
    double largest = 0;
    for (Eigen::Index row = 0; const Grasp& g : contact.grasps) {
      const Eigen::VectorXd P =
          constrained_directions(g).transpose() * solution.null_space.col(column).segment(row, row_count(g.model));
      stress.angular_impulse.push_back({P[0], P[1], P[2]});
      stress.impulse.push_back({P[3], P[4], P[5]});
      largest = std::max(largest, P.lpNorm<Eigen::Infinity>());
      row += row_count(g.model);
    }
    if (largest == 0) continue;  // of held rates alone
    for (Vector3d& P : stress.impulse) P = (1 / largest) * P;
    for (Vector3d& P : stress.angular_impulse) P = (1 / largest) * P;
    basis.push_back(std::move(stress));
  }
  return basis;
}

std::vector<BodyImpulse> body_impulses(const Model& model, const Kinematics& before, const Kinematics& after) {
  std::vector<BodyImpulse> impulses;
  const std::string prefix = target_body_name("");
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Momentumd h0 = body_momentum(model, before, static_cast<int>(i)).h;
    const Momentumd h1 = body_momentum(model, after, static_cast<int>(i)).h;
    const std::string& name = model.bodies()[i].description.name;
    impulses.push_back(
        {name.starts_with(prefix) ? name.substr(prefix.size()) : name, h1.linear - h0.linear, h1.angular - h0.angular});
  }
  return impulses;
}

// Velocities and impulses by the thesis's formulas, with the books that show what they do not keep.
ImpactSolution published_solution(const CaptureSystem& system, const Contact& contact) {
  const Model& model = system.model;
  const PublishedImpact published = published_impact(model, contact.state, system.base, contact.grasps);
  if (!published.undefined.empty())
    throw std::invalid_argument("the published formulas are not defined here: " + published.undefined);
  const Eigen::MatrixXd M = mass_matrix(model, contact.state);
  const Eigen::MatrixXd J = grasp_jacobian(model, forward_kinematics(model, contact.state), contact.grasps);
  const Eigen::Index n = model.velocities();
  const Eigen::VectorXd before = Eigen::Map<const Eigen::VectorXd>(contact.state.v.data(), n);
  const Eigen::VectorXd after = Eigen::Map<const Eigen::VectorXd>(published.velocity.data(), n);
  Eigen::VectorXd P(J.rows());
  ImpactSolution s;
  s.velocity = published.velocity;
  for (Eigen::Index row = 0; ContactImpulse c : published.contacts) {
    c.determined.assign(6, true);
    for (int k = 0; k < 3; ++k) P[row + k] = c.P_WC.angular[k], P[row + 3 + k] = c.P_WC.linear[k];
    s.contacts.push_back(std::move(c));
    row += 6;
  }
  s.rows = static_cast<int>(J.rows());
  s.rank = static_cast<int>(J.fullPivLu().rank());
  s.kinetic_energy_before = 0.5 * before.dot(M * before);
  s.kinetic_energy_after = 0.5 * after.dot(M * after);
  const Eigen::VectorXd u = J * before, left = J * after;
  const double energy = std::max(s.kinetic_energy_before, 1e-300);
  s.energy_identity_residual = std::abs(s.kinetic_energy_after - s.kinetic_energy_before - 0.5 * P.dot(u)) / energy;
  s.constraint_residual = left.lpNorm<Eigen::Infinity>() /
                          std::max({u.lpNorm<Eigen::Infinity>(), before.lpNorm<Eigen::Infinity>(), 1e-300});
  const Eigen::VectorXd residual = M * (after - before) - J.transpose() * P;
  s.generalized_momentum_residual = std::sqrt(std::abs(residual.dot(M.llt().solve(residual))) / (2 * energy));
  return s;
}

}  // namespace

ImpactOutcome run_impact(const CaptureProblem& problem, const CaptureSystem& system, const Contact& contact,
                         double time, std::size_t already_closed, std::span<const HeldRate> held) {
  const Model& model = system.model;
  ImpactOutcome outcome;
  const bool published = problem.impact->law == ImpactSetup::Law::as_published;
  outcome.solution =
      published ? published_solution(system, contact) : plastic_impact(model, contact.state, contact.grasps, held);
  outcome.after = {contact.state.q, outcome.solution.velocity};
  const Kinematics before = forward_kinematics(model, contact.state);

  ImpactReport& report = outcome.report;
  report.law = published ? "as_published" : "plastic";
  report.time = time;
  report.duration = problem.impact->duration;
  report.rank = outcome.solution.rank;
  report.rows = outcome.solution.rows;
  for (std::size_t i = 0; i < contact.grasps.size(); ++i) {
    report.grasps.push_back(describe_grasp(problem, contact, outcome.solution, before, i));
  }
  const Kinematics after = forward_kinematics(model, outcome.after);
  report.loops = loop_gaps(problem, contact);
  report.null_space = describe_null_space(contact, outcome.solution);
  report.body_impulses = body_impulses(model, before, after);
  // Energies body by body, independent of the mass matrix that solved the impact.
  report.kinetic_energy_before = kinetic_energy(model, before, contact.state);
  report.kinetic_energy_after = kinetic_energy(model, after, outcome.after);
  const Twistd jump = after.V_WB[system.base] - before.V_WB[system.base];
  report.base_velocity_change = jump.linear;
  report.base_angular_velocity_change = jump.angular;
  for (int j : system.robot_joints) {
    const int v = model.bodies()[model.joints()[j]].v;
    report.joint_names.push_back(model.bodies()[model.joints()[j]].description.joint.name);
    report.joint_velocity_change.push_back(outcome.after.v[v] - contact.state.v[v]);
  }
  report.targets_before = describe(problem, system, contact.state, time).targets;
  report.targets_after = describe(problem, system, outcome.after, time).targets;
  describe_reactions(system, contact, outcome.after, outcome);
  if (already_closed == 0) {
    describe_published(system, problem, contact, report);
  } else {
    report.as_published_absent = "a target is already held";
  }
  return outcome;
}

BrakeOutcome run_brake(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                       std::span<const Grasp> grasps, std::span<const std::size_t> joints,
                       std::span<const HeldRate> driven) {
  const Model& model = system.model;
  BrakeOutcome outcome;
  BrakeReport& report = outcome.report;
  std::vector<HeldRate> held;
  for (std::size_t j : joints) {
    const Body& body = model.bodies()[model.joints()[system.robot_joints[j]]];
    held.push_back({body.v, 0});
    report.joints.push_back(body.description.joint.name);
  }
  held.insert(held.end(), driven.begin(), driven.end());
  const ImpactSolution solution = plastic_impact(model, state, grasps, held);
  outcome.after = {state.q, solution.velocity};
  outcome.energy_identity_residual = solution.energy_identity_residual;
  const auto& impulses = solution.held_impulses;
  report.impulse.assign(impulses.begin(), impulses.begin() + static_cast<std::ptrdiff_t>(joints.size()));
  const Kinematics k0 = forward_kinematics(model, state), k1 = forward_kinematics(model, outcome.after);
  report.kinetic_energy_before = kinetic_energy(model, k0, state);
  report.kinetic_energy_after = kinetic_energy(model, k1, outcome.after);
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Impulsed& P = solution.contacts[i].P_WC;
    report.grasps.push_back({problem.grasps[i].end_effector, problem.grasps[i].target, P.linear, P.angular});
  }
  const Twistd jump = k1.V_WB[system.base] - k0.V_WB[system.base];
  report.base_velocity_change = jump.linear;
  report.base_angular_velocity_change = jump.angular;
  outcome.from_ground =
      from_ground(system, k0, joint_impulses(model, state, outcome.after, impulses_at(grasps, solution)));
  return outcome;
}

void scale_published(const LedgerScale& scale, ImpactReport& report) {
  if (!report.as_published) return;
  report.as_published->relative_linear_momentum_error =
      report.as_published->linear_momentum_error / scale.linear_momentum;
  report.as_published->relative_angular_momentum_error =
      report.as_published->angular_momentum_error / scale.angular_momentum;
}

}  // namespace grapnel
