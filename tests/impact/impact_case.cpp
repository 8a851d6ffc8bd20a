#include "impact/impact_case.hpp"

namespace grapnel::testing {
namespace {

ImpactCase make(int index, RobotOptions options, bool shared) {
  Random random(index);
  ImpactCase c{random_model(options, random), {}, {}};
  c.state = random_state(c.model, random);
  const Kinematics k = forward_kinematics(c.model, c.state);
  std::vector<int> links, targets;
  for (int i = 0; i < static_cast<int>(c.model.bodies().size()); ++i) {
    (c.model.bodies()[i].description.name[0] == 't' ? targets : links).push_back(i);
  }
  for (int t : targets) {
    const int grips = shared ? random.integer(1, 3) : 1;
    for (int g = 0; g < grips; ++g) {
      const int link = links[random.integer(0, static_cast<int>(links.size()) - 1)];
      const Vector3d p = k.X_WB[link].p + k.X_WB[link].R * random.vector(0.5);
      // The target sits around the first of its contact points.
      if (g == 0) set_root_pose(c.model, t, {random.rotation(), p + random.vector(0.8)}, c.state);
      const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
      c.grasps.push_back({link, t, models[random.integer(0, 2)], p, random.direction()});
    }
  }
  return c;
}

}  // namespace

ImpactCase random_impact(int index) {
  RobotOptions options;
  options.least_bodies = index % 3 == 0 ? 1 : 6;
  options.most_bodies = index % 2 == 0 ? 20 : 8;
  options.free_root = index % 5 != 4;
  options.spherical_joints = index % 4 == 1;
  options.targets = 1 + index % 3;
  return make(index, options, true);
}

ImpactCase random_open_impact(int index) {
  RobotOptions options;
  options.least_bodies = 8;
  options.most_bodies = 16;
  options.targets = 1 + index % 2;
  return make(index, options, false);
}

Eigen::VectorXd stacked_impulse(const ImpactCase& c, const ImpactSolution& solution) {
  Eigen::VectorXd P(solution.rows);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < c.grasps.size(); ++i) {
    const int rows = row_count(c.grasps[i].model);
    P.segment(row, rows) = constrained_directions(c.grasps[i]) * eigen(solution.contacts[i].P_WC);
    row += rows;
  }
  return P;
}

}  // namespace grapnel::testing
