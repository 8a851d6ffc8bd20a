#include "grapnel/approach/capture_goals.hpp"

#include <cmath>

namespace grapnel {
namespace {

Goal::Orientation orientation_of(const GraspSetup& grasp) {
  return grasp.orientation == GraspSetup::Orientation::axis   ? Goal::Orientation::axis
         : grasp.orientation == GraspSetup::Orientation::pose ? Goal::Orientation::pose
                                                              : Goal::Orientation::free;
}

// Used only for orientation by axis, which requires it.
Vector3d approach_axis(const CaptureProblem& problem, const GraspSetup& grasp) {
  return end_effector_of(problem, grasp).approach_axis.value_or(Vector3d{1, 0, 0});
}

}  // namespace

// Grasps and targets at the capture => goals: pose and twist of each grasp point in W plus the demanded relative twist,
// direction, and half of the capture envelope as accepted errors.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets) {
  std::vector<Goal> goals;
  for (const GraspSetup& grasp : problem.grasps) {
    const GraspPoint& point = grasp_point_of(problem, grasp);
    const TargetMotion& at = targets.capture[target_index(problem, grasp.target)];
    Goal g;
    g.frame = model.frame_index(grasp.end_effector);
    g.name = grasp.end_effector, g.target = grasp.target, g.point = grasp.grasp_point;
    g.X_WG = at.X_WT * point.X_TG;
    g.V_WG = shift(at.V_WT, at.X_WT.R * point.X_TG.p);
    g.V_WG += Twistd{grasp.relative_angular_velocity, grasp.relative_velocity};
    g.orientation = orientation_of(grasp);
    if (point.approach_direction) g.direction_W = at.X_WT.R * *point.approach_direction;
    g.axis_E = approach_axis(problem, grasp);
    // Half of the gripper's envelope is reserved for control errors.
    if (const auto& envelope = end_effector_of(problem, grasp).envelope) {
      g.accepted_distance = std::isfinite(envelope->position) ? 0.5 * envelope->position : 0;
      g.accepted_angle = std::isfinite(envelope->angle) ? 0.5 * envelope->angle : 0;
    }
    goals.push_back(g);
  }
  return goals;
}

std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model) {
  std::vector<StraightGoal> goals;
  for (const GraspSetup& grasp : problem.grasps) {
    const GraspPoint& point = grasp_point_of(problem, grasp);
    goals.push_back({model.frame_index(grasp.end_effector), grasp.end_effector,
                     static_cast<int>(target_index(problem, grasp.target)), point.X_TG,
                     point.approach_direction.value_or(Vector3d{1, 0, 0}), orientation_of(grasp),
                     approach_axis(problem, grasp), grasp.target, grasp.grasp_point,
                     problem.approach->straight_in->roll == StraightIn::Roll::matched});
  }
  return goals;
}

// Approach settings => demand of (6.2): stated rates first, then approach.match; without either, twist for a search and
// given (zero) rates for stated joints.
RateDemand rate_demand(const ApproachSetup& approach) {
  if (approach.final_rates) return RateDemand::given;
  if (!approach.match) return approach.plan ? RateDemand::twist : RateDemand::given;
  switch (*approach.match) {
    case RateMatch::velocity:
      return RateDemand::velocity;
    case RateMatch::twist:
      return RateDemand::twist;
    case RateMatch::velocity_least_rates:
      break;
  }
  return RateDemand::linear;
}

}  // namespace grapnel
