#include "grapnel/problem/moving_frame.hpp"

namespace grapnel {
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
