#include "capture/impact_case.hpp"

#include <cmath>

namespace grapnel::testing {

CaptureProblem contact_capture_case(int index) {
  LoopOptions options;
  options.target_of_arm = {0, 1};
  options.joints = 4;
  options.time = 2;
  CaptureProblem p = random_loops(options, index);
  p.name = "meeting " + std::to_string(index);
  const CaptureResult contact = simulate_impact_only(p);
  Random random(9000 + index);
  for (std::size_t i = 0; i < p.grasps.size(); ++i) {
    const Vector3d u = contact.impact()->grasps[i].relative_velocity_before;
    const Vector3d oblique = (-1 / norm(u)) * u + random.vector(0.5);
    p.targets[i].grasp_points[0].normal = transpose(p.targets[i].X_WT.R) * ((1 / norm(oblique)) * oblique);
  }
  return p;
}

CaptureProblem rebound_case(ImpactSetup::Law law, double restitution, double friction, int index) {
  CaptureProblem p = contact_capture_case(index);
  p.impact->law = law;
  p.impact->restitution = restitution;
  p.impact->friction = friction;
  for (GraspSetup& g : p.grasps) g.contact = true;
  return p;
}

CaptureProblem yielding_case(double linear_stiffness, int index) {
  CaptureProblem p = contact_capture_case(index);
  p.impact->law = ImpactSetup::Law::compliant;
  GraspComplianceSetup& g = p.impact->grasp;
  g.linear_stiffness = linear_stiffness;
  g.linear_damping = 6 * std::sqrt(linear_stiffness);
  g.angular_stiffness = 0.05 * linear_stiffness;
  g.angular_damping = 0.7 * std::sqrt(linear_stiffness);
  return p;
}

Twistd relative_twist_at(const CaptureProblem& p, const CaptureResult& r, std::size_t grasp, std::size_t sample) {
  const GraspSetup& g = p.grasps.at(grasp);
  const Twistd end_effector = twist_at(r, "end_effectors/" + g.end_effector, sample);
  const Vector3d at = vector_at(r, "end_effectors/" + g.end_effector + "/position", sample);
  const Twistd target = twist_at(r, "targets/" + g.target, sample);
  return end_effector - shift(target, at - vector_at(r, "targets/" + g.target + "/position", sample));
}

double momentum_jump(const CaptureResult& r, std::size_t before, std::size_t after) {
  const auto momentum = [&](std::size_t s) {
    const Vector3d p = vector_at(r, "system/linear_momentum", s);
    return Momentumd{vector_at(r, "system/angular_momentum", s) + cross(vector_at(r, "system/center_of_mass", s), p),
                     p};
  };
  const Momentumd h0 = momentum(before), h1 = momentum(after);
  return std::max(norm(h1.linear - h0.linear) / norm(h0.linear), norm(h1.angular - h0.angular) / norm(h0.angular));
}

}  // namespace grapnel::testing
