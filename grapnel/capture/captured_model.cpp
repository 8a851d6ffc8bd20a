#include "grapnel/capture/captured_model.hpp"

#include <algorithm>

namespace grapnel {
namespace {

// The target's body with its frame moved to the contact point (axes unchanged), where the new joint sits.
BodyDescription at_contact(BodyDescription target, const Posed& X_WT, const Vector3d& p_WC) {
  target.com = target.com - transposed_times(X_WT.R, p_WC - X_WT.p);
  return target;
}

JointDescription grip_joint(const Grasp& grasp, const std::string& name, const Rotationd& R_WT) {
  JointDescription joint;
  joint.name = name;
  joint.type = grasp.model == GraspModel::rigid   ? JointType::fixed
               : grasp.model == GraspModel::hinge ? JointType::revolute
                                                  : JointType::spherical;
  if (grasp.model == GraspModel::hinge) joint.axis = transposed_times(R_WT, grasp.hinge_W);
  return joint;
}

}  // namespace

CapturedSystem capture_targets(const CaptureProblem& problem, const CaptureSystem& before, const State& state,
                               std::span<const Grasp> grasps) {
  const Kinematics k = forward_kinematics(before.model, state);
  ModelBuilder builder;
  for (const Body& body : before.model.bodies()) {
    const int index = static_cast<int>(&body - before.model.bodies().data());
    const auto grip =
        std::find_if(grasps.begin(), grasps.end(), [&](const Grasp& g) { return g.target_body == index; });
    if (grip == grasps.end()) {
      builder.add(body.description);
      continue;
    }
    const Posed& X_WT = k.X_WB[index];
    const Posed& X_WE = k.X_WB[grip->robot_body];
    BodyDescription caught = at_contact(body.description, X_WT, grip->p_WC);
    caught.parent = before.model.bodies()[grip->robot_body].description.name;
    caught.X_PF = inverse(X_WE) * Posed{X_WT.R, grip->p_WC};
    caught.joint = grip_joint(*grip, "grip:" + caught.name, X_WT.R);
    builder.add(caught);
  }
  for (const Frame& frame : before.model.frames()) {
    const auto grip =
        std::find_if(grasps.begin(), grasps.end(), [&](const Grasp& g) { return g.target_body == frame.body; });
    Posed X_BE = frame.X_BE;
    if (grip != grasps.end()) {
      const Posed& X_WT = k.X_WB[frame.body];
      X_BE.p = X_BE.p - transposed_times(X_WT.R, grip->p_WC - X_WT.p);
    }
    builder.add(FrameDescription{frame.name, before.model.bodies()[frame.body].description.name, X_BE});
  }

  CapturedSystem captured{{builder.build(), 0, {}, {}, {}}, {}};
  CaptureSystem& system = captured.system;
  const Model& model = system.model;
  system.base = model.body_index(problem.robot.base);
  for (int f : before.end_effectors) system.end_effectors.push_back(model.frame_index(before.model.frames()[f].name));
  for (int f : before.target_frames) system.target_frames.push_back(model.frame_index(before.model.frames()[f].name));
  for (int j : before.robot_joints) {
    const std::string& name = before.model.bodies()[before.model.joints()[j]].description.name;
    const int body = model.body_index(name);
    const auto at = std::find(model.joints().begin(), model.joints().end(), body);
    system.robot_joints.push_back(static_cast<int>(at - model.joints().begin()));
  }

  // Coordinates and velocities carry over by body; new joints start at zero with the relative rate.
  captured.state = zero_state(model);
  for (std::size_t i = 0; i < before.model.bodies().size(); ++i) {
    const Body& old_body = before.model.bodies()[i];
    const Body& new_body = model.bodies()[model.body_index(old_body.description.name)];
    const JointType type = new_body.description.joint.type;
    if (type == old_body.description.joint.type && (new_body.parent >= 0) == (old_body.parent >= 0)) {
      std::copy_n(state.q.begin() + old_body.q, coordinate_count(type), captured.state.q.begin() + new_body.q);
      std::copy_n(state.v.begin() + old_body.v, velocity_count(type), captured.state.v.begin() + new_body.v);
      continue;
    }
    const auto grip = std::find_if(grasps.begin(), grasps.end(),
                                   [&](const Grasp& g) { return g.target_body == static_cast<int>(i); });
    const Vector3d relative = k.V_WB[i].angular - k.V_WB[grip->robot_body].angular;
    if (type == JointType::revolute) captured.state.v[new_body.v] = dot(grip->hinge_W, relative);
    if (type == JointType::spherical) {
      const Vector3d w_T = transposed_times(k.X_WB[i].R, relative);
      for (int c = 0; c < 3; ++c) captured.state.v[new_body.v + c] = w_T[c];
    }
  }
  return captured;
}

}  // namespace grapnel
