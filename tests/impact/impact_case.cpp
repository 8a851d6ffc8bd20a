#include "impact/impact_case.hpp"
#include "grapnel/spatial/decompositions.hpp"

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
    const int grasps = shared ? random.integer(1, 2) : 1;
    for (int g = 0; g < grasps; ++g) {
      const int link = links[random.integer(0, static_cast<int>(links.size()) - 1)];
      const Vector3d p = k.X_WB[link].p + k.X_WB[link].R * random.vector(0.5);
      // The target is placed near the first of its contact points.
      if (g == 0) set_root_pose(c.model, t, {random.rotation(), p + random.vector(0.8)}, c.state);
      const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
      c.grasps.push_back({link, t, models[random.integer(0, 2)], p, random.direction()});
    }
  }
  return c;
}

// True if the rows, scaled to unit length in the metric of M, are either clearly independent or clearly dependent.
bool well_conditioned(const ImpactCase& c) {
  const Eigen::LLT<Eigen::MatrixXd> mass(mass_matrix(c.model, c.state));
  Eigen::MatrixXd Y =
      mass.matrixL().solve(grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps).transpose().eval());
  for (Eigen::Index i = 0; i < Y.cols(); ++i) {
    if (Y.col(i).norm() > 1e-9) Y.col(i).normalize();
  }
  const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(Y).singularValues();
  for (double s : sigma) {
    if (s > 1e-11 * sigma[0] && s < 1e-3 * sigma[0]) return false;
  }
  return true;
}

}  // namespace

ImpactCase random_impact(int index) {
  // Near-singular configurations are excluded: there the reference solutions, not the impact, lose accuracy.
  RobotOptions options;
  options.min_bodies = index % 6 == 0 ? 1 : 8;
  options.max_bodies = index % 2 == 0 ? 20 : 10;
  options.free_root = index % 5 != 4;
  options.spherical_joints = index % 4 == 1;
  options.targets = 1 + index % 3;
  for (int draw = 0;; ++draw) {
    ImpactCase c = make(index + 1'000'000 * draw, options, index % 3 != 0);
    if (well_conditioned(c)) return c;
  }
}

ImpactCase random_open_impact(int index) {
  RobotOptions options;
  options.min_bodies = 8;
  options.max_bodies = 16;
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
