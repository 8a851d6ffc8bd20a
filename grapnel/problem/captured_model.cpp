#include "grapnel/problem/captured_model.hpp"

#include <algorithm>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {
namespace {

// The first grasp of a body, which carries it; null for bodies without a grasp.
const HeldGrasp* carrier(std::span<const HeldGrasp> grasps, int body) {
  const auto grasp =
      std::find_if(grasps.begin(), grasps.end(), [&](const HeldGrasp& g) { return g.frames.body_b == body; });
  return grasp == grasps.end() ? nullptr : &*grasp;
}

JointDescription grasp_joint(const LoopClosure& grasp, const std::string& name, const Rotationd& R_TC) {
  JointDescription joint;
  joint.name = name;
  joint.type = grasp.model == GraspModel::rigid   ? JointType::fixed
               : grasp.model == GraspModel::hinge ? JointType::revolute
                                                  : JointType::spherical;
  if (grasp.model == GraspModel::hinge) joint.axis = R_TC * grasp.hinge_C;
  return joint;
}

// The target's body, with its frame moved to the grasp (axes unchanged), where the new joint is. A rigid grasp keeps
// the pose at closing; the other joints start from the current rotation.
BodyDescription hang(const BodyDescription& target, const HeldGrasp& grasp, const std::string& parent,
                     const Kinematics& k) {
  const LoopClosure& frames = grasp.frames;
  BodyDescription captured = target;
  captured.com = captured.com - frames.X_BD.p;
  captured.parent = parent;
  const Rotationd R_CT = transpose((k.X_WB[frames.body_a] * frames.X_AC).R) * k.X_WB[frames.body_b].R;
  const Rotationd R = frames.model == GraspModel::rigid ? transpose(frames.X_BD.R) : R_CT;
  captured.X_PF = frames.X_AC * Posed{R, Vector3d::zero()};
  captured.joint = grasp_joint(frames, "grasp:" + captured.name, transpose(R));
  return captured;
}

// Coordinates and velocities are copied by body; new joints start at zero with the relative velocity.
State carry_over(const Model& from, const State& state, const Kinematics& k, std::span<const HeldGrasp> grasps,
                 const Model& to) {
  State result = zero_state(to);
  for (std::size_t i = 0; i < from.bodies().size(); ++i) {
    const Body& old_body = from.bodies()[i];
    const Body& new_body = to.bodies()[to.body_index(old_body.description.name)];
    const HeldGrasp* grasp = carrier(grasps, static_cast<int>(i));
    if (!grasp) {
      const JointType type = new_body.description.joint.type;
      std::copy_n(state.q.begin() + old_body.q, coordinate_count(type), result.q.begin() + new_body.q);
      std::copy_n(state.v.begin() + old_body.v, velocity_count(type), result.v.begin() + new_body.v);
      continue;
    }
    const LoopClosure& frames = grasp->frames;
    const Vector3d relative = k.V_WB[i].angular - k.V_WB[frames.body_a].angular;
    if (frames.model == GraspModel::hinge)
      result.v[new_body.v] = dot((k.X_WB[frames.body_a] * frames.X_AC).R * frames.hinge_C, relative);
    if (frames.model == GraspModel::point) {
      const Vector3d w_T = transposed_times(k.X_WB[i].R, relative);
      for (int c = 0; c < 3; ++c) result.v[new_body.v + c] = w_T[c];
    }
  }
  return result;
}

// Replaces indices by those of the same names in another model.
CaptureSystem renumber(const CaptureSystem& from, Model model) {
  CaptureSystem to{std::move(model), 0, {}, {}, {}, {}, {}};
  const auto body_name = [&](int body) -> const std::string& { return from.model.bodies()[body].description.name; };
  const auto frame = [&](int f) { return to.model.frame_index(from.model.frames()[f].name); };
  to.base = to.model.body_index(body_name(from.base));
  for (int f : from.end_effectors) to.end_effectors.push_back(frame(f));
  for (int f : from.target_frames) to.target_frames.push_back(frame(f));
  const auto joint = [&](int j) {
    const int body = to.model.body_index(body_name(from.model.joints()[j]));
    return static_cast<int>(std::find(to.model.joints().begin(), to.model.joints().end(), body) -
                            to.model.joints().begin());
  };
  for (int j : from.robot_joints) to.robot_joints.push_back(joint(j));
  for (int j : from.wheels) to.wheels.push_back(joint(j));
  for (int j : from.elastic_joints) to.elastic_joints.push_back(joint(j));
  for (const CaptureSystem::Gyro& gyro : from.gyros) to.gyros.push_back({joint(gyro.gimbal), joint(gyro.rotor)});
  to.addresses.resize(from.addresses.size());
  for (std::size_t i = 0; i < from.addresses.size(); ++i)
    to.addresses[to.model.body_index(body_name(static_cast<int>(i)))] = from.addresses[i];
  return to;
}

// Adds a slipping grasp of bodies in `from`; `carried_by`: the grasp that carries its target, at whose place the
// target's frame is, or null.
void add_slip(const Model& from, const SlippingGrasp& grasp, const HeldGrasp* carried_by, CaptureSystem& system) {
  const auto renumbered = [&](int body) { return system.model.body_index(from.bodies()[body].description.name); };
  SlippingGrasp slip = grasp;
  slip.slip.body_a = slip.frames.body_a = renumbered(grasp.frames.body_a);
  slip.slip.body_b = slip.frames.body_b = renumbered(grasp.frames.body_b);
  if (carried_by) {
    slip.slip.X_BD.p = slip.slip.X_BD.p - carried_by->frames.X_BD.p;
    slip.frames.X_BD.p = slip.frames.X_BD.p - carried_by->frames.X_BD.p;
  }
  const auto link_of = [&](int body) { return system.model.bodies()[body].placement.link; };
  if (slip.has_closure && link_of(slip.frames.body_a) != link_of(slip.frames.body_b)) {
    slip.closure = static_cast<int>(system.closures.size());
    system.closures.push_back(slip.frames);
  }
  system.slips.push_back(std::move(slip));
}

}  // namespace

HeldGrasp hold_grasp(const CaptureProblem& problem, const CaptureSystem& free, const Kinematics& kinematics,
                     std::size_t grasp) {
  const GraspSetup& setup = problem.grasps[grasp];
  const Frame& end_effector = free.model.frames()[free.model.frame_index(setup.end_effector)];
  HeldGrasp held;
  held.grasp = grasp;
  held.frames.name = "grasp of '" + setup.end_effector + "' on '" + setup.target + "'";
  held.frames.body_a = end_effector.body;
  held.frames.X_AC = end_effector.X_BE;
  held.frames.body_b = free.model.frames()[free.target_frames[target_index(problem, setup.target)]].body;
  held.frames.X_BD =
      inverse(kinematics.X_WB[held.frames.body_b]) * (kinematics.X_WB[end_effector.body] * end_effector.X_BE);
  held.frames.model = setup.model;
  held.frames.hinge_C = setup.hinge_axis;
  held.X_BD_closing = held.frames.X_BD;
  return held;
}

Grasp grasp_of(const HeldGrasp& grasp, const Kinematics& kinematics) {
  const Posed X_WC = kinematics.X_WB[grasp.frames.body_a] * grasp.frames.X_AC;
  return {grasp.frames.body_a, grasp.frames.body_b, grasp.frames.model, X_WC.p, X_WC.R * grasp.frames.hinge_C};
}

CapturedSystem join_targets(const CaptureSystem& free, const State& state, std::span<const HeldGrasp> grasps,
                            std::span<const SlippingGrasp> slips) {
  const Kinematics k = forward_kinematics(free.model, state);
  const auto name_of = [&](int body) -> const std::string& { return free.model.bodies()[body].description.name; };
  ModelBuilder builder;
  for (std::size_t i = 0; i < free.model.bodies().size(); ++i) {
    const BodyDescription& body = free.model.bodies()[i].description;
    const HeldGrasp* grasp = carrier(grasps, static_cast<int>(i));
    if (grasp) {
      builder.add(hang(body, *grasp, name_of(grasp->frames.body_a), k));
      continue;
    }
    // A panel of a target whose frame has moved to the grasp.
    BodyDescription same = body;
    const int parent = free.model.bodies()[i].parent;
    if (const HeldGrasp* of_parent = parent < 0 ? nullptr : carrier(grasps, parent))
      same.X_PF.p = same.X_PF.p - of_parent->frames.X_BD.p;
    builder.add(std::move(same));
  }
  for (const Frame& frame : free.model.frames()) {
    Posed X_BE = frame.X_BE;
    if (const HeldGrasp* grasp = carrier(grasps, frame.body)) X_BE.p = X_BE.p - grasp->frames.X_BD.p;
    builder.add(FrameDescription{frame.name, name_of(frame.body), X_BE});
  }
  CapturedSystem captured{renumber(free, std::move(builder).build()), {}};
  CaptureSystem& system = captured.system;
  for (const HeldGrasp& grasp : grasps) {
    HeldGrasp held = grasp;
    const HeldGrasp* first = carrier(grasps, grasp.frames.body_b);
    held.frames.body_a = system.model.body_index(name_of(grasp.frames.body_a));
    held.frames.body_b = system.model.body_index(name_of(grasp.frames.body_b));
    held.frames.X_BD.p = held.frames.X_BD.p - first->frames.X_BD.p;
    const auto link_of = [&](int body) { return system.model.bodies()[body].placement.link; };
    held.closure = HeldGrasp::kInTree;
    if (first != &grasp && link_of(held.frames.body_a) == link_of(held.frames.body_b)) {
      held.closure = HeldGrasp::kRedundant;
    } else if (first != &grasp) {
      held.closure = static_cast<int>(system.closures.size());
      system.closures.push_back(held.frames);
    }
    system.grasps.push_back(std::move(held));
  }
  for (const SlippingGrasp& slip : slips) add_slip(free.model, slip, carrier(grasps, slip.frames.body_b), system);
  captured.state = carry_over(free.model, state, k, grasps, system.model);
  return captured;
}

State take_apart(const CaptureSystem& free, const CaptureSystem& joined, const State& state) {
  const Kinematics k = forward_kinematics(joined.model, state);
  State result = zero_state(free.model);
  for (std::size_t i = 0; i < free.model.bodies().size(); ++i) {
    const Body& to = free.model.bodies()[i];
    const Body& from = joined.model.bodies()[joined.model.body_index(to.description.name)];
    const JointType type = to.description.joint.type;
    if (from.description.joint.type == type && (from.parent >= 0) == (to.parent >= 0)) {
      std::copy_n(state.q.begin() + from.q, coordinate_count(type), result.q.begin() + to.q);
      std::copy_n(state.v.begin() + from.v, velocity_count(type), result.v.begin() + to.v);
    }
  }
  for (std::size_t t = 0; t < free.target_frames.size(); ++t) {
    const int body = free.model.frames()[free.target_frames[t]].body;
    const Body& from = joined.model.bodies()[joined.model.body_index(free.model.bodies()[body].description.name)];
    if (from.parent < 0) continue;
    set_root_pose(free.model, body, frame_pose(joined.model, k, joined.target_frames[t]), result);
    set_root_twist(free.model, body, frame_twist(joined.model, k, joined.target_frames[t]), result);
  }
  return result;
}

namespace {

double servicer_mass(const CaptureProblem& problem) {
  double mass = 0;
  for (const BodyDescription& body : problem.robot.bodies) mass += body.mass;
  return mass;
}

void to_world(const MovingFrame& frame, double time, BodyMotion& motion) {
  motion.position += frame.place(time);
  motion.velocity += frame.velocity;
}

}  // namespace

MovingFrame moving_frame(const CaptureProblem& problem) {
  if (!problem.obstacles.empty()) return {};
  MovingFrame frame{problem.X_WB.p, Vector3d::zero()};
  if (problem.robot.base_mode != RobotSetup::Base::free) return frame;
  if (problem.V_WB) {
    frame.velocity = problem.V_WB->linear;
  } else if (const double mass = servicer_mass(problem); problem.momentum && mass > 0) {
    frame.velocity = (1 / mass) * problem.momentum->linear;
  }
  return frame;
}

CaptureProblem seen_from(const MovingFrame& frame, CaptureProblem problem) {
  problem.X_WB.p = problem.X_WB.p - frame.origin;
  if (problem.V_WB && problem.robot.base_mode == RobotSetup::Base::free)
    problem.V_WB->linear = problem.V_WB->linear - frame.velocity;
  if (problem.momentum) problem.momentum->linear -= servicer_mass(problem) * frame.velocity;
  if (problem.orbit) {
    problem.orbit->position -= frame.origin;
    problem.orbit->velocity -= frame.velocity;
  }
  const double capture = problem.approach ? problem.approach->duration : 0;
  for (TargetSetup& target : problem.targets) {
    const bool at_start = target.given_at == TargetSetup::Instant::start;
    target.X_WT.p = target.X_WT.p - frame.place(at_start ? 0 : capture);
    target.V_WT.linear = target.V_WT.linear - frame.velocity;
  }
  if (!problem.approach) return problem;
  for (Waypoint& waypoint : problem.approach->waypoints) {
    for (Waypoint::Place& place : waypoint.places) {
      if (!place.target.empty()) continue;  // relative to it
      place.position = place.position - frame.place(waypoint.time);
      place.velocity = place.velocity - frame.velocity;
    }
  }
  return problem;
}

void to_world(const MovingFrame& frame, PhaseEnd& end) {
  to_world(frame, end.time, end.base);
  for (EndEffectorMotion& e : end.end_effectors) {
    e.position += frame.place(end.time);
    e.velocity += frame.velocity;
  }
  for (BodyMotion& target : end.targets) to_world(frame, end.time, target);
}

void to_world(const MovingFrame& frame, const Vector3d& momentum, double mass, ImpactReport& report) {
  for (GraspImpulse& grasp : report.grasps) grasp.contact_point += frame.place(report.time);
  const double over = report.time + (report.compliant ? report.compliant->duration : 0);
  for (BodyMotion& target : report.targets_before) to_world(frame, report.time, target);
  for (BodyMotion& target : report.targets_after) to_world(frame, over, target);
  // Sum of m |v + V|^2 / 2; impacts leave the momentum.
  const double more = dot(frame.velocity, momentum) + 0.5 * mass * dot(frame.velocity, frame.velocity);
  report.kinetic_energy_before += more;
  report.kinetic_energy_after += more;
  if (!report.brake) return;
  report.brake->kinetic_energy_before += more;
  report.brake->kinetic_energy_after += more;
}

void to_world(const MovingFrame& frame, double time, Kinematics& kinematics) {
  const Vector3d place = frame.place(time);
  for (Posed& X : kinematics.X_WB) X.p += place;
  for (Twistd& V : kinematics.V_WB) V.linear += frame.velocity;
  for (LinkMotion<double>& link : kinematics.links) {
    link.X_WL.p += place;
    link.V_WL.linear += frame.velocity;
  }
}

}  // namespace grapnel
