#include "grapnel/plan/path_constraint_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kDifference = 1e-6;  // increment of finite differences of efforts

}  // namespace

// Base and problem, which must outlive it => check with storage for the efforts.
PathConstraintCheck::PathConstraintCheck(FloatingBase& base, const ReachProblem& problem)
    : base_(base),
      problem_(problem),
      setup_(problem.constraints),
      efforts_(base, problem.motion.gravity),
      n_(base.joints()) {}

// States at the nodes => local maxima of all violations above -band, and the figures of the path.
std::vector<PathConstraintCheck::Found> PathConstraintCheck::scan(int nodes, const PointAt& point_at, double band,
                                                                  double wanted, PathFigures* figures) {
  std::vector<Found> found;
  std::map<std::tuple<Kind, int, int>, std::vector<double>> series;
  const auto note = [&](Kind kind, int index, double sign, int node, double v) {
    if (!(v > -kUnbounded)) return;
    auto& s = series[{kind, index, sign > 0}];
    if (s.empty()) s.assign(static_cast<std::size_t>(nodes), -kUnbounded);
    s[static_cast<std::size_t>(node)] = v;
  };
  const bool efforts = checks_efforts();
  std::vector<double> effort(static_cast<std::size_t>(n_));
  Kinematics at;
  for (int node = 0; node < nodes; ++node) {
    const PathSegment::SegmentPoint w = point_at(node);
    for (int j = 0; j < n_; ++j)
      check_joint_limits(j, w, figures, [&](Kind k, double sign, double v) {
        if (setup_.limits) note(k, j, sign, node, v);
      });
    if (efforts) {
      evaluate_efforts(w.position, w.rate, w.acceleration, w.X_WB, w.time, effort);
      for (int j = 0; j < n_; ++j) {
        const double limit = setup_.effort_limit[static_cast<std::size_t>(j)];
        if (!std::isfinite(limit)) continue;
        const double share = effort[static_cast<std::size_t>(j)] / limit;
        if (figures) figures->effort_share = std::max(figures->effort_share.value_or(0), std::abs(share));
        note(Kind::effort, j, share > 0 ? 1 : -1, node, std::abs(share) - 1);
      }
    }
    const double turn = rotation_angle(transpose(setup_.R_WB0) * w.X_WB.R);
    if (figures) figures->base_turn = std::max(figures->base_turn, turn);
    if (std::isfinite(setup_.base_turn)) note(Kind::base_turn, 0, 1, node, turn - setup_.base_turn);
    for (int i = 0; setup_.wheels && i < static_cast<int>(setup_.wheels->wheels.size()); ++i) {
      const double share = wheel_share(i, w);
      if (figures) {
        figures->wheel_share.resize(setup_.wheels->wheels.size());
        double& largest = figures->wheel_share[static_cast<std::size_t>(i)];
        largest = std::max(largest, std::abs(share));
      }
      if (std::isfinite(setup_.wheel_share))
        note(Kind::wheel, i, share > 0 ? 1 : -1, node, std::abs(share) - setup_.wheel_share);
    }
    if (!setup_.bodies || setup_.bodies->model.pairs().empty()) continue;
    place(w, at);
    check_distances(node, w, at, band, wanted, figures, note);
  }
  for (const auto& [key, s] : series) {
    for (int i = 0; i < nodes; ++i) {
      const double v = s[static_cast<std::size_t>(i)];
      if (!(v > -band)) continue;
      const bool rises = i == 0 || v >= s[static_cast<std::size_t>(i - 1)];
      const bool falls = i + 1 == nodes || v > s[static_cast<std::size_t>(i + 1)];
      if (rises && falls) found.push_back({{std::get<0>(key), std::get<1>(key), std::get<2>(key) ? 1.0 : -1.0, i}, v});
    }
  }
  return found;
}

// Violation => message with the constraint, its value, limit and time.
std::string PathConstraintCheck::describe(const Found& f, const PathSegment::SegmentPoint& w) const {
  const auto joint = [&] { return base_.model().bodies()[base_.model().joints()[f.at.index]].description.joint.name; };
  const auto j = static_cast<std::size_t>(f.at.index);
  switch (f.at.kind) {
    case Kind::position:
      return fmt::format("joint '{}' moves {:.3g} (rad or m) beyond its {} limit of {:.4g} at t = {:.4g} s", joint(),
                         f.value, f.at.sign > 0 ? "upper" : "lower",
                         f.at.sign > 0 ? problem_.upper[j] : problem_.lower[j], w.time);
    case Kind::rate:
      return fmt::format("joint '{}' exceeds its rate limit of {:.4g} by {:.3g} % at t = {:.4g} s", joint(),
                         problem_.rate_limit[j], 100 * f.value, w.time);
    case Kind::effort:
      return fmt::format("joint '{}' exceeds its effort limit of {:.4g} by {:.3g} % at t = {:.4g} s", joint(),
                         setup_.effort_limit[j], 100 * f.value, w.time);
    case Kind::base_turn:
      return fmt::format("the base rotates {:.4g} rad from its initial attitude at t = {:.4g} s, the limit is {:.4g}",
                         setup_.base_turn + f.value, w.time, setup_.base_turn);
    case Kind::wheel:
      return fmt::format("wheel '{}' holds {:.4g} of its momentum capacity at t = {:.4g} s, the limit is {:.4g}",
                         setup_.wheels->wheels[static_cast<std::size_t>(f.at.index)].name, setup_.wheel_share + f.value,
                         w.time, setup_.wheel_share);
    case Kind::clearance:
      break;
  }
  const ClearancePair& pair = setup_.bodies->model.pairs()[static_cast<std::size_t>(f.at.index)];
  const double d = *setup_.clearance - f.value;
  return fmt::format("'{}' and '{}' {} at t = {:.4g} s, the minimum is {:.4g} m", setup_.bodies->names[pair.body_a],
                     setup_.bodies->names[pair.body_b],
                     d < 0 ? fmt::format("overlap by {:.4g} m", -d) : fmt::format("come within {:.4g} m", d), w.time,
                     *setup_.clearance);
}

bool PathConstraintCheck::checks_efforts() const {
  return setup_.limits && std::any_of(setup_.effort_limit.begin(), setup_.effort_limit.end(),
                                      [](double limit) { return std::isfinite(limit); });
}

void PathConstraintCheck::evaluate_efforts(const std::vector<double>& position, const std::vector<double>& rate,
                                           const std::vector<double>& acceleration, const Posed& X_WB, double time,
                                           std::span<double> effort) {
  // Momentum and the centre of mass determine the base's position; its attitude is independent.
  base_.place(position);
  const Posed X{X_WB.R, base_.floats() ? problem_.motion.com_at(time) - X_WB.R * base_.com() : X_WB.p};
  efforts_.evaluate(position, rate, acceleration, X, problem_.motion.in_base(time, X), effort);
}

// One constraint at one point of the path => g_i of (6.20), positive if violated, and with `d` its derivatives by
// joints, rates, accelerations and base rotation.
double PathConstraintCheck::violation(const Instant& at, const PathSegment::SegmentPoint& w, PerMotion* d) {
  const auto j = static_cast<std::size_t>(at.index);
  switch (at.kind) {
    case Kind::position:
      if (d) d->position[at.index] = at.sign;
      return at.sign > 0 ? w.position[j] - problem_.upper[j] : problem_.lower[j] - w.position[j];
    case Kind::rate:
      if (d) d->rate[at.index] = at.sign / problem_.rate_limit[j];
      return at.sign * w.rate[j] / problem_.rate_limit[j] - 1;
    case Kind::effort:
      return effort_violation(at, w, d);
    case Kind::base_turn: {
      const Vector3d phi = rotation_vector(w.X_WB.R * transpose(setup_.R_WB0));
      const double angle = norm(phi);
      if (d && angle > 0) d->turn = column((1 / angle) * phi);
      return angle - setup_.base_turn;
    }
    case Kind::wheel: {
      if (d) {
        std::vector<double> weights(setup_.wheels->wheels.size());
        weights[j] = at.sign;
        add_wheel_change(w, weights, *d);
      }
      return at.sign * wheel_share(at.index, w) - setup_.wheel_share;
    }
    case Kind::clearance:
      break;
  }
  const double value = *setup_.clearance - distance(at.index, w, d);
  if (d) d->position *= -1, d->turn *= -1;
  return value;
}

template <class At>
void PathConstraintCheck::check_joint_limits(int joint, const PathSegment::SegmentPoint& w, PathFigures* figures,
                                             At&& at) {
  if (base_.is_held(joint)) return;
  const auto j = static_cast<std::size_t>(joint);
  const double above = w.position[j] - problem_.upper[j], below = problem_.lower[j] - w.position[j];
  at(Kind::position, 1.0, above), at(Kind::position, -1.0, below);
  const double limit = problem_.rate_limit.empty() ? kUnbounded : problem_.rate_limit[j];
  const double share = std::isfinite(limit) ? w.rate[j] / limit : 0;
  if (std::isfinite(limit)) at(Kind::rate, 1.0, share - 1), at(Kind::rate, -1.0, -share - 1);
  if (!figures) return;
  figures->position_margin = std::min(figures->position_margin, -std::max(above, below));
  figures->rate_share = std::max(figures->rate_share, std::abs(share));
}

double PathConstraintCheck::effort_violation(const Instant& at, const PathSegment::SegmentPoint& w, PerMotion* d) {
  const double scale = at.sign / setup_.effort_limit[static_cast<std::size_t>(at.index)];
  std::vector<double> effort(static_cast<std::size_t>(n_));
  evaluate_efforts(w.position, w.rate, w.acceleration, w.X_WB, w.time, effort);
  if (d) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(n_);
    weights[at.index] = scale;
    add_effort_change(w, effort, weights, *d);
  }
  return scale * effort[static_cast<std::size_t>(at.index)] - 1;
}

// Weights on efforts => derivatives with respect to the motion at a node, by reverse differentiation or, for rotors
// with stated axes, by finite differences.
void PathConstraintCheck::add_effort_change(const PathSegment::SegmentPoint& w, const std::vector<double>& effort,
                                            const Eigen::VectorXd& weights, PerMotion& d) {
  if (base_.model().rotors().empty()) {
    // Linear momentum requires no effort; without it h_B is independent of the joints.
    const Momentumd h_B{transposed_times(w.X_WB.R, problem_.motion.h.angular), Vector3d::zero()};
    efforts_.differentiate(w.position, w.rate, w.acceleration, w.X_WB, h_B,
                           {weights.data(), static_cast<std::size_t>(n_)}, effort_change_);
    const JointEfforts::Gradient& g = effort_change_;
    d.position += as_vector(g.position), d.rate += as_vector(g.rate), d.acceleration += as_vector(g.acceleration);
    d.turn += Eigen::Vector3d(g.turn[0], g.turn[1], g.turn[2]);
    return;
  }
  // Rotors with stated axes: finite differences.
  std::vector<double> other(static_cast<std::size_t>(n_));
  const auto change = [&](const std::vector<double>& position, const std::vector<double>& rate,
                          const std::vector<double>& acceleration, const Posed& X) {
    evaluate_efforts(position, rate, acceleration, X, w.time, other);
    double sum = 0;
    for (int k = 0; k < n_; ++k) {
      sum += weights[k] * (other[static_cast<std::size_t>(k)] - effort[static_cast<std::size_t>(k)]);
    }
    return sum / kDifference;
  };
  std::vector<double> x = w.position, r = w.rate, a = w.acceleration;
  for (int j = 0; j < n_; ++j) {
    const auto i = static_cast<std::size_t>(j);
    x[i] += kDifference, d.position[j] += change(x, r, a, w.X_WB), x[i] = w.position[i];
    r[i] += kDifference, d.rate[j] += change(x, r, a, w.X_WB), r[i] = w.rate[i];
    a[i] += kDifference, d.acceleration[j] += change(x, r, a, w.X_WB), a[i] = w.acceleration[i];
  }
  if (!base_.floats() || !(dot(problem_.motion.h.angular, problem_.motion.h.angular) > 0)) return;
  for (int k = 0; k < 3; ++k) {
    const Posed X{rotation_about(Vector3d::unit(k), kDifference) * w.X_WB.R, w.X_WB.p};
    d.turn[k] += change(x, r, a, X);
  }
}

double PathConstraintCheck::wheel_share(int wheel, const PathSegment::SegmentPoint& w) const {
  return setup_.wheels->share(static_cast<std::size_t>(wheel), w.time,
                              FloatingBase::momentum_of_rates(w.links(), w.rate));
}

void PathConstraintCheck::add_wheel_change(const PathSegment::SegmentPoint& w, std::span<const double> weights,
                                           PerMotion& d) {
  Vector3d row = Vector3d::zero();
  for (std::size_t i = 0; i < weights.size(); ++i) row += weights[i] * setup_.wheels->wheels[i].row;
  std::vector<Vector3d> g(static_cast<std::size_t>(n_));
  base_.angular_momentum_per_angle(w.links(), w.rate, Vector3d::zero(), g);
  for (int j = 0; j < n_; ++j) {
    d.position[j] -= dot(row, g[static_cast<std::size_t>(j)]);
    d.rate[j] -= dot(row, w.links().k[static_cast<std::size_t>(j)]);
  }
}

// State at a node => poses of all bodies of the clearance model.
void PathConstraintCheck::place(const PathSegment::SegmentPoint& w, Kinematics& at) {
  const ConstraintBodies& bodies = *setup_.bodies;
  at.X_WB.resize(bodies.link.size());
  auto [others, fresh] = others_.try_emplace(w.time);
  if (fresh) {
    others->second.resize(bodies.link.size());
    bodies.place_others(w.time, others->second);
  }
  for (std::size_t b = 0; b < bodies.link.size(); ++b) {
    const int link = bodies.link[b];
    at.X_WB[b] =
        link < 0 ? others->second[b] : w.X_WB * w.links().X_BL[static_cast<std::size_t>(link)] * bodies.X_LB[b];
  }
}

bool PathConstraintCheck::may_touch(int pair, const PathSegment::SegmentPoint& w, const Kinematics& at) const {
  const ConstraintBodies& bodies = *setup_.bodies;
  const int index = bodies.end_effector[static_cast<std::size_t>(pair)];
  if (index < 0) return false;
  const ConstraintBodies::EndEffector& end_effector = bodies.end_effectors[static_cast<std::size_t>(index)];
  const Frame& frame = base_.model().frames()[end_effector.frame];
  const BodyPlacement& placement = base_.model().bodies()[frame.body].placement;
  const Posed X_WE = w.X_WB * w.links().X_BL[static_cast<std::size_t>(placement.link)] * placement.X_LB * frame.X_BE;
  return norm(X_WE.p - at.X_WB[static_cast<std::size_t>(end_effector.target)] * end_effector.p_TG) <= end_effector.near;
}

bool PathConstraintCheck::may_touch(const Instant& at, const PathSegment::SegmentPoint& w) {
  if (at.kind != Kind::clearance) return false;
  Kinematics kinematics;
  place(w, kinematics);
  return may_touch(at.index, w, kinematics);
}

// State at a node => distances of all pairs that lower bounds do not exclude.
template <class Note>
void PathConstraintCheck::check_distances(int node, const PathSegment::SegmentPoint& w, const Kinematics& at,
                                          double band, double wanted, PathFigures* figures, Note&& note) {
  const ClearanceModel& model = setup_.bodies->model;
  const double required = setup_.clearance.value_or(-kUnbounded);
  for (int p = 0; p < static_cast<int>(model.pairs().size()); ++p) {
    const double cutoff =
        std::max(required + band, std::max(wanted, figures ? figures->clearance.distance : -kUnbounded));
    if (model.coarse_bound(p, at) > cutoff || model.lower_bound(p, at) > cutoff || may_touch(p, w, at)) continue;
    const ShapeDistance d = model.distance(p, at);
    if (figures && d.distance < figures->clearance.distance) {
      const ClearancePair& pair = model.pairs()[static_cast<std::size_t>(p)];
      figures->clearance = {d.distance, p, pair.body_a, pair.body_b, d.point_a, d.point_b, d.normal};
      figures->clearance_time = w.time;
    }
    note(Kind::clearance, p, 1.0, node, std::max(required, wanted - band) - d.distance);
  }
}

double PathConstraintCheck::distance(int pair, const PathSegment::SegmentPoint& w, PerMotion* d) {
  Kinematics at;
  place(w, at);
  const ShapeDistance found = setup_.bodies->model.distance(pair, at);
  if (d) {
    const ClearancePair& p = setup_.bodies->model.pairs()[static_cast<std::size_t>(pair)];
    add_point(p.body_b, found.point_b, found.normal, w, *d);
    add_point(p.body_a, found.point_a, -found.normal, w, *d);
  }
  return found.distance;
}

// Point of a body => its displacement along n per joint value and base rotation, (2) of path_constraints.hpp.
void PathConstraintCheck::add_point(int body, const Vector3d& p_W, const Vector3d& n,
                                    const PathSegment::SegmentPoint& w, PerMotion& d) {
  const int link = setup_.bodies->link[static_cast<std::size_t>(body)];
  if (link < 0) return;
  const PlacedLinks& links = w.links();
  const Vector3d r = inverse(w.X_WB) * p_W, n_B = transposed_times(w.X_WB.R, n);
  const auto& tree = base_.model().tree().links;
  for (int i = link; i > 0; i = tree[static_cast<std::size_t>(i)].parent) {
    const Twistd& S = links.axis[static_cast<std::size_t>(i)];
    d.position[base_.joint_of_link(i)] += dot(n_B, S.linear + cross(S.angular, r));
  }
  if (!base_.floats()) return;
  for (int j = 0; j < n_; ++j) {
    d.position[j] -= dot(n_B, (1 / links.mass) * links.joint_momentum[static_cast<std::size_t>(j)].linear);
  }
  d.turn += column(cross(w.X_WB.R * (r - links.com), n));
}

}  // namespace grapnel
