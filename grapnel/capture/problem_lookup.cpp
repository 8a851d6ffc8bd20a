#include "grapnel/capture/problem_lookup.hpp"

#include <algorithm>

namespace grapnel {
namespace {

template <class Items>
std::size_t index_of(const Items& items, const std::string& name) {
  const auto at = std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  return static_cast<std::size_t>(at - items.begin());
}

}  // namespace

std::size_t target_index(const CaptureProblem& problem, const std::string& target) {
  return index_of(problem.targets, target);
}

const TargetSetup& target_of(const CaptureProblem& problem, const GraspSetup& grasp) {
  return problem.targets.at(target_index(problem, grasp.target));
}

const GraspPoint& grasp_point_of(const CaptureProblem& problem, const GraspSetup& grasp) {
  const std::vector<GraspPoint>& points = target_of(problem, grasp).grasp_points;
  return points.at(index_of(points, grasp.grasp_point));
}

const EndEffectorSetup& end_effector_of(const CaptureProblem& problem, const GraspSetup& grasp) {
  const std::vector<EndEffectorSetup>& all = problem.robot.end_effectors;
  return all.at(index_of(all, grasp.end_effector));
}

}  // namespace grapnel
