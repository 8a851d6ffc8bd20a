#include "grapnel/plan/way.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <random>

#include "grapnel/plan/segment_way.hpp"

namespace grapnel {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr int kWayPanels[] = {8, 2};  // at least; of 16 nodes

using Kept = WayLook::Kept;
using Instant = WayLook::Instant;
using Found = WayLook::Found;

// The exchange, for one start.
class Exchange {
 public:
  Exchange(SegmentWay& way, SegmentWay& finer) : way_(way), finer_(finer), setup_(way.problem().way) {
    for (const Objective::Term& t : way.problem().objective.terms()) {
      if (t.kind == Objective::Kind::clearance) clearance_weight_ = t.weight;
    }
  }

  WayEnd run(const Shot& solution, std::vector<double> coefficients, bool improves) {
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
    if (!improves) return finish(y);
    settled_ = false;
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

  // Whether nothing was violated at the nodes in the end.
  bool settled() const { return settled_; }

 private:
  static constexpr double kBand = 0.02;  // instants this near to a violation are kept as well

  bool wants_clearance() const { return clearance_weight_ > 0; }

  // SLSQP at the instants known, then the new ones, until nothing is violated.
  void exchange(std::vector<double>& y) {
    // Without anything to keep, the rounds only go on with what the optimizer was not given the time for.
    const int most = way_.problem().way.keeps_something() || wants_clearance() ? 12 : 3;
    // Without splines the search has made what depends on the end alone as small as it gets.
    const bool settled_as_is =
        !wants_clearance() && way_.problem().objective.depends_on_end_alone() && way_.problem().start.knots == 0;
    double before = kInfinite;
    int stuck = 0;
    for (int round = 0; round < most && way_.shot().valid; ++round) {
      const std::size_t known = instants_.size();
      const double worst = add_instants();
      // From the same place with the same instants it would end there again.
      if (round > 0 && !moved_far_ && instants_.size() == known) return;
      const bool arrived = way_.shot().largest_error() <= 1e-5;
      settled_ = arrived && worst <= -margin_ + kAimed;
      if (settled_ && (round == 0 ? settled_as_is : !moved_far_)) return;
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
    if (way_.nodes() != nodes_) instants_.clear(), nodes_ = way_.nodes();
    // Hands that have come near their grasp points meanwhile are free there.
    std::erase_if(instants_, [&](const Instant& i) { return way_.may_touch(i); });
    const double band = kBand + margin_;
    double worst = -kInfinite;
    for (const Found& f : way_.scan(band, wanted, nullptr)) {
      const double kept = setup_.clearance.value_or(-kInfinite);
      const double asked = f.at.kept == Kept::clearance ? std::max(0.0, wanted - band - kept) : 0.0;
      worst = std::max(worst, f.value - asked);
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
      const double bent = way_.is_held(j % n) ? 0 : kMostBent;
      lower[i] = std::max(j < n ? p.lower[i] : -bent, y[i] - kFarthest);
      upper[i] = std::min(j < n ? p.upper[i] : bent, y[i] + kFarthest);
    }
    if (wants_clearance())
      z.push_back(std::isfinite(least_) ? least_ : 0), lower.back() = z.back() - 1, upper.back() = z.back() + 1;
    rows_ = independent_rows(way_.shot().J);
    // The optimizer's first guess of curvatures is one.
    if (!p.objective.depends_on_end_alone()) {
      const double nearest = wants_clearance() && std::isfinite(least_) ? clearance_weight_ * std::abs(least_) : 0;
      scale_ = 1 / std::max(1e-9, std::abs(way_.objective(nullptr)) + nearest);
    }
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
    // Of its iterates the optimizer returns the best one that it takes for admissible: it never meets anything exactly.
    constexpr double kMet = 2e-7;
    if (inequalities > 0)
      optimizer.add_inequality_mconstraint(&Exchange::inequalities, this, std::vector<double>(inequalities, kMet));
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
    for (std::size_t i = static_cast<std::size_t>(way_.joints()); i < y.size(); ++i) {
      if (way_.is_held(static_cast<int>(i) % way_.joints())) lower[i] = upper[i] = 0;
    }
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

  SegmentWay& way_;
  SegmentWay& finer_;
  const WaySetup& setup_;
  double clearance_weight_ = 0, scale_ = 1;
  double margin_ = 0, least_ = kInfinite;
  bool moved_far_ = true, settled_ = false;
  std::vector<Instant> instants_;
  int nodes_ = 0;  // that they are counted by
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

std::vector<double> coefficients_to_begin_with(const FloatingBase& base, const ReachProblem& problem,
                                               const Shot& solution, int knots, int attempt) {
  std::vector<double> coefficients(static_cast<std::size_t>(base.joints() * knots), 0.0);
  if (attempt > 0) {
    std::mt19937_64 generator(problem.seed + static_cast<std::uint64_t>(attempt));
    // Not the library's distributions, whose numbers differ from one standard library to the next.
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      const double c = std::ldexp(static_cast<double>(generator() >> 11), -53) * 2 - 1;
      if (!base.is_held(static_cast<int>(i) % base.joints())) coefficients[i] = c;
    }
  }
  if (attempt <= 0 && solution.coefficients.size() == coefficients.size()) coefficients = solution.coefficients;
  return coefficients;
}

WayEnd keep_way(FloatingBase& base, const ReachProblem& problem, const Shot& solution, int knots, int attempt) {
  constexpr int kFiner = 4;
  const bool at_all_times = problem.way.keeps_something() || wants_clearance(problem);
  const int panels = kWayPanels[at_all_times ? 0 : 1];
  SegmentWay way(base, problem, knots, panels), finer(base, problem, knots, kFiner * panels);
  std::vector<double> coefficients = coefficients_to_begin_with(base, problem, solution, knots, attempt);
  Exchange exchange(way, finer);
  WayEnd end = exchange.run(solution, std::move(coefficients), attempt != kAsItIs);
  // More may be missing between the nodes than they show: where a hand comes near its grasp point, say.
  if (!end.kept && end.shot && exchange.settled()) {
    WayEnd closer = Exchange(finer, finer).run(*end.shot, end.coefficients, true);
    if (closer.kept) end = std::move(closer);
  }
  end.rhs_evaluations = way.rhs_evaluations() + finer.rhs_evaluations();
  return end;
}

}  // namespace grapnel
