#include "grapnel/plan/straight_way.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/plan/way_look.hpp"

namespace grapnel {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();
constexpr int kTerms = 8;                // of the self-motion
constexpr int kSteps = 40;               // of the search's integration
constexpr double kNearViolation = 0.05;  // instants this near to a violation are kept as well
constexpr double kFarthestMove = 0.5;    // that a joint moves from iterate to iterate [rad or m]

// The motion at the ends of steps, with its derivatives by the unknowns: [where it begins, c].
struct Node {
  double time = 0;
  std::vector<double> position, rate, acceleration;
  Posed X_WB = Posed::identity();
  PlacedLinks links;
  Eigen::MatrixXd per_position, per_rate, per_acceleration;  // joints x unknowns
  Matrix6Xd per_displacement;                                // of the base, in B
};

// One integration of (1) to (3) by the classical method of order 4, with steps that stay the same.
class SelfMotions {
 public:
  SelfMotions(FloatingBase& base, const StraightInProblem& problem, const StartFreedom* freedom)
      : base_(base), problem_(problem), freedom_(freedom), n_(base.joints()) {
    for (int i = 0; i <= 2 * kSteps; ++i)
      times_.push_back(i == 2 * kSteps ? problem.end : problem.begin + 0.5 * step() * i);
    targets_ = targets_on_the_way(problem, times_);
  }

  int start_unknowns() const { return freedom_ ? static_cast<int>(freedom_->position.cols()) : 0; }
  int unknowns() const { return start_unknowns() + n_ * kTerms; }
  // Joint values at the begin count as rates that would bring them about in the piece's duration.
  double start_scale() const { return problem_.end - problem_.begin; }
  bool complete() const { return targets_.size() == times_.size(); }
  int self_motions() const { return self_motions_; }
  long evaluations() const { return evaluations_; }

  std::vector<double> start(const Eigen::VectorXd& v) const {
    std::vector<double> position = problem_.position;
    if (freedom_)
      Eigen::Map<Eigen::VectorXd>(position.data(), n_) += start_scale() * freedom_->position * v.head(start_unknowns());
    return position;
  }

  std::vector<Node> integrate(const Eigen::VectorXd& v) {
    std::vector<Node> nodes;
    State s;
    s.position = start(v);
    s.X_WB = problem_.X_WB;
    s.per_position = Eigen::MatrixXd::Zero(n_, unknowns());
    s.per_displacement = Matrix6Xd::Zero(6, unknowns());
    if (freedom_) {
      s.per_position.leftCols(start_unknowns()) = start_scale() * freedom_->position;
      s.per_displacement.leftCols(start_unknowns()) = start_scale() * freedom_->displacement;
      const Vector6d xi = s.per_displacement.leftCols(start_unknowns()) * v.head(start_unknowns());
      s.X_WB = displaced(s.X_WB, xi);
    }
    s.q_WB = quaternion_from(s.X_WB.R);
    settle(s, problem_.begin);
    for (int i = 0; i <= kSteps; ++i) {
      const Change k1 = change(s, 2 * i, v);
      nodes.push_back({times_[static_cast<std::size_t>(2 * i)],
                       s.position,
                       k1.rate,
                       {},
                       s.X_WB,
                       base_.placed(),
                       s.per_position,
                       k1.per_position,
                       {},
                       s.per_displacement});
      if (i == kSteps) break;
      const Change k2 = change(after(s, k1, 0.5 * step(), 2 * i + 1), 2 * i + 1, v);
      const Change k3 = change(after(s, k2, 0.5 * step(), 2 * i + 1), 2 * i + 1, v);
      const Change k4 = change(after(s, k3, step(), 2 * i + 2), 2 * i + 2, v);
      s = after(s, mean(k1, k2, k3, k4), step(), 2 * i + 2);
    }
    add_accelerations(nodes);
    return nodes;
  }

 private:
  struct State {
    std::vector<double> position;
    Quaterniond q_WB;
    Posed X_WB;  // where q_WB has it
    Eigen::MatrixXd per_position;
    Matrix6Xd per_displacement;
  };
  struct Change {
    std::vector<double> rate;
    Quaterniond turn;  // of the base's quaternion
    Eigen::MatrixXd per_position;
    Matrix6Xd per_displacement;
  };

  double step() const { return (problem_.end - problem_.begin) / kSteps; }

  // The base's place follows from its attitude.
  void settle(State& s, double time) {
    if (!base_.floats()) return;
    s.X_WB.R = rotation_matrix(s.q_WB);
    base_.place(s.position, links_);
    s.X_WB.p = problem_.motion.com_at(time) - s.X_WB.R * links_.com;
  }

  State after(const State& s, const Change& k, double h, int at) {
    State next = s;
    for (int j = 0; j < n_; ++j) next.position[static_cast<std::size_t>(j)] += h * k.rate[static_cast<std::size_t>(j)];
    next.q_WB = normalized(Quaterniond{s.q_WB.w + h * k.turn.w, s.q_WB.x + h * k.turn.x, s.q_WB.y + h * k.turn.y,
                                       s.q_WB.z + h * k.turn.z});
    next.per_position += h * k.per_position;
    next.per_displacement += h * k.per_displacement;
    settle(next, times_[static_cast<std::size_t>(at)]);
    return next;
  }

  // (1) to (3).
  Change change(const State& s, int at, const Eigen::VectorXd& v) {
    ++evaluations_;
    const double time = times_[static_cast<std::size_t>(at)];
    const JointPoint d = straight_distance(problem_, time);
    const std::vector<Goal> goals = goals_at(problem_, targets_[static_cast<std::size_t>(at)], d.position, -d.rate);
    const Momentumd h_B = problem_.motion.in_base(time, s.X_WB);
    base_.place(s.position);
    DemandedRates demanded = demanded_rates(base_, s.X_WB, h_B, goals, RateDemand::task);
    double phi[kTerms];
    self_motion_basis((time - problem_.begin) / (problem_.end - problem_.begin), phi);
    Eigen::VectorXd z = Eigen::VectorXd::Zero(n_);
    for (int k = 0; k < kTerms; ++k) z += phi[k] * v.segment(start_unknowns() + k * n_, n_);
    add_self_motion(z, demanded);
    const RateSensitivity rho = rate_sensitivity(base_, s.X_WB, h_B, goals, RateDemand::task, demanded);
    Change c;
    c.rate.assign(demanded.rates.begin(), demanded.rates.end());
    base_.move(c.rate, h_B);
    c.turn = quaternion_rate(s.q_WB, twist_from(base_.base_twist()).angular);
    c.per_position = rho.per_angle * s.per_position + rho.per_displacement * s.per_displacement;
    Eigen::MatrixXd free = Eigen::MatrixXd::Identity(n_, n_) - demanded.G_inverse * demanded.G;
    for (int j = 0; j < n_; ++j) {
      if (base_.is_held(j)) free.col(j).setZero(), free.row(j).setZero();
    }
    self_motions_ = std::max(self_motions_, static_cast<int>(std::lround(free.trace())));
    for (int k = 0; k < kTerms; ++k) c.per_position.middleCols(start_unknowns() + k * n_, n_) += phi[k] * free;
    c.per_displacement = base_.displacement_rate(h_B) * s.per_displacement + base_.per_angle() * s.per_position +
                         base_.per_rate() * c.per_position;
    return c;
  }

  static Change mean(const Change& k1, const Change& k2, const Change& k3, const Change& k4) {
    Change m = k1;
    for (std::size_t j = 0; j < m.rate.size(); ++j)
      m.rate[j] = (k1.rate[j] + 2 * k2.rate[j] + 2 * k3.rate[j] + k4.rate[j]) / 6;
    const auto of = [&](double Quaterniond::*part) {
      return (k1.turn.*part + 2 * k2.turn.*part + 2 * k3.turn.*part + k4.turn.*part) / 6;
    };
    m.turn = {of(&Quaterniond::w), of(&Quaterniond::x), of(&Quaterniond::y), of(&Quaterniond::z)};
    m.per_position = (k1.per_position + 2 * k2.per_position + 2 * k3.per_position + k4.per_position) / 6;
    m.per_displacement =
        (k1.per_displacement + 2 * k2.per_displacement + 2 * k3.per_displacement + k4.per_displacement) / 6;
    return m;
  }

  // By differences of order 4 of the rates at five nodes.
  void add_accelerations(std::vector<Node>& nodes) const {
    constexpr double kWeights[5][5] = {
        {-25, 48, -36, 16, -3}, {-3, -10, 18, -6, 1}, {1, -8, 0, 8, -1}, {-1, 6, -18, 10, 3}, {3, -16, 36, -48, 25}};
    const int last = static_cast<int>(nodes.size()) - 1;
    for (int i = 0; i <= last; ++i) {
      const int from = std::clamp(i - 2, 0, last - 4);
      Node& node = nodes[static_cast<std::size_t>(i)];
      node.acceleration.assign(static_cast<std::size_t>(n_), 0.0);
      node.per_acceleration = Eigen::MatrixXd::Zero(n_, unknowns());
      for (int k = 0; k < 5; ++k) {
        const double weight = kWeights[i - from][k] / (12 * step());
        const Node& other = nodes[static_cast<std::size_t>(from + k)];
        for (std::size_t j = 0; j < node.acceleration.size(); ++j) node.acceleration[j] += weight * other.rate[j];
        node.per_acceleration += weight * other.per_rate;
      }
    }
  }

  FloatingBase& base_;
  const StraightInProblem& problem_;
  const StartFreedom* freedom_;
  int n_;
  std::vector<double> times_;  // of steps' ends and middles
  std::vector<std::vector<FreeBody>> targets_;
  PlacedLinks links_;
  int self_motions_ = 0;
  long evaluations_ = 0;
};

PathSegment::WayPoint way_point(double time, const std::vector<double>& position, const std::vector<double>& rate,
                                const std::vector<double>& acceleration, const Posed& X_WB, const PlacedLinks& links) {
  PathSegment::WayPoint w;
  w.time = time;
  w.position = position, w.rate = rate, w.acceleration = acceleration;
  w.X_WB = X_WB;
  w.links = &links;
  return w;
}

// The x nearest to c with A x <= b: c - A^T l, where l >= 0 makes l^T A A^T l / 2 - l^T (A c - b) least, by active sets
// [Lawson and Hanson 1974, chapter 23]. A little on the diagonal stands for rows that depend on each other, and makes a
// compromise where none can be met together.
Eigen::VectorXd nearest_below(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c) {
  constexpr double kDiagonal = 1e-9;  // of the mean
  constexpr double kMet = 1e-10;
  const Eigen::Index count = A.rows();
  if (count == 0) return c;
  Eigen::MatrixXd G = A * A.transpose();
  G.diagonal().array() += kDiagonal * G.trace() / static_cast<double>(count) + 1e-30;
  const Eigen::VectorXd r = A * c - b;
  Eigen::VectorXd l = Eigen::VectorXd::Zero(count);
  std::vector<Eigen::Index> active;
  for (Eigen::Index round = 0; round < 3 * count; ++round) {
    Eigen::VectorXd left = r - G * l;
    for (const Eigen::Index i : active) left[i] = 0;
    Eigen::Index most = 0;
    if (!(left.maxCoeff(&most) > kMet)) break;
    active.push_back(most);
    while (!active.empty()) {
      const Eigen::VectorXd next = cholesky_solution(Cholesky(G(active, active)), Eigen::VectorXd(r(active)));
      if (next.minCoeff() > 0) {
        l.setZero();
        l(active) = next;
        break;
      }
      // As far as all stay positive, and without those that do not.
      double share = 1;
      for (std::size_t i = 0; i < active.size(); ++i) {
        const double now = l[active[i]], then = next[static_cast<Eigen::Index>(i)];
        if (then <= 0) share = std::min(share, now / (now - then));
      }
      const Eigen::VectorXd now = l(active);
      l(active) = now + share * (next - now);
      const double smallest = 1e-14 * l.maxCoeff();
      std::vector<Eigen::Index> rest;
      for (std::size_t i = 0; i < active.size(); ++i) {
        if (next[static_cast<Eigen::Index>(i)] <= 0 && l[active[i]] <= smallest)
          l[active[i]] = 0;
        else
          rest.push_back(active[i]);
      }
      active = std::move(rest);
    }
  }
  return c - A.transpose() * l;
}

// The c of (4) for one beginning of the piece.
class StraightSearch {
 public:
  StraightSearch(FloatingBase& base, const StraightInProblem& problem, const ReachProblem& kept,
                 const StartFreedom* freedom)
      : base_(base), problem_(problem), look_(base, kept), motions_(base, problem, freedom) {}

  StraightWay run() {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(motions_.unknowns());
    if (motions_.start_unknowns() > 0) {
      StraightWay way;
      if (motions_.complete()) exchange(v), way.start = motions_.start(v);
      return closed(way);
    }
    StraightWay best = exact(v);
    if (best.kept || !best.path.finished || !motions_.complete()) return closed(best);
    constexpr int kFiner = 4;
    for (int i = 0; i <= kFiner; ++i) {
      const double worst = exchange(v);
      const bool arrived = worst <= -margin_ + kAimed;
      constexpr double kHopeless = 0.3;
      if (worst > kHopeless) break;
      StraightWay end = exact(v);
      const double left = end.violation;
      if (end.kept || left < best.violation) best = std::move(end);
      // Between the nodes it is worse by that.
      if (best.kept || !arrived || !(left < 1e-2)) break;
      margin_ += 2 * left;
    }
    return closed(best);
  }

 private:
  StraightWay closed(StraightWay& way) const {
    way.self_motions = motions_.self_motions();
    way.rhs_evaluations = motions_.evaluations() + evaluations_;
    return std::move(way);
  }

  // The c of least norm that keeps what is linear of the instants known, then the new ones, until nothing is violated
  // at the nodes and no less will do. What is left at the nodes.
  double exchange(Eigen::VectorXd& v) {
    constexpr int kMost = 25, kPatience = 6, kHalvings = 3;
    constexpr double kSettled = 2e-3;  // joints move no farther any more [rad or m]
    constexpr double kMostKept = 64;
    std::vector<Node> nodes = motions_.integrate(v);
    double worst = add_instants(nodes), least = worst, keep = 0;
    const auto is_kept = [&] { return worst <= -margin_ + kAimed; };
    for (int round = 0, stuck = 0; round < kMost && stuck < kPatience; ++round) {
      const Eigen::VectorXd before = v, d = nearest(nodes, v, keep / (1 + keep)) - v;
      double farthest = 0;
      for (const Node& node : nodes) farthest = std::max(farthest, (node.per_position * d).lpNorm<Eigen::Infinity>());
      if (farthest < kSettled && (is_kept() || !(farthest > 0))) break;
      double fraction = std::min(1.0, kFarthestMove / farthest);
      for (int i = 0; i <= kHalvings; ++i, fraction *= 0.5) {
        v = before + fraction * d;
        nodes = motions_.integrate(v);
        const double now = add_instants(nodes);
        const bool worse = now > std::max(1.2 * worst, worst + kNearViolation);
        if (worse && i < kHalvings) continue;
        // What is curved makes steps to the least norm swing about it; with |v - before|^2 beside |v|^2 they do not.
        if (now > std::max(0.5 * worst, -margin_ + kAimed)) keep = std::min(kMostKept, keep > 0 ? 4 * keep : 1);
        worst = now;
        break;
      }
      stuck = is_kept() || worst < 0.7 * least ? 0 : stuck + 1;
      least = std::min(least, worst);
    }
    return worst;
  }

  WayLook::PointAt points(const std::vector<Node>& nodes) const {
    return [&nodes](int i) {
      const Node& node = nodes[static_cast<std::size_t>(i)];
      return way_point(node.time, node.position, node.rate, node.acceleration, node.X_WB, node.links);
    };
  }

  double add_instants(const std::vector<Node>& nodes) {
    const WayLook::PointAt at = points(nodes);
    std::erase_if(instants_, [&](const WayLook::Instant& i) { return look_.may_touch(i, at(i.node)); });
    double worst = kNothing;
    for (const WayLook::Found& f :
         look_.scan(static_cast<int>(nodes.size()), at, kNearViolation + margin_, kNothing, nullptr)) {
      worst = std::max(worst, f.value);
      if (std::find(instants_.begin(), instants_.end(), f.at) == instants_.end()) instants_.push_back(f.at);
    }
    return worst;
  }

  // The one nearest to `share` of v that keeps what is linear of it at v.
  Eigen::VectorXd nearest(const std::vector<Node>& nodes, const Eigen::VectorXd& v, double share) {
    const int n = base_.joints();
    const auto count = static_cast<Eigen::Index>(instants_.size());
    Eigen::MatrixXd A(count, v.size());
    Eigen::VectorXd b(count);
    const WayLook::PointAt at = points(nodes);
    for (std::size_t i = 0; i < instants_.size(); ++i) {
      const Node& node = nodes[static_cast<std::size_t>(instants_[i].node)];
      WayLook::PerMotion d(n);
      const double value = look_.violation(instants_[i], at(instants_[i].node), &d);
      const Eigen::VectorXd gradient =
          node.per_position.transpose() * d.position + node.per_rate.transpose() * d.rate +
          node.per_acceleration.transpose() * d.acceleration +
          node.per_displacement.topRows<3>().transpose() * (as_matrix(node.X_WB.R).transpose() * d.turn);
      const auto row = static_cast<Eigen::Index>(i);
      A.row(row) = gradient.transpose();
      b[row] = gradient.dot(v) - value - margin_ - kAimed;
    }
    return nearest_below(A, b, share * v);
  }

  // The piece with this self-motion, integrated exactly, and what it violates.
  StraightWay exact(const Eigen::VectorXd& v) {
    StraightWay way;
    StraightInProblem problem = problem_;
    const Eigen::VectorXd c = v.tail(v.size() - motions_.start_unknowns());
    if (c.squaredNorm() > 0) way.self_motion.coefficients.assign(c.begin(), c.end());
    problem.self_motion = way.self_motion;
    constexpr long kMostSteps = 10'000;  // more take pieces that pass a singularity
    problem.most_steps = std::min<long>(problem.most_steps, kMostSteps);
    way.path = plan_straight_in(base_, problem);
    evaluations_ += way.path.rhs_evaluations;
    if (!way.path.finished) {
      way.trouble = way.path.failure, way.violation = -kNothing;
      return way;
    }
    PlacedLinks links;
    const auto point = [&](int i) {
      const StraightInPoint& p = way.path.points[static_cast<std::size_t>(i)];
      std::vector<double> rate, acceleration;
      for (const JointTrajectory& joint : way.path.joints) {
        const JointPoint j = evaluate(joint, p.time);
        rate.push_back(j.rate), acceleration.push_back(j.acceleration);
      }
      base_.place(p.position, links);
      return way_point(p.time, p.position, rate, acceleration, p.X_WB, links);
    };
    way.violation = kNothing;
    for (const WayLook::Found& f :
         look_.scan(static_cast<int>(way.path.points.size()), point, 0, kNothing, &way.figures)) {
      if (f.value <= way.violation) continue;
      way.violation = f.value;
      if (f.value > kTolerated) way.trouble = look_.describe(f, point(f.at.node));
    }
    // A piece whose hands do not go where they are to go keeps nothing.
    constexpr double kUnmet = 1e-9;  // [m/s or rad/s]
    const bool is_sound = !way.path.damped && way.path.unmet <= kUnmet;
    way.kept = way.trouble.empty() && is_sound;
    if (!is_sound) way.violation = std::max(way.violation, 0.0) + std::max(way.path.unmet, kUnmet);
    return way;
  }

  FloatingBase& base_;
  const StraightInProblem& problem_;
  WayLook look_;
  SelfMotions motions_;
  double margin_ = 0;
  std::vector<WayLook::Instant> instants_;
  long evaluations_ = 0;
};

}  // namespace

StartFreedom start_freedom(FloatingBase& base, const ReachProblem& reach, const ReachSolution& solution) {
  ReachProblem with_knots = reach;
  with_knots.start.knots = solution.knots;
  Shooting shooting(base, with_knots);
  const Shot shot = shooting.shoot(solution.position, solution.rate, SegmentAccuracy::full, solution.coefficients);
  const auto n = static_cast<Eigen::Index>(solution.position.size());
  StartFreedom freedom{Eigen::MatrixXd(n, 0), Matrix6Xd(6, 0)};
  if (!shot.valid || shot.J.rows() == 0) return freedom;
  Eigen::MatrixXd J = shot.J.leftCols(n);
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
  freedom.displacement = shot.per_unknown.leftCols(n) * freedom.position;
  return freedom;
}

StraightWay keep_straight_in(FloatingBase& base, const StraightInProblem& problem, const ReachProblem& kept,
                             const StartFreedom* freedom) {
  return StraightSearch(base, problem, kept, freedom && freedom->position.cols() > 0 ? freedom : nullptr).run();
}

}  // namespace grapnel
