/// Impacts of hard contacts at an instant of a phase (theory section 23, Hard contacts): the impulses by the law of
/// impacts of contacts, the response of the phase's dynamics to them, and their work and impulse among the integrals.

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/contact/point_velocity.hpp"
#include "grapnel/impact/hard_impact.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

using namespace phase_integral;

namespace {

Grasp grasp_of_closure(const LoopClosure& closure, const Kinematics& k) {
  const Posed X_WC = k.X_WB[closure.body_a] * closure.X_AC;
  return {closure.body_a, closure.body_b, closure.model, X_WC.p, X_WC.R * closure.hinge_C};
}

}  // namespace

// Setup and current rates => rates that an impact does not change: those of prescribed joints, of a held root, and of
// joints that are driven or braked in impacts.
std::vector<HeldRate> PhaseDynamics::rates_in_contact_impact() const {
  std::vector<HeldRate> held;
  const auto hold = [&](int v, double after) {
    const auto is_this = [v](const HeldRate& h) { return h.velocity == v; };
    if (std::none_of(held.begin(), held.end(), is_this)) held.push_back({v, after});
  };
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const int v = model_.bodies()[model_.joints()[j]].v;
    if (output_of(setup_.drives[j].control) == ControlOutput::motion) hold(v, now_.v[v]);
  }
  for (int k = 0; k < 6 && setup_.held_root >= 0; ++k) hold(model_.bodies()[setup_.held_root].v + k, 0);
  for (const int v : setup_.driven_in_impacts) hold(v, now_.v[v]);
  for (const int v : setup_.braked_in_impacts) hold(v, 0);
  return held;
}

// Impulses of closures and couplings in the last response => added to those of the impact.
void PhaseDynamics::add_loop_impulses() {
  if (!solver_) return;
  const std::span<const double> rows = solver_->multipliers();
  hard_impact_->loop_impulses.resize(rows.size(), 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) hard_impact_->loop_impulses[i] += rows[i];
}

// Held rates and y => y with joints that brakes have stopped, before contacts act, and the work of the brakes.
void PhaseDynamics::stop_braked_joints(std::span<const HeldRate> held, std::span<double> y) {
  const auto moves = [&](int v) { return now_.v[v] != 0; };
  if (std::none_of(setup_.braked_in_impacts.begin(), setup_.braked_in_impacts.end(), moves)) return;
  std::vector<JointModes::RateChange> changes;
  for (const HeldRate& h : held) changes.push_back({h.velocity, h.after - now_.v[h.velocity]});
  const std::vector<std::uint8_t> prescribed = prescribed_;
  respond_to(changes, false);
  prescribed_ = prescribed;
  add_loop_impulses();
  book_impulses(y, true);  // now_ has the mean velocities
  for (std::size_t i = 0; i < now_.v.size(); ++i) {
    now_.v[i] += 0.5 * vdot_[i];
    y[now_.q.size() + i] += vdot_[i];
  }
  for (const HeldRate& h : held) now_.v[h.velocity] = h.after;
  forward_kinematics(model_, now_, workspace_.kinematics);
}

// Impulses on the second bodies of all points => changes of all velocities, in vdot_, by the phase's own dynamics.
void PhaseDynamics::respond_to_contacts(std::span<const HardPoint> points, std::span<const Vector3d> impulses,
                                        std::span<const HeldRate> held) {
  std::vector<ExternalWrench>& pushes = hard_impact_->impulses;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Wrenchd P{Vector3d::zero(), impulses[i]};
    if (points[i].body_a >= 0) pushes.push_back({points[i].body_a, points[i].p_WC, -P});
    if (points[i].body_b >= 0) pushes.push_back({points[i].body_b, points[i].p_WC, P});
  }
  gather_external(model_, pushes, workspace_);
  std::vector<JointModes::RateChange> changes;
  for (const HeldRate& h : held) changes.push_back({h.velocity, 0});
  const std::vector<std::uint8_t> prescribed = prescribed_;
  respond_to(changes, false, workspace_.link_wrench);
  prescribed_ = prescribed;
  add_loop_impulses();
}

// Impulses and their response => work and impulse of contacts, ground and motors added to the integrals in y, and the
// impact of every point. An impulse works at the mean of the velocities before and after it.
std::vector<HardPointImpact> PhaseDynamics::book_contacts(std::span<const HardPoint> points,
                                                          std::span<const Vector3d> impulses,
                                                          const ImpactSolution& solution, std::span<double> y) {
  book_impulses(y, true);  // now_ has the mean velocities
  const Kinematics& k = workspace_.kinematics;
  const std::span<double> integrals = y.subspan(now_.q.size() + now_.v.size(), integral_count());
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  std::vector<HardPointImpact> impacts;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const HardPoint& at = points[i];
    const ContactPointImpulse& law = solution.points[i];
    const auto push = [&](int body, const Vector3d& P) {
      if (body < 0) return 0.0;
      const double work = dot(P, point_velocity(body, at.p_WC, k));
      const std::size_t t = tree_of_[body];
      add_wrench(integrals.data(), static_cast<int>(t), trees_[t], P, at.p_WC, Vector3d::zero(), work);
      add_exchange(exchanged + kExchangeCount * t, trees_[t], P, at.p_WC, Vector3d::zero(), work);
      return work;
    };
    HardPointImpact impact;
    impact.impulse = law.normal;
    impact.work = push(at.body_a, -impulses[i]) + push(at.body_b, impulses[i]);
    impact.loss = -law.normal_work, impact.friction_loss = -law.friction_work;
    impacts.push_back(impact);
  }
  for (std::size_t i = 0; i < now_.v.size(); ++i) now_.v[i] += 0.5 * vdot_[i];
  forward_kinematics(model_, now_, workspace_.kinematics);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const HardPoint& at = points[i];
    impacts[i].separation_speed = dot(relative_velocity(at, k), at.normal);
  }
  return impacts;
}

// Closed loops, held rates => call(bodies in an impact of hard contacts).
template <class Call>
auto PhaseDynamics::in_contact_impact(std::span<const HeldRate> held, Call&& call) {
  std::vector<Grasp> closed;
  for (const LoopClosure& closure : setup_.closures) closed.push_back(grasp_of_closure(closure, workspace_.kinematics));
  std::vector<HeldRate> rows = coupling_rates(model_);
  rows.insert(rows.end(), held.begin(), held.end());
  return call(HardImpactBodies{model_, now_, closed, rows});
}

// Time and y => y after the impact of all hard contacts that touch, with its effects among the integrals and in the
// contacts' histories and modes.
std::string PhaseDynamics::apply_contact_impacts(double t, std::span<double> y) {
  hard_impact_.reset();
  if (!setup_.contacts || !setup_.contacts->any_hard()) return {};
  load(t, y);
  forward_kinematics(model_, now_, workspace_.kinematics);
  std::vector<HardPoint> points = setup_.contacts->impact_points(t, workspace_.kinematics);
  if (points.empty()) return {};

  hard_impact_ = HardImpact{t, now_, {}, {}, {}};
  const std::vector<HeldRate> held = rates_in_contact_impact();
  stop_braked_joints(held, y);
  const ImpactSolution solution =
      in_contact_impact(held, [&](const HardImpactBodies& bodies) { return solve_hard_impact(bodies, points); });
  if (solution.status != ImpactSolution::Status::solved) {
    hard_impact_.reset();
    if (in_contact_impact(held, [&](const HardImpactBodies& bodies) { return can_separate(bodies, points); }))
      return fmt::format("the impact of hard contacts at t = {:.9g} s has no solution: {}", t, solution.message);
    setup_.contacts->note_impact(t, points, std::vector<HardPointImpact>(points.size()), workspace_.kinematics);
    return {};
  }
  std::vector<Vector3d> impulses;
  for (std::size_t i = 0; i < points.size(); ++i)
    impulses.push_back(solution.points[i].normal * points[i].normal + solution.points[i].tangential);

  respond_to_contacts(points, impulses, held);
  const std::vector<HardPointImpact> impacts = book_contacts(points, impulses, solution, y);
  for (std::size_t i = 0; i < now_.v.size(); ++i) {
    y[now_.q.size() + i] += vdot_[i];
    hard_impact_->change.push_back(now_.v[i] - hard_impact_->before.v[i]);
  }
  setup_.contacts->note_impact(t, points, impacts, workspace_.kinematics);
  return {};
}

std::string PhaseDynamics::busiest_hard_contact() const {
  const ContactSet* contacts = setup_.contacts.get();
  if (!contacts || !contacts->any_hard()) return {};
  std::size_t busiest = 0;
  for (std::size_t g = 0; g < contacts->groups(); ++g) {
    if (contacts->history(g).impacts > contacts->history(busiest).impacts) busiest = g;
  }
  const GroupHistory& history = contacts->history(busiest);
  if (history.impacts == 0) return {};
  const std::pair<int, int> bodies = contacts->bodies_of_group(busiest);
  const auto name = [&](int body) {
    return body < 0 ? std::string("an obstacle") : model_.bodies()[body].description.name;
  };
  return fmt::format("{} and {} have had {} impacts, the last one at t = {:.9g} s", name(bodies.first),
                     name(bodies.second), history.impacts, *history.last_impact);
}

}  // namespace grapnel
