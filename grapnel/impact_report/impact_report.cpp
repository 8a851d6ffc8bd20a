#include "grapnel/impact_report/impact_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/bilateral_restitution.hpp"
#include "grapnel/impact/yielding_drives.hpp"
#include "grapnel/impact_report/contact.hpp"
#include "grapnel/impact_report/elastic_report.hpp"
#include "grapnel/impact_report/impact_figures.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel {

template <>
struct Described<ContactMode>
    : Enumeration<ContactMode, "ContactMode", "separated", "sticking", "sliding", "reversed"> {};

namespace {

Twistd relative_twist(const Grasp& grasp, const Kinematics& k) {
  return shift(k.V_WB[grasp.robot_body], grasp.p_WC - k.X_WB[grasp.robot_body].p) -
         shift(k.V_WB[grasp.target_body], grasp.p_WC - k.X_WB[grasp.target_body].p);
}

// The grasps' impulses, on both sides.
std::vector<ExternalImpulse> impulses_at(std::span<const Grasp> grasps, const ImpactSolution& solution) {
  std::vector<ExternalImpulse> external;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Impulsed& P = solution.contacts[i].P_WC;
    external.push_back({grasps[i].robot_body, grasps[i].p_WC, P});
    external.push_back({grasps[i].target_body, grasps[i].p_WC, -P});
  }
  return external;
}

// Impulse of the mount of a fixed base, about the world's origin; `through`: of the joints.
Momentumd from_ground(const CaptureSystem& system, const Kinematics& k, const std::vector<Impulsed>& through) {
  if (system.model.has_free_root(system.base)) return Momentumd::zero();
  const Impulsed ground = shift(through[system.base], -k.X_WB[system.base].p);
  return {ground.angular, ground.linear};
}

// Impulses transmitted by the robot's joints, and their sum at the base.
void describe_reactions(const CaptureSystem& system, const Kinematics& k, const std::vector<Impulsed>& through,
                        ImpactReport& report) {
  const Model& model = system.model;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    if (body.root != system.base || static_cast<int>(i) == system.base) continue;
    if (belongs_to_targets(system, static_cast<int>(i))) continue;  // a target that hangs on an arm
    JointImpulse joint;
    joint.joint = body.description.joint.name, joint.body = body.description.name;
    joint.impulse = through[i].linear, joint.angular_impulse = through[i].angular;
    const Vector3d axis = k.X_WB[i].R * body.description.joint.axis;
    if (slides_along_axis(body.description.joint.type)) {
      joint.along_axis = dot(axis, joint.impulse);
    } else if (has_one_axis(body.description.joint.type)) {
      joint.along_axis = dot(axis, joint.angular_impulse);
    }
    // A wheel or gimbal is not a joint of the robot, but its bearing transmits an impulse to the base.
    if (!is_inside_base(system, static_cast<int>(i)) && !is_elastic_part(body.description))
      report.joints.push_back(joint);
    if (body.parent == system.base) {
      // The joint acts on the base with the opposite sign; about the base's origin.
      const Impulsed on_base = shift(-through[i], k.X_WB[system.base].p - k.X_WB[i].p);
      report.base_impulse += on_base.linear;
      report.base_angular_impulse += on_base.angular;
    }
  }
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

// Each further grasp of a target relative to its first: distances that no motion of the target changes.
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

// Velocities and impulses by the thesis's formulas, with the balances that they violate.
ImpactSolution published_solution(const CaptureSystem& system, const Contact& contact) {
  const Model& model = system.model;
  const PublishedImpact published = published_impact(model, contact.state, system.base, contact.grasps);
  if (!published.undefined.empty())
    throw std::invalid_argument("the published formulas are not defined: " + published.undefined);
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
  s.rank = rank_of(J);
  const Eigen::VectorXd u = J * before, left = J * after, part = taking_part(model, J);
  s.constraint_residual =
      left.lpNorm<Eigen::Infinity>() /
      std::max({u.lpNorm<Eigen::Infinity>(), before.cwiseProduct(part).lpNorm<Eigen::Infinity>(), 1e-300});
  static_cast<ImpactChecks&>(s) = impact_checks(M, Cholesky(M), part, before, after, J.transpose() * P, 0.5 * P.dot(u));
  return s;
}

// --- The laws -------------------------------------------------------------------------------------------------------

// E of bilateral restitution, row by row: already held grasps do not rebound.
std::vector<std::vector<double>> restitution_rows(const ImpactTask& task) {
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < task.contact.grasps.size(); ++i) {
    const int count = row_count(task.contact.grasps[i].model);
    std::vector<double> e(static_cast<std::size_t>(count), 0.0);
    if (i >= task.already_closed) {
      for (int r = 0; r < count; ++r)
        e[r] = r < count - 3 ? task.problem.impact->angular_restitution : task.problem.impact->restitution;
    }
    rows.push_back(std::move(e));
  }
  return rows;
}

ImpactSolution solve_grasps(const ImpactTask& task, ImpactReport& report) {
  switch (task.law) {
    case ImpactSetup::Law::as_published:
      return published_solution(task.system, task.contact);
    case ImpactSetup::Law::bilateral_restitution: {
      const BilateralRestitution thrown = bilateral_restitution(task.system.model, task.contact.state,
                                                                task.contact.grasps, restitution_rows(task), task.held);
      report.inconsistent = thrown.inconsistent;
      return thrown.solution;
    }
    default:
      return plastic_impact(task.system.model, task.contact.state, task.contact.grasps, task.held);
  }
}

ContactPoint contact_point(const ImpactTask& task, const Kinematics& before, std::size_t i) {
  const Grasp& grasp = task.contact.grasps[i];
  const ImpactSetup& impact = *task.problem.impact;
  ContactPoint c;
  c.robot_body = grasp.robot_body, c.target_body = grasp.target_body;
  c.p_WC = grasp.p_WC;
  c.n_W = contact_normal_in_world(task.problem, task.system, before, task.problem.grasps[i]);
  c.restitution = impact.restitution;
  c.friction = task.law == ImpactSetup::Law::friction ? impact.friction : 0;
  return c;
}

ContactRebound describe_rebound(const ContactPoint& point, const ContactPointImpulse& impulse) {
  ContactRebound r;
  r.normal = point.n_W;
  r.normal_impulse = impulse.normal, r.tangential_impulse = impulse.tangential;
  r.compression = impulse.compression;
  r.normal_work = impulse.normal_work, r.friction_work = impulse.friction_work;
  for (ContactMode mode : impulse.modes) r.modes.push_back(name_of(mode));
  r.spread = impulse.spread;
  return r;
}

// Contacts, with grasps that transmit their impulses: converted to the form of grasps.
ImpactSolution solve_contacts(const ImpactTask& task, const Kinematics& before, ImpactOutcome& outcome) {
  std::vector<ContactPoint> points;
  for (std::size_t i = task.already_closed; i < task.contact.grasps.size(); ++i)
    points.push_back(contact_point(task, before, i));
  const auto closed = std::span(task.contact.grasps).first(task.already_closed);
  const ContactImpactSolution s =
      contact_impact(task.system.model, task.contact.state, points, task.problem.impact->hypothesis, closed, task.held);
  if (s.status != ContactImpactSolution::Status::solved) throw std::runtime_error(s.message);
  ImpactReport& report = outcome.report;
  report.hypothesis = name_of(task.problem.impact->hypothesis);
  report.energy_created = s.energy_created;
  report.unique = s.unique;
  outcome.residuals.cone = s.cone_residual;
  ImpactSolution solution;
  solution.velocity = s.velocity;
  solution.contacts = s.grasps;
  for (std::size_t i = 0; i < points.size(); ++i) {
    solution.contacts.push_back({s.contacts[i].P_WC, std::vector<bool>(6, s.unique)});
    report.grasps[task.already_closed + i].rebound = describe_rebound(points[i], s.contacts[i]);
  }
  solution.held_impulses = s.held_impulses;
  static_cast<ImpactChecks&>(solution) = s;
  return solution;
}

// Brakes and drives: P theta-dot over the impact is (before + after) / 2 times the impulse.
void describe_held(const ImpactTask& task, const ImpactSolution& solution, ImpactReport& report) {
  report.joints_during = name_of(task.problem.impact->joints);
  const std::vector<bool> was_overpowered = which_was_overpowered(task.system.model, task.held, solution.velocity);
  for (std::size_t i = 0; i < task.held.size() && i < solution.held_impulses.size(); ++i) {
    if (task.held[i].is_mode()) continue;
    const double before = task.contact.state.v[task.held[i].velocity], after = solution.velocity[task.held[i].velocity];
    HeldJoint joint;
    if (yields(held_joint(task.system.model, task.held[i]))) continue;  // impact.modes: none
    joint.joint = held_joint(task.system.model, task.held[i]).name;
    joint.impulse = solution.held_impulses[i];
    joint.work = 0.5 * joint.impulse * (before + after);
    joint.commanded_rate = task.held[i].after, joint.rate_after = after;
    joint.was_overpowered = was_overpowered[i];
    report.held_joints.push_back(std::move(joint));
  }
}

}  // namespace

const JointDescription& held_joint(const Model& model, const HeldRate& held) {
  for (int body : model.joints()) {
    if (model.bodies()[body].v == held.velocity) return model.bodies()[body].description.joint;
  }
  throw std::logic_error("held_joint: the velocity does not belong to a joint");
}

std::string describe_giving_way(const Model& model, const ImpactReport& report) {
  constexpr std::size_t kShown = 4;
  struct Drive {
    double by;
    std::string text;
  };
  std::vector<Drive> drives;
  for (const HeldJoint& held : report.held_joints) {
    if (!held.was_overpowered) continue;
    const char* unit = "rad/s";
    for (int body : model.joints()) {
      const JointDescription& joint = model.bodies()[body].description.joint;
      if (joint.name == held.joint) unit = axis_units(joint.type).rate;
    }
    const double by = held.rate_after - held.commanded_rate;
    drives.push_back({std::abs(by), fmt::format("{} by {:.4g} {} (commanded {:.4g}, now {:.4g})", held.joint, by, unit,
                                                held.commanded_rate, held.rate_after)});
  }
  if (drives.empty()) return {};
  std::stable_sort(drives.begin(), drives.end(), [](const Drive& a, const Drive& b) { return a.by > b.by; });
  std::string text =
      fmt::format("the grasps contradict the rates held by drives; {} overpowered, with minimum deviation: ",
                  drives.size() == 1 ? "one drive is" : fmt::format("{} drives are", drives.size()));
  for (std::size_t i = 0; i < std::min(kShown, drives.size()); ++i) text += (i > 0 ? ", " : "") + drives[i].text;
  if (drives.size() > kShown) text += fmt::format(" and {} more", drives.size() - kShown);
  return text;
}

GraspImpulse describe_meeting(const CaptureProblem& problem, const Contact& contact, const Kinematics& before,
                              std::size_t grasp) {
  const GraspSetup& setup = problem.grasps[grasp];
  GraspImpulse g;
  g.end_effector = setup.end_effector;
  g.target = setup.target;
  g.grasp_point = setup.grasp_point;
  g.model = setup.contact ? "contact" : name_of(setup.model);
  g.contact_point = contact.grasps[grasp].p_WC;
  g.gap = contact.gaps[grasp].distance;
  g.gap_angle = contact.gaps[grasp].angle;
  g.target_displacement = contact.displacement[grasp];
  const Twistd u = relative_twist(contact.grasps[grasp], before);
  g.relative_velocity_before = u.linear;
  g.relative_angular_velocity_before = u.angular;
  return g;
}

Momentumd describe_change(const CaptureProblem& problem, const CaptureSystem& system, const State& before,
                          const State& after, std::span<const ExternalImpulse> external, ImpactReport& report) {
  const Model& model = system.model;
  const Kinematics k0 = forward_kinematics(model, before), k1 = forward_kinematics(model, after);
  report.body_impulses = body_impulses(model, k0, k1);
  // Energies body by body, independent of the mass matrix that solved the impact.
  report.kinetic_energy_before = kinetic_energy(model, k0, before);
  report.kinetic_energy_after = kinetic_energy(model, k1, after);
  const Twistd jump = k1.V_WB[system.base] - k0.V_WB[system.base];
  report.base_velocity_change = jump.linear;
  report.base_angular_velocity_change = jump.angular;
  for (int j : system.robot_joints) {
    const int v = model.bodies()[model.joints()[j]].v;
    report.joint_names.push_back(model.bodies()[model.joints()[j]].description.joint.name);
    report.joint_velocity_change.push_back(after.v[v] - before.v[v]);
  }
  report.targets_before = describe_targets(problem, system, k0);
  report.targets_after = describe_targets(problem, system, k1);
  const std::vector<Impulsed> through = joint_impulses(model, before, after, external);
  describe_reactions(system, k0, through, report);
  return from_ground(system, k0, through);
}

ImpactOutcome run_impact(const ImpactTask& task) {
  const CaptureProblem& problem = task.problem;
  const CaptureSystem& system = task.system;
  const Contact& contact = task.contact;
  const Model& model = system.model;
  const Kinematics before = forward_kinematics(model, contact.state);
  ImpactOutcome outcome;
  ImpactReport& report = outcome.report;
  report.law = name_of(task.law);
  report.time = task.time;
  report.duration = problem.impact->duration;
  report.show_as_published = problem.output_as_published || task.law == ImpactSetup::Law::as_published;
  for (std::size_t i = 0; i < contact.grasps.size(); ++i)
    report.grasps.push_back(describe_meeting(problem, contact, before, i));

  const bool rebounds = task.law == ImpactSetup::Law::restitution || task.law == ImpactSetup::Law::friction;
  const ImpactSolution solution = rebounds ? solve_contacts(task, before, outcome) : solve_grasps(task, report);
  outcome.after = {contact.state.q, solution.velocity};
  outcome.residuals.momentum = solution.generalized_momentum_residual;
  outcome.residuals.energy = solution.energy_identity_residual;
  if (!rebounds && report.inconsistent.empty()) outcome.residuals.velocity = solution.constraint_residual;

  const Kinematics after = forward_kinematics(model, outcome.after);
  for (std::size_t i = 0; i < contact.grasps.size(); ++i) {
    GraspImpulse& g = report.grasps[i];
    g.impulse = solution.contacts[i].P_WC.linear, g.angular_impulse = solution.contacts[i].P_WC.angular;
    g.impulse_magnitude = norm(g.impulse);
    g.mean_force = g.impulse_magnitude / problem.impact->duration;
    g.determined = solution.contacts[i].determined;
    const Twistd u = relative_twist(contact.grasps[i], after);
    g.relative_velocity_after = u.linear, g.relative_angular_velocity_after = u.angular;
  }
  report.rank = solution.rank;
  report.rows = solution.rows;
  report.loops = loop_gaps(problem, contact);
  const bool full = task.detail == CaptureDetail::full;
  if (full && !rebounds) report.null_space = describe_impulses(contact.grasps, solution.null_space);
  describe_held(task, solution, report);
  outcome.from_ground =
      describe_change(problem, system, contact.state, outcome.after, impulses_at(contact.grasps, solution), report);
  if (!full) return outcome;
  std::vector<HeldRate> kept(task.held.begin(), task.held.end());
  for (HeldRate& h : kept) {
    if (!h.is_mode()) h.after = solution.velocity[h.velocity];
  }
  ImpactTask as_kept = task;
  as_kept.held = kept;
  add_measures(as_kept, report);
  if (task.law == ImpactSetup::Law::plastic) {
    // Changes of modes that do not respond are unknown.
    if (task.held.empty() || !task.held.front().is_mode()) add_sensitivities(task, report);
    report.by_modes = impulses_by_modes(task);
  }
  if (task.already_closed > 0) {
    report.as_published_absent = "a target is already held";
  } else if (rebounds) {
    report.as_published_absent = "the thesis has no contacts that rebound";
  } else {
    describe_published(system, problem, contact, report);
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
  const std::vector<Impulsed> through = joint_impulses(model, state, outcome.after, impulses_at(grasps, solution));
  ImpactReport reactions;
  describe_reactions(system, k0, through, reactions);
  outcome.joints = std::move(reactions.joints);
  outcome.from_ground = from_ground(system, k0, through);
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
