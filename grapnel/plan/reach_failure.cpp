#include "grapnel/plan/reach_failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <nlopt.hpp>
#include <numbers>
#include <random>

#include "grapnel/plan/arm_starts.hpp"

namespace grapnel {
namespace {

constexpr double kBlamed = 1e-5;  // an arm that comes nearer than this is not what stops the plan [m and rad]

int rows_of(const Goal& g) {
  return g.orientation == Goal::Orientation::free ? 3 : g.orientation == Goal::Orientation::axis ? 5 : 6;
}

// Longest way from the first joint of the frame's chain to the frame, and that joint's body; nothing for a chain with a
// prismatic joint without limits.
struct Reach {
  int first_body = -1;
  double length = 0;
};
Reach reach_of(const Model& model, int frame) {
  const Frame& f = model.frames()[frame];
  Reach reach{-1, norm(f.X_BE.p)};
  for (int b = f.body; b >= 0 && model.bodies()[b].parent >= 0; b = model.bodies()[b].parent) {
    const JointDescription& joint = model.bodies()[b].description.joint;
    if (joint.type == JointType::prismatic) {
      reach.length += std::max(std::abs(joint.limits.lower), std::abs(joint.limits.upper));
    }
    if (velocity_count(joint.type) == 0) {
      reach.length += norm(model.bodies()[b].description.X_PF.p);
      continue;
    }
    reach.first_body = b;
    // The way from this joint down to its parent's joint belongs to the chain only if there is another joint below.
    bool another = false;
    for (int a = model.bodies()[b].parent; a >= 0; a = model.bodies()[a].parent) {
      another =
          another || (model.bodies()[a].parent >= 0 && velocity_count(model.bodies()[a].description.joint.type) > 0);
    }
    if (!another) break;
    reach.length += norm(model.bodies()[b].description.X_PF.p);
  }
  return reach;
}

// Where the first joint's parent frame puts the joint, for a base at X_WB.
std::string beyond_reach(FloatingBase& base, const Posed& X_WB, const Goal& goal) {
  const Model& model = base.model();
  const Reach reach = reach_of(model, goal.frame);
  if (reach.first_body < 0 || !std::isfinite(reach.length)) return {};
  // The first joint sits still in the base.
  Posed X_BF = Posed::identity();
  for (int b = reach.first_body; b >= 0 && model.bodies()[b].parent >= 0; b = model.bodies()[b].parent) {
    X_BF = model.bodies()[b].description.X_PF * X_BF;
  }
  const double distance = norm(goal.X_WG.p - X_WB * X_BF.p);
  if (distance <= reach.length * (1 + 1e-12)) return {};
  return fmt::format("the grasp point is {:.4g} m from joint '{}' and the arm is at most {:.4g} m long", distance,
                     model.bodies()[reach.first_body].description.joint.name, reach.length);
}

// An arm as near to its goals as it goes.
struct Nearest {
  Eigen::VectorXd error;
  Eigen::MatrixXd J;  // per joint of the arm
};

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

// Least squares from theta; leaves the result there.
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

// The best of several beginnings: where joints are, and random values.
Nearest nearest_of_many(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                        std::vector<double>& theta) {
  constexpr int kTrials = 12;
  std::mt19937_64 random(problem.seed + 1);
  std::vector<double> best_theta = theta;
  Nearest best = approach_goals(base, X_WB, arm, problem, best_theta);
  for (int trial = 0; trial < kTrials && best.error.norm() > 1e-7; ++trial) {
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

std::string cause(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB, const Arm& arm, const Goal& goal,
                  const std::vector<double>& theta, const Nearest& nearest) {
  if (arm.joints.empty()) return "no joint moves it against the base";
  if (std::string text = beyond_reach(base, X_WB, goal); !text.empty()) return text;
  const Eigen::VectorXd gradient = nearest.J.transpose() * nearest.error;
  if (std::string text = at_limits(base, problem, arm, theta, gradient); !text.empty()) return text;
  return "its Jacobian is singular there: no joint moves it nearer (the arm is stretched out or folded, or its joints "
         "do not give the direction or orientation asked for)";
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

Failure explain_failure(FloatingBase& base, const ReachProblem& problem, const Shot& closest) {
  const std::vector<Arm> arms = split_arms(base, problem.goals);
  // Brings each arm as near as it goes, flies there, ends at rest, and again with the base where it then is.
  std::vector<double> theta = closest.valid ? closest.position : problem.guess;
  Posed X_WB = problem.start.X_WB;
  std::vector<Nearest> nearest(arms.size());
  Leg leg(base, problem.start, problem.motion, 1e-9, 1e-11);
  const std::vector<double> at_rest(theta.size(), 0.0);
  for (int i = 0; i < 4; ++i) {
    for (std::size_t a = 0; a < arms.size(); ++a) {
      nearest[a] = i == 0 ? nearest_of_many(base, X_WB, arms[a], problem, theta)
                          : approach_goals(base, X_WB, arms[a], problem, theta);
    }
    if (const LegEnd end = leg.fly(theta, at_rest, false); i < 3 && end.finished) X_WB = end.X_WB;
  }
  Failure failure;
  failure.miss.resize(problem.goals.size());
  for (std::size_t a = 0; a < arms.size(); ++a) {
    const std::vector<GoalMiss> miss = misses(arms[a].goals, nearest[a].error);
    for (std::size_t i = 0; i < miss.size(); ++i) {
      const Goal& goal = arms[a].goals[i];
      for (std::size_t g = 0; g < problem.goals.size(); ++g) {
        if (problem.goals[g].frame == goal.frame) failure.miss[g] = miss[i];
      }
      if (miss[i].distance < kBlamed && miss[i].angle < kBlamed) continue;
      failure.text += fmt::format("{}end-effector '{}' comes no closer than {:.4g} m", failure.text.empty() ? "" : "; ",
                                  goal.name, miss[i].distance);
      if (goal.orientation != Goal::Orientation::free) failure.text += fmt::format(" and {:.4g} rad", miss[i].angle);
      failure.text += ": " + cause(base, problem, X_WB, arms[a], goal, theta, nearest[a]);
    }
  }
  if (failure.text.empty()) {
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    failure.miss.assign(problem.goals.size(), {kUnknown, kUnknown});
    if (closest.valid) failure.miss = misses(problem.goals, closest.error);
    failure.text = fmt::format(
        "every arm by itself reaches its point, but no motion was found from {} beginnings that brings all there with "
        "the demanded final motion; another duration, other final_rates, or more approach.plan.starts may help",
        problem.starts);
  }
  return failure;
}

}  // namespace grapnel
