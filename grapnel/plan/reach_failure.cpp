#include "grapnel/plan/reach_failure.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/plan/newton_step.hpp"

namespace grapnel {
namespace {

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

std::string at_limits(const FloatingBase& base, const ReachProblem& problem, const Shot& closest, const Goal& goal) {
  const Model& model = base.model();
  std::string text;
  for (int j = 0; j < base.joints(); ++j) {
    if (!base.carries(j, goal.frame)) continue;
    const bool low = closest.position[j] <= problem.lower[j] + 1e-9;
    const bool high = closest.position[j] >= problem.upper[j] - 1e-9;
    if (!low && !high) continue;
    text += fmt::format("{}joint '{}' is at its {} limit {:.6g}", text.empty() ? "" : ", ",
                        model.bodies()[model.joints()[j]].description.joint.name, low ? "lower" : "upper",
                        low ? problem.lower[j] : problem.upper[j]);
  }
  return text;
}

// What stops a goal, by what can be shown about the closest attempt.
std::string cause(FloatingBase& base, const ReachProblem& problem, const Shot& closest, const Goal& goal, int row) {
  base.place(closest.position);
  if (std::string text = beyond_reach(base, closest.X_WB, goal); !text.empty()) return text;
  if (std::string text = at_limits(base, problem, closest, goal); !text.empty()) return text;
  const int rows = rows_of(goal);
  const Eigen::MatrixXd J = closest.J.middleRows(row, rows);
  const Eigen::VectorXd e = closest.error.segment(row, rows);
  // At a singularity the error points where no joint leads: J^T e vanishes while e does not.
  const double gradient = (J.transpose() * e).norm(), size = e.norm() * J.norm();
  if (gradient < 1e-2 * size) {
    return "its Jacobian is singular there: no joint moves it towards the point (the arm is stretched out or folded, "
           "or the direction is one that its joints cannot give)";
  }
  return fmt::format("no solution from {} beginnings; more may find one (approach.plan.starts)", problem.starts);
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

std::string explain_failure(FloatingBase& base, const ReachProblem& problem, Shooting&, const Shot& closest) {
  if (!closest.valid) {
    return "the motion of the base, or joint rates that meet the demand, could not be computed from any beginning: the "
           "demanded end-effector motion may be singular everywhere near";
  }
  const std::vector<GoalMiss> miss = misses(problem.goals, closest.error);
  std::string text;
  int row = 0;
  for (std::size_t i = 0; i < miss.size(); ++i) {
    const Goal& goal = problem.goals[i];
    if (miss[i].distance > kArrived || miss[i].angle > kArrived) {
      text += fmt::format("{}end-effector '{}' comes no closer than {:.4g} m", text.empty() ? "" : "; ", goal.name,
                          miss[i].distance);
      if (goal.orientation != Goal::Orientation::free) text += fmt::format(" and {:.4g} rad", miss[i].angle);
      text += ": " + cause(base, problem, closest, goal, row);
    }
    row += rows_of(goal);
  }
  return text;
}

}  // namespace grapnel
