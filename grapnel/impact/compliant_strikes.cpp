/// Impacts in an instant of hard shapes within a compliant impact (docs/theory, section 23, Hard contacts).

#include "grapnel/impact/compliant_system.hpp"
#include "grapnel/impact/contact_impact.hpp"

namespace grapnel {
namespace {

// Steps of a path of impulses beyond which contacts do not part, as in motion phases.
constexpr int kMaxStrikeSteps = 10'000;

Vector3d velocity_at(int body, const Vector3d& p_W, const Kinematics& k) {
  return body < 0 ? Vector3d::zero() : shift(k.V_WB[body], p_W - k.X_WB[body].p).linear;
}

Vector3d relative_velocity(const HardPoint& at, const Kinematics& k) {
  return velocity_at(at.body_b, at.p_WC, k) - velocity_at(at.body_a, at.p_WC, k);
}

// Points, state, held velocities, which keep their values => impulses by (11.1) to (11.8) with Stronge's hypothesis.
// Grasps are springs, which transmit no impulse.
ImpactSolution solve_strike(const Model& model, const State& state, std::span<const HardPoint> points,
                            std::span<const int> held) {
  std::vector<ContactPoint> contacts;
  for (const HardPoint& p : points)
    contacts.push_back({p.body_b, p.body_a, p.p_WC, p.normal, p.restitution, p.friction});
  std::vector<HeldRate> rates;
  for (const int v : held) rates.push_back({v, state.v[v]});
  return contact_impact(model, state, contacts, RestitutionHypothesis::stronge, {}, rates,
                        {.spread = false, .max_steps = kMaxStrikeSteps});
}

}  // namespace

// Instant, y => y after the impact of all hard pairs that touch, if one of them must have one: rates, impulses of
// channels and of held velocities, and their work jump. Without a solution contact lasts, with finite forces.
void CompliantSystem::strike(double t, std::vector<double>& y) {
  ContactSet& contacts = shapes_->contacts();
  if (!contacts.any_hard()) return;
  place(t, y);
  ImpactShapes& results = shapes_->results();
  const double time = results.begin + t;
  const Kinematics before = forward_kinematics(model_, now_);
  const std::vector<HardPoint> points = contacts.impact_points(time, before);
  if (points.empty()) return;
  std::vector<HardPointImpact> impacts(points.size());
  const ImpactSolution solution = solve_strike(model_, now_, points, held_);
  if (solution.status != ImpactSolution::Status::solved) {
    contacts.note_impact(time, points, impacts, before);
    return;
  }
  State moved = now_;
  moved.v = solution.velocity;
  const Kinematics after = forward_kinematics(model_, moved);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const HardPoint& at = points[i];
    const ContactPointImpulse& law = solution.points[i];
    const Vector3d P = law.normal * at.normal + law.tangential;  // on b
    const Vector3d u = relative_velocity(at, before), u_after = relative_velocity(at, after);
    impacts[i] = {law.normal, 0.5 * dot(P, u + u_after), -law.normal_work, -law.friction_work, dot(u_after, at.normal)};
    results.strike_work += impacts[i].work;
    add_shape_impulse(at.body_a, at.body_b, at.p_WC, {Vector3d::zero(), P}, y.data());
    shapes_->add_impulse(at.body_a, at.body_b, at.p_WC, {Vector3d::zero(), P},
                         std::span(y).subspan(static_cast<std::size_t>(shape_at_)));
  }
  for (std::size_t r = 0; r < rates_.size(); ++r)
    y[static_cast<std::size_t>(tables_.rate_at) + r] = solution.velocity[rates_[r]] - start_.v[rates_[r]];
  for (std::size_t h = 0; h < held_.size(); ++h) {
    y[static_cast<std::size_t>(tables_.held_at) + h] += solution.held_impulses[h];
    y[tables_.work_at] += solution.held_impulses[h] * now_.v[held_[h]];
  }
  contacts.note_impact(time, points, impacts, after);
  place(t, y);
}

}  // namespace grapnel
