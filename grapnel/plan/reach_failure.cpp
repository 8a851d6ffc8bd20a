#include "grapnel/plan/reach_failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/plan/arm_reach.hpp"
#include "grapnel/plan/nearest.hpp"
#include "grapnel/plan/together.hpp"

namespace grapnel {
namespace {

constexpr double kBlamed = 1e-5;  // an arm that comes nearer than this is not what stops the plan [m and rad]

// Where the first joint's parent frame puts the joint, for a base at X_WB.
std::string beyond_reach(FloatingBase& base, const Posed& X_WB, const Goal& goal) {
  const Model& model = base.model();
  const ArmReach reach = arm_reach(model, goal.frame);
  if (reach.first_body < 0 || !std::isfinite(reach.length)) return {};
  // The first joint sits still in the base.
  Posed X_BF = Posed::identity();
  for (int b = reach.first_body; b >= 0 && model.bodies()[b].parent >= 0; b = model.bodies()[b].parent) {
    X_BF = model.bodies()[b].description.X_PF * X_BF;
  }
  const double distance = norm(goal.X_WG.p - X_WB * X_BF.p);
  if (distance <= reach.length * (1 + 1e-12)) return {};
  return fmt::format(
      "the grasp point is {:.4g} m from joint '{}' and the arm is at most {:.4g} m long; base and target "
      "must be {:.4g} m nearer to each other when it closes",
      distance, model.bodies()[reach.first_body].description.joint.name, reach.length, distance - reach.length);
}

// Limits that the joints would have to pass to come nearer: the gradient pushes against them.
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

// "0.2 m and 0.1 rad"; what is left of an iteration is zero.
std::string amount(const Goal& goal, const GoalMiss& miss) {
  const auto shown = [](double x) { return x < 1e-7 ? 0.0 : x; };
  std::string text = fmt::format("{:.4g} m", shown(miss.distance));
  if (goal.orientation != Goal::Orientation::free) text += fmt::format(" and {:.4g} rad", shown(miss.angle));
  return text;
}

// " to grasp point 'left' of target 'sat'", where several goals share the target and the hand alone does not say it.
std::string place_of(std::span<const Goal> goals, const Goal& goal, const char* preposition = "to") {
  const auto on_it = std::count_if(goals.begin(), goals.end(), [&](const Goal& g) { return g.target == goal.target; });
  if (goal.target.empty() || on_it < 2) return {};
  return fmt::format(" {} grasp point '{}' of target '{}'", preposition, goal.point, goal.target);
}

// Joints that move several goals of an arm, if goal `i` of arm `a` is reached as soon as the others are dropped.
std::string in_others_way(FloatingBase& base, const ReachProblem& problem, const SettledArms& settled, std::size_t a,
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
  return fmt::format("alone it would arrive, but {} would not: they hang on the same joints ({})", others, shared);
}

// What keeps goal `i` of arm `a` from its place.
std::string cause(FloatingBase& base, const ReachProblem& problem, const SettledArms& settled, std::size_t a,
                  std::size_t i) {
  const Arm& arm = settled.arms[a];
  if (arm.joints.empty()) return "no joint moves it against the base";
  if (std::string text = beyond_reach(base, settled.X_WB, arm.goals[i]); !text.empty()) return text;
  if (std::string text = in_others_way(base, problem, settled, a, i); !text.empty()) return text;
  const Eigen::VectorXd gradient = settled.nearest[a].J.transpose() * settled.nearest[a].error;
  if (std::string text = at_limits(base, problem, arm, settled.theta, gradient); !text.empty())
    return text + "; wider limits, another grasp point or other initial joints may help";
  return "no joint moves it nearer: the arm is stretched out or folded there, or its joints do not give the direction "
         "or orientation asked for (its Jacobian is singular); another grasp point, another way to come in "
         "(approach_direction, approach_axis), orientation: free, or a base that is placed otherwise may help";
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

Failure explain_failure(FloatingBase& base, const ReachProblem& problem, const Shot& closest, int tried) {
  const std::vector<double>& from = closest.valid ? closest.position : problem.guess;
  const SettledArms settled = settle_arms(base, problem, from);
  Failure failure;
  failure.miss.resize(problem.goals.size());
  std::vector<bool> explained(problem.goals.size(), false);
  const auto say = [&](const std::string& text) { failure.text += (failure.text.empty() ? "" : "; ") + text; };
  for (const Incompatible& set : incompatible_goals(base, problem, from)) {
    say(set.text);
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
      say(fmt::format("end-effector '{}' comes no closer than {}{}: {}", arm.goals[i].name,
                      amount(arm.goals[i], miss[i]), place_of(problem.goals, arm.goals[i]),
                      cause(base, problem, settled, a, i)));
    }
  }
  if (!failure.text.empty()) return failure;
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  failure.miss.assign(problem.goals.size(), {kUnknown, kUnknown});
  failure.text = fmt::format(
      "every arm by itself reaches its point, but none of the {} initial guess{} tried led to a motion "
      "that brings all there with the demanded final motion",
      tried, tried == 1 ? "" : "s");
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
