#include "grapnel/capture/contact_normal.hpp"

#include "grapnel/capture/problem_lookup.hpp"

namespace grapnel {

std::optional<Vector3d> contact_normal(const TargetSetup& target, const GraspPoint& point) {
  if (point.normal) return point.normal;
  if (point.approach_direction) return -*point.approach_direction;
  if (target.geometry.shape != Geometry::Shape::sphere) return {};
  const Vector3d out = point.X_TG.p - target.geometry.X_BG.p;
  const double distance = norm(out);
  if (!(distance > 0)) return {};
  return (1 / distance) * out;
}

Vector3d contact_normal_in_world(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics, const GraspSetup& grasp) {
  const auto normal = contact_normal(target_of(problem, grasp), grasp_point_of(problem, grasp));
  if (!normal) throw CaptureProblemError("grasp of '" + grasp.end_effector + "': a contact needs the surface's normal");
  const int frame = system.target_frames[target_index(problem, grasp.target)];
  return frame_pose(system.model, kinematics, frame).R * *normal;
}

}  // namespace grapnel
