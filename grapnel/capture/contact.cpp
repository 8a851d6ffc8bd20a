#include "grapnel/capture/contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "grapnel/plan/arm_starts.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

// --- Gaps and contact ---

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

std::string gap_too_wide(const CaptureProblem& problem, const GraspSetup& grasp, const CaptureSystem& system,
                         const GraspGap& gap, const Vector3d& displacement) {
  if (problem.contact.gap == ContactSetup::Gap::refuse) return {};  // its limit has been checked
  if (judges_position(end_effector_of(problem, grasp).envelope)) return {};
  if (grasp.closes == GraspSetup::Closes::when_settled) return {};  // the gripper holds the target anywhere
  const double reach = arm_reach(system.model, system.model.frame_index(grasp.end_effector)).length;
  const double stated = problem.contact.largest_gap.value_or(kLargestGapOfReach * reach);
  const double left = norm(gap.X_WE.p - gap.X_WG.p - displacement);
  const double moved = norm(displacement), most = problem.contact.largest_gap.value_or(reach);
  if (moved > most) {
    return fmt::format("target '{}' would have to be moved by {:.4g} m to end-effector '{}', more than {} of {:.4g} m",
                       grasp.target, moved, grasp.end_effector,
                       problem.contact.largest_gap ? "contact.largest_gap" : "its arm's reach", most);
  }
  if (left <= stated) return {};
  const std::string limit = problem.contact.largest_gap
                                ? fmt::format("contact.largest_gap is {:.4g} m", stated)
                                : fmt::format(
                                      "more than a tenth of its arm's reach of {:.4g} m (it has no envelope with a "
                                      "position; state one, or contact.largest_gap)",
                                      reach);
  return fmt::format("end-effector '{}' is {:.4g} m from grasp point '{}' of target '{}', {}", grasp.end_effector, left,
                     grasp.grasp_point, grasp.target, limit);
}

// --- Envelopes ---

namespace {

// One tolerance: its key in a robot file, its name, the deviation, the limit, the unit.
struct Item {
  const char* key;
  const char* name;
  double value, tolerance;
  const char* unit;
};
std::array<Item, 4> items(const CaptureEnvelope& e, const GraspDeviation& d) {
  return {{{"position", "distance", d.position, e.position, "m"},
           {"angle", "angle", d.angle, e.angle, "rad"},
           {"velocity", "speed", d.velocity, e.velocity, "m/s"},
           {"angular_velocity", "angular rate", d.angular_velocity, e.angular_velocity, "rad/s"}}};
}

GraspDecision decide(const std::optional<CaptureEnvelope>& envelope, const GraspDeviation& deviation) {
  GraspDecision decision;
  decision.captured = true;
  decision.deviation = deviation;
  decision.judged = judges_position(envelope);
  if (!envelope) {
    decision.reason = "the end-effector has no envelope: capture is not evaluated, the grasp is assumed to hold";
    return decision;
  }
  std::string inside, outside;
  double largest = 0;
  for (const Item& item : items(*envelope, deviation)) {
    if (item.tolerance == CaptureEnvelope::kAny) continue;
    // At an event, a deviation may be on the edge to within rounding.
    const bool fits = item.value <= item.tolerance * (1 + 1e-9);
    std::string& text = fits ? inside : outside;
    text += fmt::format("{}{} {:.4g} {} of {:.4g} {}", text.empty() ? "" : ", ", item.name, item.value, item.unit,
                        item.tolerance, item.unit);
    if (fits || !(item.value / item.tolerance > largest)) continue;
    largest = item.value / item.tolerance;
    decision.limiting = item.key;
  }
  decision.captured = outside.empty();
  decision.reason = decision.captured ? "within the envelope: " + inside : "outside the envelope: " + outside;
  if (decision.captured && !decision.judged)
    decision.reason += "; the envelope has no position: the distance is not evaluated";
  return decision;
}

}  // namespace

std::vector<GraspDeviation> grasp_deviations(const CaptureProblem& problem, const CaptureSystem& system,
                                             const Kinematics& kinematics) {
  const std::vector<GraspGap> gaps = grasp_gaps(problem, system, kinematics);
  std::vector<GraspDeviation> deviations;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const GraspSetup& grasp = problem.grasps[i];
    const GraspGap& gap = gaps[i];
    GraspDeviation d;
    d.position = gap.distance;
    if (grasp.orientation == GraspSetup::Orientation::pose) d.angle = gap.angle;
    if (grasp.orientation == GraspSetup::Orientation::axis) {
      const GraspPoint& point = grasp_point_of(problem, grasp);
      // The direction is given in the target's frame, the gap in the grasp point's.
      const Vector3d direction_W = gap.X_WG.R * transposed_times(point.X_TG.R, *point.approach_direction);
      const Vector3d axis_W = gap.X_WE.R * *end_effector_of(problem, grasp).approach_axis;
      d.angle = rotation_angle(rotation_between(direction_W, axis_W));
    }
    d.velocity = norm(gap.V_WE.linear - gap.V_WG.linear);
    d.angular_velocity = norm(gap.V_WE.angular - gap.V_WG.angular);
    deviations.push_back(d);
  }
  return deviations;
}

bool judges_position(const std::optional<CaptureEnvelope>& envelope) {
  return envelope && envelope->position != CaptureEnvelope::kAny;
}

double envelope_excess(const std::optional<CaptureEnvelope>& envelope, const GraspDeviation& deviation) {
  double excess = -1;
  if (!envelope) return excess;
  for (const Item& item : items(*envelope, deviation)) excess = std::max(excess, item.value / item.tolerance - 1);
  return excess;
}

std::vector<GraspDecision> decide_grasps(const CaptureProblem& problem, const CaptureSystem& system,
                                         const Kinematics& kinematics) {
  const std::vector<GraspDeviation> deviations = grasp_deviations(problem, system, kinematics);
  std::vector<GraspDecision> decisions;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    decisions.push_back(decide(end_effector_of(problem, problem.grasps[i]).envelope, deviations[i]));
  }
  return decisions;
}

std::vector<double> envelope_excesses(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics) {
  const std::vector<GraspDeviation> deviations = grasp_deviations(problem, system, kinematics);
  std::vector<double> excesses;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    excesses.push_back(envelope_excess(end_effector_of(problem, problem.grasps[i]).envelope, deviations[i]));
  }
  return excesses;
}

// --- Normals ---

Vector3d contact_normal_in_world(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics, const GraspSetup& grasp) {
  const auto normal = contact_normal(target_of(problem, grasp), grasp_point_of(problem, grasp));
  if (!normal) throw CaptureProblemError("grasp of '" + grasp.end_effector + "': a contact needs the surface's normal");
  const int frame = system.target_frames[target_index(problem, grasp.target)];
  // The given vector is a unit vector to 1e-9, an error that friction at small slip would amplify.
  return (1 / norm(*normal)) * (frame_pose(system.model, kinematics, frame).R * *normal);
}

// --- Motion at an instant ---

namespace {

BodyMotion motion(const std::string& name, const Posed& X, const Twistd& V) {
  return {name, X.p, quaternion_from(X.R), V.angular, V.linear};
}

}  // namespace

PhaseEnd describe(const CaptureProblem& problem, const CaptureSystem& system, const State& state, double time) {
  const Model& model = system.model;
  const Kinematics k = forward_kinematics(model, state);
  PhaseEnd end;
  end.time = time;
  end.base = motion(problem.robot.base, k.X_WB[system.base], k.V_WB[system.base]);
  for (int j : system.robot_joints) {
    const Body& body = model.bodies()[model.joints()[j]];
    end.joints.names.push_back(body.description.joint.name);
    end.joints.position.push_back(state.q[body.q]);
    end.joints.velocity.push_back(state.v[body.v]);
  }
  const std::vector<GraspGap> gaps = grasp_gaps(problem, system, k);
  for (int f : system.end_effectors) {
    const Twistd V = frame_twist(model, k, f);
    EndEffectorMotion e;
    e.name = model.frames()[f].name;
    e.position = frame_pose(model, k, f).p;
    e.velocity = V.linear;
    e.angular_velocity = V.angular;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      if (problem.grasps[i].end_effector != e.name) continue;
      e.target = problem.grasps[i].target;
      e.grasp_point = problem.grasps[i].grasp_point;
      e.miss_distance = gaps[i].distance;
      e.relative_velocity = V.linear - gaps[i].V_WG.linear;
      e.relative_angular_velocity = V.angular - gaps[i].V_WG.angular;
    }
    end.end_effectors.push_back(e);
  }
  end.targets = describe_targets(problem, system, k);
  return end;
}

std::vector<BodyMotion> describe_targets(const CaptureProblem& problem, const CaptureSystem& system,
                                         const Kinematics& k) {
  std::vector<BodyMotion> targets;
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const int f = system.target_frames[t];
    targets.push_back(motion(problem.targets[t].name, frame_pose(system.model, k, f), frame_twist(system.model, k, f)));
  }
  return targets;
}

}  // namespace grapnel
