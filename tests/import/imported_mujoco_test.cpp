// Robots as `grapnel import` makes them from URDF and MJCF files, read back as robot files: their mass matrix and bias
// against MuJoCo's on the same source file, at random states.
#include <gtest/gtest.h>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "import/mujoco_file.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace imported_mujoco_test {

using namespace testing;

struct Case {
  const char* file;
  const char* base;  // MuJoCo's name of the floating body; null: the base is fixed in MuJoCo
  int velocities;
  double bound = 1e-10;  // the issue's
  std::map<std::string, double> held = {};
};

const Case kCases[] = {
    {"mujoco/tree.urdf", "base", 10},
    // MuJoCo seeks the principal axes of what has products of inertia, and of what it fuses, to 1.4e-6 rad at worst.
    {"mujoco/fused.urdf", nullptr, 4, 1e-6},
    {"mjcf/free_two_arms.xml", "bus", 12},
    {"mjcf/anchors.xml", "hub", 10},
    {"mjcf/geoms.xml", "bus", 11, 1e-6},
    {"mjcf/geoms_apart.xml", "bus", 11},
    {"mjcf/bounds.xml", "bus", 9},
    {"mjcf/includes.xml", "bus", 8},
    {"mjcf/target_beside.xml", "chaser", 7},
    // The second finger follows the first, and stands where it is while that one is at zero.
    {"mjcf/gripper.xml", "bus", 8, 1e-10, {{"finger2", 0.006}}},
};

Model import(const Case& one) {
  const std::filesystem::path file = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "tests/import/corpus" / one.file;
  const std::filesystem::path place = file.parent_path() / "robot.yaml";
  FaultList faults;
  ScenarioFiles files;
  const auto imported = import_model(file, Node{}, file, place, files, faults);
  for (const Fault& fault : faults.all()) ADD_FAILURE() << fault.text();
  if (!imported) throw std::runtime_error("not imported");
  ModelBuilder builder;
  for (BodyDescription body : read_imported(*imported, place, files).bodies) {
    if (body.parent.empty() && one.base == nullptr) body.joint.type = JointType::fixed;
    builder.add(std::move(body));
  }
  return builder.build();
}

class ImportedFile : public ::testing::TestWithParam<Case> {};

TEST_P(ImportedFile, HasMujocosMassMatrixAndBias) {
  const Case& one = GetParam();
  const Model model = import(one);
  ASSERT_EQ(model.velocities(), one.velocities);
  MujocoFile mujoco(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "tests/import/corpus" / one.file);
  Worst matrix("mass matrix"), vector("bias");
  Workspace workspace(model);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const State state = random_state(model, random);
    mujoco.set_state(model, one.base != nullptr ? one.base : "", state, one.held);
    const Eigen::MatrixXd M = mass_matrix(model, state);
    ASSERT_LE(matrix.note(relative_difference(mujoco.mass_matrix(), M), i), one.bound);
    std::vector<double> c;
    bias(model, state, Vector3d::zero(), workspace, c);
    ASSERT_GT(eigen(c).norm(), 0);
    ASSERT_LE(vector.note(relative_difference(mujoco.bias(), eigen(c)), i), one.bound);
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, ImportedFile, ::testing::ValuesIn(kCases), [](const auto& instance) {
  return std::filesystem::path(instance.param.file).stem().string();
});

}  // namespace imported_mujoco_test
}  // namespace grapnel
