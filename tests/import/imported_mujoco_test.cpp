// Robot files that `grapnel import` creates from URDF and MJCF files: mass matrix and bias against MuJoCo's from the
// same source file, at random states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "import/import_files.hpp"
#include "import/mujoco_file.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace imported_mujoco_test {

using namespace testing;

constexpr double kBound = 1e-10;  // required agreement

struct Case {
  const char* file;
  const char* base;  // MuJoCo's name of the floating body; null: the base is fixed in MuJoCo
  int velocities;
  bool is_turned = false;  // MuJoCo computes principal axes (kTurnedAxes)
};

const Case kCases[] = {
    {"mujoco/tree.urdf", "base", 10}, {"mujoco/fused.urdf", nullptr, 4, true}, {"massless-root.urdf", nullptr, 2, true},
    {"limits.urdf", nullptr, 5},      {"chain.urdf", nullptr, 4, true},        {"mjcf/free_two_arms.xml", "bus", 12},
    {"mjcf/anchors.xml", "hub", 10},  {"mjcf/geoms.xml", "bus", 11, true},     {"mjcf/geoms_apart.xml", "bus", 11},
    {"mjcf/bounds.xml", "bus", 9},    {"mjcf/includes.xml", "bus", 8},         {"mjcf/target_beside.xml", "chaser", 7},
    {"mjcf/gripper.xml", "bus", 9},  // the coupling of its fingers has no effect on these
};

Model import(const Case& one) {
  const std::filesystem::path file = corpus(one.file), place = file.parent_path() / "robot.yaml";
  FaultList faults;
  ScenarioFiles files;
  const auto imported = import_model(file, Node{}, file, place, files, faults);
  for (const Fault& fault : faults.all()) ADD_FAILURE() << fault.text();
  if (!imported) throw std::runtime_error("not imported");
  ModelBuilder builder;
  for (BodyDescription body : read_imported(*imported, place, files).bodies) {
    if (body.parent.empty() && one.base == nullptr) body.joint.type = JointType::fixed;
    if (file.extension() == ".urdf") body.joint.rotor_inertia = 0;  // MuJoCo does not read it
    builder.add(std::move(body));
  }
  return builder.build();
}

// MuJoCo requires all six components of a URDF inertia; in Grapnel missing ones are 0.
std::string with_all_components(std::string text) {
  for (std::size_t at = 0; (at = text.find("<inertia ", at)) != std::string::npos; ++at) {
    const std::string element = text.substr(at, text.find('>', at) - at);
    for (const char* key : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
      if (element.find(key) == std::string::npos) text.insert(at + 9, std::string(key) + "=\"0\" ");
    }
  }
  return text;
}

class ImportedFile : public ::testing::TestWithParam<Case> {
 protected:
  // The file as MuJoCo reads it.
  std::filesystem::path file_for_mujoco() const {
    const std::filesystem::path file = corpus(GetParam().file);
    return file.extension() == ".urdf" ? folder_.write("robot.urdf", with_all_components(bytes_of(file))) : file;
  }
  ModelFolder folder_;
};

TEST_P(ImportedFile, HasMujocosMassMatrixAndBias) {
  const Case& one = GetParam();
  const Model imported = import(one);
  ASSERT_EQ(imported.velocities(), one.velocities);
  MujocoFile mujoco(file_for_mujoco());
  Worst inertia("inertia"), matrix("mass matrix"), vector("bias");
  const Model model = one.is_turned ? with_inertias_of(mujoco, imported, inertia) : imported;
  EXPECT_LE(inertia.value(), kTurnedAxes);  // measured 2.5e-7
  Workspace workspace(model);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const State state = random_state(model, random);
    mujoco.set_state(model, one.base != nullptr ? one.base : "", state);
    const Eigen::MatrixXd M = mass_matrix(model, state);
    ASSERT_LE(matrix.note(relative_difference(mujoco.mass_matrix(), M), i), kBound);
    std::vector<double> c;
    bias(model, state, Vector3d::zero(), workspace, c);
    ASSERT_GT(eigen(c).norm(), 0);
    ASSERT_LE(vector.note(relative_difference(mujoco.bias(), eigen(c)), i), kBound);
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, ImportedFile, ::testing::ValuesIn(kCases), [](const auto& instance) {
  std::string name = std::filesystem::path(instance.param.file).stem().string();
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// The coupling of two fingers: MuJoCo's defect and row of its equality constraint, and accelerations from its mass
// matrix, bias and row as of a hard constraint, (2.9) to (2.12).
TEST(ImportedCoupling, HasMujocosRowAndAccelerations) {
  const Model model = import({"mjcf/gripper.xml", "bus", 9});
  ASSERT_EQ(model.couplings().size(), 1u);
  MujocoFile mujoco(corpus("mjcf/gripper.xml"));
  LoopSolver solver(model, {});
  Workspace workspace(model);
  Worst defect("defect"), rate("rate"), acceleration("accelerations"), multiplier("effort");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const State state = random_state(model, random);
    mujoco.set_state(model, "bus", state);
    const Eigen::MatrixXd J = mujoco.equality_rows();
    ASSERT_EQ(J.rows(), 1);
    const JointCoupling& coupling = model.couplings()[0];
    EXPECT_LE(defect.note(std::abs(mujoco.equality_defects()[0] - coupling_defect(model, coupling, state.q)), i),
              1e-14);
    EXPECT_LE(rate.note(std::abs((J * eigen(state.v))[0] - coupling_rate(model, coupling, state.v)), i), 1e-14);

    const std::vector<double> torque = random.values(model.velocities(), 2);
    const Eigen::LDLT<Eigen::MatrixXd> M(mujoco.mass_matrix());
    const Eigen::VectorXd free = M.solve(Eigen::VectorXd(eigen(torque) - mujoco.bias()));
    const Eigen::VectorXd response = M.solve(Eigen::VectorXd(J.transpose()));
    const double lambda = -(J * free)[0] / (J * response)[0];
    DynamicsInput<double> in;
    in.q = state.q, in.v = state.v, in.force = torque;
    std::vector<double> vdot(torque), force(torque);
    solver.accelerations(in, 0, workspace, vdot, force);
    EXPECT_LE(acceleration.note(relative_difference(eigen(vdot), Eigen::VectorXd(free + lambda * response)), i),
              kBound);
    EXPECT_LE(multiplier.note(std::abs(solver.coupling_multipliers()[0] - lambda), i), kBound);
  }
}

}  // namespace imported_mujoco_test
}  // namespace grapnel
