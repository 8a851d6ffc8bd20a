#include "grapnel/capture/conservation_monitor.hpp"

namespace grapnel {
namespace {

Vector3d velocity(const GroupQuantities& group) { return (1 / group.size.mass) * group.h.linear; }

// A body at its centre of mass.
struct BodyQuantities {
  BodyMomentum momentum;
  double twice_spin_energy = 0;  // w . I w, and its rotor's
};

BodyQuantities body_quantities(const Model& model, const Kinematics& k, const State& state, std::size_t i) {
  const Body& body = model.bodies()[i];
  const BodyDescription& d = body.description;
  const Posed& X_WB = k.X_WB[i];
  const Vector3d arm = X_WB.R * d.com;
  const Twistd V_WC = shift(k.V_WB[i], arm);
  const Vector3d w_B = transposed_times(X_WB.R, V_WC.angular);
  const Vector3d h_B = d.inertia * w_B;
  BodyQuantities b{{{X_WB.R * h_B, d.mass * V_WC.linear}, X_WB.p + arm}, dot(w_B, h_B)};
  if (has_one_axis(d.joint.type)) {
    const double rate = state.v[body.v];
    b.twice_spin_energy += d.joint.reflected_inertia() * rate * rate;
  }
  return b;
}

}  // namespace

std::vector<int> trees_of_bodies(const Model& model) {
  std::vector<int> trees;
  int count = 0;
  for (const Body& body : model.bodies()) trees.push_back(body.parent < 0 ? count++ : trees[body.root]);
  return trees;
}

GroupQuantities together(std::span<const GroupQuantities> groups) {
  if (groups.size() == 1) return groups.front();
  GroupQuantities all;
  for (const GroupQuantities& g : groups) {
    all.size.mass += g.size.mass;
    all.com += g.size.mass * g.com;
    all.h.linear += g.h.linear;
    all.size.energy += g.size.energy;
  }
  all.com = (1 / all.size.mass) * all.com;
  const Vector3d V = velocity(all);
  for (const GroupQuantities& g : groups) {
    const Vector3d r = g.com - all.com, own = velocity(g) - V;
    const Vector3d moment = cross(r, g.size.mass * own);
    all.h.angular += g.h.angular + moment;
    all.size.linear += g.size.linear;
    all.size.angular += g.size.angular + norm(moment);
    all.size.second_moment += g.size.second_moment + g.size.mass * dot(r, r);
    all.size.inner_energy += g.size.inner_energy + 0.5 * g.size.mass * dot(own, own);
  }
  return all;
}

ConservedQuantities conserved_quantities(const Model& model, const Kinematics& kinematics, const State& state) {
  ConservedQuantities quantities;
  const std::size_t count = model.bodies().size();
  const std::vector<int> tree_of = trees_of_bodies(model);
  std::vector<BodyQuantities> bodies;
  bodies.reserve(count);
  quantities.about_com = Momentumd::zero();
  quantities.com = Vector3d::zero();
  double mass = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bodies.push_back(body_quantities(model, kinematics, state, i));
    const BodyMomentum& m = bodies.back().momentum;
    if (model.bodies()[i].parent < 0) quantities.trees.emplace_back();
    GroupQuantities& tree = quantities.trees[tree_of[i]];
    const double m_i = model.bodies()[i].description.mass;
    tree.size.mass += m_i;
    tree.com += m_i * m.p_WC;
    tree.h.linear += m.h.linear;
    mass += m_i;
  }
  for (GroupQuantities& tree : quantities.trees) {
    quantities.com += tree.com;
    tree.com = (1 / tree.size.mass) * tree.com;
  }
  quantities.com = (1 / mass) * quantities.com;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [m, twice_spin_energy] = bodies[i];
    const BodyDescription& d = model.bodies()[i].description;
    GroupQuantities& tree = quantities.trees[tree_of[i]];
    const Vector3d from_com = m.p_WC - quantities.com, r = m.p_WC - tree.com;
    const Vector3d own = m.h.linear - d.mass * velocity(tree);
    const Vector3d moment = cross(r, own);
    const double linear = norm(m.h.linear), spin = norm(m.h.angular);
    quantities.about_com += shift(m.h, -from_com);
    quantities.linear_scale += linear;
    quantities.angular_scale += spin + norm(cross(from_com, m.h.linear));
    tree.h.angular += m.h.angular + moment;
    tree.size.linear += linear;
    tree.size.angular += spin + norm(moment);
    tree.size.second_moment += d.mass * dot(r, r) + 0.5 * (d.inertia.xx + d.inertia.yy + d.inertia.zz);
    tree.size.inner_energy += 0.5 * (twice_spin_energy + dot(own, own) / d.mass);
    quantities.kinetic_energy += 0.5 * (twice_spin_energy + dot(m.h.linear, m.h.linear) / d.mass);
  }
  for (GroupQuantities& tree : quantities.trees)
    tree.size.energy = tree.size.inner_energy + 0.5 * dot(tree.h.linear, velocity(tree));
  return quantities;
}

Momentumd group_momentum(const Model& model, const Kinematics& kinematics, std::span<const int> bodies,
                         const Vector3d& p_W) {
  Momentumd total = Momentumd::zero();
  for (int body : bodies) {
    const BodyMomentum m = body_momentum(model, kinematics, body);
    total += shift(m.h, p_W - m.p_WC);
  }
  return total;
}

}  // namespace grapnel
