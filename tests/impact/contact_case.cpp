#include "impact/contact_case.hpp"

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel::testing {
namespace {

double relative_normal_velocity(const ContactCase& c, const ContactPoint& at) {
  const Kinematics k = forward_kinematics(c.model, c.state);
  const auto velocity = [&](int b) { return shift(k.V_WB[b], at.p_WC - k.X_WB[b].p).linear; };
  return dot(velocity(at.robot_body) - velocity(at.target_body), at.n_W);
}

}  // namespace

ContactCase random_contacts(int index, int contacts) {
  Random random(index);
  RobotOptions options;
  options.min_bodies = 1 + index % 4;
  options.max_bodies = 8;
  options.spherical_joints = index % 5 == 1;
  options.targets = random.integer(1, 3);
  ContactCase c{random_model(options, random), {}, {}};
  c.state = random_state(c.model, random);
  const Kinematics k = forward_kinematics(c.model, c.state);
  std::vector<int> links, targets;
  for (int i = 0; i < static_cast<int>(c.model.bodies().size()); ++i) {
    (c.model.bodies()[i].description.name[0] == 't' ? targets : links).push_back(i);
  }
  std::vector<bool> placed(c.model.bodies().size(), false);
  const int count = contacts > 0 ? contacts : random.integer(1, 3);
  for (int i = 0; i < count; ++i) {
    const int link = links[random.integer(0, static_cast<int>(links.size()) - 1)];
    const int target = targets[random.integer(0, static_cast<int>(targets.size()) - 1)];
    ContactPoint p{link, target, k.X_WB[link] * random.vector(0.5), random.direction()};
    p.restitution = random.chance(0.15) ? 0 : random.chance(0.15) ? 1 : random.uniform(0, 1);
    p.friction = random.chance(0.15) ? 0 : random.uniform(0, 1.5);
    if (!placed[target]) {
      set_root_pose(c.model, target, {random.rotation(), p.p_WC + random.vector(0.8)}, c.state);
      placed[target] = true;
    }
    c.contacts.push_back(p);
  }
  for (std::size_t i = 0; i < c.contacts.size(); ++i) {
    ContactPoint& p = c.contacts[i];
    if ((i == 0 || random.chance(0.7)) && relative_normal_velocity(c, p) > 0) p.n_W = -p.n_W;
  }
  return c;
}

ContactCase lumps(const std::vector<Lump>& bodies) {
  ModelBuilder builder;
  for (const Lump& l : bodies) {
    BodyDescription b;
    b.name = l.name;
    b.joint.name = "joint of " + l.name;
    b.joint.type = l.mass > 0 ? JointType::free : JointType::fixed;
    if (!(l.mass > 0)) b.X_PF = {Rotationd::identity(), l.position};
    b.mass = l.mass > 0 ? l.mass : 1;
    b.inertia = l.mass > 0 ? Symmetric3d::diagonal(l.moments[0], l.moments[1], l.moments[2])
                           : Symmetric3d::diagonal(1.0, 1.0, 1.0);
    builder.add(b);
  }
  ContactCase c{builder.build(), {}, {}};
  c.state = zero_state(c.model);
  for (const Lump& l : bodies) {
    if (!(l.mass > 0)) continue;
    const int body = c.model.body_index(l.name);
    set_root_pose(c.model, body, {Rotationd::identity(), l.position}, c.state);
    set_root_twist(c.model, body, l.V_WB, c.state);
  }
  return c;
}

double kinetic_energy_of(const ContactCase& c, const std::vector<double>& velocity) {
  const State state = with_rates(c.state, velocity);
  return kinetic_energy(c.model, forward_kinematics(c.model, state), state);
}

}  // namespace grapnel::testing
