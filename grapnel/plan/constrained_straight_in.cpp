#include "grapnel/plan/constrained_straight_in.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/plan/least_distance.hpp"
#include "grapnel/plan/path_constraint_check.hpp"
#include "grapnel/plan/self_motions.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();
constexpr double kNearViolation = 0.2;  // instants with a smaller margin are also constrained
constexpr double kFarthestMove = 0.5;   // maximum joint change between iterates [rad or m]

using Node = SelfMotions::Node;

PathSegment::SegmentPoint path_point(double time, const std::vector<double>& position, const std::vector<double>& rate,
                                     const std::vector<double>& acceleration, const Posed& X_WB,
                                     const PlacedLinks& links) {
  PathSegment::SegmentPoint w;
  w.time = time;
  w.position = position, w.rate = rate, w.acceleration = acceleration;
  w.X_WB = X_WB;
  w.placed = &links;
  return w;
}

// Search for c of (4) for one initial state.
class StraightSearch {
 public:
  StraightSearch(FloatingBase& base, const StraightInProblem& problem, const ReachProblem& reach,
                 const StartFreedom* freedom)
      : base_(base), problem_(problem), check_(base, reach), motions_(base, problem, freedom) {}

  // Runs the search: checks the minimum-norm rates, then the exchange method with self-motion, and refines the margin
  // between nodes.
  ConstrainedStraightIn run() {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(motions_.unknowns());
    ConstrainedStraightIn best;
    if (!motions_.complete()) return closed(best = exact(v));
    if (motions_.start_unknowns() > 0) {
      constexpr double kFirstOrder = 1e-3;  // the exact search starts below it
      if (exchange(v, kFirstOrder) <= kHopeless) best.start = motions_.start(v), best.self_motion = self_motion_of(v);
      return closed(best);
    }
    // An evaluation at the nodes costs a tenth of an exact one, which is used near a singularity or for the final
    // check.
    do {
      best = at_nodes(motions_.integrate(v, SelfMotions::Derivatives::none));
    } while (best.violation > kNearly && !is_reliable(best.violation) && motions_.refine());
    if (best.violation <= kNearly || motions_.near_singularity() || !is_reliable(best.violation)) best = exact(v);
    if (best.feasible) return closed(best);
    if (!problem_.self_motion.coefficients.empty()) {
      const Eigen::VectorXd known = as_vector(problem_.self_motion.coefficients);
      if (worst_at(motions_.integrate(known, SelfMotions::Derivatives::none)) < best.violation) v = known;
    }
    constexpr int kFiner = 4;
    for (int i = 0; i <= kFiner; ++i) {
      const double worst = exchange(v, kNothing);
      const bool arrived = worst <= -margin_ + kAimed;
      if (worst > kNearly) {
        ConstrainedStraightIn end = at_nodes(motions_.integrate(v, SelfMotions::Derivatives::none));
        if (!is_reliable(end.violation)) end = exact(v);
        if (end.feasible) best = std::move(end);
        if (best.feasible) break;
        // A segment within its limits that is rejected for a singularity is preferred to one beyond its limits.
        const bool satisfies_limits = best.path.finished && best.failure.empty();
        if (!satisfies_limits && !end.failure.empty() && end.violation < best.violation) best = std::move(end);
        break;
      }
      ConstrainedStraightIn end = exact(v);
      const double left = end.violation;
      if (end.feasible || left < best.violation) best = std::move(end);
      // The violation between the nodes exceeds that at the nodes by this amount.
      if (best.feasible || !arrived || !(left < 1e-2)) break;
      margin_ += 2 * left;
    }
    return closed(best);
  }

 private:
  static constexpr double kHopeless = 0.3, kNearly = 0.02;

  // Whether the last integration is accurate enough to detect this violation: its estimated error is small relative to
  // it. Results that are not finite are close to a singularity for any number of steps.
  bool is_reliable(double violation) const {
    constexpr double kSmall = 0.5;
    return !std::isfinite(violation) || motions_.error() <= kSmall * std::max(kNearly, violation);
  }

  ConstrainedStraightIn closed(ConstrainedStraightIn& result) const {
    result.self_motions = motions_.self_motions();
    result.rhs_evaluations = motions_.evaluations() + evaluations_;
    return std::move(result);
  }

  struct Iterate {
    Eigen::VectorXd v;
    std::vector<Node> nodes;
    double worst = 0;             // maximum at the nodes
    bool has_derivatives = true;  // whether the nodes have derivatives
  };

  // Step to the v closest to `share` of the present one that satisfies the linearization, or to the closest possible
  // one within the radius of joint motion.
  struct Step {
    Eigen::VectorXd v;
    double farthest = 0;  // maximum joint motion [rad or m]
    double foreseen = 0;  // predicted violation after the step
  };
  // Iterate => step to the nearest v that satisfies the linearized constraints, with the least relaxation that keeps
  // joint motion within the radius.
  Step step_within(double radius, Iterate& at, double share) {
    if (!at.has_derivatives) at.nodes = motions_.integrate(at.v, SelfMotions::Derivatives::all);
    at.has_derivatives = true;
    const std::vector<Node>& nodes = at.nodes;
    const Eigen::VectorXd& v = at.v;
    const Rows rows = linear_at(nodes, v);
    NearestBelow nearest(rows.A, rows.b, share * v);
    const auto with = [&](double relaxation) {
      Step step;
      step.v = nearest.with(relaxation).x;
      const Eigen::VectorXd change = step.v - v;
      for (const Node& node : nodes)
        step.farthest = std::max(step.farthest, (node.per_position * change).lpNorm<Eigen::Infinity>());
      return step;
    };
    // Relaxation of the rows, reduced step by step to the minimum for which joint motion is within the radius.
    constexpr double kMaxRelaxation = 2.187e10 * kRelaxation, kLess = 1.0 / 30, kOfRadius = 0.7;
    double relaxation = kMaxRelaxation, less = 0;
    Step step = with(relaxation);
    while (step.farthest <= radius && relaxation > kRelaxation && less == 0) {
      const double next = std::max(kRelaxation, kLess * relaxation);
      Step other = with(next);
      if (other.farthest > radius)
        less = next;
      else
        relaxation = next, step = std::move(other);
    }
    for (int i = 0; i < 4 && less > 0 && step.farthest < kOfRadius * radius; ++i) {
      const double between = std::sqrt(less * relaxation);
      Step other = with(between);
      if (other.farthest > radius)
        less = between;
      else
        relaxation = between, step = std::move(other);
    }
    if (step.farthest > radius) step.v = v + radius / step.farthest * (step.v - v), step.farthest = radius;
    step.foreseen = rows.b.size() ? (rows.A * step.v - rows.b).maxCoeff() : kNothing;
    return step;
  }

  // Iterates from v until no violation at the nodes exceeds `enough`; for zero, to the local minimum of the
  // self-motion. Returns the remaining violation at the nodes.
  double exchange(Eigen::VectorXd& v, double enough) {
    Iterate at;
    at.v = v;
    do {
      if (!at.nodes.empty()) instants_.clear();  // those of the previous nodes
      at.nodes = motions_.integrate(v, SelfMotions::Derivatives::all);
      at.worst = add_instants(at.nodes);
    } while (!is_reliable(at.worst) && motions_.refine());
    constexpr double kSwing = 0.03;  // maximum violation caused by steps that reduce the self-motion
    const double allowed = -margin_ + kAimed;
    restore(at, std::max(enough, allowed));
    if (enough == kNothing && at.worst <= allowed) {
      constexpr int kRounds = 6;
      constexpr double kSettled = 2e-3;  // convergence: maximum joint motion per step [rad or m]
      Iterate best = at;
      for (double weight = 0; weight < std::pow(4.0, kRounds); weight = std::max(1.0, 4 * weight)) {
        const Step step = step_within(kFarthestMove, at, weight / (1 + weight));
        if (step.farthest < kSettled || !take(at, step, kSwing)) continue;
        restore(at, allowed);
        if (at.worst <= allowed && at.v.squaredNorm() < best.v.squaredNorm())
          best = at;
        else
          at = best;
      }
      at = std::move(best);
    }
    v = at.v;
    return at.worst;
  }

  // Takes the step, unless its violation exceeds `max_violation`; then the violated constraints are added.
  bool take(Iterate& at, const Step& step, double max_violation) {
    std::vector<Node> nodes = motions_.integrate(step.v, SelfMotions::Derivatives::none);
    const double now = add_instants(nodes);
    if (now > max_violation) return false;
    at = {step.v, std::move(nodes), now, false};
    return true;
  }

  // Minimum-norm steps that satisfy the linearization at the known instants, then at new ones, until no violation
  // exceeds `enough` or no step helps.
  void restore(Iterate& at, double enough) {
    constexpr int kMaxRounds = 25, kPatience = 5;
    constexpr int kNowhere = 2;
    constexpr double kSwing = 0.05, kFar = 0.02, kLittle = 0.9, kShortest = 1e-5;
    double smallest = at.worst, foreseen = std::numeric_limits<double>::infinity(), radius = kFarthestMove;
    for (int round = 0, stuck = 0, nowhere = 0; round < kMaxRounds && stuck < kPatience && at.worst > enough; ++round) {
      const Step step = step_within(radius, at, 1);
      if (!(step.farthest > 0) || radius < kShortest) break;
      if (radius >= kFarthestMove) {
        // The linearization predicts no progress repeatedly.
        const bool leads =
            step.foreseen <= kFar || (step.foreseen <= kLittle * at.worst &&
                                      (step.foreseen <= kHopeless || step.foreseen <= kLittle * foreseen));
        if (leads) nowhere = 0;
        if (!leads && ++nowhere == kNowhere) break;
        foreseen = step.foreseen;
      }
      if (!take(at, step, std::max(1.2 * at.worst, at.worst + kSwing))) {
        radius = 0.25 * step.farthest;
        continue;
      }
      radius = std::min(kFarthestMove, std::max(radius, 2 * step.farthest));
      if (motions_.begins_elsewhere_by(at.v) > kFarthestMove) break;  // the first-order model is not valid beyond
      stuck = at.worst < 0.7 * smallest ? 0 : stuck + 1;
      smallest = std::min(smallest, at.worst);
    }
  }

  PathConstraintCheck::PointAt points(const std::vector<Node>& nodes) const {
    return [&nodes](int i) {
      const Node& node = nodes[static_cast<std::size_t>(i)];
      return path_point(node.time, node.position, node.rate, node.acceleration, node.X_WB, node.links);
    };
  }

  // The largest violation at the nodes, if any.
  ConstrainedStraightIn at_nodes(const std::vector<Node>& nodes) {
    ConstrainedStraightIn result;
    if (!is_finite(nodes)) {
      result.violation = -kNothing;
      result.failure = "joint motion diverges near a singularity";
      return result;
    }
    result.violation = kNothing;
    const PathConstraintCheck::PointAt at = points(nodes);
    for (const PathConstraintCheck::Found& f : check_.scan(static_cast<int>(nodes.size()), at, 0, kNothing, nullptr)) {
      if (f.value <= result.violation) continue;
      result.violation = f.value;
      if (f.value > kTolerated) result.failure = check_.describe(f, at(f.at.node));
    }
    return result;
  }

  double worst_at(const std::vector<Node>& nodes) {
    if (!is_finite(nodes)) return -kNothing;
    double worst = kNothing;
    for (const PathConstraintCheck::Found& f : found_at(nodes)) worst = std::max(worst, f.value);
    return worst;
  }

  // Violations that the self-motion can change: at the begin only another initial state can.
  std::vector<PathConstraintCheck::Found> found_at(const std::vector<Node>& nodes) {
    std::vector<PathConstraintCheck::Found> found =
        check_.scan(static_cast<int>(nodes.size()), points(nodes), kNearViolation + margin_, kNothing, nullptr);
    if (motions_.start_unknowns() == 0)
      std::erase_if(found, [](const PathConstraintCheck::Found& f) { return f.at.node == 0; });
    return found;
  }

  // States beyond a singularity may not be finite.
  static bool is_finite(const std::vector<Node>& nodes) {
    const std::vector<double>& q = nodes.back().position;
    return std::all_of(q.begin(), q.end(), [](double x) { return std::isfinite(x); });
  }

  double add_instants(const std::vector<Node>& nodes) {
    if (!is_finite(nodes)) return -kNothing;
    const PathConstraintCheck::PointAt at = points(nodes);
    std::erase_if(instants_, [&](const PathConstraintCheck::Instant& i) { return check_.may_touch(i, at(i.node)); });
    double worst = kNothing;
    for (const PathConstraintCheck::Found& f : found_at(nodes)) {
      worst = std::max(worst, f.value);
      if (std::find(instants_.begin(), instants_.end(), f.at) == instants_.end()) instants_.push_back(f.at);
    }
    return worst;
  }

  // Linearized constraints at an instant: A v <= b.
  struct Rows {
    Eigen::MatrixXd A;
    Eigen::VectorXd b;
  };
  // States at the nodes => linearized constraints A v <= b at the selected instants.
  Rows linear_at(const std::vector<Node>& nodes, const Eigen::VectorXd& v) {
    const int n = base_.joints();
    const auto count = static_cast<Eigen::Index>(instants_.size());
    Rows rows{Eigen::MatrixXd(count, v.size()), Eigen::VectorXd(count)};
    const PathConstraintCheck::PointAt at = points(nodes);
    for (std::size_t i = 0; i < instants_.size(); ++i) {
      const Node& node = nodes[static_cast<std::size_t>(instants_[i].node)];
      PathConstraintCheck::PerMotion d(n);
      const double value = check_.violation(instants_[i], at(instants_[i].node), &d);
      const Eigen::VectorXd gradient =
          node.per_position.transpose() * d.position + node.per_rate.transpose() * d.rate +
          node.per_acceleration.transpose() * d.acceleration +
          node.per_displacement.topRows<3>().transpose() * (as_matrix(node.X_WB.R).transpose() * d.turn);
      const auto row = static_cast<Eigen::Index>(i);
      rows.A.row(row) = gradient.transpose();
      rows.b[row] = gradient.dot(v) - value - margin_ - kAimed;
    }
    return rows;
  }

  SelfMotion self_motion_of(const Eigen::VectorXd& v) const {
    SelfMotion z;
    const Eigen::VectorXd c = v.tail(v.size() - motions_.start_unknowns());
    if (c.squaredNorm() > 0) z.coefficients.assign(c.begin(), c.end());
    return z;
  }

  // The exactly integrated segment with this self-motion, and its violations.
  ConstrainedStraightIn exact(const Eigen::VectorXd& v) {
    ConstrainedStraightIn result;
    StraightInProblem problem = problem_;
    problem.self_motion = result.self_motion = self_motion_of(v);
    constexpr long kMaxIntegrationSteps = 10'000;  // segments through a singularity take more
    problem.max_steps = std::min<long>(problem.max_steps, kMaxIntegrationSteps);
    result.path = plan_straight_in(base_, problem);
    evaluations_ += result.path.rhs_evaluations;
    if (!result.path.finished) {
      result.failure = result.path.failure, result.violation = -kNothing;
      return result;
    }
    PlacedLinks links;
    const auto point = [&](int i) {
      const StraightInPoint& p = result.path.points[static_cast<std::size_t>(i)];
      std::vector<double> rate, acceleration;
      for (const JointTrajectory& joint : result.path.joints) {
        const JointPoint j = evaluate(joint, p.time);
        rate.push_back(j.rate), acceleration.push_back(j.acceleration);
      }
      base_.place(p.position, links);
      return path_point(p.time, p.position, rate, acceleration, p.X_WB, links);
    };
    result.violation = kNothing;
    for (const PathConstraintCheck::Found& f :
         check_.scan(static_cast<int>(result.path.points.size()), point, 0, kNothing, &result.figures)) {
      if (f.value <= result.violation) continue;
      result.violation = f.value;
      if (f.value > kTolerated) result.failure = check_.describe(f, point(f.at.node));
    }
    // A segment whose end-effectors deviate from their paths is infeasible.
    constexpr double kUnmet = 1e-9;  // [m/s or rad/s]
    const bool is_sound = !result.path.damped && result.path.unmet <= kUnmet;
    result.feasible = result.failure.empty() && is_sound;
    if (!is_sound) result.violation = std::max(result.violation, 0.0) + std::max(result.path.unmet, kUnmet);
    return result;
  }

  FloatingBase& base_;
  const StraightInProblem& problem_;
  PathConstraintCheck check_;
  SelfMotions motions_;
  double margin_ = 0;
  std::vector<PathConstraintCheck::Instant> instants_;
  long evaluations_ = 0;
};

}  // namespace

// Solution at the stand-off => basis of joint and base displacements that keep the end-effectors in place: the null
// space of the goals' Jacobian.
StartFreedom start_freedom(FloatingBase& base, const ReachProblem& reach, const ReachSolution& solution) {
  ReachProblem with_knots = reach;
  with_knots.start.knots = solution.knots;
  Shooting shooting(base, with_knots);
  const ShootingIterate iterate =
      shooting.shoot(solution.position, solution.rate, SegmentAccuracy::full, solution.coefficients);
  const auto n = static_cast<Eigen::Index>(solution.position.size());
  StartFreedom freedom{Eigen::MatrixXd(n, 0), Matrix6Xd(6, 0)};
  if (!iterate.valid || iterate.J.rows() == 0) return freedom;
  Eigen::MatrixXd J = iterate.J.leftCols(n);
  std::vector<Eigen::Index> moving;
  for (Eigen::Index j = 0; j < n; ++j) {
    if (!base.is_held(static_cast<int>(j))) moving.push_back(j);
  }
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(J(Eigen::all, moving), Eigen::ComputeFullV);
  Eigen::Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > 1e-6 * svd.singularValues()[0]) ++rank;
  const auto count = static_cast<Eigen::Index>(moving.size()) - rank;
  freedom.position = Eigen::MatrixXd::Zero(n, count);
  freedom.position(moving, Eigen::all) = svd.matrixV().rightCols(count);
  freedom.displacement = iterate.per_unknown.leftCols(n) * freedom.position;
  return freedom;
}

ConstrainedStraightIn constrain_straight_in(FloatingBase& base, const StraightInProblem& problem,
                                            const ReachProblem& reach, const StartFreedom* freedom) {
  return StraightSearch(base, problem, reach, freedom && freedom->position.cols() > 0 ? freedom : nullptr).run();
}

}  // namespace grapnel
