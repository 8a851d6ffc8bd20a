#include "grapnel/plan/together.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <nlopt.hpp>
#include <numbers>
#include <random>

#include "grapnel/plan/reach_failure.hpp"

namespace grapnel {
namespace {

constexpr double kFits = 1e-6;  // a smaller gap is none [m and rad]
constexpr int kInitialGuesses = 24;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w) {
  Eigen::Matrix3d M;
  M << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return M;
}

// d of the rotation vector of R -> angular displacement in the turned frame: the right Jacobian of SO(3) (Chirikjian
// 2012, 10.86).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d W = cross_matrix(w);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 6;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * W +
         (angle - std::sin(angle)) / (angle * angle * angle) * W * W;
}

// What NLopt's callback needs. Variables: joint values, then position and rotation vector of the base from X_WB0.
struct FreeChain {
  FloatingBase& base;
  std::span<const Goal> goals;
  Posed X_WB0;

  Posed pose(const std::vector<double>& x) const {
    const double* b = x.data() + base.joints();
    const Vector3d w{b[3], b[4], b[5]};
    const double angle = norm(w);
    const Rotationd R = angle > 0 ? rotation_about((1 / angle) * w, angle) : Rotationd::identity();
    return {X_WB0.R * R, X_WB0.p + Vector3d{b[0], b[1], b[2]}};
  }

  double half_square(const std::vector<double>& x, std::vector<double>& gradient) {
    const Posed X_WB = pose(x);
    const int n = base.joints();
    base.place(std::span(x).first(static_cast<std::size_t>(n)));
    Eigen::VectorXd e;
    Eigen::MatrixXd J_joint, J_base;
    goal_error(base, X_WB, goals, e, J_joint, J_base);
    if (!gradient.empty()) {
      Eigen::Map<Eigen::VectorXd> g(gradient.data(), n + 6);
      g.head(n) = J_joint.transpose() * e;
      // A displacement of the base in B is [J_r dw; R^T dp].
      const Eigen::Vector3d w{x[n + 3], x[n + 4], x[n + 5]};
      g.segment<3>(n) = as_matrix(X_WB.R) * (J_base.rightCols(3).transpose() * e);
      g.tail<3>() = right_jacobian(w).transpose() * (J_base.leftCols(3).transpose() * e);
    }
    return 0.5 * e.squaredNorm();
  }
};

double gap_square(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  return static_cast<FreeChain*>(data)->half_square(x, gradient);
}

ClosestTogether least_squares(FreeChain& chain, const ReachProblem& problem, std::vector<double> x) {
  const std::size_t n = static_cast<std::size_t>(chain.base.joints());
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  std::vector<double> lower = problem.lower, upper = problem.upper;
  lower.resize(n + 6, -kAnywhere), upper.resize(n + 6, kAnywhere);
  for (std::size_t j = 0; j < n; ++j) x[j] = std::clamp(x[j], lower[j], upper[j]);
  nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(n + 6));
  optimizer.set_lower_bounds(lower);
  optimizer.set_upper_bounds(upper);
  optimizer.set_min_objective(gap_square, &chain);
  optimizer.set_xtol_rel(1e-10);
  optimizer.set_stopval(0.5 * (0.1 * kFits) * (0.1 * kFits));
  optimizer.set_maxeval(400);
  double least = 0;
  try {
    optimizer.optimize(x, least);
  } catch (const std::exception&) {
    // Roundoff at a singularity: x is as near as it came.
  }
  ClosestTogether result;
  result.theta.assign(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(n));
  result.X_WB = chain.pose(x);
  chain.base.place(result.theta);
  Eigen::MatrixXd unused, unused_too;
  goal_error(chain.base, result.X_WB, chain.goals, result.error, unused, unused_too);
  return result;
}

// --- Words ----------------------------------------------------------------------------------------------------------

// "'a', 'b' and 'c'"
std::string quoted_list(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + fmt::format("'{}'", names[i]);
  }
  return text;
}

std::string who_and_where(std::span<const Goal> goals) {
  std::vector<std::string> hands, points;
  for (const Goal& g : goals) hands.push_back(g.name), points.push_back(g.point);
  return fmt::format("end-effectors {} cannot be at grasp points {} of target '{}' at once", quoted_list(hands),
                     quoted_list(points), goals[0].target);
}

std::string remaining(std::span<const Goal> goals, const Eigen::VectorXd& error) {
  std::string text;
  const std::vector<GoalMiss> miss = misses(goals, error);
  for (std::size_t i = 0; i < goals.size(); ++i) {
    text += fmt::format("{}'{}' {:.4g} m",
                        i == 0                  ? ""
                        : i + 1 == goals.size() ? " and "
                                                : ", ",
                        goals[i].name, miss[i].distance);
    if (goals[i].orientation != Goal::Orientation::free)
      text += fmt::format(" and {:.4g} rad", miss[i].angle < kFits ? 0.0 : miss[i].angle);
    text += fmt::format(" from '{}'", goals[i].point);
  }
  return text;
}

// Two hands whose distance from each other cannot be that of their points. Where the base is free, the sum of squares
// is least with the gap shared equally and the rest of the chain in line; so the gap is the difference of the
// distances.
std::string too_far_or_too_near(FloatingBase& base, std::span<const Goal> goals, const ClosestTogether& closest) {
  base.place(closest.theta);
  const double wanted = norm(goals[1].X_WG.p - goals[0].X_WG.p);
  const double given = norm(base.frame_pose(goals[1].frame).p - base.frame_pose(goals[0].frame).p);
  return fmt::format(
      "{}, wherever the base is: these are {:.4g} m apart, the hands come {} {:.4g} m {}; a gap of {:.4g} m remains "
      "between '{}' and '{}' when '{}' is at '{}'",
      who_and_where(goals), wanted, given < wanted ? "at most" : "no nearer than", given,
      given < wanted ? "apart" : "to each other", (closest.error.segment<3>(3) - closest.error.head<3>()).norm(),
      goals[1].name, goals[1].point, goals[0].name, goals[0].point);
}

// Nothing if the goals fit together.
std::string why_not_together(FloatingBase& base, const ReachProblem& problem, const std::vector<Goal>& goals,
                             const std::vector<double>& theta) {
  std::vector<Goal> places = goals;
  for (Goal& g : places) g.orientation = Goal::Orientation::free;
  const ClosestTogether by_distance = closest_together(base, problem, places, theta);
  if (by_distance.error.norm() > kFits) {
    if (goals.size() == 2) return too_far_or_too_near(base, places, by_distance);
    return fmt::format("{}, wherever the base is, though any two of them can: the closest attempt leaves {}",
                       who_and_where(places), remaining(places, by_distance.error));
  }
  const bool oriented =
      std::any_of(goals.begin(), goals.end(), [](const Goal& g) { return g.orientation != Goal::Orientation::free; });
  if (!oriented) return {};
  const ClosestTogether closest = closest_together(base, problem, goals, by_distance.theta);
  if (closest.error.norm() <= kFits) return {};
  return fmt::format(
      "{} with the orientations asked for, wherever the base is: without these they can, with them the closest attempt "
      "leaves {}",
      who_and_where(goals), remaining(goals, closest.error));
}

std::vector<Goal> pick(std::span<const Goal> goals, const std::vector<std::size_t>& indices) {
  std::vector<Goal> picked;
  for (std::size_t i : indices) picked.push_back(goals[i]);
  return picked;
}

}  // namespace

ClosestTogether closest_together(FloatingBase& base, const ReachProblem& problem, std::span<const Goal> goals,
                                 const std::vector<double>& theta) {
  FreeChain chain{base, goals, problem.start.X_WB};
  std::mt19937_64 random(problem.seed + 2);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  std::vector<double> x = theta;
  x.resize(theta.size() + 6, 0.0);
  ClosestTogether best = least_squares(chain, problem, x);
  for (int i = 1; i < kInitialGuesses && best.error.norm() > kFits; ++i) {
    for (std::size_t j = 0; j < theta.size(); ++j) {
      const double start = problem.start.position[j];
      x[j] = uniform(std::max(problem.lower[j], start - std::numbers::pi),
                     std::min(problem.upper[j], start + std::numbers::pi));
    }
    for (std::size_t k = 3; k < 6; ++k) x[theta.size() + k] = uniform(-1.5, 1.5);
    ClosestTogether other = least_squares(chain, problem, x);
    if (other.error.norm() < best.error.norm()) best = std::move(other);
  }
  return best;
}

std::vector<Incompatible> incompatible_goals(FloatingBase& base, const ReachProblem& problem,
                                             const std::vector<double>& theta) {
  std::map<std::string, std::vector<std::size_t>> by_target;
  for (std::size_t i = 0; i < problem.goals.size(); ++i) {
    if (!problem.goals[i].target.empty()) by_target[problem.goals[i].target].push_back(i);
  }
  std::vector<Incompatible> found;
  for (const auto& [target, members] : by_target) {
    const std::size_t before = found.size();
    const auto look_at = [&](const std::vector<std::size_t>& set) {
      std::string text = why_not_together(base, problem, pick(problem.goals, set), theta);
      if (!text.empty()) found.push_back({set, std::move(text)});
    };
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t k = i + 1; k < members.size(); ++k) look_at({members[i], members[k]});
    }
    if (members.size() > 2 && found.size() == before) look_at(members);
  }
  return found;
}

}  // namespace grapnel
