// Mechanics alone: an arm of two links on a free-floating base, its kinematics, momentum and dynamics.
#include <cstdio>

#include "grapnel/api/mechanics.hpp"

namespace {

// A box; its joint, about z, is at p in the frame of its parent.
grapnel::BodyDescription box(const char* name, const char* parent, double mass, grapnel::Vector3d p) {
  grapnel::BodyDescription body;
  body.name = name, body.parent = parent, body.joint.name = std::string(name) + "-joint";
  body.joint.type = *parent ? grapnel::JointType::revolute : grapnel::JointType::free;
  body.X_PF.p = p, body.mass = mass, body.com = {*parent ? 0.5 : 0.0, 0, 0};
  body.inertia = grapnel::Symmetric3d::diagonal(mass / 12, mass / 6, mass / 6);
  return body;
}

}  // namespace

int main() {
  const grapnel::Model model =
      grapnel::ModelBuilder()
          .add(box("base", "", 200, {0, 0, 0}))
          .add(box("upper-arm", "base", 20, {0.5, 0, 0}))
          .add(box("forearm", "upper-arm", 10, {1, 0, 0}))
          .add(grapnel::FrameDescription{"tip", "forearm", {grapnel::Rotationd::identity(), {1, 0, 0}}})
          .build();
  const int base = model.body_index("base"), tip = model.frame_index("tip");

  // q: position and quaternion of the base, then joint angles; v: angular and linear velocity of the base, joint rates.
  grapnel::State state = grapnel::zero_state(model);
  state.q[7] = 0.6, state.q[8] = -1.1, state.v[6] = 0.1, state.v[7] = 0.2;
  // The base moves such that the total momentum is zero.
  set_root_twist(model, base, base_twist_from_momentum(model, state, base, grapnel::Momentumd::zero()), state);

  const grapnel::Kinematics kinematics = forward_kinematics(model, state);
  const grapnel::Posed X_WE = frame_pose(model, kinematics, tip);
  std::printf("tip at %.4f %.4f m\n", X_WE.p[0], X_WE.p[1]);
  // Its velocity from the joint rates alone, by the generalized Jacobian, and from all velocities.
  const Eigen::VectorXd V = generalized_jacobian(model, state, base, tip) * Eigen::Vector2d(0.1, 0.2);
  const grapnel::Twistd V_WE = frame_twist(model, kinematics, tip);
  std::printf("tip velocity %.6f %.6f m/s, and %.6f %.6f m/s\n", V[3], V[4], V_WE.linear[0], V_WE.linear[1]);

  const grapnel::Momentumd h = momentum_about(model, kinematics, center_of_mass(model, kinematics));
  std::printf("momentum below 1e-12: %s\n", norm(h.angular) + norm(h.linear) < 1e-12 ? "yes" : "no");
  std::printf("kinetic energy %.6f J\n", kinetic_energy(model, kinematics, state));

  // Joint torques => accelerations => the torques that they require.
  grapnel::Forces forces;
  forces.generalized = {0, 0, 0, 0, 0, 0, 1.5, -0.5};
  const std::vector<double> vdot = forward_dynamics(model, state, forces);
  const std::vector<double> tau = inverse_dynamics(model, state, vdot);
  std::printf("joint accelerations %.6f %.6f rad/s^2 need %.3f %.3f N m\n", vdot[6], vdot[7], tau[6], tau[7]);
  const Eigen::MatrixXd M = mass_matrix(model, state), I = generalized_inertia(model, state, base);
  std::printf("inertia of the shoulder: %.4f kg m^2 on a fixed base, %.4f free-floating\n", M(6, 6), I(0, 0));
}
