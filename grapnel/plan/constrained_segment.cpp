#include "grapnel/plan/constrained_segment.hpp"

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

ConstrainedSegment::ConstrainedSegment(FloatingBase& base, const ReachProblem& problem, int knots, int panels)
    : base_(base),
      problem_(with_knots(problem, knots)),
      setup_(problem_.constraints),
      shooting_(base, problem_),
      check_(base, problem_),
      n_(base.joints()) {
  shooting_.segment().solve_with_path_constraints(panels);
}

const ShootingIterate& ConstrainedSegment::shoot(std::span<const double> y, const ShootingIterate& like,
                                                 SegmentAccuracy accuracy) {
  const std::vector<double> position(y.begin(), y.begin() + n_), c(y.begin() + n_, y.begin() + unknowns());
  iterate_ = shooting_.shoot(position, like.rate_at(position, c), accuracy, c);
  return iterate_;
}

double ConstrainedSegment::value(const Instant& at, Eigen::VectorXd* gradient) {
  const PathSegment::SegmentPoint w = segment().path_point(at.node);
  PerMotion d(n_);
  const double result = check_.violation(at, w, gradient ? &d : nullptr);
  if (gradient) *gradient = per_unknown(d, w, at.node);
  return result;
}

double ConstrainedSegment::distance(int pair, int node, Eigen::VectorXd* gradient) {
  const PathSegment::SegmentPoint w = segment().path_point(node);
  PerMotion d(n_);
  const double result = check_.distance(pair, w, gradient ? &d : nullptr);
  if (gradient) *gradient = per_unknown(d, w, node);
  return result;
}

std::vector<ConstrainedSegment::Found> ConstrainedSegment::scan(double band, double wanted, PathFigures* figures) {
  return check_.scan(
      segment().path_points(), [&](int node) { return segment().path_point(node); }, band, wanted, figures);
}

// Last iterate => weighted objective (6.20), its gradient by the unknowns and the unweighted terms. Clearance counts as
// zero here: it is a separate unknown.
double ConstrainedSegment::objective(Eigen::VectorXd* gradient, std::vector<double>* terms) {
  const Objective& objective = problem_.objective;
  if (gradient) gradient->setZero(unknowns());
  double sum = 0;
  for (const Objective::Term& term : objective.terms()) {
    double value = 0;
    switch (term.kind) {
      case Objective::Kind::effort:
        value = effort_term(term.weight, gradient);
        break;
      case Objective::Kind::base_attitude:
        value = attitude_term(term.weight, gradient);
        break;
      case Objective::Kind::base_motion:
        value = motion_term(term.weight, gradient);
        break;
      case Objective::Kind::wheel_momentum:
        value = wheel_term(term.weight, gradient);
        break;
      case Objective::Kind::clearance:
        break;
      case Objective::Kind::impulse:
      case Objective::Kind::impulse_index:
        value = measure_term(term, gradient);
        break;
      default:
        value = end_term(term, gradient);
    }
    if (terms) terms->push_back(value);
    sum += term.weight * value;
  }
  return sum;
}

ReachProblem ConstrainedSegment::with_knots(const ReachProblem& problem, int knots) {
  ReachProblem result = problem;
  result.start.knots = knots;
  result.objective = problem.objective.with_knots(knots);
  return result;
}

Eigen::VectorXd ConstrainedSegment::per_unknown(const PerMotion& d, const PathSegment::SegmentPoint& w, int node) {
  const auto with = [&](const JointPoint& basis) {
    return (basis.position * d.position + basis.rate * d.rate + basis.acceleration * d.acceleration).eval();
  };
  Eigen::VectorXd all(unknowns() + n_);
  all.head(n_) = with(w.a);
  all.segment(n_, n_) = with(w.b);
  for (std::size_t k = 0; k < w.N.size(); ++k) all.segment((2 + static_cast<int>(k)) * n_, n_) = with(w.N[k]);
  if (d.turn.squaredNorm() > 0) all += segment().turn_per_unknown(node).transpose() * d.turn;
  return through_rates(all);
}

Eigen::VectorXd ConstrainedSegment::through_rates(const Eigen::VectorXd& all) const {
  Eigen::VectorXd y(unknowns());
  y << all.head(n_), all.tail(unknowns() - n_);
  return y + iterate_.K.transpose() * all.segment(n_, n_);
}

// Term in closed form (excursion, distances, manipulability) => its value; adds its weighted gradient, with the final
// rates' derivatives K of (6.8).
double ConstrainedSegment::end_term(const Objective::Term& term, Eigen::VectorXd* gradient) {
  Objective::Gradient g;
  if (gradient) {
    g.position.assign(static_cast<std::size_t>(n_), 0.0), g.rate.assign(static_cast<std::size_t>(n_), 0.0);
    g.coefficients.assign(iterate_.coefficients.size(), 0.0);
  }
  const double value = problem_.objective.term(term, base_, problem_.goals, iterate_.position, iterate_.rate,
                                               gradient ? &g : nullptr, iterate_.coefficients);
  if (gradient) {
    gradient->head(n_) += as_vector(g.position);
    gradient->tail(unknowns() - n_) += as_vector(g.coefficients);
    *gradient += iterate_.K.transpose() * as_vector(g.rate);
  }
  return value;
}

// Impulse term => its value at the end of the segment; adds its weighted gradient by central differences over joints,
// rates and base displacement.
double ConstrainedSegment::measure_term(const Objective::Term& term, Eigen::VectorXd* gradient) {
  std::vector<double> position = iterate_.position, rate = iterate_.rate;
  const auto measure = [&](const Posed& X_WB) { return setup_.end_measure(term.kind, position, rate, X_WB); };
  const double value = measure(iterate_.X_WB);
  if (!gradient) return value;
  constexpr double kStep = 1e-5;
  const auto slope = [&](double& x) {
    const double before = x;
    x = before + kStep;
    const double above = measure(iterate_.X_WB);
    x = before - kStep;
    const double below = measure(iterate_.X_WB);
    x = before;
    return (above - below) / (2 * kStep);
  };
  Eigen::VectorXd per_rate(n_);
  for (int j = 0; j < n_; ++j) {
    const auto i = static_cast<std::size_t>(j);
    (*gradient)[j] += term.weight * slope(position[i]);
    per_rate[j] = slope(rate[i]);
  }
  Vector6d per_displacement = Vector6d::Zero();
  for (int k = 0; k < 6 && base_.floats(); ++k) {
    const Posed above = displaced(iterate_.X_WB, kStep * Vector6d::Unit(k));
    const Posed below = displaced(iterate_.X_WB, -kStep * Vector6d::Unit(k));
    per_displacement[k] = (measure(above) - measure(below)) / (2 * kStep);
  }
  *gradient += term.weight * (iterate_.K.transpose() * per_rate + iterate_.per_unknown.transpose() * per_displacement);
  return value;
}

double ConstrainedSegment::attitude_term(double weight, Eigen::VectorXd* gradient) {
  const Vector3d phi =
      rotation_vector(transpose(setup_.R_WB0) * iterate_.X_WB.R);  // in B or in the initial frame: equal components
  if (gradient) *gradient += weight * iterate_.per_unknown.topRows(3).transpose() * column(phi);
  return 0.5 * dot(phi, phi);
}

double ConstrainedSegment::motion_term(double weight, Eigen::VectorXd* gradient) {
  const double T = problem_.start.end - problem_.start.begin;
  Eigen::VectorXd all = Eigen::VectorXd::Zero(unknowns() + n_);
  double sum = 0;
  for (int i = 0; i < segment().path_points(); ++i) {
    const PathSegment::SegmentPoint w = segment().path_point(i);
    sum += 0.5 * T * w.weight * dot(w.w_B, w.w_B);
    if (gradient) all += (weight * T * w.weight) * segment().w_per_unknown(i).transpose() * column(w.w_B);
  }
  if (gradient) *gradient += through_rates(all);
  return sum;
}

// Weight => 1/2 sum of squared efforts (6.23), averaged over the segment by the quadrature of section 6.1; adds its
// weighted gradient (6.23a).
double ConstrainedSegment::effort_term(double weight, Eigen::VectorXd* gradient) {
  const double T = problem_.start.end - problem_.start.begin;
  std::vector<double> effort(static_cast<std::size_t>(n_));
  double sum = 0;
  for (int i = 0; i < segment().path_points(); ++i) {
    const PathSegment::SegmentPoint w = segment().path_point(i);
    check_.evaluate_efforts(w.position, w.rate, w.acceleration, w.X_WB, w.time, effort);
    sum += 0.5 * w.weight / T * as_vector(effort).squaredNorm();
    if (!gradient) continue;
    PerMotion d(n_);
    check_.add_effort_change(w, effort, (weight * w.weight / T) * as_vector(effort), d);
    *gradient += per_unknown(d, w, i);
  }
  return sum;
}

// Weight => 1/2 sum of squared wheel shares (6.27), averaged over the segment; adds its weighted gradient.
double ConstrainedSegment::wheel_term(double weight, Eigen::VectorXd* gradient) {
  const double T = problem_.start.end - problem_.start.begin;
  std::vector<double> weights(setup_.wheels->wheels.size());
  double sum = 0;
  for (int i = 0; i < segment().path_points(); ++i) {
    const PathSegment::SegmentPoint w = segment().path_point(i);
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const double share = check_.wheel_share(static_cast<int>(k), w);
      sum += 0.5 * w.weight / T * share * share;
      weights[k] = weight * w.weight / T * share;
    }
    if (!gradient) continue;
    PerMotion d(n_);
    check_.add_wheel_change(w, weights, d);
    *gradient += per_unknown(d, w, i);
  }
  return sum;
}

}  // namespace grapnel
