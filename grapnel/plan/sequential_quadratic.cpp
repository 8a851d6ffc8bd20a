#include "grapnel/plan/sequential_quadratic.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <set>

#include "grapnel/plan/least_distance.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Solution of (2).
struct Step {
  Eigen::VectorXd d;
  Eigen::VectorXd of_goals, of_rows;  // multipliers of e and the g_i
  double left = 0;                    // relaxation of the rows
  bool valid = false;
};

// (2) for one B and the rows of one iterate, for several values of e and g_i.
class QuadraticProgram {
 public:
  // The Hessian is B plus `more` times the identity.
  QuadraticProgram(const Eigen::MatrixXd& B, double more, const Linearized& at)
      : L_(B + more * Eigen::MatrixXd::Identity(B.rows(), B.cols())) {
    if (L_.info() != Eigen::Success) return;
    const Eigen::Index size = B.rows();
    c_ = -lower_solution(L_, at.slope);
    A_ = lower_solution(L_, at.A.transpose()).transpose();
    if (at.J.rows() > 0) {
      constexpr double kIndependent = 1e-6;  // of the largest
      qr_.compute(lower_solution(L_, at.J.transpose()));
      qr_.setThreshold(kIndependent);
      rank_ = qr_.rank();
      R_ = qr_.matrixR().topLeftCorner(rank_, rank_);
      Q_ = qr_.householderQ() * Eigen::MatrixXd::Identity(size, rank_);
    } else {
      Q_.resize(size, 0);
    }
    free_ = A_ - (A_ * Q_) * Q_.transpose();
    // Smaller values are rounding errors in directions that the goals determine.
    constexpr double kRounding = 1e-12;
    for (Eigen::Index i = 0; i < A_.rows(); ++i) {
      if (free_.row(i).norm() < kRounding * A_.row(i).norm()) free_.row(i).setZero();
    }
    valid_ = c_.allFinite() && A_.allFinite();
  }

  // Starts with the active rows of the last step.
  Step solve(const Eigen::VectorXd& error, const Eigen::VectorXd& violated, std::vector<Eigen::Index> active) const {
    Step step;
    if (!valid_) return step;
    // x = x0 + w, x0 of least norm with e + J L^-T x0 = 0: J L^-T = Pi R^T Q^T.
    Eigen::VectorXd x0 = Eigen::VectorXd::Zero(c_.size());
    if (rank_ > 0) {
      const Eigen::VectorXd e = (qr_.colsPermutation().transpose() * error).head(rank_);
      x0 = -(Q_ * R_.triangularView<Eigen::Upper>().transpose().solve(e));
    }
    constexpr double kSmallRelaxation = 1e-12;
    const Eigen::VectorXd w0 = c_ - Q_ * (Q_.transpose() * c_);
    NearestBelow below(free_, -violated - A_ * x0, w0);
    below.begin_with(std::move(active));
    const LeastDistance nearest = below.with(kSmallRelaxation);
    const Eigen::VectorXd x = x0 + nearest.x;
    step.d = upper_solution(L_, x);
    step.of_rows = nearest.multipliers;
    step.left = nearest.left;
    // x - c + A^T l + (J L^-T)^T lambda = 0.
    step.of_goals = Eigen::VectorXd::Zero(error.size());
    if (rank_ > 0) {
      const Eigen::VectorXd rest = c_ - x - A_.transpose() * nearest.multipliers;
      step.of_goals.head(rank_) = R_.triangularView<Eigen::Upper>().solve(Q_.transpose() * rest);
      step.of_goals = (qr_.colsPermutation() * step.of_goals).eval();
    }
    step.valid = step.d.allFinite() && step.of_goals.allFinite() && step.of_rows.allFinite();
    return step;
  }

 private:
  Cholesky L_;
  Eigen::VectorXd c_;
  Eigen::MatrixXd A_, free_, Q_, R_;  // rows in x; Q: the rows of e span it
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr_;
  Eigen::Index rank_ = 0;
  bool valid_ = false;
};

// Detects stagnation: each step leaves most of the predicted violation within the radius, and the violation decreases
// only slightly.
class Patience {
 public:
  void note(double violated, double foreseen) {
    constexpr double kLess = 0.9, kLarge = 0.3;
    if (violated < kLess * smallest_)
      smallest_ = violated, steps_ = 0;
    else if (foreseen > kLarge * violated)
      ++steps_;
  }
  bool is_over() const {
    constexpr int kFew = 8;
    return steps_ >= kFew;
  }

 private:
  double smallest_ = std::numeric_limits<double>::infinity();
  int steps_ = 0;
};

class Minimization {
 public:
  Minimization(NonlinearProgram& program, const std::vector<int>& free, const QuadraticSearch& search,
               std::vector<double>& y, Eigen::MatrixXd& B)
      : program_(program), free_(free), search_(search), y_(y), B_(B) {}

  // Main loop: takes steps until the step limit, convergence of the objective, or stagnation => number of steps.
  int run() {
    at_ = linearized();
    value_ = program_.value(), violation_ = std::max(0.0, program_.violation());
    if (B_.rows() != size()) begin_anew();
    radius_ = search_.farthest;
    int steps = 0;
    patience_ = {};
    std::deque<double> values;  // objective values of the last few feasible steps
    for (; steps < search_.max_steps && !patience_.is_over(); ++steps) {
      if (violation_ > search_.violated)
        values.clear();
      else
        values.push_back(value_);
      if (values.size() > kFew) {
        if (values.front() - values.back() <= search_.settled * std::abs(value_)) break;
        values.pop_front();
      }
      const Eigen::VectorXd from = here();
      const Step step = advance();
      if (!step.valid) {
        // The Hessian estimate from other points may be misleading here.
        if (learned_ == 0 || is_there_ || is_lost_) break;
        begin_anew();
        radius_ = search_.farthest, damping_ = 0;
        continue;
      }
      Linearized next = linearized();
      learn(here() - from, next, step);
      at_ = std::move(next);
    }
    return steps;
  }

 private:
  static constexpr std::size_t kFew = 3;
  static constexpr double kSlightly = 1.2;     // tolerance of the step length relative to the radius
  static constexpr double kShorterThan = 0.9;  // relative to the previous step

  Eigen::Index size() const { return static_cast<Eigen::Index>(free_.size()); }
  bool has_level() const { return at_.slope.size() > size(); }
  Eigen::VectorXd here() const { return as_vector(y_)(free_); }

  Linearized linearized() {
    Linearized at = program_.linearized();
    std::vector<int> columns = free_;
    const auto unknowns = static_cast<Eigen::Index>(y_.size());
    if (at.slope.size() > unknowns) columns.push_back(static_cast<int>(unknowns));
    at.slope = at.slope(columns).eval();
    at.J = at.J(Eigen::all, columns).eval();
    at.A = at.A(Eigen::all, columns).eval();
    return at;
  }

  void begin_anew() {
    B_ = program_.curvature()(free_, free_);
    learned_ = 0;
  }

  // f is linear in z; this curvature limits its change to one metre.
  Eigen::MatrixXd with_level() const {
    if (!has_level()) return B_;
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(size() + 1, size() + 1);
    B.topLeftCorner(size(), size()) = B_;
    B(size(), size()) = -at_.slope[size()];
    return B;
  }

  // Sets mu of (3): at least the sum of the multipliers, as at the solution. It is large enough that a step with these
  // changes of f and of the violation decreases (3).
  void weigh(const Step& step, double added, double taken_off) {
    constexpr double kOfIt = 0.5, kRounding = 1e-10;
    double needed = taken_off > kRounding ? std::max(0.0, added) / (kOfIt * taken_off) : 0;
    if (states_anything(step)) needed = std::max(needed, weight_of(step));
    mu_ = std::max(needed, 0.5 * (mu_ + needed));
  }

  static double weight_of(const Step& step) { return step.of_rows.sum() + step.of_goals.lpNorm<1>(); }

  // Whether the multipliers are meaningful: not for infeasible or nearly dependent rows.
  bool states_anything(const Step& step) const {
    constexpr double kRelaxed = 1e-6, kMaxWeight = 1e6;
    return step.left <= kRelaxed &&
           weight_of(step) <= kMaxWeight * (std::abs(value_) + at_.slope.lpNorm<Eigen::Infinity>());
  }

  double merit() const { return value_ + mu_ * violation_; }

  // Moves to y + d if (3) is at most `max_merit` there.
  bool step_to(const Eigen::VectorXd& d, double max_merit) {
    std::vector<double> next = y_;
    for (std::size_t i = 0; i < free_.size(); ++i)
      next[static_cast<std::size_t>(free_[i])] += d[static_cast<Eigen::Index>(i)];
    can_evaluate_ = program_.move_to(next);
    if (!can_evaluate_) return false;
    const double value = program_.value(), violation = std::max(0.0, program_.violation());
    if (!(value + mu_ * violation <= max_merit)) return false;
    y_ = std::move(next), value_ = value, violation_ = violation;
    return true;
  }

  // A step that decreases (3) sufficiently, within the radius of validity of (2); invalid if there is none.
  Step advance() {
    constexpr double kEnough = 1e-4, kPoor = 0.25, kWell = 0.4, kShorter = 0.35, kLittle = 1e-6, kRounding = 1e-12;
    constexpr int kMaxAdditions = 3, kMaxDamped = 3;
    const Eigen::MatrixXd B = with_level();
    QuadraticProgram quadratic(B, damping_, at_);
    is_there_ = false;
    // Steps this short do not decrease the violation.
    constexpr double kTooShort = 1e-4;
    const double shortest = violation_ > kTooShort ? kTooShort : search_.nothing;
    bool is_noted = false;
    for (int additions = 0, damped = 0; radius_ > shortest;) {
      Step step = quadratic.solve(at_.error, at_.violated, active());
      if (!step.valid) break;
      note_active(step);
      double farthest = farthest_of(step.d);
      is_there_ = farthest <= search_.nothing;
      if (is_there_ && damping_ == 0) break;
      // A step may be short because of damping.
      if (is_there_) {
        is_there_ = false;
        damping_ = 0;
        quadratic = QuadraticProgram(B, damping_, at_);
        continue;
      }
      // The objective's part is damped to the radius; the part of rows and goals is scaled, since damping does not
      // shorten it.
      if (farthest > kSlightly * radius_ && damped < kMaxDamped) {
        const double bend = step.d.dot(B * step.d) / step.d.squaredNorm() + damping_;
        const double more = (farthest / radius_ - 1) * bend;
        QuadraticProgram other(B, damping_ + more, at_);
        const Step shorter = other.solve(at_.error, at_.violated, active());
        if (shorter.valid && farthest_of(shorter.d) < kShorterThan * farthest) {
          ++damped;
          damping_ += more;
          quadratic = std::move(other);
          continue;
        }
        damped = kMaxDamped;
      }
      const double share = std::min(1.0, radius_ / farthest);
      const Eigen::VectorXd d = share * step.d;
      farthest *= share;
      const double added = at_.slope.dot(d) + 0.5 * d.dot(B * d);
      const double taken_off = share * (violation_ - std::min(violation_, std::max(step.left, at_.out_of_reach)));
      if (!is_noted) patience_.note(violation_, violation_ - taken_off);
      is_noted = true;
      weigh(step, added, taken_off);
      const double from = merit(), foreseen = mu_ * taken_off - added;
      const double max_merit = from - kEnough * std::max(0.0, foreseen) + kRounding * (std::abs(value_) + mu_);
      if (step_to(d, max_merit) || (share == 1 && can_evaluate_ && step_to(corrected(quadratic, step), max_merit))) {
        const double part = foreseen > 0 ? (from - merit()) / foreseen : 0;
        if (part > kWell) {
          radius_ = std::min(search_.farthest, std::max(radius_, 2 * farthest));
          damping_ *= kPoor;
          if (damping_ < kLittle * B.trace() / static_cast<double>(B.rows())) damping_ = 0;
        }
        if (part < kPoor) radius_ = 0.5 * farthest;
        return step;
      }
      damped = 0;
      // Adds newly found constraints to (2); the step may then be as long in another direction.
      if (program_.has_more() && additions++ < kMaxAdditions) {
        if (!come_back()) return {};
        at_ = linearized();
        quadratic = QuadraticProgram(B, damping_, at_);
        if (additions == 1) continue;
      }
      radius_ = kShorter * farthest;
    }
    come_back();
    return {};
  }

  // Returns to y, where more constraints may be known by now.
  bool come_back() {
    is_lost_ = !program_.move_to(y_);
    if (is_lost_) return false;
    value_ = program_.value(), violation_ = std::max(0.0, program_.violation());
    return true;
  }

  // The active rows of the last step, among those at the present iterate.
  std::vector<Eigen::Index> active() const {
    std::vector<Eigen::Index> rows;
    for (std::size_t i = 0; i < at_.rows.size(); ++i) {
      if (active_.contains(at_.rows[i])) rows.push_back(static_cast<Eigen::Index>(i));
    }
    return rows;
  }

  void note_active(const Step& step) {
    active_.clear();
    for (std::size_t i = 0; i < at_.rows.size(); ++i) {
      if (step.of_rows[static_cast<Eigen::Index>(i)] > 0) active_.insert(at_.rows[i]);
    }
  }

  double farthest_of(const Eigen::VectorXd& d) const { return d.head(size()).lpNorm<Eigen::Infinity>(); }

  // Second-order correction: the step for e and the g_i at the trial point, minus their linear parts.
  Eigen::VectorXd corrected(const QuadraticProgram& quadratic, const Step& step) {
    Eigen::VectorXd error, violated;
    program_.evaluate(at_.rows, error, violated);
    const Step other =
        quadratic.solve(error - at_.J * step.d, violated - at_.A.leftCols(size()) * step.d.head(size()), active());
    constexpr double kSimilar = 0.5;  // otherwise the correction is rejected
    const bool is_one = other.valid && (other.d - step.d).norm() <= kSimilar * step.d.norm();
    return is_one ? other.d : Eigen::VectorXd(0.5 * step.d);
  }

  // BFGS update for a step s and the change of the Lagrangian's gradient, damped to remain positive definite.
  void learn(const Eigen::VectorXd& s, const Linearized& next, const Step& step) {
    constexpr double kDamped = 0.2;
    if (!states_anything(step)) return;
    Eigen::VectorXd q = (next.slope - at_.slope).head(size());
    q += (next.J - at_.J).leftCols(size()).transpose() * step.of_goals;
    std::map<long, Eigen::Index> places;
    for (std::size_t i = 0; i < next.rows.size(); ++i) places[next.rows[i]] = static_cast<Eigen::Index>(i);
    for (std::size_t i = 0; i < at_.rows.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const auto other = places.find(at_.rows[i]);
      if (step.of_rows[row] == 0 || other == places.end()) continue;
      q += step.of_rows[row] * (next.A.row(other->second) - at_.A.row(row)).head(size()).transpose();
    }
    Eigen::VectorXd Bs = B_ * s;
    double sBs = s.dot(Bs), sq = s.dot(q);
    if (!(sBs > 0) || !std::isfinite(sq)) return;
    if (sq < kDamped * sBs) {
      const double of_new = (1 - kDamped) * sBs / (sBs - sq);
      q = of_new * q + (1 - of_new) * Bs;
      sq = s.dot(q);
    }
    B_ += q * (q / sq).transpose() - Bs * (Bs / sBs).transpose();
    ++learned_;
  }

  NonlinearProgram& program_;
  const std::vector<int>& free_;
  const QuadraticSearch& search_;
  std::vector<double>& y_;
  Eigen::MatrixXd& B_;
  Linearized at_;
  double value_ = 0, violation_ = 0, mu_ = 0;
  double radius_ = 0, damping_ = 0;
  Patience patience_;
  std::set<long> active_;
  int learned_ = 1;            // number of updates since the last reset
  bool can_evaluate_ = false;  // whether the last point could be evaluated
  bool is_there_ = false;      // converged: (2) gives no further step
  bool is_lost_ = false;       // y could not be evaluated when the program returned to it
};

}  // namespace

int minimize(NonlinearProgram& program, const std::vector<int>& free, const QuadraticSearch& search,
             std::vector<double>& y, Eigen::MatrixXd& B) {
  if (free.empty()) return 0;
  return Minimization(program, free, search, y, B).run();
}

}  // namespace grapnel
