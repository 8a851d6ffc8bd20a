#include "grapnel/plan/nearest.hpp"

#include <algorithm>
#include <exception>
#include <nlopt.hpp>
#include <numbers>
#include <random>

namespace grapnel {
namespace {

struct StillArm {
  FloatingBase& base;
  const Posed& X_WB;
  const Arm& arm;
  std::vector<double> theta;  // all joints

  Nearest at(const std::vector<double>& x) {
    for (std::size_t k = 0; k < x.size(); ++k) theta[arm.joints[k]] = x[k];
    base.place(theta);
    Nearest n;
    Eigen::MatrixXd J, unused;
    goal_error(base, X_WB, arm.goals, n.error, J, unused);
    n.J = J(Eigen::all, arm.joints);
    return n;
  }
};

double half_square(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  const Nearest n = static_cast<StillArm*>(data)->at(x);
  if (!gradient.empty()) {
    Eigen::Map<Eigen::VectorXd>(gradient.data(), static_cast<Eigen::Index>(gradient.size())) =
        n.J.transpose() * n.error;
  }
  return 0.5 * n.error.squaredNorm();
}

// The best of several initial guesses: where joints are, and random values.
Nearest nearest_of_many(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                        std::vector<double>& theta) {
  constexpr int kInitialGuesses = 12;
  std::mt19937_64 random(problem.seed + 1);
  std::vector<double> best_theta = theta;
  Nearest best = approach_goals(base, X_WB, arm, problem, best_theta);
  for (int trial = 0; trial < kInitialGuesses && best.error.norm() > 1e-7; ++trial) {
    std::vector<double> from = theta;
    for (int j : arm.joints) {
      const double u = static_cast<double>(random() >> 11) * 0x1p-53, start = problem.start.position[j];
      const double low = std::max(problem.lower[j], start - std::numbers::pi);
      const double high = std::min(problem.upper[j], start + std::numbers::pi);
      from[j] = low + (high - low) * u;
    }
    const Nearest n = approach_goals(base, X_WB, arm, problem, from);
    if (n.error.norm() < 0.999 * best.error.norm()) best = n, best_theta = from;
  }
  theta = best_theta;
  return best;
}

}  // namespace

Nearest approach_goals(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                       std::vector<double>& theta) {
  StillArm still{base, X_WB, arm, theta};
  std::vector<double> x, lower, upper;
  for (int j : arm.joints) {
    x.push_back(std::clamp(theta[j], problem.lower[j], problem.upper[j]));
    lower.push_back(problem.lower[j]), upper.push_back(problem.upper[j]);
  }
  if (!x.empty()) {
    nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(x.size()));
    optimizer.set_lower_bounds(lower);
    optimizer.set_upper_bounds(upper);
    optimizer.set_min_objective(half_square, &still);
    optimizer.set_xtol_rel(1e-9);
    optimizer.set_maxeval(300);
    double least = 0;
    try {
      optimizer.optimize(x, least);
    } catch (const std::exception&) {
      // Roundoff at a singularity: x is as near as it came.
    }
  }
  Nearest n = still.at(x);
  theta = still.theta;
  return n;
}

SettledArms settle_arms(FloatingBase& base, const ReachProblem& problem, std::vector<double> theta) {
  constexpr int kRounds = 4;
  SettledArms s{split_arms(base, problem.goals), {}, std::move(theta), problem.start.X_WB};
  s.nearest.resize(s.arms.size());
  PathSegment segment(base, problem.start, problem.motion, 1e-9, 1e-11);
  const std::vector<double> at_rest(s.theta.size(), 0.0);
  for (int i = 0; i < kRounds; ++i) {
    for (std::size_t a = 0; a < s.arms.size(); ++a) {
      s.nearest[a] = i == 0 ? nearest_of_many(base, s.X_WB, s.arms[a], problem, s.theta)
                            : approach_goals(base, s.X_WB, s.arms[a], problem, s.theta);
    }
    if (i + 1 == kRounds) break;
    if (const SegmentEnd end = segment.fly(s.theta, at_rest, false); end.finished) s.X_WB = end.X_WB;
  }
  return s;
}

}  // namespace grapnel
