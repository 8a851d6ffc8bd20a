/// Impacts in an instant of hard shapes within a compliant impact (docs/theory, section 23, Hard contacts).

#include "grapnel/contact/point_velocity.hpp"
#include "grapnel/impact/compliant_system.hpp"
#include "grapnel/impact/hard_impact.hpp"

namespace grapnel {
namespace {}  // namespace

// Instant, y => y after the impact of all hard pairs that touch, if one of them must have one: rates, impulses of
// channels and of held velocities, and their work jump. Without a solution contact lasts, with finite forces.
void CompliantSystem::strike(double t, std::vector<double>& y) {
  ContactSet& contacts = shapes_->contacts();
  if (!contacts.any_hard()) return;
  place(t, y);
  ImpactShapes& results = shapes_->results();
  const double time = results.begin + t;
  const Kinematics before = forward_kinematics(model_, now_);
  std::vector<HardPoint> points = contacts.impact_points(time, before);
  if (points.empty()) return;
  std::vector<HeldRate> rates;  // held velocities keep their values; grasps are springs, which transmit no impulse
  for (const int v : held_) rates.push_back({v, now_.v[v]});
  const std::vector<Grasp> closed = closed_grasps(before);
  const ImpactSolution solution = solve_hard_impact({model_, now_, closed, rates}, points);
  std::vector<HardPointImpact> impacts(points.size());
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
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const Impulsed P = shift(solution.contacts[i].P_WC, tables_.channel_point - closed[i].p_WC);
    double* const at = y.data() + loop_offset(static_cast<int>(i));
    for (int n = 0; n < 3; ++n) at[n] += P.angular[n], at[3 + n] += P.linear[n];
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
