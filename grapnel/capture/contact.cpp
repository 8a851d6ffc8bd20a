#include "grapnel/capture/contact.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/capture/envelope.hpp"
#include "grapnel/capture/problem_lookup.hpp"
#include "grapnel/plan/arm_reach.hpp"

namespace grapnel {

std::vector<GraspGap> grasp_gaps(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics) {
  std::vector<GraspGap> gaps;
  for (const GraspSetup& g : problem.grasps) {
    const std::size_t at = target_index(problem, g.target);
    const GraspPoint& point = grasp_point_of(problem, g);
    const int frame = system.model.frame_index(g.end_effector);
    const Posed X_WT = frame_pose(system.model, kinematics, system.target_frames[at]);
    const Twistd V_WT = frame_twist(system.model, kinematics, system.target_frames[at]);
    GraspGap gap;
    gap.X_WE = frame_pose(system.model, kinematics, frame);
    gap.V_WE = frame_twist(system.model, kinematics, frame);
    gap.X_WG = X_WT * point.X_TG;
    gap.V_WG = shift(V_WT, X_WT.R * point.X_TG.p);
    gap.distance = norm(gap.X_WE.p - gap.X_WG.p);
    gap.angle = rotation_angle(transpose(gap.X_WG.R) * gap.X_WE.R);
    gaps.push_back(gap);
  }
  return gaps;
}

Contact make_contact(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                     const std::vector<bool>& held) {
  const Model& model = system.model;
  Contact contact;
  contact.state = state;
  contact.gaps = grasp_gaps(problem, system, forward_kinematics(model, state));
  contact.displacement.assign(problem.grasps.size(), Vector3d::zero());

  if (problem.contact.gap == ContactSetup::Gap::refuse) {
    for (std::size_t i = 0; i < contact.gaps.size(); ++i) {
      if (contact.gaps[i].distance <= problem.contact.refuse_beyond) continue;
      contact.refused += fmt::format(
          "{}end-effector '{}' misses grasp point '{}' of target '{}' by {:.4g} m; contact.limit is {:.4g} m",
          contact.refused.empty() ? "" : "; ", problem.grasps[i].end_effector, problem.grasps[i].grasp_point,
          problem.grasps[i].target, contact.gaps[i].distance, problem.contact.refuse_beyond);
    }
    if (!contact.refused.empty()) return contact;
  }
  if (problem.contact.gap == ContactSetup::Gap::translate_target) {
    for (std::size_t t = 0; t < problem.targets.size(); ++t) {
      if (!held.empty() && held[t]) continue;
      Vector3d sum = Vector3d::zero();
      int count = 0;
      for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
        if (problem.grasps[i].target != problem.targets[t].name) continue;
        sum += contact.gaps[i].X_WE.p - contact.gaps[i].X_WG.p;
        ++count;
      }
      if (count == 0) continue;
      const Vector3d move = (1.0 / count) * sum;
      const int body = model.frames()[system.target_frames[t]].body;
      Posed X_WT = root_pose(model, contact.state, body);
      for (int k = 0; k < 3; ++k) contact.state.q[model.bodies()[body].q + k] = X_WT.p[k] + move[k];
      for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
        if (problem.grasps[i].target == problem.targets[t].name) contact.displacement[i] = move;
      }
    }
  }
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
    const GraspSetup& g = problem.grasps[i];
    const int frame = model.frame_index(g.end_effector);
    const int target = model.frames()[system.target_frames[target_index(problem, g.target)]].body;
    contact.grasps.push_back(
        {model.frames()[frame].body, target, g.model, contact.gaps[i].X_WE.p, contact.gaps[i].X_WE.R * g.hinge_axis});
  }
  return contact;
}

std::string gaps_too_wide(const CaptureProblem& problem, const CaptureSystem& system, const Contact& contact) {
  std::string text;
  if (problem.contact.gap == ContactSetup::Gap::refuse) return text;  // its limit has been asked for
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
    const GraspSetup& g = problem.grasps[i];
    if (judges_position(end_effector_of(problem, g).envelope)) continue;
    const double reach = arm_reach(system.model, system.model.frame_index(g.end_effector)).length;
    const double stated = problem.contact.largest_gap.value_or(kLargestGapOfReach * reach);
    const double gap = norm(contact.gaps[i].X_WE.p - contact.gaps[i].X_WG.p - contact.displacement[i]);
    const double moved = norm(contact.displacement[i]), most = problem.contact.largest_gap.value_or(reach);
    if (moved > most) {
      text +=
          fmt::format("{}target '{}' would have to be moved by {:.4g} m to end-effector '{}', more than {} of {:.4g} m",
                      text.empty() ? "" : "; ", g.target, moved, g.end_effector,
                      problem.contact.largest_gap ? "contact.largest_gap" : "its arm's reach", most);
      continue;
    }
    if (gap <= stated) continue;
    text += text.empty() ? "" : "; ";
    text += fmt::format("end-effector '{}' is {:.4g} m from grasp point '{}' of target '{}'", g.end_effector, gap,
                        g.grasp_point, g.target);
    text += problem.contact.largest_gap
                ? fmt::format(", contact.largest_gap is {:.4g} m", stated)
                : fmt::format(
                      ", more than a tenth of its arm's reach of {:.4g} m (it has no envelope with a "
                      "position; state one, or contact.largest_gap)",
                      reach);
  }
  return text;
}

}  // namespace grapnel
