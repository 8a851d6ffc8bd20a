// Imported robots and what MuJoCo makes of the same file: mass matrix, bias and poses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Dense>
#include <random>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "import/urdf_files.hpp"

namespace grapnel {
namespace urdf_mujoco_test {

// MuJoCo wants all six components of an inertia; those that are absent are 0 for Grapnel.
std::string with_all_components(std::string text) {
  for (std::size_t at = 0; (at = text.find("<inertia ", at)) != std::string::npos; ++at) {
    const std::string element = text.substr(at, text.find('>', at) - at);
    for (const char* key : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
      if (element.find(key) == std::string::npos) text.insert(at + 9, std::string(key) + "=\"0\" ");
    }
  }
  return text;
}

// MuJoCo bolts a URDF's root to the ground, so compared are the rows of the joints with the base at rest.
void compare(const std::string& name, double bound) {
  SCOPED_TRACE(name);
  char message[1000] = "";
  const auto file = std::filesystem::temp_directory_path() / ("grapnel-mujoco-" + std::to_string(getpid()) + ".urdf");
  std::ofstream(file) << with_all_components(testing::bytes_of(testing::corpus(name)));
  mjModel* const m = mj_loadXML(file.c_str(), nullptr, message, sizeof message);
  std::filesystem::remove(file);
  ASSERT_NE(m, nullptr) << message;
  mjData* const d = mj_makeData(m);
  m->opt.gravity[0] = m->opt.gravity[1] = m->opt.gravity[2] = 0;

  const testing::Imported imported = testing::import_corpus(name);
  ASSERT_EQ(imported.faults, "");
  CaptureProblem problem;
  problem.robot = testing::robot_of(imported);
  for (BodyDescription& body : problem.robot.bodies) body.joint.rotor_inertia = 0;  // MuJoCo reads none
  const CaptureSystem system = make_servicer(problem);
  const Model& model = system.model;
  ASSERT_EQ(m->nv, static_cast<int>(model.joints().size()));

  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  State state = zero_state(model);
  std::vector<int> rows;  // MuJoCo's, per joint
  for (const int body : model.joints()) {
    const Body& one = model.bodies()[body];
    const int joint = mj_name2id(m, mjOBJ_JOINT, one.description.joint.name.c_str());
    ASSERT_GE(joint, 0) << one.description.joint.name;
    rows.push_back(m->jnt_dofadr[joint]);
    d->qpos[m->jnt_qposadr[joint]] = state.q[one.q] = number(random);
    d->qvel[rows.back()] = state.v[one.v] = number(random);
  }
  mj_forward(m, d);
  std::vector<mjtNum> full(static_cast<std::size_t>(m->nv) * m->nv);
  mj_fullM(m, full.data(), d->qM);

  const Eigen::MatrixXd M = mass_matrix(model, state);
  const std::vector<double> no_acceleration(state.v.size(), 0.0);
  const std::vector<double> bias = inverse_dynamics(model, state, no_acceleration);
  double worst_mass = 0, worst_bias = 0, scale = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int v = model.bodies()[model.joints()[i]].v;
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const double expected = full[static_cast<std::size_t>(rows[i]) * m->nv + rows[j]];
      worst_mass = std::max(worst_mass, std::abs(M(v, model.bodies()[model.joints()[j]].v) - expected));
      scale = std::max(scale, std::abs(expected));
    }
    worst_bias = std::max(worst_bias, std::abs(bias[v] - d->qfrc_bias[rows[i]]));
  }
  EXPECT_LT(worst_mass, bound * scale);
  EXPECT_LT(worst_bias, bound * scale);
  EXPECT_GT(scale, 0.05);
  mj_deleteData(d);
  mj_deleteModel(m);
}

TEST(UrdfMujoco, MassMatrixAndBiasAreMujocosOfTheSameFile) {
  compare("massless-root.urdf", 1e-10);
  compare("limits.urdf", 1e-10);
  // MuJoCo looks for the principal axes of links that it fuses by iterations that end early: it differs by 2.3e-9 from
  // what UrdfAssembly.* computes otherwise.
  compare("chain.urdf", 1e-8);
}

}  // namespace urdf_mujoco_test
}  // namespace grapnel
