#include "grapnel/capture/joint_loads.hpp"

#include <algorithm>

#include "grapnel/capture/captured_model.hpp"
#include "grapnel/dynamics/body_acceleration.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

// Rate of a body's momentum about its frame's origin: m a_C there, and I alpha + w x I w about its centre of mass.
Wrenchd inertial_wrench(const Body& body, const Posed& X_WB, const Twistd& V_WB, const BodyAcceleration& A) {
  const Vector3d& w = V_WB.angular;
  const Vector3d r = X_WB.R * body.description.com;
  const Vector3d a_C = A.linear + cross(A.angular, r) + cross(w, cross(w, r));
  const auto times_inertia = [&](const Vector3d& v) {
    return X_WB.R * (body.description.inertia * (transpose(X_WB.R) * v));
  };
  const Vector3d force = body.description.mass * a_C;
  return {times_inertia(A.angular) + cross(w, times_inertia(w)) + cross(r, force), force};
}

}  // namespace

std::vector<Wrenchd> joint_wrenches(const Model& model, const State& state, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external) {
  return joint_wrenches(model, forward_kinematics(model, state), vdot, external);
}

std::vector<Wrenchd> joint_wrenches(const Model& model, const Kinematics& k, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external) {
  const std::vector<BodyAcceleration> A = body_accelerations(model, k, vdot);
  std::vector<Wrenchd> needed;
  for (std::size_t i = 0; i < model.bodies().size(); ++i)
    needed.push_back(inertial_wrench(model.bodies()[i], k.X_WB[i], k.V_WB[i], A[i]));
  for (const ExternalWrench& e : external) needed[e.body] -= shift(e.F_W, k.X_WB[e.body].p - e.p_WP);
  // From the tips in: a joint passes on what its body and all beyond it need.
  for (std::size_t i = model.bodies().size(); i-- > 0;) {
    const int parent = model.bodies()[i].parent;
    if (parent >= 0) needed[parent] += shift(needed[i], k.X_WB[parent].p - k.X_WB[i].p);
  }
  return needed;
}

std::vector<Wrenchd> joint_wrenches(const CaptureSystem& system, const Kinematics& k, const PhaseSample& sample,
                                    std::span<const Wrenchd> grips) {
  const PhaseDynamics& dynamics = *sample.dynamics;
  std::vector<ExternalWrench> external(dynamics.external_wrenches().begin(), dynamics.external_wrenches().end());
  const std::vector<Body>& bodies = system.model.bodies();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyDescription& body = bodies[i].description;
    external.push_back({static_cast<int>(i), k.X_WB[i] * body.com, {Vector3d::zero(), body.mass * dynamics.gravity()}});
  }
  for (std::size_t g = 0; g < system.grips.size(); ++g) {
    if (system.grips[g].closure == HeldGrip::kInTree) continue;  // a joint of the tree carries the target
    const Grasp grasp = grasp_of(system.grips[g], k);
    external.push_back({grasp.robot_body, grasp.p_WC, grips[g]});
    external.push_back({grasp.target_body, grasp.p_WC, -grips[g]});
  }
  return joint_wrenches(system.model, k, dynamics.acceleration(), external);
}

std::vector<int> carried_bodies(const CaptureSystem& system) {
  std::vector<int> bodies;
  for (int i = 0; i < static_cast<int>(system.model.bodies().size()); ++i) {
    const bool target = std::any_of(system.target_frames.begin(), system.target_frames.end(),
                                    [&](int f) { return system.model.frames()[f].body == i; });
    if (i != system.base && !target) bodies.push_back(i);
  }
  return bodies;
}

}  // namespace grapnel
