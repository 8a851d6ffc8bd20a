#include "grapnel/simulate/arm_reaction.hpp"

#include <vector>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

// Rate of the angular momentum of a root's tree about its centre of mass, in W; the root's linear acceleration drops
// out.
Vector3d momentum_rate(const Model& model, const State& state, int root, std::span<const double> vdot) {
  const Kinematics k = forward_kinematics(model, state);
  const std::vector<BodyAcceleration> A = body_accelerations(model, k, vdot);
  const auto is_in = [&](std::size_t i) { return model.bodies()[i].root == root || static_cast<int>(i) == root; };
  double mass = 0;
  Vector3d com = Vector3d::zero();
  for (std::size_t i = 0; i < A.size(); ++i) {
    if (!is_in(i)) continue;
    const BodyDescription& body = model.bodies()[i].description;
    mass += body.mass;
    com += body.mass * (k.X_WB[i] * body.com);
  }
  com = (1 / mass) * com;
  Vector3d rate = Vector3d::zero();
  for (std::size_t i = 0; i < A.size(); ++i) {
    if (!is_in(i)) continue;
    const BodyDescription& body = model.bodies()[i].description;
    const Rotationd& R = k.X_WB[i].R;
    const Vector3d &w = k.V_WB[i].angular, r = R * body.com;
    const Vector3d a = A[i].linear + cross(A[i].angular, r) + cross(w, cross(w, r));
    const Symmetric3d I = rotate(R, body.inertia);
    rate += cross(k.X_WB[i].p + r - com, body.mass * a) + I * A[i].angular + cross(w, I * w);
  }
  // The angular momentum of rotors rotates with the links that carry them, (19.8).
  for (const int rotor : model.rotors()) {
    const Body& body = model.bodies()[rotor];
    if (!is_in(static_cast<std::size_t>(body.parent))) continue;
    const Vector3d r = rotor_momentum(model, k, rotor);
    rate += vdot[body.v] * r + cross(k.V_WB[body.parent].angular, state.v[body.v] * r);
  }
  return rate;
}

}  // namespace

Vector3d arm_reaction(const Model& model, const State& state, int root, std::span<const double> acceleration,
                      std::span<const std::uint8_t> idle) {
  State still = state;
  std::vector<double> moving(state.v.size(), 0.0), resting(state.v.size(), 0.0);
  for (const int joint : model.joints()) {
    const int v = model.bodies()[joint].v;
    if (idle[v]) continue;
    moving[v] = acceleration[v];
    still.v[v] = 0;
  }
  const Vector3d rate = momentum_rate(model, state, root, moving) - momentum_rate(model, still, root, resting);
  return transpose(root_pose(model, state, root).R) * rate;
}

}  // namespace grapnel
