#include "grapnel/control/held_body.hpp"

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {

// Bodies => one rigid body: mass, centre of mass, inertia about it by the parallel-axis theorem, and the first body's
// twist there.
HeldBody held_body(const Model& model, const Kinematics& kinematics, std::span<const int> bodies) {
  HeldBody held;
  const auto com_of = [&](int b) { return kinematics.X_WB[b] * model.bodies()[b].description.com; };
  Vector3d moment = Vector3d::zero();
  for (int b : bodies) {
    const double mass = model.bodies()[b].description.mass;
    held.mass += mass, moment += mass * com_of(b);
  }
  held.com = (1 / held.mass) * moment;
  for (int b : bodies) {
    const BodyDescription& body = model.bodies()[b].description;
    held.inertia += rotate(kinematics.X_WB[b].R, body.inertia);
    held.inertia += point_mass_inertia(body.mass, com_of(b) - held.com);
  }
  held.motion = shift(kinematics.V_WB[bodies[0]], held.com - kinematics.X_WB[bodies[0]].p);
  return held;
}

// Held bodies => their angular momentum about their centre of mass and the velocity of that centre relative to the
// centre of mass of the whole tree, in W; relative to the ground on a fixed root.
TargetMotion3d target_motion(const Model& model, const Kinematics& kinematics, std::span<const int> bodies) {
  const HeldBody held = held_body(model, kinematics, bodies);
  TargetMotion3d motion{held.inertia * held.motion.angular, held.motion.linear};
  const int target = bodies[0];
  if (!model.has_free_root(target)) return motion;  // relative to the ground
  double mass = 0;
  for (const Body& b : model.bodies()) {
    if (b.root == model.bodies()[target].root) mass += b.description.mass;
  }
  const int roots[] = {model.bodies()[target].root};
  motion.velocity -= (1 / mass) * momentum_about(model, kinematics, held.com, roots).linear;
  return motion;
}

}  // namespace grapnel
