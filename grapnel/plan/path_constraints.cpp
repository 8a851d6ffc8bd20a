#include "grapnel/plan/path_constraints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "grapnel/plan/constrained_segment.hpp"
#include "grapnel/plan/sequential_quadratic.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr int kPanels[] = {8, 2};  // minimum number of panels of 16 nodes

using Kind = PathConstraintCheck::Kind;
using Instant = PathConstraintCheck::Instant;
using Found = PathConstraintCheck::Found;

// The exchange method for one start: nearly violated constraints at the nodes are constraints of the program.
class Exchange : private NonlinearProgram {
 public:
  Exchange(ConstrainedSegment& segment, ConstrainedSegment& finer, int steps)
      : segment_(segment), finer_(finer), setup_(segment.problem().constraints), n_(segment.joints()), steps_(steps) {
    for (const Objective::Term& t : segment.problem().objective.terms()) {
      if (t.kind == Objective::Kind::clearance) clearance_weight_ = t.weight;
    }
    const std::vector<double>& limit = segment.problem().rate_limit;
    for (int j = 0; j < static_cast<int>(limit.size()); ++j) {
      if (std::isfinite(limit[static_cast<std::size_t>(j)])) limited_.push_back(j);
    }
    for (int i = 0; i < segment.unknowns(); ++i) {
      if (!is_held(i)) free_.push_back(i);
    }
  }

  // Solution and coefficients => feasible local minimum (1): sequential quadratic programming at the nodes, then a
  // check between them with an increased margin if necessary.
  ConstrainedSolution run(const ShootingIterate& solution, std::vector<double> coefficients, bool improves) {
    std::vector<double> y = solution.position;
    y.insert(y.end(), coefficients.begin(), coefficients.end());
    y.resize(static_cast<std::size_t>(segment_.unknowns()));
    last_valid_ = solution;
    last_valid_.K.resize(0, 0);
    last_valid_.coefficients.assign(y.begin() + n_, y.end());
    ConstrainedSolution end;
    if (!move_to(y)) {
      end.failure = "the motion is not resolved", end.violation = kInfinite;
      return end;
    }
    if (!improves) return finish(y);
    constexpr int kFiner = 4;
    bool may_improve = false;
    for (int i = 0;; ++i) {
      settled_ = is_best_as_it_is() && violation() <= 2 * kAimed;
      if (!settled_) {
        QuadraticSearch search;
        search.max_steps = steps_;
        if (wants_clearance()) search.settled = kSettledDistance;
        may_improve = minimize(*this, free_, search, y, B_) >= steps_;
        settled_ = violation() <= 2 * kAimed;
      }
      end = finish(y);
      end.may_improve = may_improve;
      if (end.feasible || i == kFiner || !(end.violation < 1e-2)) break;
      // The violation between the nodes exceeds that at the nodes by this amount.
      margin_ += 2 * end.violation;
      if (!move_to(y)) break;
    }
    return end;
  }

  // Whether the constraints were finally satisfied at the nodes.
  bool settled() const { return settled_; }

 private:
  // Margins below which instants are added to the program, and below which its instants are linearized [rad, m or 1].
  static constexpr double kBand = 0.05, kNear = 0.2;
  static constexpr double kSettledDistance = 1e-4;  // minimum decrease of an objective with clearance over a few steps
  static constexpr double kFar = 5;                 // longer steps are not useful [rad or m]
  static constexpr double kMaxCoefficient = 20;     // maximum spline coefficient [rad or m]
  static constexpr double kOfLimit = 0.9999;        // of final rate limits: margin for refinement

  bool wants_clearance() const { return clearance_weight_ > 0; }
  bool is_held(int unknown) const {
    const auto j = static_cast<std::size_t>(unknown);
    const ReachProblem& p = segment_.problem();
    return unknown < n_ ? p.lower[j] == p.upper[j] : segment_.is_held(unknown % n_);
  }

  // Without splines the search has already minimized objectives that depend on the end alone.
  bool is_best_as_it_is() const {
    return !wants_clearance() && segment_.problem().objective.depends_on_end_alone() &&
           segment_.problem().start.knots == 0;
  }

  // --- Interface of the nonlinear program

  bool move_to(const std::vector<double>& y) override {
    is_scanned_ = false;
    if (!segment_.shoot(y, last_valid_, SegmentAccuracy::search).valid) return false;
    last_valid_ = segment_.iterate();
    return true;
  }

  double value() override {
    scan();
    return segment_.objective(nullptr) - (wants_clearance() ? clearance_weight_ * known_min_distance() : 0);
  }

  // Last iterate => largest violation over nodes, goal errors, bounds of the unknowns and final rate limits; infinite
  // if its evaluation failed.
  double violation() override {
    if (!segment_.iterate().valid) return kInfinite;
    scan();
    double result = std::max(worst_ + margin_ + kAimed, segment_.iterate().largest_error());
    for (int i : free_) {
      const auto j = static_cast<std::size_t>(i);
      if (i >= n_) {
        result = std::max(
            result, std::abs(segment_.iterate().coefficients[j - static_cast<std::size_t>(n_)]) - kMaxCoefficient);
        continue;
      }
      const double at = segment_.iterate().position[j];
      result = std::max({result, at - segment_.problem().upper[j], segment_.problem().lower[j] - at});
    }
    for (int j : limited_)
      result = std::max(result, std::abs(segment_.iterate().rate[static_cast<std::size_t>(j)]) / limit(j) - 1);
    return result;
  }

  // No distance is known if all close pairs may touch.
  double known_min_distance() const { return std::isfinite(min_distance_) ? min_distance_ : 0; }

  // Largest violation of the last iterate. Instants with nearly violated constraints are added to the program.
  void scan() {
    if (is_scanned_) return;
    is_scanned_ = true;
    if (segment_.nodes() != nodes_) {
      first_ += static_cast<long>(instants_.size());
      instants_.clear(), nodes_ = segment_.nodes();
    }
    const double band = kBand + margin_, min_clearance = setup_.clearance.value_or(-kInfinite);
    const auto scan_pairs = [&](double wanted) {
      PathFigures figures;
      std::vector<Found> found = segment_.scan(band, wanted, wants_clearance() ? &figures : nullptr);
      min_distance_ = figures.clearance.distance;
      const double required = std::max(0.0, wanted - band - min_clearance);
      for (Found& f : found) f.value -= f.at.kind == Kind::clearance ? required : 0;
      return found;
    };
    // The minimum distance has barely changed; otherwise close pairs are searched for again.
    double wanted = -kInfinite;
    if (wants_clearance()) wanted = std::isfinite(min_distance_) ? min_distance_ + kBand : 0;
    std::vector<Found> found = scan_pairs(wanted);
    if (wants_clearance() && min_distance_ + 0.5 * kBand > wanted) found = scan_pairs(min_distance_ + kBand);
    worst_ = -kInfinite;
    for (const Found& f : found) {
      worst_ = std::max(worst_, f.value);
      if (std::find(instants_.begin(), instants_.end(), f.at) == instants_.end()) instants_.push_back(f.at);
    }
  }

  double limit(int joint) const { return kOfLimit * segment_.problem().rate_limit[static_cast<std::size_t>(joint)]; }

  // Numbering of the program's rows: instants, each also with a row for the minimum distance; limits of unknowns and of
  // final rates.
  enum class Of { instant, level, upper, lower, rate, rate_back };
  static constexpr long kKinds = 6;
  static long number(Of of, long i) { return i * kKinds + static_cast<long>(of); }

  // Value of a row, and its gradient unless null. Empty if an end-effector may touch its target at that instant.
  std::optional<double> row(long number, Eigen::VectorXd* gradient) {
    const long i = number / kKinds;
    const auto of = static_cast<Of>(number % kKinds);
    const ShootingIterate& iterate = segment_.iterate();
    if (of == Of::instant || of == Of::level) {
      if (i < first_) return std::nullopt;
      const Instant& at = instants_[static_cast<std::size_t>(i - first_)];
      if (segment_.may_touch(at)) return std::nullopt;
      if (at.kind != Kind::clearance) return segment_.value(at, gradient) + margin_ + kAimed;
      const double d = segment_.distance(at.index, at.node, gradient);
      if (gradient) *gradient *= -1;
      return (of == Of::level ? level_ : *setup_.clearance + margin_ + kAimed) - d;
    }
    const double sign = of == Of::upper || of == Of::rate ? 1 : -1;
    const auto j = static_cast<std::size_t>(i);
    if (of == Of::rate || of == Of::rate_back) {
      if (gradient) *gradient = (sign / limit(static_cast<int>(i))) * iterate.K.row(i).transpose();
      return sign * iterate.rate[j] / limit(static_cast<int>(i)) - 1;
    }
    if (gradient) *gradient = sign * Eigen::VectorXd::Unit(segment_.unknowns(), i);
    if (i >= n_) return sign * iterate.coefficients[j - static_cast<std::size_t>(n_)] - kMaxCoefficient;
    return sign > 0 ? iterate.position[j] - segment_.problem().upper[j]
                    : segment_.problem().lower[j] - iterate.position[j];
  }

  bool has_more() override { return first_ + static_cast<long>(instants_.size()) > known_ || first_ != known_first_; }

  // Present point => gradients of the objective, the goals' errors and the nearly violated constraints.
  Linearized linearized() override {
    scan();
    level_ = known_min_distance();
    known_ = first_ + static_cast<long>(instants_.size()), known_first_ = first_;
    const ShootingIterate& iterate = segment_.iterate();
    const Eigen::Index unknowns = segment_.unknowns(), size = unknowns + (wants_clearance() ? 1 : 0);
    Linearized at;
    at.error = iterate.error;
    at.J = Eigen::MatrixXd::Zero(iterate.J.rows(), size);
    at.J.leftCols(unknowns) = iterate.J;
    Eigen::VectorXd g;
    segment_.objective(&g);
    at.slope.resize(size);
    at.slope.head(unknowns) = g;
    if (wants_clearance()) at.slope[unknowns] = -clearance_weight_;
    std::vector<double> values;
    std::vector<Eigen::VectorXd> gradients;
    const auto put = [&](Of of, long i, double near) {
      const std::optional<double> now = row(number(of, i), nullptr);
      if (!now || !(*now > -near)) return;
      row(number(of, i), &g);
      // No step decreases this row, for example for bodies that cross without a separating motion.
      if (*now > kFar * g.lpNorm<1>()) {
        at.out_of_reach = std::max(at.out_of_reach, *now);
        return;
      }
      at.rows.push_back(number(of, i)), values.push_back(*now), gradients.push_back(g);
    };
    for (std::size_t i = 0; i < instants_.size(); ++i) {
      const long k = first_ + static_cast<long>(i);
      const bool is_distance = instants_[i].kind == Kind::clearance;
      if (!is_distance || setup_.clearance) put(Of::instant, k, kNear);
      if (is_distance && wants_clearance()) put(Of::level, k, kNear);
    }
    for (int j : limited_) put(Of::rate, j, kNear), put(Of::rate_back, j, kNear);
    for (int i : free_) put(Of::upper, i, 1), put(Of::lower, i, 1);
    at.violated = as_vector(values);
    at.A = Eigen::MatrixXd::Zero(at.violated.size(), size);
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      at.A.row(k).head(unknowns) = gradients[i].transpose();
      if (at.rows[i] % kKinds == static_cast<long>(Of::level)) at.A(k, unknowns) = 1;
    }
    return at;
  }

  void evaluate(std::span<const long> rows, Eigen::VectorXd& error, Eigen::VectorXd& violated) override {
    error = segment_.iterate().error;
    violated.resize(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i)
      violated[static_cast<Eigen::Index>(i)] = row(rows[i], nullptr).value_or(-kNear);
  }

  Eigen::MatrixXd curvature() override {
    scan();
    const Objective& objective = segment_.problem().objective;
    Eigen::MatrixXd B = objective.curvature(segment_.iterate().K);
    if (objective.depends_on_end_alone()) return B;
    // The scale of other objectives is their own value: a step of one radian changes them by that amount.
    constexpr double kMinCurvature = 1e-9;
    const double nearest =
        wants_clearance() && std::isfinite(min_distance_) ? clearance_weight_ * std::abs(min_distance_) : 0;
    B.diagonal().array() += std::max(kMinCurvature, std::abs(segment_.objective(nullptr)) + nearest);
    return B;
  }

  // Refines the goals by Newton's method, and checks the path densely.
  ConstrainedSolution finish(const std::vector<double>& found) {
    ConstrainedSolution end;
    std::vector<double> y = found, lower = segment_.problem().lower, upper = segment_.problem().upper;
    lower.resize(y.size(), -kInfinite), upper.resize(y.size(), kInfinite);
    for (std::size_t i = static_cast<std::size_t>(segment_.joints()); i < y.size(); ++i) {
      if (segment_.is_held(static_cast<int>(i) % segment_.joints())) lower[i] = upper[i] = 0;
    }
    for (std::size_t j = 0; j < y.size(); ++j) y[j] = std::clamp(y[j], lower[j], upper[j]);
    ShootingIterate like = last_valid_;
    for (int i = 0; i < 8; ++i) {
      const ShootingIterate& iterate = finer_.shoot(y, like, SegmentAccuracy::full);
      if (!iterate.valid) break;
      like = iterate;
      if (iterate.largest_error() <= 1e-2 * kArrived) break;
      const NewtonStep step = minimum_norm_step(iterate.J, iterate.error, y, lower, upper, 1e-6);
      for (std::size_t j = 0; j < y.size(); ++j) {
        y[j] = std::clamp(y[j] + step.d[static_cast<Eigen::Index>(j)], lower[j], upper[j]);
      }
    }
    const ShootingIterate& iterate = finer_.iterate();
    if (!iterate.valid) {
      end.failure = "the motion is not resolved", end.violation = kInfinite;
      return end;
    }
    end.iterate = std::make_shared<ShootingIterate>(iterate);
    end.knots = finer_.problem().start.knots;
    end.position = iterate.position, end.rate = iterate.rate, end.coefficients = iterate.coefficients;
    end.violation = -kInfinite;
    for (const Found& f : finer_.scan(0, -kInfinite, &end.figures)) {
      if (f.value <= end.violation) continue;
      end.violation = f.value;
      if (f.value > kTolerated) end.failure = finer_.describe(f);
    }
    for (std::size_t j = 0; j < segment_.problem().rate_limit.size(); ++j) {
      const double share = std::abs(iterate.rate[j]) / segment_.problem().rate_limit[j];
      if (share > 1 + kTolerated && share - 1 > end.violation && setup_.limits) {
        end.violation = share - 1;
        end.failure = "final rates exceed their limits";
      }
    }
    if (iterate.largest_error() > kArrived) {
      end.failure = "the end-effectors do not arrive", end.violation = std::max(end.violation, iterate.largest_error());
    }
    end.feasible = end.failure.empty();
    end.objective = finer_.objective(nullptr, &end.terms);
    const auto& terms = finer_.problem().objective.terms();
    for (std::size_t i = 0; i < terms.size(); ++i) {
      if (terms[i].kind != Objective::Kind::clearance) continue;
      end.terms[i] = -end.figures.clearance.distance;
      end.objective += terms[i].weight * end.terms[i];
    }
    return end;
  }

  ConstrainedSegment& segment_;
  ConstrainedSegment& finer_;
  const PathConstraints& setup_;
  int n_, steps_;
  double clearance_weight_ = 0;
  std::vector<int> limited_, free_;  // joints with limits of their final rates; free unknowns
  double margin_ = 0;
  bool settled_ = false;
  Eigen::MatrixXd B_;
  ShootingIterate last_valid_;
  // Results of scan() at the last iterate.
  bool is_scanned_ = false;
  double worst_ = -kInfinite, min_distance_ = kInfinite;
  double level_ = kInfinite;  // min_distance_ at the last linearized()
  std::vector<Instant> instants_;
  long first_ = 0;                    // number of the first instant
  long known_ = 0, known_first_ = 0;  // range of the instants at the last linearized()
  int nodes_ = 0;                     // number of nodes that defines the numbering
};

}  // namespace

bool depends_on_path(const ReachProblem& problem) {
  return problem.constraints.has_constraints() || !problem.objective.depends_on_end_alone() ||
         problem.constraints.knots.value_or(0) > 0;
}

bool wants_clearance(const ReachProblem& problem) {
  const auto& terms = problem.objective.terms();
  return std::any_of(terms.begin(), terms.end(),
                     [](const Objective::Term& t) { return t.kind == Objective::Kind::clearance; });
}

// Number of an attempt => initial spline coefficients: those of the solution if they fit, otherwise zero; from attempt
// 1 on random in [-1, 1), by seed and attempt, except of held joints.
std::vector<double> coefficients_to_begin_with(const FloatingBase& base, const ReachProblem& problem,
                                               const ShootingIterate& solution, int knots, int attempt) {
  std::vector<double> coefficients(static_cast<std::size_t>(base.joints() * knots), 0.0);
  if (attempt > 0) {
    std::mt19937_64 generator(problem.seed + static_cast<std::uint64_t>(attempt));
    // The distributions of the standard library differ between implementations.
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      const double c = std::ldexp(static_cast<double>(generator() >> 11), -53) * 2 - 1;
      if (!base.is_held(static_cast<int>(i) % base.joints())) coefficients[i] = c;
    }
  }
  if (attempt <= 0 && solution.coefficients.size() == coefficients.size()) coefficients = solution.coefficients;
  return coefficients;
}

// Problem and solution => result of the exchange method; repeats it with all nodes if the path between the nodes is
// infeasible.
ConstrainedSolution solve_with_path_constraints(FloatingBase& base, const ReachProblem& problem,
                                                const ShootingIterate& solution, int knots, int attempt, int steps) {
  constexpr int kFiner = 4;
  const bool at_all_times = problem.constraints.has_constraints() || wants_clearance(problem);
  const int panels = kPanels[at_all_times ? 0 : 1];
  ConstrainedSegment segment(base, problem, knots, panels), finer(base, problem, knots, kFiner * panels);
  std::vector<double> coefficients = coefficients_to_begin_with(base, problem, solution, knots, attempt);
  Exchange exchange(attempt == kAtAllNodes ? finer : segment, finer, steps);
  ConstrainedSolution end = exchange.run(solution, std::move(coefficients), attempt != kAsItIs);
  // Violations between the nodes may exceed those at the nodes, for example near a grasp point.
  if (!end.feasible && end.iterate && exchange.settled()) {
    ConstrainedSolution closer = Exchange(finer, finer, steps).run(*end.iterate, end.coefficients, true);
    if (closer.feasible) end = std::move(closer);
  }
  end.rhs_evaluations = segment.rhs_evaluations() + finer.rhs_evaluations();
  return end;
}

}  // namespace grapnel
