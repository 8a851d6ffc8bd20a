#include "grapnel/plan/way.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlopt.hpp>
#include <numbers>
#include <random>

#include "grapnel/plan/joint_efforts.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr int kWayPanels[] = {8, 2};  // at least; of 16 nodes
constexpr double kTolerated = 1e-6;   // more is a violation [rad, m or 1]
constexpr double kAimed = 5e-7;       // what is aimed at, within the violation
constexpr double kDifference = 1e-6;

/// What may be violated. Positive where it is: positions [rad or m], rates and efforts as a share of their limits less
/// one, distances [m], the base's turn [rad].
enum class Kept { position, rate, effort, clearance, base_turn };

struct Instant {
  Kept kept = Kept::position;
  int index = 0;    // joint or pair
  double sign = 1;  // of the limit
  int node = 0;
  bool operator==(const Instant&) const = default;
};

struct Found {
  Instant at;
  double value = 0;
};

// Derivatives with what a node's motion is made of.
struct PerMotion {
  Eigen::VectorXd position, rate, acceleration;  // of the joints
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();

  explicit PerMotion(int n)
      : position(Eigen::VectorXd::Zero(n)), rate(Eigen::VectorXd::Zero(n)), acceleration(Eigen::VectorXd::Zero(n)) {}
};

// One segment with knots: its way, looked at and improved.
class Way {
 public:
  Way(FloatingBase& base, const ReachProblem& problem, int knots, int panels)
      : base_(base),
        problem_(with_knots(problem, knots)),
        setup_(problem_.way),
        shooting_(base, problem_),
        efforts_(base, problem_.motion.gravity),
        n_(base.joints()) {
    shooting_.segment().keep_way(panels);
  }

  const ReachProblem& problem() const { return problem_; }
  int joints() const { return n_; }
  int unknowns() const { return n_ * (1 + problem_.start.knots); }
  long rhs_evaluations() const { return shooting_.rhs_evaluations(); }

  // Evaluates for [theta_f, c]; `like` knows the rates to expect.
  const Shot& shoot(std::span<const double> y, const Shot& like, SegmentAccuracy accuracy) {
    const std::vector<double> position(y.begin(), y.begin() + n_), c(y.begin() + n_, y.begin() + unknowns());
    shot_ = shooting_.shoot(position, like.rate_at(position, c), accuracy, c);
    return shot_;
  }
  const Shot& shot() const { return shot_; }

  // --- What is kept, at one instant

  double value(const Instant& at, Eigen::VectorXd* gradient) {
    const PathSegment::WayPoint w = segment().way_point(at.node);
    PerMotion d(n_);
    const double result = violation(at, w, gradient ? &d : nullptr);
    if (gradient) *gradient = per_unknown(d, w, at.node);
    return result;
  }

  // Distance of a pair, and how it changes.
  double distance(int pair, int node, Eigen::VectorXd* gradient) {
    const PathSegment::WayPoint w = segment().way_point(node);
    PerMotion d(n_);
    const double result = distance(pair, w, gradient ? &d : nullptr);
    if (gradient) *gradient = per_unknown(d, w, node);
    return result;
  }

  // --- The whole way

  // All instants at which something is violated by more than -`band`: the local maxima over the nodes. `wanted`: a
  // distance below which pairs count whatever is asked.
  std::vector<Found> scan(double band, double wanted, WayFigures* figures) {
    std::vector<Found> found;
    std::map<std::tuple<Kept, int, int>, std::vector<double>> series;
    const int nodes = segment().way_points();
    const auto note = [&](Kept kept, int index, double sign, int node, double v) {
      if (!(v > -kInfinite)) return;
      auto& s = series[{kept, index, sign > 0}];
      if (s.empty()) s.assign(static_cast<std::size_t>(nodes), -kInfinite);
      s[static_cast<std::size_t>(node)] = v;
    };
    const bool efforts = looks_at_efforts();
    std::vector<double> effort(static_cast<std::size_t>(n_));
    Kinematics at;
    for (int node = 0; node < nodes; ++node) {
      const PathSegment::WayPoint w = segment().way_point(node);
      for (int j = 0; j < n_; ++j)
        look_at_joint(j, w, figures, [&](Kept k, double sign, double v) {
          if (setup_.limits) note(k, j, sign, node, v);
        });
      if (efforts) {
        evaluate_efforts(w.position, w.rate, w.acceleration, w.X_WB, w.time, effort);
        for (int j = 0; j < n_; ++j) {
          const double limit = setup_.effort_limit[static_cast<std::size_t>(j)];
          if (!std::isfinite(limit)) continue;
          const double share = effort[static_cast<std::size_t>(j)] / limit;
          if (figures) figures->effort_share = std::max(figures->effort_share.value_or(0), std::abs(share));
          note(Kept::effort, j, share > 0 ? 1 : -1, node, std::abs(share) - 1);
        }
      }
      const double turn = rotation_angle(transpose(setup_.R_WB0) * w.X_WB.R);
      if (figures) figures->base_turn = std::max(figures->base_turn, turn);
      if (std::isfinite(setup_.base_turn)) note(Kept::base_turn, 0, 1, node, turn - setup_.base_turn);
      if (!setup_.bodies || setup_.bodies->model.pairs().empty()) continue;
      place(w, at);
      look_at_distances(node, w, at, band, wanted, figures, note);
    }
    for (const auto& [key, s] : series) {
      for (int i = 0; i < nodes; ++i) {
        const double v = s[static_cast<std::size_t>(i)];
        if (!(v > -band)) continue;
        const bool rises = i == 0 || v >= s[static_cast<std::size_t>(i - 1)];
        const bool falls = i + 1 == nodes || v > s[static_cast<std::size_t>(i + 1)];
        if (rises && falls)
          found.push_back({{std::get<0>(key), std::get<1>(key), std::get<2>(key) ? 1.0 : -1.0, i}, v});
      }
    }
    return found;
  }

  // In words, for users.
  std::string describe(const Found& f) {
    const PathSegment::WayPoint w = segment().way_point(f.at.node);
    const auto joint = [&] {
      return base_.model().bodies()[base_.model().joints()[f.at.index]].description.joint.name;
    };
    switch (f.at.kept) {
      case Kept::position:
        return fmt::format("joint '{}' goes {:.3g} (rad or m) beyond its limit at t = {:.4g} s", joint(), f.value,
                           w.time);
      case Kept::rate:
        return fmt::format("joint '{}' exceeds its rate limit by {:.3g} % at t = {:.4g} s", joint(), 100 * f.value,
                           w.time);
      case Kept::effort:
        return fmt::format("joint '{}' exceeds its effort limit by {:.3g} % at t = {:.4g} s", joint(), 100 * f.value,
                           w.time);
      case Kept::base_turn:
        return fmt::format("the base turns {:.4g} rad from its initial attitude at t = {:.4g} s, {:.4g} is allowed",
                           setup_.base_turn + f.value, w.time, setup_.base_turn);
      case Kept::clearance:
        break;
    }
    const ClearancePair& pair = setup_.bodies->model.pairs()[static_cast<std::size_t>(f.at.index)];
    const double d = *setup_.clearance - f.value;
    return fmt::format("'{}' and '{}' {} at t = {:.4g} s, {:.4g} m is to be kept", setup_.bodies->names[pair.body_a],
                       setup_.bodies->names[pair.body_b],
                       d < 0 ? fmt::format("overlap by {:.4g} m", -d) : fmt::format("come within {:.4g} m", d), w.time,
                       *setup_.clearance);
  }

  // --- The objective

  // Value of all terms but the clearance's, and its gradient for [theta_f, c].
  double objective(Eigen::VectorXd* gradient, std::vector<double>* terms = nullptr) {
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
        case Objective::Kind::clearance:
          break;
        default:
          value = end_term(term, gradient);
      }
      if (terms) terms->push_back(value);
      sum += term.weight * value;
    }
    return sum;
  }

 private:
  static ReachProblem with_knots(const ReachProblem& problem, int knots) {
    ReachProblem result = problem;
    result.start.knots = knots;
    result.objective = problem.objective.with_knots(knots);
    return result;
  }

  PathSegment& segment() { return shooting_.segment(); }

  bool looks_at_efforts() const {
    return setup_.limits && std::any_of(setup_.effort_limit.begin(), setup_.effort_limit.end(),
                                        [](double limit) { return std::isfinite(limit); });
  }

  void evaluate_efforts(const std::vector<double>& position, const std::vector<double>& rate,
                        const std::vector<double>& acceleration, const Posed& X_WB, double time,
                        std::span<double> effort) {
    // The base is where momentum and the centre of mass have it: only its attitude is its own.
    base_.place(position);
    const Posed X{X_WB.R, base_.floats() ? problem_.motion.com_at(time) - X_WB.R * base_.com() : X_WB.p};
    efforts_.evaluate(position, rate, acceleration, X, problem_.motion.in_base(time, X), effort);
  }

  // From derivatives with the motion at a node to those with [theta_f, c].
  Eigen::VectorXd per_unknown(const PerMotion& d, const PathSegment::WayPoint& w, int node) {
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
  // Final rates follow from the unknowns.
  Eigen::VectorXd through_rates(const Eigen::VectorXd& all) const {
    Eigen::VectorXd y(unknowns());
    y << all.head(n_), all.tail(unknowns() - n_);
    return y + shot_.K.transpose() * all.segment(n_, n_);
  }

  double violation(const Instant& at, const PathSegment::WayPoint& w, PerMotion* d) {
    const auto j = static_cast<std::size_t>(at.index);
    switch (at.kept) {
      case Kept::position:
        if (d) d->position[at.index] = at.sign;
        return at.sign > 0 ? w.position[j] - problem_.upper[j] : problem_.lower[j] - w.position[j];
      case Kept::rate:
        if (d) d->rate[at.index] = at.sign / problem_.rate_limit[j];
        return at.sign * w.rate[j] / problem_.rate_limit[j] - 1;
      case Kept::effort:
        return effort_violation(at, w, d);
      case Kept::base_turn: {
        const Vector3d phi = rotation_vector(w.X_WB.R * transpose(setup_.R_WB0));
        const double angle = norm(phi);
        if (d && angle > 0) d->turn = column((1 / angle) * phi);
        return angle - setup_.base_turn;
      }
      case Kept::clearance:
        break;
    }
    const double value = *setup_.clearance - distance(at.index, w, d);
    if (d) d->position *= -1, d->turn *= -1;
    return value;
  }

  // Calls at(kept, sign, violation) for both sides of a joint's position and rate.
  template <class At>
  void look_at_joint(int joint, const PathSegment::WayPoint& w, WayFigures* figures, At&& at) {
    const auto j = static_cast<std::size_t>(joint);
    const double above = w.position[j] - problem_.upper[j], below = problem_.lower[j] - w.position[j];
    at(Kept::position, 1.0, above), at(Kept::position, -1.0, below);
    const double limit = problem_.rate_limit.empty() ? kInfinite : problem_.rate_limit[j];
    const double share = std::isfinite(limit) ? w.rate[j] / limit : 0;
    if (std::isfinite(limit)) at(Kept::rate, 1.0, share - 1), at(Kept::rate, -1.0, -share - 1);
    if (!figures) return;
    figures->position_margin = std::min(figures->position_margin, -std::max(above, below));
    figures->rate_share = std::max(figures->rate_share, std::abs(share));
  }

  double effort_violation(const Instant& at, const PathSegment::WayPoint& w, PerMotion* d) {
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

  // Derivatives of a weighted sum of efforts, by differences.
  void add_effort_change(const PathSegment::WayPoint& w, const std::vector<double>& effort,
                         const Eigen::VectorXd& weights, PerMotion& d) {
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

  // --- Distances

  void place(const PathSegment::WayPoint& w, Kinematics& at) {
    const WayBodies& bodies = *setup_.bodies;
    at.X_WB.resize(bodies.link.size());
    auto [others, fresh] = others_.try_emplace(w.time);
    if (fresh) {
      others->second.resize(bodies.link.size());
      bodies.place_others(w.time, others->second);
    }
    for (std::size_t b = 0; b < bodies.link.size(); ++b) {
      const int link = bodies.link[b];
      at.X_WB[b] =
          link < 0 ? others->second[b] : w.X_WB * w.links->motion[static_cast<std::size_t>(link)].X_WL * bodies.X_LB[b];
    }
  }

  bool may_touch(int pair, const PathSegment::WayPoint& w, const Kinematics& at) const {
    const WayBodies& bodies = *setup_.bodies;
    const int index = bodies.hand[static_cast<std::size_t>(pair)];
    if (index < 0) return false;
    const WayBodies::Hand& hand = bodies.hands[static_cast<std::size_t>(index)];
    const Frame& frame = base_.model().frames()[hand.frame];
    const BodyPlacement& placement = base_.model().bodies()[frame.body].placement;
    const Posed X_WE =
        w.X_WB * w.links->motion[static_cast<std::size_t>(placement.link)].X_WL * placement.X_LB * frame.X_BE;
    return norm(X_WE.p - at.X_WB[static_cast<std::size_t>(hand.target)] * hand.p_TG) <= hand.near;
  }

  template <class Note>
  void look_at_distances(int node, const PathSegment::WayPoint& w, const Kinematics& at, double band, double wanted,
                         WayFigures* figures, Note&& note) {
    const ClearanceModel& model = setup_.bodies->model;
    const double kept = setup_.clearance.value_or(-kInfinite);
    for (int p = 0; p < static_cast<int>(model.pairs().size()); ++p) {
      const double least = std::max(kept + band, std::max(wanted, figures ? figures->clearance.distance : -kInfinite));
      if (model.coarse_bound(p, at) > least || model.lower_bound(p, at) > least || may_touch(p, w, at)) continue;
      const ShapeDistance d = model.distance(p, at);
      if (figures && d.distance < figures->clearance.distance) {
        const ClearancePair& pair = model.pairs()[static_cast<std::size_t>(p)];
        figures->clearance = {d.distance, p, pair.body_a, pair.body_b, d.point_a, d.point_b, d.normal};
        figures->clearance_time = w.time;
      }
      if (setup_.clearance)
        note(Kept::clearance, p, 1.0, node, kept - d.distance);
      else
        note(Kept::clearance, p, 1.0, node, wanted - band - d.distance);
    }
  }

  double distance(int pair, const PathSegment::WayPoint& w, PerMotion* d) {
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

  // (2) along n, for a point at p_W of a body.
  void add_point(int body, const Vector3d& p_W, const Vector3d& n, const PathSegment::WayPoint& w, PerMotion& d) {
    const int link = setup_.bodies->link[static_cast<std::size_t>(body)];
    if (link < 0) return;
    const PlacedLinks& links = *w.links;
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

  // --- Terms of the objective

  double end_term(const Objective::Term& term, Eigen::VectorXd* gradient) {
    Objective::Gradient g;
    if (gradient) {
      g.position.assign(static_cast<std::size_t>(n_), 0.0), g.rate.assign(static_cast<std::size_t>(n_), 0.0);
      g.coefficients.assign(shot_.coefficients.size(), 0.0);
    }
    const double value = problem_.objective.term(term, base_, problem_.goals, shot_.position, shot_.rate,
                                                 gradient ? &g : nullptr, shot_.coefficients);
    if (gradient) {
      gradient->head(n_) += as_vector(g.position);
      gradient->tail(unknowns() - n_) += as_vector(g.coefficients);
      *gradient += shot_.K.transpose() * as_vector(g.rate);
    }
    return value;
  }

  double attitude_term(double weight, Eigen::VectorXd* gradient) {
    const Vector3d phi = rotation_vector(transpose(setup_.R_WB0) * shot_.X_WB.R);  // in B, or at the start: the same
    if (gradient) *gradient += weight * shot_.per_unknown.topRows(3).transpose() * column(phi);
    return 0.5 * dot(phi, phi);
  }

  double motion_term(double weight, Eigen::VectorXd* gradient) {
    const double T = problem_.start.end - problem_.start.begin;
    Eigen::VectorXd all = Eigen::VectorXd::Zero(unknowns() + n_);
    double sum = 0;
    for (int i = 0; i < segment().way_points(); ++i) {
      const PathSegment::WayPoint w = segment().way_point(i);
      sum += 0.5 * T * w.weight * dot(w.w_B, w.w_B);
      if (gradient) all += (weight * T * w.weight) * segment().w_per_unknown(i).transpose() * column(w.w_B);
    }
    if (gradient) *gradient += through_rates(all);
    return sum;
  }

  double effort_term(double weight, Eigen::VectorXd* gradient) {
    const double T = problem_.start.end - problem_.start.begin;
    std::vector<double> effort(static_cast<std::size_t>(n_));
    double sum = 0;
    for (int i = 0; i < segment().way_points(); ++i) {
      const PathSegment::WayPoint w = segment().way_point(i);
      evaluate_efforts(w.position, w.rate, w.acceleration, w.X_WB, w.time, effort);
      sum += 0.5 * w.weight / T * as_vector(effort).squaredNorm();
      if (!gradient) continue;
      PerMotion d(n_);
      add_effort_change(w, effort, (weight * w.weight / T) * as_vector(effort), d);
      *gradient += per_unknown(d, w, i);
    }
    return sum;
  }

  FloatingBase& base_;
  ReachProblem problem_;
  const WaySetup& setup_;
  Shooting shooting_;
  JointEfforts efforts_;
  int n_;
  Shot shot_;
  std::map<double, std::vector<Posed>> others_;
};

// The exchange, for one start.
class Exchange {
 public:
  Exchange(Way& way, Way& finer) : way_(way), finer_(finer), setup_(way.problem().way) {
    for (const Objective::Term& t : way.problem().objective.terms()) {
      if (t.kind == Objective::Kind::clearance) clearance_weight_ = t.weight;
    }
  }

  WayEnd run(const Shot& solution, std::vector<double> coefficients) {
    std::vector<double> y = solution.position;
    y.insert(y.end(), coefficients.begin(), coefficients.end());
    y.resize(static_cast<std::size_t>(way_.unknowns()));
    Shot like = solution;
    like.K.resize(0, 0);
    like.coefficients.assign(y.begin() + way_.joints(), y.end());
    WayEnd end;
    if (!way_.shoot(y, like, SegmentAccuracy::search).valid) {
      end.trouble = "the motion is not resolved", end.violation = kInfinite;
      return end;
    }
    constexpr int kFiner = 4;
    for (int i = 0;; ++i) {
      exchange(y);
      end = finish(y);
      if (end.kept || i == kFiner || !(end.violation < 1e-2)) break;
      // Between the nodes it is worse by that.
      margin_ += 2 * end.violation;
    }
    return end;
  }

 private:
  static constexpr double kBand = 0.02;  // instants this near to a violation are kept as well

  bool wants_clearance() const { return clearance_weight_ > 0; }

  // SLSQP at the instants known, then the new ones, until nothing is violated.
  void exchange(std::vector<double>& y) {
    // Without anything to keep, the rounds only go on with what the optimizer was not given the time for.
    const int most = way_.problem().way.keeps_something() || wants_clearance() ? 12 : 3;
    const bool settled_as_is = !wants_clearance() && way_.problem().objective.depends_on_end_alone();
    double before = kInfinite;
    int stuck = 0;
    for (int round = 0; round < most; ++round) {
      const std::size_t known = instants_.size();
      const double worst = add_instants();
      // From the same place with the same instants it would end there again.
      if (round > 0 && !moved_far_ && instants_.size() == known) return;
      const bool arrived = way_.shot().largest_error() <= 1e-5;
      if (round == 0 && settled_as_is && worst <= -margin_ + kAimed && arrived) return;
      if (round > 0 && worst <= -margin_ + kAimed && arrived && !moved_far_) return;
      if (worst > 0.7 * before && ++stuck > 5) return;
      before = std::min(before, worst);
      if (!improve(y) && ++stuck > 2) return;
    }
  }

  // What the latest shot violates most.
  double add_instants() {
    double wanted = -kInfinite;
    if (wants_clearance()) {
      WayFigures figures;
      way_.scan(0, -kInfinite, &figures);
      least_ = figures.clearance.distance;
      wanted = least_ + kBand;
    }
    double worst = -kInfinite;
    for (const Found& f : way_.scan(kBand + margin_, wanted, nullptr)) {
      if (f.at.kept != Kept::clearance || setup_.clearance) worst = std::max(worst, f.value);
      if (std::find(instants_.begin(), instants_.end(), f.at) == instants_.end()) instants_.push_back(f.at);
    }
    return worst;
  }

  bool improve(std::vector<double>& y) {
    const ReachProblem& p = way_.problem();
    const int n = way_.joints(), unknowns = way_.unknowns();
    const int size = unknowns + (wants_clearance() ? 1 : 0);
    std::vector<double> lower(static_cast<std::size_t>(size), -kInfinite), upper(lower.size(), kInfinite), z = y;
    constexpr double kFarthest = 1, kMostBent = 20;  // [rad or m]
    for (int j = 0; j < unknowns; ++j) {
      const auto i = static_cast<std::size_t>(j);
      lower[i] = std::max(j < n ? p.lower[i] : -kMostBent, y[i] - kFarthest);
      upper[i] = std::min(j < n ? p.upper[i] : kMostBent, y[i] + kFarthest);
    }
    if (wants_clearance())
      z.push_back(std::isfinite(least_) ? least_ : 0), lower.back() = z.back() - 1, upper.back() = z.back() + 1;
    rows_ = independent_rows(way_.shot().J);
    // The optimizer's first guess of curvatures is one.
    if (!p.objective.depends_on_end_alone()) scale_ = 1 / std::max(1e-9, std::abs(way_.objective(nullptr)));
    nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(size));
    optimizer.set_lower_bounds(lower);
    optimizer.set_upper_bounds(upper);
    optimizer.set_min_objective(&Exchange::objective, this);
    if (rows_.rows() > 0)
      optimizer.add_equality_mconstraint(&Exchange::goals, this,
                                         std::vector<double>(static_cast<std::size_t>(rows_.rows()), 1e-6));
    final_rates_.clear();
    for (int j = 0; j < static_cast<int>(p.rate_limit.size()); ++j) {
      if (std::isfinite(p.rate_limit[static_cast<std::size_t>(j)])) final_rates_.push_back(j);
    }
    const std::size_t inequalities =
        instants_.size() * (wants_clearance() && setup_.clearance ? 2 : 1) + 2 * final_rates_.size();
    if (inequalities > 0)
      optimizer.add_inequality_mconstraint(&Exchange::inequalities, this, std::vector<double>(inequalities, 1e-9));
    optimizer.set_xtol_abs(1e-7);
    optimizer.set_ftol_rel(1e-9);
    optimizer.set_maxeval(100);
    bool ended = true;
    double least = 0;
    try {
      optimizer.optimize(z, least);
    } catch (const WorkLimit&) {
      throw;
    } catch (const std::exception&) {
      ended = false;
    }
    z.resize(static_cast<std::size_t>(unknowns));
    double farthest = 0;
    for (std::size_t i = 0; i < z.size(); ++i) farthest = std::max(farthest, std::abs(z[i] - y[i]));
    moved_far_ = farthest > 1e-4;
    const Shot like = way_.shot().valid ? way_.shot() : last_valid_;
    if (way_.shoot(z, like, SegmentAccuracy::search).valid) {
      y = z;
    } else {
      way_.shoot(y, last_valid_, SegmentAccuracy::search);
      ended = false;
    }
    return ended;
  }

  static Eigen::MatrixXd independent_rows(const Eigen::MatrixXd& J) {
    if (J.size() == 0) return Eigen::MatrixXd(0, J.rows());
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
    Eigen::Index rank = 0;
    while (rank < svd.singularValues().size() && svd.singularValues()[rank] > 1e-6 * svd.singularValues()[0]) ++rank;
    return svd.matrixU().leftCols(rank).transpose();
  }

  // Evaluates unless it is the point known; false where it cannot be.
  void at(const double* z) {
    const std::vector<double> y(z, z + way_.unknowns());
    const Shot& now = way_.shot();
    const auto n = static_cast<std::ptrdiff_t>(way_.joints());
    if (now.valid && std::equal(y.begin(), y.begin() + n, now.position.begin()) &&
        std::equal(y.begin() + n, y.end(), now.coefficients.begin()))
      return;
    if (now.valid) last_valid_ = now;
    if (!way_.shoot(y, last_valid_.valid ? last_valid_ : now, SegmentAccuracy::search).valid)
      throw nlopt::forced_stop();
  }

  static double objective(unsigned size, const double* z, double* gradient, void* data) {
    Exchange& e = *static_cast<Exchange*>(data);
    e.at(z);
    Eigen::VectorXd g;
    double value = e.scale_ * e.way_.objective(gradient ? &g : nullptr);
    g *= e.scale_;
    if (gradient) std::copy(g.begin(), g.end(), gradient);
    if (e.wants_clearance()) {
      value -= e.scale_ * e.clearance_weight_ * z[size - 1];
      if (gradient) gradient[size - 1] = -e.scale_ * e.clearance_weight_;
    }
    return value;
  }

  static void goals(unsigned m, double* result, unsigned size, const double* z, double* gradient, void* data) {
    Exchange& e = *static_cast<Exchange*>(data);
    e.at(z);
    const Shot& shot = e.way_.shot();
    Eigen::Map<Eigen::VectorXd>(result, m) = e.rows_ * shot.error;
    if (!gradient) return;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> G(gradient, m, size);
    G.setZero();
    G.leftCols(shot.J.cols()) = e.rows_ * shot.J;
  }

  static void inequalities(unsigned, double* result, unsigned size, const double* z, double* gradient, void* data) {
    Exchange& e = *static_cast<Exchange*>(data);
    e.at(z);
    const int unknowns = e.way_.unknowns();
    std::size_t row = 0;
    const auto put = [&](double value, const Eigen::VectorXd& g, double for_clearance) {
      result[row] = value;
      if (gradient) {
        std::copy(g.begin(), g.end(), gradient + row * size);
        if (static_cast<int>(size) > unknowns) gradient[row * size + size - 1] = for_clearance;
      }
      ++row;
    };
    Eigen::VectorXd g;
    for (const Instant& i : e.instants_) {
      if (i.kept == Kept::clearance && e.wants_clearance()) {
        const double d = e.way_.distance(i.index, i.node, gradient ? &g : nullptr);
        put(z[size - 1] - d, -g, 1);
        if (e.setup_.clearance) put(*e.setup_.clearance + e.margin_ + kAimed - d, -g, 0);
        continue;
      }
      const double v = e.way_.value(i, gradient ? &g : nullptr);
      put(v + e.margin_ + kAimed, g, 0);
    }
    const Shot& shot = e.way_.shot();
    constexpr double kOfLimit = 0.9999;
    for (int j : e.final_rates_) {
      const double limit = kOfLimit * e.way_.problem().rate_limit[static_cast<std::size_t>(j)];
      for (const double sign : {1.0, -1.0}) {
        g = (sign / limit) * shot.K.row(j).transpose();
        put(sign * shot.rate[static_cast<std::size_t>(j)] / limit - 1, g, 0);
      }
    }
  }

  // Newton's method on the goals alone, and a close look at the way there.
  WayEnd finish(const std::vector<double>& found) {
    WayEnd end;
    std::vector<double> y = found, lower = way_.problem().lower, upper = way_.problem().upper;
    lower.resize(y.size(), -kInfinite), upper.resize(y.size(), kInfinite);
    Shot like = way_.shot();
    for (int i = 0; i < 8; ++i) {
      const Shot& shot = finer_.shoot(y, like, SegmentAccuracy::full);
      if (!shot.valid) break;
      like = shot;
      if (shot.largest_error() <= 1e-2 * kArrived) break;
      const NewtonStep step = least_norm_step(shot.J, shot.error, y, lower, upper, 1e-6);
      for (std::size_t j = 0; j < y.size(); ++j) {
        y[j] = std::clamp(y[j] + step.d[static_cast<Eigen::Index>(j)], lower[j], upper[j]);
      }
    }
    const Shot& shot = finer_.shot();
    if (!shot.valid) {
      end.trouble = "the motion is not resolved", end.violation = kInfinite;
      return end;
    }
    end.shot = std::make_shared<Shot>(shot);
    end.knots = finer_.problem().start.knots;
    end.position = shot.position, end.rate = shot.rate, end.coefficients = shot.coefficients;
    end.violation = -kInfinite;
    for (const Found& f : finer_.scan(0, -kInfinite, &end.figures)) {
      if (f.value <= end.violation) continue;
      end.violation = f.value;
      if (f.value > kTolerated) end.trouble = finer_.describe(f);
    }
    for (std::size_t j = 0; j < way_.problem().rate_limit.size(); ++j) {
      const double share = std::abs(shot.rate[j]) / way_.problem().rate_limit[j];
      if (share > 1 + kTolerated && share - 1 > end.violation && setup_.limits) {
        end.violation = share - 1;
        end.trouble = "final rates exceed their limits";
      }
    }
    if (shot.largest_error() > kArrived) {
      end.trouble = "the end-effectors do not arrive", end.violation = std::max(end.violation, shot.largest_error());
    }
    end.kept = end.trouble.empty();
    end.objective = finer_.objective(nullptr, &end.terms);
    const auto& terms = finer_.problem().objective.terms();
    for (std::size_t i = 0; i < terms.size(); ++i) {
      if (terms[i].kind != Objective::Kind::clearance) continue;
      end.terms[i] = -end.figures.clearance.distance;
      end.objective += terms[i].weight * end.terms[i];
    }
    return end;
  }

  Way& way_;
  Way& finer_;
  const WaySetup& setup_;
  double clearance_weight_ = 0, scale_ = 1;
  double margin_ = 0, least_ = kInfinite;
  bool moved_far_ = true;
  std::vector<Instant> instants_;
  std::vector<int> final_rates_;
  Eigen::MatrixXd rows_;
  Shot last_valid_;
};

}  // namespace

bool asks_of_way(const ReachProblem& problem) {
  return problem.way.keeps_something() || !problem.objective.depends_on_end_alone() ||
         problem.way.knots.value_or(0) > 0;
}

namespace {

bool wants_clearance(const ReachProblem& problem) {
  const auto& terms = problem.objective.terms();
  return std::any_of(terms.begin(), terms.end(),
                     [](const Objective::Term& t) { return t.kind == Objective::Kind::clearance; });
}

}  // namespace

WayEnd keep_way(FloatingBase& base, const ReachProblem& problem, const Shot& solution, int knots, int attempt) {
  constexpr int kFiner = 4;
  const bool at_all_times = problem.way.keeps_something() || wants_clearance(problem);
  const int panels = kWayPanels[at_all_times ? 0 : 1];
  Way way(base, problem, knots, panels), finer(base, problem, knots, kFiner * panels);
  std::vector<double> coefficients(static_cast<std::size_t>(base.joints() * knots), 0.0);
  if (attempt > 0) {
    std::mt19937_64 generator(problem.seed + static_cast<std::uint64_t>(attempt));
    // Not the library's distributions, whose numbers differ from one standard library to the next.
    for (double& c : coefficients) c = std::ldexp(static_cast<double>(generator() >> 11), -53) * 2 - 1;
  }
  WayEnd end = Exchange(way, finer).run(solution, std::move(coefficients));
  end.rhs_evaluations = way.rhs_evaluations() + finer.rhs_evaluations();
  return end;
}

}  // namespace grapnel
