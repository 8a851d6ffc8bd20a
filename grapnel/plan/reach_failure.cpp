#include "grapnel/plan/reach_failure.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <nlopt.hpp>
#include <numbers>
#include <random>

#include "grapnel/plan/arm_starts.hpp"
#include "grapnel/plan/exchanged_grasps.hpp"

namespace grapnel {

namespace {

struct StillArm {
  FloatingBase& base;
  const Posed& X_WB;
  const Arm& arm;
  std::vector<double> theta;  // one value per joint

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

// The best result of several initial guesses: the present joint values, and random values.
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

// Joint values => least-squares solution of the arm's goals with a fixed base, by SLSQP within the joint limits.
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
    double minimum = 0;
    try {
      optimizer.optimize(x, minimum);
    } catch (const std::exception&) {
      // Roundoff at a singularity: x is as near as it came.
    }
  }
  Nearest n = still.at(x);
  theta = still.theta;
  return n;
}

// Initial joint values => least-squares solutions of all arms at the base pose after the motion to them, in alternating
// rounds.
SettledArms settle_arms(FloatingBase& base, const ReachProblem& problem, std::vector<double> theta) {
  constexpr int kRounds = 4;
  SettledArms s{split_arms(base, problem.goals), {}, std::move(theta), problem.start.X_WB};
  s.nearest.resize(s.arms.size());
  PathSegment segment(base, problem.start, problem.motion);
  const std::vector<double> at_rest(s.theta.size(), 0.0);
  for (int i = 0; i < kRounds; ++i) {
    for (std::size_t a = 0; a < s.arms.size(); ++a) {
      s.nearest[a] = i == 0 ? nearest_of_many(base, s.X_WB, s.arms[a], problem, s.theta)
                            : approach_goals(base, s.X_WB, s.arms[a], problem, s.theta);
    }
    if (i + 1 == kRounds) break;
    if (const SegmentEnd end = segment.integrate(s.theta, at_rest, false); end.finished) s.X_WB = end.X_WB;
  }
  return s;
}

namespace {

constexpr double kFits = 1e-6;  // smaller gaps are zero [m and rad]
constexpr int kInitialGuesses = 24;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w) {
  Eigen::Matrix3d M;
  M << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return M;
}

// Right Jacobian of SO(3): derivative of a rotation vector => angular displacement in the rotated frame (Chirikjian
// 2012, 10.86).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d W = cross_matrix(w);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 6;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * W +
         (angle - std::sin(angle)) / (angle * angle * angle) * W * W;
}

// Data of NLopt's callback. Variables: joint values, then position and rotation vector of the base relative to X_WB0.
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

  // Joints and base pose => half the squared goal errors of a free chain, and its gradient; the base is displaced by a
  // position in W and a rotation vector in B.
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

// Initial point => least-squares solution of the goals over joints and base pose, by SLSQP.
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
  double minimum = 0;
  try {
    optimizer.optimize(x, minimum);
  } catch (const std::exception&) {
    // Roundoff at a singularity: x is as near as it came.
  }
  ClosestTogether result;
  result.theta.assign(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(n));
  result.X_WB = chain.pose(x);
  chain.base.place(result.theta);
  goal_error(chain.base, result.X_WB, chain.goals, result.error);
  return result;
}

// --- Messages -------------------------------------------------------------------------------------------------------

// "'a', 'b' and 'c'"
std::string quoted_list(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + fmt::format("'{}'", names[i]);
  }
  return text;
}

std::string who_and_where(std::span<const Goal> goals) {
  std::vector<std::string> names, points;
  for (const Goal& g : goals) names.push_back(g.name), points.push_back(g.point);
  return fmt::format("end-effectors {} cannot reach grasp points {} of target '{}' simultaneously", quoted_list(names),
                     quoted_list(points), goals[0].target);
}

// Error vector => message with the remaining distance and angle per goal.
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

// Message for two end-effectors whose possible distances exclude that of their grasp points. With a free base, the sum
// of squares is minimal with the gap shared equally and the rest of the chain aligned. The gap is therefore the
// difference of the distances.
std::string too_far_or_too_near(FloatingBase& base, std::span<const Goal> goals, const ClosestTogether& closest) {
  base.place(closest.theta);
  const double wanted = norm(goals[1].X_WG.p - goals[0].X_WG.p);
  const double given = norm(base.frame_pose(goals[1].frame).p - base.frame_pose(goals[0].frame).p);
  return fmt::format(
      "{} for any base pose: the grasp points are {:.4g} m apart, the end-effectors come {} {:.4g} m {}; a gap of "
      "{:.4g} m remains between '{}' and '{}' when '{}' is at '{}'",
      who_and_where(goals), wanted, given < wanted ? "at most" : "no nearer than", given,
      given < wanted ? "apart" : "to each other", (closest.error.segment<3>(3) - closest.error.head<3>()).norm(),
      goals[1].name, goals[1].point, goals[0].name, goals[0].point);
}

// Empty if the goals are compatible.
std::string why_not_together(FloatingBase& base, const ReachProblem& problem, const std::vector<Goal>& goals,
                             const std::vector<double>& theta) {
  std::vector<Goal> places = goals;
  for (Goal& g : places) g.orientation = Goal::Orientation::free;
  const ClosestTogether by_distance = closest_together(base, problem, places, theta);
  if (by_distance.error.norm() > kFits) {
    if (goals.size() == 2) return too_far_or_too_near(base, places, by_distance);
    return fmt::format("{} for any base pose, although each pair of them can: the closest attempt leaves {}",
                       who_and_where(places), remaining(places, by_distance.error));
  }
  const bool oriented =
      std::any_of(goals.begin(), goals.end(), [](const Goal& g) { return g.orientation != Goal::Orientation::free; });
  if (!oriented) return {};
  const ClosestTogether closest = closest_together(base, problem, goals, by_distance.theta);
  if (closest.error.norm() <= kFits) return {};
  return fmt::format(
      "{} with the demanded orientations for any base pose; the positions alone are reachable, the closest attempt "
      "with the orientations leaves {}",
      who_and_where(goals), remaining(goals, closest.error));
}

std::vector<Goal> pick(std::span<const Goal> goals, const std::vector<std::size_t>& indices) {
  std::vector<Goal> picked;
  for (std::size_t i : indices) picked.push_back(goals[i]);
  return picked;
}

}  // namespace

// Goals => closest attempt over joints and base pose, from several initial guesses.
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

// Goals => incompatible pairs on one target, then incompatible sets of compatible pairs.
std::vector<Incompatible> incompatible_goals(FloatingBase& base, const ReachProblem& problem,
                                             const std::vector<double>& theta) {
  std::map<std::string, std::vector<std::size_t>> by_target;
  for (std::size_t i = 0; i < problem.goals.size(); ++i) {
    if (!problem.goals[i].target.empty()) by_target[problem.goals[i].target].push_back(i);
  }
  std::vector<Incompatible> found;
  for (const auto& [target, members] : by_target) {
    const std::size_t before = found.size();
    const auto check = [&](const std::vector<std::size_t>& set) {
      std::string text = why_not_together(base, problem, pick(problem.goals, set), theta);
      if (!text.empty()) found.push_back({set, std::move(text)});
    };
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t k = i + 1; k < members.size(); ++k) check({members[i], members[k]});
    }
    if (members.size() > 2 && found.size() == before) check(members);
  }
  return found;
}

// Goal => message by how much it is beyond the length of its arm; empty if it is within.
std::string beyond_reach(FloatingBase& base, const Posed& X_WB, const Goal& goal) {
  const Model& model = base.model();
  const ArmReach reach = arm_reach(model, goal.frame);
  if (reach.first_body < 0 || !std::isfinite(reach.length)) return {};
  // The first joint is fixed in the base.
  Posed X_BF = Posed::identity();
  for (int b = reach.first_body; b >= 0 && model.bodies()[b].parent >= 0; b = model.bodies()[b].parent) {
    X_BF = model.bodies()[b].description.X_PF * X_BF;
  }
  const double distance = norm(goal.X_WG.p - X_WB * X_BF.p);
  if (distance <= reach.length * (1 + 1e-12)) return {};
  return fmt::format(
      "the grasp point is {:.4g} m from joint '{}' and the arm is at most {:.4g} m long; base and target must be "
      "{:.4g} m closer to each other at the capture",
      distance, model.bodies()[reach.first_body].description.joint.name, reach.length, distance - reach.length);
}

namespace {

constexpr double kBlamed = 1e-5;  // an arm with a smaller error does not cause the failure [m and rad]

// Active joint limits: the descent direction of the error points beyond them.
std::string at_limits(const FloatingBase& base, const ReachProblem& problem, const Arm& arm,
                      const std::vector<double>& theta, const Eigen::VectorXd& gradient) {
  const Model& model = base.model();
  std::string text;
  for (std::size_t k = 0; k < arm.joints.size(); ++k) {
    const int j = arm.joints[k];
    const double g = gradient[static_cast<Eigen::Index>(k)];
    const bool low = theta[j] <= problem.lower[j] + 1e-7 && g > 1e-9;
    const bool high = theta[j] >= problem.upper[j] - 1e-7 && g < -1e-9;
    if (!low && !high) continue;
    text += fmt::format("{}joint '{}' is at its {} limit {:.6g}", text.empty() ? "" : ", ",
                        model.bodies()[model.joints()[j]].description.joint.name, low ? "lower" : "upper",
                        low ? problem.lower[j] : problem.upper[j]);
  }
  return text;
}

std::size_t index_of(std::span<const Goal> goals, const Goal& goal) {
  std::size_t i = 0;
  while (i + 1 < goals.size() && goals[i].frame != goal.frame) ++i;
  return i;
}

// "0.2 m and 0.1 rad"; iteration errors are shown as zero.
std::string amount(const Goal& goal, const GoalMiss& miss) {
  const auto shown = [](double x) { return x < 1e-7 ? 0.0 : x; };
  std::string text = fmt::format("{:.4g} m", shown(miss.distance));
  if (goal.orientation != Goal::Orientation::free) text += fmt::format(" and {:.4g} rad", shown(miss.angle));
  return text;
}

// " to grasp point 'left' of target 'sat'" if several goals share the target; otherwise the end-effector's name is
// sufficient.
std::string place_of(std::span<const Goal> goals, const Goal& goal, const char* preposition = "to") {
  const auto on_it = std::count_if(goals.begin(), goals.end(), [&](const Goal& g) { return g.target == goal.target; });
  if (goal.target.empty() || on_it < 2) return {};
  return fmt::format(" {} grasp point '{}' of target '{}'", preposition, goal.point, goal.target);
}

// Shared joints of an arm, if goal `i` of arm `a` is reachable without the arm's other goals.
std::string joint_conflict(FloatingBase& base, const ReachProblem& problem, const SettledArms& settled, std::size_t a,
                           std::size_t i) {
  const Arm& arm = settled.arms[a];
  if (arm.goals.size() < 2) return {};
  Arm alone = arm;
  alone.goals = {arm.goals[i]};
  std::vector<double> theta = settled.theta;
  if (approach_goals(base, settled.X_WB, alone, problem, theta).error.lpNorm<Eigen::Infinity>() > kBlamed) return {};
  std::string others, shared;
  for (const Goal& g : arm.goals) {
    if (g.frame != arm.goals[i].frame) others += fmt::format("{}'{}'", others.empty() ? "" : ", ", g.name);
  }
  const Model& model = base.model();
  for (int j : arm.joints) {
    const auto carried =
        std::count_if(arm.goals.begin(), arm.goals.end(), [&](const Goal& g) { return base.carries(j, g.frame); });
    if (carried < 2) continue;
    shared +=
        fmt::format("{}'{}'", shared.empty() ? "" : ", ", model.bodies()[model.joints()[j]].description.joint.name);
  }
  return fmt::format("it could arrive alone, but then {} could not: they share joints ({})", others, shared);
}

// Cause of the error of goal `i` of arm `a`.
std::string cause(FloatingBase& base, const ReachProblem& problem, const SettledArms& settled, std::size_t a,
                  std::size_t i) {
  const Arm& arm = settled.arms[a];
  if (arm.joints.empty()) return "no joint moves it relative to the base";
  if (std::string text = beyond_reach(base, settled.X_WB, arm.goals[i]); !text.empty()) return text;
  if (std::string text = joint_conflict(base, problem, settled, a, i); !text.empty()) return text;
  const Eigen::VectorXd gradient = settled.nearest[a].J.transpose() * settled.nearest[a].error;
  if (std::string text = at_limits(base, problem, arm, settled.theta, gradient); !text.empty())
    return text + "; wider limits, another grasp point or other initial joints may help";
  return "no joint moves it closer: the arm is fully extended or folded, or its joints cannot produce the demanded "
         "direction or orientation (its Jacobian is singular); another grasp point, another approach direction "
         "(approach_direction, approach_axis), orientation: free, or another base pose may help";
}

}  // namespace

std::vector<GoalMiss> misses(std::span<const Goal> goals, const Eigen::VectorXd& error) {
  std::vector<GoalMiss> result(goals.size());
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < goals.size(); ++i) {
    const int rows = rows_of(goals[i]);
    if (row + rows > error.size()) break;
    result[i].distance = error.segment(row, 3).norm();
    result[i].angle = error.segment(row + 3, rows - 3).norm();
    row += rows;
  }
  return result;
}

// Closest attempt => message with the cause of the failure, and the smallest errors per goal.
Failure explain_failure(FloatingBase& base, const ReachProblem& problem, const ShootingIterate& closest, int tried) {
  const std::vector<double>& from = closest.valid ? closest.position : problem.guess;
  const SettledArms settled = settle_arms(base, problem, from);
  Failure failure;
  failure.miss.resize(problem.goals.size());
  std::vector<bool> explained(problem.goals.size(), false);
  const auto append = [&](const std::string& text) { failure.text += (failure.text.empty() ? "" : "; ") + text; };
  std::vector<std::vector<std::size_t>> faulty;
  for (const Incompatible& set : incompatible_goals(base, problem, from)) {
    append(set.text);
    faulty.push_back(set.goals);
    for (std::size_t g : set.goals) explained[g] = true;
  }
  for (std::size_t a = 0; a < settled.arms.size(); ++a) {
    const Arm& arm = settled.arms[a];
    const std::vector<GoalMiss> miss = misses(arm.goals, settled.nearest[a].error);
    for (std::size_t i = 0; i < miss.size(); ++i) {
      const std::size_t g = index_of(problem.goals, arm.goals[i]);
      failure.miss[g] = miss[i];
      if (explained[g] || (miss[i].distance < kBlamed && miss[i].angle < kBlamed)) continue;
      base.place(settled.theta);
      faulty.push_back({g});
      append(fmt::format("end-effector '{}' comes no closer than {}{}: {}", arm.goals[i].name,
                         amount(arm.goals[i], miss[i]), place_of(problem.goals, arm.goals[i]),
                         cause(base, problem, settled, a, i)));
    }
  }
  if (!failure.text.empty()) {
    const std::string exchange = exchange_of_grasps(base, problem, settled.X_WB, faulty);
    if (!exchange.empty()) failure.text = exchange + "; as stated: " + failure.text;
    return failure;
  }
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  failure.miss.assign(problem.goals.size(), {kUnknown, kUnknown});
  failure.text = fmt::format(
      "each arm alone reaches its grasp point, but none of the {} initial guess{} tried led to a motion that brings "
      "all end-effectors there with the demanded final motion",
      tried, tried == 1 ? "" : "es");
  if (closest.valid) {
    failure.miss = misses(problem.goals, closest.error);
    std::string left;
    for (std::size_t g = 0; g < failure.miss.size(); ++g) {
      left += fmt::format("{}'{}' {}{}", left.empty() ? "" : ", ", problem.goals[g].name,
                          amount(problem.goals[g], failure.miss[g]), place_of(problem.goals, problem.goals[g], "from"));
    }
    failure.text += " (the closest leaves " + left + ")";
  }
  failure.text += "; another duration, other final_rates, or more approach.plan.starts may help";
  return failure;
}

}  // namespace grapnel
