#include "grapnel/impact/hard_impact.hpp"

#include <algorithm>

#include "grapnel/contact/point_velocity.hpp"
#include "grapnel/impact/impact_law.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

// ---- Hard contacts alone ----

namespace {

// Slip speed that counts as a rounding error, relative to the largest approach speed.
constexpr double kNoSlip = 1e-9;

double slip_along(const Vector3d& v, const Vector3d& n) { return norm(v - dot(v, n) * n); }

// The largest slip speed of points, at the velocities of kinematics, or after an impact [m/s].
double largest_slip(std::span<const HardPoint> points, const Kinematics& k) {
  double slip = 0;
  for (const HardPoint& p : points) slip = std::max(slip, slip_along(relative_velocity(p, k), p.normal));
  return slip;
}
double largest_slip(std::span<const HardPoint> points, const ImpactSolution& solution) {
  double slip = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    slip = std::max(slip, slip_along(solution.points[i].velocity_after, points[i].normal));
  return slip;
}
double largest_approach(std::span<const HardPoint> points, const Kinematics& k) {
  double speed = 0;
  for (const HardPoint& p : points) speed = std::max(speed, -dot(relative_velocity(p, k), p.normal));
  return speed;
}

std::vector<HardPoint> without_friction(std::vector<HardPoint> points) {
  for (HardPoint& p : points) p.friction = 0;
  return points;
}

// The second body is the "robot", which the normals point to.
std::vector<ContactPoint> contact_points(std::span<const HardPoint> points) {
  std::vector<ContactPoint> contacts;
  for (const HardPoint& p : points) {
    ContactPoint& c = contacts.emplace_back(ContactPoint{p.body_b, p.body_a, p.p_WC, p.normal});
    c.restitution = p.restitution, c.friction = p.friction;
    c.hypothesis = RestitutionHypothesis::stronge;
  }
  return contacts;
}

ImpactSolution solve_points(const HardImpactBodies& bodies, std::span<const HardPoint> points) {
  return contact_impact(bodies.model, bodies.state, contact_points(points), RestitutionHypothesis::stronge,
                        bodies.closed, bodies.held,
                        {.spread = false, .max_steps = bodies.max_steps, .keep_rates = bodies.keep_rates});
}

bool is_solved(const ImpactSolution& solution) { return solution.status == ImpactSolution::Status::solved; }

}  // namespace

// If no point slips before and after the impact without friction, that impact is the solution: friction of redundant
// points, as of a box that falls flat, would have to balance rounding errors.
ImpactSolution solve_hard_impact(const HardImpactBodies& bodies, std::vector<HardPoint>& points) {
  const Kinematics k = forward_kinematics(bodies.model, bodies.state);
  const double slips = kNoSlip * largest_approach(points, k);
  if (points.size() > 1 && largest_slip(points, k) <= slips) {
    ImpactSolution smooth = solve_points(bodies, without_friction(points));
    if (is_solved(smooth) && largest_slip(points, smooth) <= slips) return smooth;
  }
  ImpactSolution solution = solve_points(bodies, points);
  const auto lasts = [](const HardPoint& p) { return p.lasts; };
  if (is_solved(solution) || std::none_of(points.begin(), points.end(), lasts) || can_separate(bodies, points))
    return solution;
  std::erase_if(points, lasts);
  return solve_points(bodies, points);
}

bool can_separate(const HardImpactBodies& bodies, std::vector<HardPoint> points) {
  return is_solved(solve_points(bodies, without_friction(std::move(points))));
}

// ---- In impacts of grasps, contacts and brakes ----

namespace {

// The impulses of a point that receives none.
ContactPointImpulse no_impulse() {
  ContactPointImpulse none;
  none.tangential = none.velocity_before = none.velocity_after = Vector3d::zero();
  return none;
}

// Impulses of the points that took part => per point of the input.
std::vector<ContactPointImpulse> impulses_of_all(std::span<const HardPoint> all, std::span<const HardPoint> part,
                                                 std::vector<ContactPointImpulse> impulses) {
  std::vector<ContactPointImpulse> result;
  for (std::size_t i = 0, next = 0; i < all.size(); ++i) {
    const bool takes_part = part.size() == all.size() || !all[i].lasts;
    result.push_back(takes_part ? std::move(impulses[next++]) : no_impulse());
  }
  return result;
}

bool any_approaches(std::span<const HardPoint> points, const Kinematics& k) {
  return std::any_of(points.begin(), points.end(),
                     [&](const HardPoint& p) { return -dot(relative_velocity(p, k), p.normal) >= p.rest_speed; });
}

// The largest change of the velocities of rows that should keep them, over the largest speed.
double change_of_rows(const ImpactInput& input, std::span<const Grasp> closed, const std::vector<double>& before,
                      const std::vector<double>& after) {
  const auto vector = [](const std::vector<double>& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  if (closed.empty()) return 0;
  const Eigen::MatrixXd J = grasp_jacobian(input.model, forward_kinematics(input.model, input.state), closed);
  const double change = (J * (vector(after) - vector(before))).lpNorm<Eigen::Infinity>();
  const double speed =
      std::max(vector(input.state.v).lpNorm<Eigen::Infinity>(), vector(before).lpNorm<Eigen::Infinity>());
  return change == 0 ? 0 : change / speed;
}

// Impact of the rows of the law, then that of the hard contacts, in which these rows keep their velocities => both, as
// one impact.
void add_hard_impact(const ImpactInput& input, std::span<const Grasp> closed, ImpactSolution hard,
                     ImpactSolution& solution) {
  for (std::size_t i = 0; i < closed.size(); ++i) solution.contacts[i].P_WC += hard.contacts[i].P_WC;
  for (std::size_t i = 0; i < hard.held_impulses.size(); ++i) solution.held_impulses[i] += hard.held_impulses[i];
  solution.constraint_residual =
      std::max(solution.constraint_residual, change_of_rows(input, closed, solution.velocity, hard.velocity));
  solution.velocity = std::move(hard.velocity);
  solution.kinetic_energy_after = hard.kinetic_energy_after;
  solution.energy_identity_residual = std::max(solution.energy_identity_residual, hard.energy_identity_residual);
  solution.generalized_momentum_residual =
      std::max(solution.generalized_momentum_residual, hard.generalized_momentum_residual);
  solution.cone_residual = hard.cone_residual;
  solution.steps += hard.steps;
}

// Grasps hold, or have rebounded; hard contacts follow from these velocities in the same instant. Without a finite
// impulse that separates bodies, contact lasts from here on.
ImpactSolution solve_grasps(const ImpactLaw& law, const ImpactInput& input) {
  ImpactSolution solution = law.solve(input);
  if (solution.status == ImpactSolution::Status::failed) return solution;
  const State closed_state{input.state.q, solution.velocity};
  if (!any_approaches(input.hard, forward_kinematics(input.model, closed_state))) return solution;
  const std::span<const Grasp> closed = law.separates ? input.grasps.first(input.holding) : input.grasps;
  HardImpactBodies bodies{input.model, closed_state, closed, input.held, true};
  std::vector<HardPoint> points(input.hard.begin(), input.hard.end());
  ImpactSolution hard = solve_hard_impact(bodies, points);
  const bool separates = is_solved(hard) || can_separate(bodies, points);
  if (!is_solved(hard) && separates) {  // friction may need more steps
    bodies.max_steps = ContactImpactOptions{}.max_steps;
    hard = solve_hard_impact(bodies, points);
  }
  if (is_solved(hard)) {
    solution.hard = impulses_of_all(input.hard, points, std::move(hard.points));
    add_hard_impact(input, closed, std::move(hard), solution);
  } else if (separates) {
    solution.status = ImpactSolution::Status::failed;
    solution.message = "the impact of hard contacts has no solution: " + hard.message;
  } else {
    solution.hard.assign(input.hard.size(), no_impulse());
  }
  return solution;
}

// Contacts of the law and these hard points on one path of impulses.
ImpactSolution solve_beside(const ImpactLaw& law, const ImpactInput& input, std::span<const HardPoint> points) {
  const std::vector<ContactPoint> others = contact_points(points);
  ImpactInput with = input;
  with.beside = others;
  return law.solve(with);
}

// Whether no hard point, which are the last ones of the solution, slips before or after it.
bool none_slips(std::span<const HardPoint> points, const ImpactSolution& solution) {
  const std::size_t own = solution.points.size() - points.size();
  double speed = 0, slip = 0;
  for (std::size_t i = 0; i < solution.points.size(); ++i) {
    const ContactPointImpulse& p = solution.points[i];
    speed = std::max({speed, norm(p.velocity_before), norm(p.velocity_after)});
    if (i < own) continue;
    const Vector3d& n = points[i - own].normal;
    slip = std::max({slip, slip_along(p.velocity_before, n), slip_along(p.velocity_after, n)});
  }
  return slip <= kNoSlip * speed;
}

// Contacts of the law and hard contacts follow one path, as in solve_hard_impact(). Without a solution lasting contacts
// take no part, whose forces are finite; then none does, and their impact follows in the motion afterwards.
ImpactSolution solve_contacts(const ImpactLaw& law, const ImpactInput& input) {
  std::vector<HardPoint> points(input.hard.begin(), input.hard.end());
  ImpactSolution solution = solve_beside(law, input, without_friction(points));
  if (!is_solved(solution) || !none_slips(points, solution)) solution = solve_beside(law, input, points);
  if (!is_solved(solution)) {
    std::erase_if(points, [](const HardPoint& p) { return p.lasts; });
    if (points.empty() || points.size() == input.hard.size()) return law.solve(input);
    solution = solve_beside(law, input, points);
    if (!is_solved(solution)) return law.solve(input);
  }
  const std::size_t own = solution.points.size() - points.size();
  solution.hard = impulses_of_all(input.hard, points,
                                  {solution.points.begin() + static_cast<std::ptrdiff_t>(own), solution.points.end()});
  solution.points.resize(own);
  solution.contacts.resize(input.grasps.size());
  return solution;
}

}  // namespace

ImpactSolution solve_impact(const ImpactLaw& law, const ImpactInput& input) {
  if (input.hard.empty() || law.in_time || law.published) return law.solve(input);
  return law.of_grasps ? solve_grasps(law, input) : solve_contacts(law, input);
}

}  // namespace grapnel
