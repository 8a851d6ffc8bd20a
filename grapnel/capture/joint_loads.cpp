#include "grapnel/capture/joint_loads.hpp"

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
  const Kinematics k = forward_kinematics(model, state);
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

}  // namespace grapnel
