#include "grapnel/plan/path_restoration.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/plan/constrained_segment.hpp"
#include "grapnel/plan/least_distance.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

class Restoration {
 public:
  explicit Restoration(ConstrainedSegment& segment) : segment_(segment), n_(segment.joints()) {
    const std::vector<double>& limit = segment.problem().rate_limit;
    for (int j = 0; j < static_cast<int>(limit.size()) && segment.problem().constraints.limits; ++j) {
      if (std::isfinite(limit[static_cast<std::size_t>(j)])) limited_.push_back(j);
    }
  }

  // Iterates from y until no violation exceeds `enough`, or no step helps.
  ConstrainedSolution run(std::vector<double> y, const ShootingIterate& like, double enough) {
    constexpr int kMaxRounds = 60, kPatience = 6;  // maximum number of steps, and of slow steps
    constexpr double kLess = 0.93;                 // relative decrease below which a step is slow
    constexpr double kSame = 0.97;                 // predicted decrease below which the search ends
    constexpr double kSwing = 0.02;                // maximum increase by a step
    constexpr double kShortest = 1e-4;             // minimum step, relative to the radius
    constexpr double kArriving = 0.02;             // error of the goals below which predictions are used
    ConstrainedSolution end;
    if (!segment_.shoot(y, like, SegmentAccuracy::search).valid) {
      end.failure = "the motion is not resolved", end.violation = kInfinite;
      return end;
    }
    double now = evaluate(end);
    double smallest = now, radius = kFarthest;
    for (int round = 0, stuck = 0; round < kMaxRounds && stuck < kPatience && now > enough; ++round) {
      const ShootingIterate here = segment_.iterate();
      const Step step = step_within(radius, y);
      if (!(step.farthest > 0) || radius < kShortest) break;
      const bool rows_decide = violated_ > enough && here.largest_error() < kArriving;
      if (rows_decide && radius >= kFarthest && step.foreseen > kSame * violated_) break;
      std::vector<double> next = y;
      for (std::size_t i = 0; i < y.size(); ++i) next[i] += step.d[static_cast<Eigen::Index>(i)];
      clamp_to_bounds(next);
      const bool valid = segment_.shoot(next, here, SegmentAccuracy::search).valid;
      const double then = valid ? evaluate(end) : kInfinite;
      if (then < kLess * smallest)
        stuck = 0, smallest = then;
      else
        ++stuck;
      if (then > std::max(1.1 * now, now + kSwing)) {
        if (!segment_.shoot(y, here, SegmentAccuracy::search).valid) break;
        evaluate(end);
        radius = 0.3 * step.farthest;
        continue;
      }
      radius = std::min(kFarthest, std::max(radius, 2 * step.farthest));
      y = std::move(next), now = then;
    }
    return end;
  }

 private:
  static constexpr double kInfinite = std::numeric_limits<double>::infinity();
  static constexpr double kNear = 0.2;      // instants with a smaller margin are also constrained
  static constexpr double kFarthest = 0.5;  // maximum change of an unknown per step [rad or m]

  // Largest violation of the last iterate; updates `best` if it is smaller. Adds the instants to the constraints.
  double evaluate(ConstrainedSolution& best) {
    if (segment_.nodes() != nodes_) instants_.clear(), nodes_ = segment_.nodes();
    std::erase_if(instants_, [&](const PathConstraintCheck::Instant& i) { return segment_.may_touch(i); });
    ConstrainedSolution end;
    end.violation = -kInfinite;
    std::map<PathConstraintCheck::Kind, PathConstraintCheck::Found> worst;
    for (const PathConstraintCheck::Found& f : segment_.scan(kNear, -kInfinite, nullptr)) {
      if (std::find(instants_.begin(), instants_.end(), f.at) == instants_.end()) instants_.push_back(f.at);
      const auto [known, is_first] = worst.try_emplace(f.at.kind, f);
      if (f.value > known->second.value) known->second = f;
      end.violation = std::max(end.violation, f.value);
    }
    // All pairs of bodies with a comparable violation are reported.
    constexpr double kAsMuch = 0.5;
    for (const auto& [kind, f] : worst) {
      if (f.value <= std::max(kTolerated, kAsMuch * end.violation)) continue;
      end.obstructed = end.obstructed || kind == PathConstraintCheck::Kind::clearance;
      end.failure += (end.failure.empty() ? "" : " and ") + segment_.describe(f);
    }
    const ShootingIterate& iterate = segment_.iterate();
    for (int j : limited_) {
      const double share = std::abs(iterate.rate[static_cast<std::size_t>(j)]) / limit(j) - 1;
      if (share <= end.violation) continue;
      end.violation = share;
      if (share > kTolerated) end.failure = "final rates exceed their limits";
    }
    violated_ = end.violation;
    const double missed = iterate.largest_error();
    constexpr double kNearGoals = 1e-3;  // remaining errors are left to Newton's method
    if (missed > std::max(end.violation, kNearGoals))
      end.violation = missed, end.failure = "the end-effectors do not arrive";
    if (!best.iterate || end.violation < best.violation) {
      end.iterate = std::make_shared<ShootingIterate>(iterate);
      end.knots = segment_.problem().start.knots;
      end.position = iterate.position, end.rate = iterate.rate, end.coefficients = iterate.coefficients;
      best = end;
    }
    return end.violation;
  }

  double limit(int joint) const { return segment_.problem().rate_limit[static_cast<std::size_t>(joint)]; }

  void clamp_to_bounds(std::vector<double>& y) const {
    for (std::size_t j = 0; j < static_cast<std::size_t>(n_); ++j)
      y[j] = std::clamp(y[j], segment_.problem().lower[j], segment_.problem().upper[j]);
  }

  void leave_out_held(Eigen::MatrixXd& rows) const {
    for (int i = 0; i < static_cast<int>(rows.cols()); ++i) {
      if (segment_.is_held(i % n_)) rows.col(i).setZero();
    }
  }

  struct Step {
    Eigen::VectorXd d;
    double farthest = 0, foreseen = 0;
  };

  // Present point => minimum-norm step (1) with the least relaxation of the rows for which it is within the radius.
  Step step_within(double radius, const std::vector<double>& y) {
    const ShootingIterate& iterate = segment_.iterate();
    const int size = segment_.unknowns();
    // d = d0 + P w: d0 the minimum-norm solution of e + J d0 = 0, P the projection onto the null space of J.
    Eigen::MatrixXd J = iterate.J;
    leave_out_held(J);
    Eigen::VectorXd d0 = Eigen::VectorXd::Zero(size);
    Eigen::MatrixXd Q(size, 0);
    if (J.rows() > 0) {
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(Eigen::MatrixXd(J.transpose()));
      qr.setThreshold(1e-6);
      const Eigen::Index rank = qr.rank();
      Q = qr.householderQ() * Eigen::MatrixXd::Identity(size, rank);
      // J^T Pi = Q R: J d = -e is R^T Q^T d = -Pi^T e in the rows of full rank.
      const Eigen::VectorXd e = (qr.colsPermutation().transpose() * iterate.error).head(rank);
      const Eigen::MatrixXd R = qr.matrixR().topLeftCorner(rank, rank);
      d0 = -(Q * R.triangularView<Eigen::Upper>().transpose().solve(e));
      const double far = d0.lpNorm<Eigen::Infinity>();
      if (far > 0.5 * radius) d0 *= 0.5 * radius / far;
    }
    // Rows A d <= b.
    Eigen::MatrixXd A(0, size);
    std::vector<double> b;
    const auto put = [&](const Eigen::VectorXd& g, double value) {
      if (A.rows() <= static_cast<Eigen::Index>(b.size())) A.conservativeResize(2 * A.rows() + 32, size);
      A.row(static_cast<Eigen::Index>(b.size())) = g.transpose();
      b.push_back(-value - kAimed);
    };
    Eigen::VectorXd g;
    for (const PathConstraintCheck::Instant& i : instants_) {
      const double value = segment_.value(i, &g);
      put(g, value);
    }
    for (int j : limited_) {
      for (const double sign : {1.0, -1.0}) {
        const double value = sign * iterate.rate[static_cast<std::size_t>(j)] / limit(j) - 1;
        if (value > -kNear) put((sign / limit(j)) * iterate.K.row(j).transpose(), value);
      }
    }
    for (int j = 0; j < n_; ++j) {
      const auto i = static_cast<std::size_t>(j);
      if (y[i] + radius > segment_.problem().upper[i])
        put(Eigen::VectorXd::Unit(size, j), y[i] - segment_.problem().upper[i]);
      if (y[i] - radius < segment_.problem().lower[i])
        put(-Eigen::VectorXd::Unit(size, j), segment_.problem().lower[i] - y[i]);
    }
    const auto count = static_cast<Eigen::Index>(b.size());
    A.conservativeResize(count, size);
    leave_out_held(A);
    const Eigen::VectorXd rest = as_vector(b) - A * d0;
    Eigen::MatrixXd AP = A - (A * Q) * Q.transpose();
    // Smaller values are rounding errors in directions that the goals determine.
    constexpr double kRounding = 1e-12;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (AP.row(i).norm() < kRounding * A.row(i).norm()) AP.row(i).setZero();
    }
    NearestBelow nearest(AP, rest, Eigen::VectorXd::Zero(size));
    const auto with = [&](double relaxation) {
      Step step;
      step.d = d0 + nearest.with(relaxation).x;
      step.farthest = step.d.lpNorm<Eigen::Infinity>();
      return step;
    };
    // Minimum relaxation of the rows for which the step is within the radius, starting from that of the last step.
    constexpr double kMore = 30, kMaxRelaxation = 1, kOfRadius = 0.5;
    Step step = with(relaxation_);
    double too_little = 0;  // a relaxation with too long steps
    while (step.farthest > radius && relaxation_ < kMaxRelaxation)
      too_little = relaxation_, relaxation_ *= kMore, step = with(relaxation_);
    while (step.farthest < kOfRadius * radius && relaxation_ > kRelaxation) {
      const double less =
          std::max(kRelaxation, too_little > 0 ? std::sqrt(too_little * relaxation_) : relaxation_ / kMore);
      if (relaxation_ < 2 * less) break;
      Step other = with(less);
      if (other.farthest > radius)
        too_little = less;
      else
        relaxation_ = less, step = std::move(other);
    }
    if (step.farthest > radius) step.d *= radius / step.farthest, step.farthest = radius;
    step.foreseen = count ? (A * step.d - as_vector(b)).maxCoeff() : 0;
    return step;
  }

  ConstrainedSegment& segment_;
  int n_;
  std::vector<int> limited_;  // joints with limits of their final rates
  std::vector<PathConstraintCheck::Instant> instants_;
  int nodes_ = 0;                    // number of nodes that defines the numbering
  double violated_ = 0;              // in the last iterate, without the goals' errors
  double relaxation_ = kRelaxation;  // of the last step
};

}  // namespace

// Solution of the goals => nearest path that satisfies all path constraints, by the steps (6.20a) on four panels;
// `enough`: violation at which the search ends.
ConstrainedSolution nearest_feasible_path(FloatingBase& base, const ReachProblem& problem,
                                          const ShootingIterate& solution, int knots, int attempt, double enough) {
  constexpr int kPanels = 4;
  ConstrainedSegment segment(base, problem, knots, kPanels);
  std::vector<double> y = solution.position;
  const std::vector<double> c = coefficients_to_begin_with(base, problem, solution, knots, attempt);
  y.insert(y.end(), c.begin(), c.end());
  ShootingIterate like = solution;
  like.K.resize(0, 0);
  like.coefficients = c;
  ConstrainedSolution end = Restoration(segment).run(std::move(y), like, enough);
  end.rhs_evaluations = segment.rhs_evaluations();
  return end;
}

}  // namespace grapnel
