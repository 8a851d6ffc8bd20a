#include "grapnel/plan/straight_way.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/plan/least_distance.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/plan/way_look.hpp"

namespace grapnel {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();
constexpr int kTerms = 8;               // of the self-motion
constexpr std::size_t kSteps = 40;      // of the search's integration
constexpr std::size_t kBegun = 4;       // nodes from which it goes on by several steps' rates
constexpr double kNearViolation = 0.2;  // instants this near to a violation are kept as well
constexpr double kFarthestMove = 0.5;   // that a joint moves from iterate to iterate [rad or m]

// The motion at the ends of steps, with its derivatives by the unknowns: [where it begins, c].
struct Node {
  double time = 0;
  std::vector<double> position, rate, acceleration;
  Posed X_WB = Posed::identity();
  PlacedLinks links;
  Eigen::MatrixXd per_position, per_rate, per_acceleration;  // joints x unknowns
  Matrix6Xd per_displacement;                                // of the base, in B
};

// Integrations of (1) to (3) with steps that stay the same, of order 4: the classical method for the first, then that
// of Adams, Bashforth and Moulton, which takes one evaluation per step: rates are those at the predicted states.
class SelfMotions {
 public:
  SelfMotions(FloatingBase& base, const StraightInProblem& problem, const StartFreedom* freedom)
      : base_(base), problem_(problem), freedom_(freedom), n_(base.joints()) {
    for (std::size_t i = 0; i <= 2 * kSteps; ++i)
      times_.push_back(i == 2 * kSteps ? problem.end : problem.begin + 0.5 * step() * static_cast<double>(i));
    targets_ = targets_on_the_way(problem, times_);
  }

  int start_unknowns() const { return freedom_ ? static_cast<int>(freedom_->position.cols()) : 0; }
  int unknowns() const { return start_unknowns() + n_ * kTerms; }
  // Joint values at the begin count as rates that would bring them about in the piece's duration.
  double start_scale() const { return problem_.end - problem_.begin; }
  bool complete() const { return targets_.size() == times_.size(); }
  int self_motions() const { return self_motions_; }
  bool near_singularity() const { return near_singularity_; }  // at any time, in any integration
  long evaluations() const { return evaluations_; }

  std::vector<double> start(const Eigen::VectorXd& v) const {
    std::vector<double> position = problem_.position;
    if (freedom_)
      Eigen::Map<Eigen::VectorXd>(position.data(), n_) += start_scale() * freedom_->position * v.head(start_unknowns());
    return position;
  }

  // The farthest that a joint is then from where it was to begin [rad or m].
  double begins_elsewhere_by(const Eigen::VectorXd& v) const {
    if (start_unknowns() == 0) return 0;
    return start_scale() * (freedom_->position * v.head(start_unknowns())).lpNorm<Eigen::Infinity>();
  }

  // Without derivatives it takes a fraction of the time.
  enum class Derivatives { none, all };

  std::vector<Node> integrate(const Eigen::VectorXd& v, Derivatives derivatives) {
    derivatives_ = derivatives == Derivatives::all;
    const int columns = derivatives_ ? unknowns() : 0;
    std::vector<Node> nodes;
    State s;
    s.position = start(v);
    s.X_WB = problem_.X_WB;
    s.per_position = Eigen::MatrixXd::Zero(n_, columns);
    s.per_displacement = Matrix6Xd::Zero(6, columns);
    if (freedom_) {
      const Vector6d xi = start_scale() * (freedom_->displacement * v.head(start_unknowns()));
      s.X_WB = displaced(s.X_WB, xi);
    }
    if (freedom_ && derivatives_) {
      s.per_position.leftCols(start_unknowns()) = start_scale() * freedom_->position;
      s.per_displacement.leftCols(start_unknowns()) = start_scale() * freedom_->displacement;
    }
    s.q_WB = quaternion_from(s.X_WB.R);
    settle(s, problem_.begin);
    std::vector<Change> f;  // at the nodes, those after the fourth at the predicted states
    for (std::size_t i = 0;; ++i) {
      const int at = 2 * static_cast<int>(i);
      if (i < kBegun) f.push_back(change(s, at, v));
      base_.place(s.position, links_);
      nodes.push_back({times_[2 * i],
                       s.position,
                       f[i].rate,
                       {},
                       s.X_WB,
                       links_,
                       s.per_position,
                       f[i].per_position,
                       {},
                       s.per_displacement});
      if (i == kSteps) break;
      if (i + 1 < kBegun) {
        const Change k2 = change(after(s, f[i], 0.5 * step(), at + 1), at + 1, v);
        const Change k3 = change(after(s, k2, 0.5 * step(), at + 1), at + 1, v);
        const Change k4 = change(after(s, k3, step(), at + 2), at + 2, v);
        s = after(s, sum({{1, f[i]}, {2, k2}, {2, k3}, {1, k4}}), step() / 6, at + 2);
      } else {
        const Change predictor = sum({{55, f[i]}, {-59, f[i - 1]}, {37, f[i - 2]}, {-9, f[i - 3]}});
        f.push_back(change(after(s, predictor, step() / 24, at + 2), at + 2, v));
        const Change corrector = sum({{9, f[i + 1]}, {19, f[i]}, {-5, f[i - 1]}, {1, f[i - 2]}});
        s = after(s, corrector, step() / 24, at + 2);
      }
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

  double step() const { return (problem_.end - problem_.begin) / static_cast<double>(kSteps); }

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
    const std::vector<Goal> goals = goals_at(problem_, targets_[static_cast<std::size_t>(at)], time);
    const Momentumd h_B = problem_.motion.in_base(time, s.X_WB);
    base_.place(s.position);
    double phi[kTerms];
    self_motion_basis((time - problem_.begin) / (problem_.end - problem_.begin), phi);
    Eigen::VectorXd z = Eigen::VectorXd::Zero(n_);
    for (int k = 0; k < kTerms; ++k) z += phi[k] * v.segment(start_unknowns() + k * n_, n_);
    if (!derivatives_) {
      const Eigen::VectorXd rates = rates_nearest_to(z, s.X_WB, h_B, goals);
      Change c;
      c.rate.assign(rates.begin(), rates.end());
      base_.move(c.rate, h_B);
      c.turn = quaternion_rate(s.q_WB, twist_from(base_.base_twist()).angular);
      c.per_position.resize(n_, 0), c.per_displacement.resize(6, 0);
      return c;
    }
    DemandedRates demanded = demanded_rates(base_, s.X_WB, h_B, goals, RateDemand::task);
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
    constexpr double kRounding = 1e-12;  // is no freedom, and no program is to move joints by it
    free = (free.array().abs() < kRounding).select(0.0, free);
    for (int k = 0; k < kTerms; ++k) c.per_position.middleCols(start_unknowns() + k * n_, n_) += phi[k] * free;
    c.per_displacement = base_.displacement_rate(h_B) * s.per_displacement + base_.per_angle() * s.per_position +
                         base_.per_rate() * c.per_position;
    return c;
  }

  // Whether plan_straight_in() would damp it.
  static bool is_damped(const Eigen::MatrixXd& G) {
    const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(G).singularValues();
    constexpr double kNever = 1e-9;  // what a planar arm can never do
    return std::any_of(sigma.begin(), sigma.end(),
                       [&](double s) { return s > kNever * sigma[0] && s < kDampedBelow * sigma[0]; });
  }

  // (1), by normal equations where no singularity is near.
  Eigen::VectorXd rates_nearest_to(const Eigen::VectorXd& z, const Posed& X_WB, const Momentumd& h_B,
                                   const std::vector<Goal>& goals) {
    demand_rows(base_, X_WB, h_B, goals, RateDemand::task, G_, b_);
    const double largest = std::sqrt((G_ * G_.transpose()).cwiseAbs().rowwise().sum().maxCoeff());
    if (const auto rest = least_norm_above(G_, b_ - G_ * z, kDampedBelow * largest)) return z + *rest;
    near_singularity_ = near_singularity_ || is_damped(G_);
    DemandedRates demanded = demanded_rates(base_, X_WB, h_B, goals, RateDemand::task);
    add_self_motion(z, demanded);
    return demanded.rates;
  }

  static Change sum(std::initializer_list<std::pair<double, const Change&>> terms) {
    Change sum = terms.begin()->second;
    const double first = terms.begin()->first;
    for (double& rate : sum.rate) rate *= first;
    Quaterniond& q = sum.turn;
    q = {first * q.w, first * q.x, first * q.y, first * q.z};
    sum.per_position *= first, sum.per_displacement *= first;
    for (auto term = terms.begin() + 1; term != terms.end(); ++term) {
      const auto& [weight, k] = *term;
      for (std::size_t j = 0; j < sum.rate.size(); ++j) sum.rate[j] += weight * k.rate[j];
      q = {q.w + weight * k.turn.w, q.x + weight * k.turn.x, q.y + weight * k.turn.y, q.z + weight * k.turn.z};
      sum.per_position += weight * k.per_position, sum.per_displacement += weight * k.per_displacement;
    }
    return sum;
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
      node.per_acceleration = Eigen::MatrixXd::Zero(n_, node.per_rate.cols());
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
  Eigen::MatrixXd G_;
  Eigen::VectorXd b_;
  bool derivatives_ = true, near_singularity_ = false;
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

// The c of (4) for one beginning of the piece.
class StraightSearch {
 public:
  StraightSearch(FloatingBase& base, const StraightInProblem& problem, const ReachProblem& kept,
                 const StartFreedom* freedom)
      : base_(base), problem_(problem), look_(base, kept), motions_(base, problem, freedom) {}

  StraightWay run() {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(motions_.unknowns());
    StraightWay best;
    if (!motions_.complete()) return closed(best = exact(v));
    if (motions_.start_unknowns() > 0) {
      constexpr double kFirstOrder = 1e-3;  // it is looked for exactly from there
      if (exchange(v, kFirstOrder) <= kHopeless) best.start = motions_.start(v), best.self_motion = self_motion_of(v);
      return closed(best);
    }
    // A look by the nodes costs a tenth of an exact one, which there is near a singularity or where it says enough.
    best = at_nodes(motions_.integrate(v, SelfMotions::Derivatives::none));
    if (best.violation <= kNearly || motions_.near_singularity()) best = exact(v);
    if (best.kept) return closed(best);
    if (!problem_.self_motion.coefficients.empty()) {
      const Eigen::VectorXd known = as_vector(problem_.self_motion.coefficients);
      if (worst_at(motions_.integrate(known, SelfMotions::Derivatives::none)) < best.violation) v = known;
    }
    constexpr int kFiner = 4;
    for (int i = 0; i <= kFiner; ++i) {
      const double worst = exchange(v, kNothing);
      const bool arrived = worst <= -margin_ + kAimed;
      if (worst > kNearly) {
        StraightWay end = at_nodes(motions_.integrate(v, SelfMotions::Derivatives::none));
        // A piece that keeps its limits and is refused for what it passes by is not given up for one that does not.
        const bool keeps_limits = best.path.finished && best.trouble.empty();
        if (!keeps_limits && !end.trouble.empty() && end.violation < best.violation) best = std::move(end);
        break;
      }
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
  static constexpr double kHopeless = 0.3, kNearly = 0.02;

  StraightWay closed(StraightWay& way) const {
    way.self_motions = motions_.self_motions();
    way.rhs_evaluations = motions_.evaluations() + evaluations_;
    return std::move(way);
  }

  struct Iterate {
    Eigen::VectorXd v;
    std::vector<Node> nodes;
    double worst = 0;  // at the nodes
  };

  // To the v nearest to `share` of it that keeps what is linear at v, or comes as near to that as joints do that move
  // no farther than a radius.
  struct Step {
    Eigen::VectorXd v;
    double farthest = 0;  // that a joint moves [rad or m]
    double foreseen = 0;  // what is violated then, as far as that is linear
  };
  Step step_within(double radius, const Iterate& at, double share) {
    const std::vector<Node>& nodes = at.nodes;
    const Eigen::VectorXd& v = at.v;
    const Rows rows = linear_at(nodes, v);
    const auto with = [&](double giving) {
      Step step;
      step.v = nearest_below(rows.A, rows.b, share * v, giving).x;
      for (const Node& node : nodes)
        step.farthest = std::max(step.farthest, (node.per_position * (step.v - v)).lpNorm<Eigen::Infinity>());
      return step;
    };
    // Rows that give way as little as joints that stay within the radius allow.
    constexpr double kMore = 30, kMost = 1, kOfRadius = 0.7;
    double giving = kGiving, less = 0;
    Step step = with(giving);
    while (step.farthest > radius && giving < kMost) less = giving, giving *= kMore, step = with(giving);
    for (int i = 0; i < 4 && less > 0 && step.farthest < kOfRadius * radius; ++i) {
      const double between = std::sqrt(less * giving);
      Step other = with(between);
      if (other.farthest > radius)
        less = between;
      else
        giving = between, step = std::move(other);
    }
    if (step.farthest > radius) step.v = v + radius / step.farthest * (step.v - v), step.farthest = radius;
    step.foreseen = rows.b.size() ? (rows.A * step.v - rows.b).maxCoeff() : kNothing;
    return step;
  }

  // From v to one at which no more than `enough` is violated at the nodes; if nothing is to be, to the least such one
  // near there. What is left at the nodes.
  double exchange(Eigen::VectorXd& v, double enough) {
    Iterate at{v, motions_.integrate(v, SelfMotions::Derivatives::all)};
    at.worst = add_instants(at.nodes);
    constexpr double kSwing = 0.03;  // by which steps to less self-motion may miss what is kept
    const double kept = -margin_ + kAimed;
    restore(at, std::max(enough, kept));
    if (enough == kNothing && at.worst <= kept) {
      constexpr int kRounds = 6;
      constexpr double kSettled = 2e-3;  // joints move no farther any more [rad or m]
      Iterate best = at;
      for (double keep = 0; keep < std::pow(4.0, kRounds); keep = std::max(1.0, 4 * keep)) {
        const Step step = step_within(kFarthestMove, at, keep / (1 + keep));
        if (step.farthest < kSettled || !take(at, step, kSwing)) continue;
        restore(at, kept);
        if (at.worst <= kept && at.v.squaredNorm() < best.v.squaredNorm())
          best = at;
        else
          at = best;
      }
      at = std::move(best);
    }
    v = at.v;
    return at.worst;
  }

  // With the step done, unless it comes to more than `most`; then what is violated there is kept from now on.
  bool take(Iterate& at, const Step& step, double most) {
    const double now = add_instants(motions_.integrate(step.v, SelfMotions::Derivatives::none));
    if (now > most) return false;
    at.v = step.v, at.worst = now;
    at.nodes = motions_.integrate(at.v, SelfMotions::Derivatives::all);
    return true;
  }

  // By the shortest steps that keep what is linear of the instants known, then the new ones, until no more than
  // `enough` is violated, or no step helps.
  void restore(Iterate& at, double enough) {
    constexpr int kMost = 25, kPatience = 5;
    constexpr int kNowhere = 2;
    constexpr double kSwing = 0.05, kFar = 0.02, kLittle = 0.9, kShortest = 1e-5;
    double least = at.worst, foreseen = std::numeric_limits<double>::infinity(), radius = kFarthestMove;
    for (int round = 0, stuck = 0, nowhere = 0; round < kMost && stuck < kPatience && at.worst > enough; ++round) {
      const Step step = step_within(radius, at, 1);
      if (!(step.farthest > 0) || radius < kShortest) break;
      if (radius >= kFarthestMove) {
        // What is linear of it says, more than once, that it leads nowhere.
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
      if (motions_.begins_elsewhere_by(at.v) > kFarthestMove) break;  // farther on it is not what it was at first order
      stuck = at.worst < 0.7 * least ? 0 : stuck + 1;
      least = std::min(least, at.worst);
    }
  }

  WayLook::PointAt points(const std::vector<Node>& nodes) const {
    return [&nodes](int i) {
      const Node& node = nodes[static_cast<std::size_t>(i)];
      return way_point(node.time, node.position, node.rate, node.acceleration, node.X_WB, node.links);
    };
  }

  // What is violated most at the nodes, if anything is.
  StraightWay at_nodes(const std::vector<Node>& nodes) {
    StraightWay way;
    if (!is_finite(nodes)) {
      way.violation = -kNothing;
      way.trouble = "joints move beyond all bounds near a singularity";
      return way;
    }
    way.violation = kNothing;
    const WayLook::PointAt at = points(nodes);
    for (const WayLook::Found& f : look_.scan(static_cast<int>(nodes.size()), at, 0, kNothing, nullptr)) {
      if (f.value <= way.violation) continue;
      way.violation = f.value;
      if (f.value > kTolerated) way.trouble = look_.describe(f, at(f.at.node));
    }
    return way;
  }

  double worst_at(const std::vector<Node>& nodes) {
    if (!is_finite(nodes)) return -kNothing;
    double worst = kNothing;
    for (const WayLook::Found& f : found_at(nodes)) worst = std::max(worst, f.value);
    return worst;
  }

  // What self-motion may change: at the begin only another begin does.
  std::vector<WayLook::Found> found_at(const std::vector<Node>& nodes) {
    std::vector<WayLook::Found> found =
        look_.scan(static_cast<int>(nodes.size()), points(nodes), kNearViolation + margin_, kNothing, nullptr);
    if (motions_.start_unknowns() == 0) std::erase_if(found, [](const WayLook::Found& f) { return f.at.node == 0; });
    return found;
  }

  // Past a singularity it may not be.
  static bool is_finite(const std::vector<Node>& nodes) {
    const std::vector<double>& q = nodes.back().position;
    return std::all_of(q.begin(), q.end(), [](double x) { return std::isfinite(x); });
  }

  double add_instants(const std::vector<Node>& nodes) {
    if (!is_finite(nodes)) return -kNothing;
    const WayLook::PointAt at = points(nodes);
    std::erase_if(instants_, [&](const WayLook::Instant& i) { return look_.may_touch(i, at(i.node)); });
    double worst = kNothing;
    for (const WayLook::Found& f : found_at(nodes)) {
      worst = std::max(worst, f.value);
      if (std::find(instants_.begin(), instants_.end(), f.at) == instants_.end()) instants_.push_back(f.at);
    }
    return worst;
  }

  // What at an instant stays linear of it: A v <= b.
  struct Rows {
    Eigen::MatrixXd A;
    Eigen::VectorXd b;
  };
  Rows linear_at(const std::vector<Node>& nodes, const Eigen::VectorXd& v) {
    const int n = base_.joints();
    const auto count = static_cast<Eigen::Index>(instants_.size());
    Rows rows{Eigen::MatrixXd(count, v.size()), Eigen::VectorXd(count)};
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

  // The piece with this self-motion, integrated exactly, and what it violates.
  StraightWay exact(const Eigen::VectorXd& v) {
    StraightWay way;
    StraightInProblem problem = problem_;
    problem.self_motion = way.self_motion = self_motion_of(v);
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
