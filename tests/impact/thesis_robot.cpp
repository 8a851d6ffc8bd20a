#include "impact/thesis_robot.hpp"

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel::testing {

std::vector<BodyDescription> thesis_robot(double base_factor, const Units& units) {
  const double m = 1 / units.mass, I = m / (units.length * units.length), l = 1 / units.length;
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 500 * m * base_factor;
  const double I_base = 83.61 * I * base_factor;
  base.inertia = Symmetric3d::diagonal(I_base, I_base, I_base);
  std::vector<BodyDescription> bodies{base};
  for (int arm = 1; arm <= 2; ++arm) {
    for (int link = 1; link <= 3; ++link) {
      const std::string prefix = "arm-" + std::to_string(arm);
      BodyDescription b;
      b.name = prefix + "-link-" + std::to_string(link);
      b.parent = link == 1 ? "base" : prefix + "-link-" + std::to_string(link - 1);
      b.joint.name = prefix + "-joint-" + std::to_string(link);
      b.joint.type = JointType::revolute;
      b.X_PF.p = {(link > 1 ? 1 : arm == 1 ? 0.5 : -0.5) * l, 0, 0};
      b.mass = 10 * m;
      b.com = {0.5 * l, 0, 0};
      b.inertia = Symmetric3d::diagonal(0.01 * I, 1.05 * I, 1.05 * I);
      bodies.push_back(b);
    }
  }
  return bodies;
}

std::vector<FrameDescription> thesis_tips(double along, const Units& units) {
  const Posed X{Rotationd::identity(), {along / units.length, 0, 0}};
  return {{"tip-1", "arm-1-link-3", X}, {"tip-2", "arm-2-link-3", X}};
}

BodyDescription thesis_target(const std::string& name, const Units& units) {
  BodyDescription b;
  b.name = b.joint.name = name;
  b.joint.type = JointType::free;
  b.mass = 10 / units.mass;
  const double I = 1 / (units.mass * units.length * units.length);
  b.inertia = Symmetric3d::diagonal(I, I, I);
  return b;
}

void stop_momentum(const Model& model, State& state) {
  const int base = model.body_index("base");
  set_root_twist(model, base, base_twist_from_momentum(model, state, base, Momentumd::zero()), state);
}

ReferenceImpact reference_impact(GraspModel grasp_model, double speed, double base_factor) {
  ModelBuilder builder;
  for (const BodyDescription& b : thesis_robot(base_factor)) builder.add(b);
  for (const FrameDescription& f : thesis_tips()) builder.add(f);
  builder.add(thesis_target("target-1")).add(thesis_target("target-2"));
  ReferenceImpact r{builder.build(), {}, {}};
  r.state = zero_state(r.model);
  const int base = r.model.body_index("base");
  set_root_pose(r.model, base, {rotation_about({0, 0, 1}, 0.6762), {0, 0.0194, 0}}, r.state);
  const double angles[] = {-0.524, -1.393, -0.035, 2.618, -1.393, -0.035};
  for (int j = 0; j < 6; ++j) r.state.q[r.model.bodies()[r.model.joints()[j]].q] = angles[j];

  // Joint rates from the generalized Jacobian: both tips' (w_z, v_x, v_y), momentum zero.
  const int tips[] = {r.model.frame_index("tip-1"), r.model.frame_index("tip-2")};
  Eigen::MatrixXd J(6, 6);
  for (int k = 0; k < 2; ++k)
    J.middleRows(3 * k, 3) = generalized_jacobian(r.model, r.state, base, tips[k]).middleRows(2, 3);
  const Eigen::VectorXd rates =
      J.colPivHouseholderQr().solve((Eigen::VectorXd(6) << 0, -speed, 0, 0, speed, 0).finished());
  for (int j = 0; j < 6; ++j) r.state.v[r.model.bodies()[r.model.joints()[j]].v] = rates[j];
  stop_momentum(r.model, r.state);

  const Kinematics k = forward_kinematics(r.model, r.state);
  for (int i = 0; i < 2; ++i) {
    const int target = r.model.body_index("target-" + std::to_string(i + 1));
    const Vector3d tip = frame_pose(r.model, k, tips[i]).p;
    set_root_pose(r.model, target, {Rotationd::identity(), tip - Vector3d{0, i == 0 ? 0.5 : -0.5, 0}}, r.state);
    set_root_twist(r.model, target, {{0, 0, 0.2}, {0, 0, 0}}, r.state);
    r.grasps.push_back({r.model.frames()[tips[i]].body, target, grasp_model, tip, {0, 0, 1}});
  }
  return r;
}

}  // namespace grapnel::testing
