#include "bench/workload.hpp"

#include <random>

namespace grapnel::bench {

ModelBuilder describe_robot(int arms, int joints, bool alternate) {
  ModelBuilder builder;
  BodyDescription base;
  base.name = "base";
  base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 500;
  base.inertia = Symmetric3d::diagonal(83.61, 83.61, 83.61);
  builder.add(base);
  std::string tip;
  for (int arm = 0; arm < arms; ++arm) {
    std::string parent = "base";
    for (int joint = 0; joint < joints; ++joint) {
      BodyDescription link;
      link.name = "link" + std::to_string(arm) + "." + std::to_string(joint);
      link.parent = parent;
      link.X_PF.p = joint > 0 ? Vector3d{1, 0, 0} : Vector3d{arm == 0 ? 0.5 : -0.5, 0, 0};
      link.joint.name = "joint of " + link.name;
      link.joint.type = JointType::revolute;
      link.joint.axis = alternate && joint % 2 == 1 ? Vector3d{0, 1, 0} : Vector3d{0, 0, 1};
      link.mass = 10;
      link.com = {0.5, 0, 0};
      link.inertia = Symmetric3d::diagonal(0.05, 1.05, 1.05);
      builder.add(link);
      parent = tip = link.name;
    }
  }
  builder.add(FrameDescription{"tip", tip, Posed::identity()});
  return builder;
}

Workload make_workload(const std::string& name, int arms, int joints, bool alternate) {
  return make_workload(name, describe_robot(arms, joints, alternate).build());
}

Workload make_workload(const std::string& name, Model model) {
  Workload workload{name, std::move(model), {}, {}};
  std::mt19937_64 generator(20231);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < Workload::kCases; ++i) {
    State state = zero_state(workload.model);
    Forces forces;
    for (double& q : state.q) q = 2 * uniform(generator);
    for (double& v : state.v) v = uniform(generator);
    const Vector3d axis{uniform(generator), uniform(generator), uniform(generator)};
    set_root_pose(workload.model, 0, {rotation_about((1 / norm(axis)) * axis, 3 * uniform(generator)), axis}, state);
    for (int v = 0; v < workload.model.velocities(); ++v) forces.generalized.push_back(5 * uniform(generator));
    workload.states.push_back(state);
    workload.forces.push_back(forces);
  }
  return workload;
}

std::vector<Workload> targets() { return {make_workload("a", 2, 3, false), make_workload("b", 2, 7, true)}; }

std::vector<Workload> chains() {
  std::vector<Workload> result;
  for (int joints = 7; joints <= 224; joints *= 2) {
    result.push_back(make_workload("chain" + std::to_string(joints), 1, joints, true));
  }
  return result;
}

}  // namespace grapnel::bench
