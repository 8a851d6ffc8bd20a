#include "grapnel/capture/impact_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/elastic_report.hpp"
#include "grapnel/capture/impact_figures.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/hard_impact.hpp"
#include "grapnel/impact/published_impact.hpp"
#include "grapnel/impact/yielding_drives.hpp"
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
  const Model& model = system.model;
  const ImpactSolution published = published_impact(model, contact.state, system.base, contact.grasps);
  if (published.status == ImpactSolution::Status::failed) {
    report.as_published_absent = published.message;
    return;
  }
  AsPublished a;
  for (std::size_t i = 0; i < contact.grasps.size(); ++i) {
    const Impulsed& P = published.contacts[i].P_WC;
    a.grasps.push_back({problem.grasps[i].end_effector, P.linear, P.angular, norm(P.linear)});
  }
  for (int v : joint_velocities(model, system.base)) a.joint_velocity_after.push_back(published.velocity[v]);
  const Kinematics before = forward_kinematics(model, contact.state),
                   after = forward_kinematics(model, {contact.state.q, published.velocity});
  const Momentumd error =
      momentum_about(model, after, Vector3d::zero()) - momentum_about(model, before, Vector3d::zero());
  a.linear_momentum_error = norm(error.linear);
  a.angular_momentum_error = norm(shift(error, center_of_mass(model, before)).angular);
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

std::vector<BodyImpulse> body_impulses(const CaptureSystem& system, const Kinematics& before, const Kinematics& after) {
  std::vector<BodyImpulse> impulses;
  for (int i = 0; i < static_cast<int>(system.model.bodies().size()); ++i) {
    const Momentumd h0 = body_momentum(system.model, before, i).h;
    const Momentumd h1 = body_momentum(system.model, after, i).h;
    impulses.push_back({shown_name(system, i), h1.linear - h0.linear, h1.angular - h0.angular});
  }
  return impulses;
}

ContactRebound describe_rebound(const Vector3d& normal, const ContactPointImpulse& impulse) {
  ContactRebound r;
  r.normal = normal;
  r.normal_impulse = impulse.normal, r.tangential_impulse = impulse.tangential;
  r.compression = impulse.compression;
  r.normal_work = impulse.normal_work, r.friction_work = impulse.friction_work;
  for (ContactMode mode : impulse.modes) r.modes.push_back(name_of(mode));
  r.spread = impulse.spread;
  return r;
}

}  // namespace

const JointDescription& held_joint(const Model& model, const HeldRate& held) {
  for (int body : model.joints()) {
    if (model.bodies()[body].v == held.velocity) return model.bodies()[body].description.joint;
  }
  throw std::logic_error("held_joint: the velocity does not belong to a joint");
}

std::string describe_overpowered_drives(const Model& model, const ImpactReport& report) {
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

GraspImpulse describe_grasp_before(const CaptureProblem& problem, const Contact& contact, const Kinematics& before,
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

void describe_grasp_after(const Grasp& grasp, const ContactImpulse& impulse, const Kinematics& after, double duration,
                          GraspImpulse& g) {
  g.impulse = impulse.P_WC.linear, g.angular_impulse = impulse.P_WC.angular;
  g.impulse_magnitude = norm(g.impulse);
  g.mean_force = duration > 0 ? g.impulse_magnitude / duration : 0;
  g.determined = impulse.determined;
  const Twistd u = relative_twist(grasp, after);
  g.relative_velocity_after = u.linear, g.relative_angular_velocity_after = u.angular;
}

// P theta-dot over the impact is (before + after) / 2 times an instantaneous impulse, or the constant rate times the
// others.
void describe_held(const Model& model, std::span<const HeldRate> held, std::span<const double> before,
                   const ImpactSolution& solution, std::span<const double> stopping, ImpactReport& report) {
  const std::vector<bool> was_overpowered = which_was_overpowered(model, held, solution.velocity);
  for (std::size_t i = 0; i < held.size() && i < solution.held_impulses.size(); ++i) {
    if (held[i].is_mode() || yields(held_joint(model, held[i]))) continue;  // impact.modes: slow, none
    const double after = solution.velocity[held[i].velocity], impulse = solution.held_impulses[i];
    const double at_once = stopping.empty() ? impulse : stopping[i];
    HeldJoint joint;
    joint.joint = held_joint(model, held[i]).name;
    joint.impulse = at_once;
    joint.work = 0.5 * at_once * (before[held[i].velocity] + after);
    if (!stopping.empty()) joint.impulse += impulse, joint.work += impulse * after;
    joint.commanded_rate = held[i].after, joint.rate_after = after;
    joint.was_overpowered = was_overpowered[i];
    report.held_joints.push_back(std::move(joint));
  }
}

std::vector<ExternalImpulse> impulses_at(std::span<const Grasp> grasps, const ImpactSolution& solution) {
  std::vector<ExternalImpulse> external;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Impulsed& P = solution.contacts[i].P_WC;
    external.push_back({grasps[i].robot_body, grasps[i].p_WC, P});
    external.push_back({grasps[i].target_body, grasps[i].p_WC, -P});
  }
  return external;
}

Momentumd describe_change(const CaptureProblem& problem, const CaptureSystem& system, const State& before,
                          const State& after, std::span<const ExternalImpulse> external, ImpactReport& report) {
  const Model& model = system.model;
  const Kinematics k0 = forward_kinematics(model, before), k1 = forward_kinematics(model, after);
  report.body_impulses = body_impulses(system, k0, k1);
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

std::vector<Vector3d> contact_normals(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics) {
  std::vector<Vector3d> normals;
  for (const GraspSetup& grasp : problem.grasps)
    normals.push_back(grasp.contact ? contact_normal_in_world(problem, system, kinematics, grasp) : Vector3d::zero());
  return normals;
}

namespace {

// Impulses and velocities after of the grasps and contacts, determinacy, and the rebound of contacts.
void describe_solution(const ImpactTask& task, const ImpactSolution& solution, std::span<const Vector3d> normals,
                       const Kinematics& after, ImpactReport& report) {
  const Contact& contact = task.contact;
  for (std::size_t i = 0; i < contact.grasps.size(); ++i)
    describe_grasp_after(contact.grasps[i], solution.contacts[i], after, report.duration, report.grasps[i]);
  for (std::size_t i = 0; i < solution.points.size(); ++i)
    report.grasps[task.already_closed + i].rebound =
        describe_rebound(normals[task.already_closed + i], solution.points[i]);
  if (!solution.points.empty()) report.hypothesis = name_of(task.problem.impact->hypothesis);
  report.energy_created = solution.energy_created;
  report.unique = solution.unique;
  report.inconsistent = solution.inconsistent;
  report.rank = solution.rank;
  report.rows = solution.rows;
  report.loops = loop_gaps(task.problem, contact);
  if (task.detail == CaptureDetail::full && solution.points.empty())
    report.null_space = describe_impulses(contact.grasps, solution.null_space);
}

// Hard contacts that take part => their impulses added to those on bodies from outside; from obstacles, the momentum
// about the world's origin that enters the system.
Momentumd add_hard_impulses(const ImpactTask& task, const ImpactSolution& solution,
                            std::vector<ExternalImpulse>& external) {
  Momentumd entered = Momentumd::zero();
  for (std::size_t i = 0; i < solution.hard.size(); ++i) {
    const HardPoint& at = task.hard[i];
    const Impulsed P{Vector3d::zero(), solution.hard[i].normal * at.normal + solution.hard[i].tangential};
    for (const auto& [body, on_body] : {std::pair(at.body_a, -P), std::pair(at.body_b, P)}) {
      if (body >= 0)
        external.push_back({body, at.p_WC, on_body});
      else
        entered -= Momentumd{cross(at.p_WC, on_body.linear), on_body.linear};
    }
  }
  return entered;
}

// Measures and derivatives at the rates that held joints have after the impact; the thesis's estimate.
void add_comparisons(const ImpactTask& task, const ImpactSolution& solution, ImpactReport& report) {
  std::vector<HeldRate> actual_rates(task.held.begin(), task.held.end());
  for (HeldRate& h : actual_rates) {
    if (!h.is_mode()) h.after = solution.velocity[h.velocity];
  }
  ImpactTask with_actual_rates = task;
  with_actual_rates.held = actual_rates;
  add_measures(with_actual_rates, report);
  const bool touches = !solution.hard.empty();  // derivatives and comparisons are those without contacts
  if (impact_law(task.law).differentiable && !touches) {
    // Changes of modes that do not respond are unknown.
    if (task.held.empty() || !task.held.front().is_mode()) add_sensitivities(task, report);
    report.by_modes = impulses_by_modes(task);
  }
  if (touches) {
    report.as_published_absent = "hard contacts take part";
  } else if (task.already_closed > 0) {
    report.as_published_absent = "a target is already held";
  } else if (!solution.points.empty()) {
    report.as_published_absent = "the thesis has no contacts that rebound";
  } else {
    describe_published(task.system, task.problem, task.contact, report);
  }
}

}  // namespace

// Grasps in the impact, held rates, law => report, residuals, state after, momentum from the ground.
ImpactOutcome run_impact(const ImpactTask& task) {
  const CaptureProblem& problem = task.problem;
  const CaptureSystem& system = task.system;
  const Contact& contact = task.contact;
  const Model& model = system.model;
  const ImpactSetup setup = problem.impact.value_or(ImpactSetup{});  // absent: brakes in motion without a capture
  const ImpactLaw& law = impact_law(task.law);
  const Kinematics before = forward_kinematics(model, contact.state);
  const std::vector<Vector3d> normals =
      law.of_contacts ? contact_normals(problem, system, before) : std::vector<Vector3d>();
  ImpactOutcome outcome;
  ImpactReport& report = outcome.report;
  report.law = law.name;
  report.time = task.time;
  report.duration = setup.duration;
  report.show_as_published = problem.output_as_published || law.published;
  report.joints_during = name_of(setup.joints);
  for (std::size_t i = 0; i < contact.grasps.size(); ++i)
    report.grasps.push_back(describe_grasp_before(problem, contact, before, i));

  const ImpactSolution solution = solve_impact(law, {model, contact.state, setup, system.base, contact.grasps,
                                                     task.already_closed, normals, task.held, task.hard});
  if (solution.status == ImpactSolution::Status::failed) throw std::runtime_error(solution.message);
  outcome.after = {contact.state.q, solution.velocity};
  outcome.residuals.momentum = solution.generalized_momentum_residual;
  outcome.residuals.energy = solution.energy_identity_residual;
  if (!solution.points.empty()) {
    outcome.residuals.cone = solution.cone_residual;
  } else if (solution.inconsistent.empty()) {
    outcome.residuals.velocity = solution.constraint_residual;
  }
  if (!solution.hard.empty()) outcome.residuals.cone = solution.cone_residual;
  describe_solution(task, solution, normals, forward_kinematics(model, outcome.after), report);
  describe_held(model, task.held, contact.state.v, solution, {}, report);
  std::vector<ExternalImpulse> external = impulses_at(contact.grasps, solution);
  const Momentumd from_obstacles = add_hard_impulses(task, solution, external);
  outcome.from_ground =
      describe_change(problem, system, contact.state, outcome.after, external, report) + from_obstacles;
  outcome.hard = solution.hard;
  for (const ContactPointImpulse& c : solution.points)
    outcome.exchanged_with_contacts += c.work - c.normal_work - c.friction_work;
  if (task.detail == CaptureDetail::full) add_comparisons(task, solution, report);
  return outcome;
}

BrakeReport brake_report(std::span<const std::size_t> joints, const ImpactReport& impact) {
  BrakeReport report;
  for (std::size_t j : joints) {
    const std::string& name = impact.joint_names[j];
    report.joints.push_back(name);
    for (const HeldJoint& held : impact.held_joints) {
      if (held.joint == name) report.impulse.push_back(held.impulse);
    }
  }
  report.kinetic_energy_before = impact.kinetic_energy_before;
  report.kinetic_energy_after = impact.kinetic_energy_after;
  for (const GraspImpulse& g : impact.grasps)
    report.grasps.push_back({g.end_effector, g.target, g.impulse, g.angular_impulse});
  report.base_velocity_change = impact.base_velocity_change;
  report.base_angular_velocity_change = impact.base_angular_velocity_change;
  return report;
}

void scale_published(const LedgerScale& scale, ImpactReport& report) {
  if (!report.as_published) return;
  report.as_published->relative_linear_momentum_error =
      report.as_published->linear_momentum_error / scale.linear_momentum;
  report.as_published->relative_angular_momentum_error =
      report.as_published->angular_momentum_error / scale.angular_momentum;
}

}  // namespace grapnel
